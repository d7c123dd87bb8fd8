"""From measured numbers to verdicts: each item's bounds, and why they are where they are.

Bounds come from what the calibration in use has measured on this machine (noise, response, what friction keeps) and from
what the rig wants of its force (the in-band tolerance); where neither is known, from the rig's own supervision. A warning is
far enough from a healthy machine's scatter that the tests' drawn machines give none; a failure is a machine nobody should
press with.
"""

from dataclasses import dataclass
from math import nan, sqrt
from typing import Final

from gateway.bsfm import Bsfm
from gateway.control.inputs import WireCounts
from gateway.control.self_test.items import FAILED, NOT_TESTED, PASSED, WARNED, Finding, Item
from gateway.control.self_test.measurements import (
    Intervals,
    Slope,
    Trace,
    fit_slope,
    mean_n,
    time_to_share_s,
)
from gateway.control.settings import ControlSettings
from gateway.registers.words import SelfTestVerdict

NOISE_WARNS, NOISE_FAILS = 2.0, 4.0  # times the calibration's; 200 readings know a noise to 5 %
_TOLERANCE_WARNS, _TOLERANCE_FAILS = 1.0 / 20.0, 1.0 / 6.0  # of the in-band tolerance: less noise harms no hold
_UNKNOWN_WARNS, _UNKNOWN_FAILS = 1.0 / 4.0, 1.0 / 2.0  # of it where no calibration says: two sigma fill the band
_COUNTS_WARN = 2.0  # times sample_quantum_n
_COUNT_FAILS = 0.5  # of the in-band tolerance: then the band holds two counts each way
_FEWEST_EQUAL: Final = 20  # readings, of which noise would have changed one
_VISIBLE_NOISE: Final = 0.5  # of a count: a cell with so much shows it in one of three readings

_KEPT: Final = (
    1.3  # times the falling branch at rest: friction that has stood holds so much more than it did in a ladder
)

SCALE_WARNS: Final = 0.15  # of the calibration's slope; more is a change that the trim has to make good
SCALE_LOW, SCALE_HIGH = 0.3, 3.0  # as the supervision's check of the first rise (A303)
_UNSURE_N: Final = 0.5  # what friction and a good fit leave between two levels, N
_FRICTION_LEFT: Final = (
    0.2  # of the loop's width: a slide that has not moved since it was mounted presses so much better
)
_UNSURE_SCALE: Final = 0.7  # a bound as wide says nothing but that there is force
SILENT_SHARE: Final = 0.05  # of the expected rise: no force at all
_VISIBLE_STEP: Final = 2.0  # times the noise
_SHARE_OF_STEP: Final = 0.63  # of a step that one lag has done after its time constant
RESPONSE_WARNS, RESPONSE_FAILS = 1.4, 2.0  # times what the calibration has measured
_GUESS_WARNS, _GUESS_FAILS = 2.0, 4.0  # times supervision.response_lag_s, where nothing was measured
_GRACE_S: Final = 0.05  # of sample, tick and wire, whose places in time are not known
LEAK_WARNS, LEAK_FAILS = (
    0.01,
    0.04,
)  # of the force, per second: a held force that halves in a minute, in a quarter of it
_LEAST_HELD_N: Final = 0.5  # below it a share of the force means nothing
_FEWEST_PRESSURES: Final = 30
_PRESSURE_NOISE: Final = 0.003  # of the pressure per second: one count of a regulator over the hold
LOST_WARNS, LOST_FAILS = 0.02, 0.10  # share of the messages
_LEAST_LOST: Final = 3  # one burst on the wire breaks two
_SLOW_SHARE: Final = 0.5  # of the bound on silence, for one exchange or one gap


@dataclass(frozen=True, slots=True)
class Known:
    """What is known before the test. model: the calibration in use; noise_n: of the cell as that has measured it, 0 where it
    has not."""

    settings: ControlSettings
    model: Bsfm
    noise_n: float = 0.0

    @property
    def rest_v(self) -> float:
        """Voltage at rest."""
        return self.settings.limits.safe_voltage_v

    @property
    def tolerance_n(self) -> float:
        """Half width of the rig's band, N."""
        return self.settings.defaults.in_band_tolerance_n

    @property
    def has_measured_response(self) -> bool:
        """Decide whether the calibration in use has measured how fast this machine is."""
        return self.settings.timing is not None

    @property
    def response_s(self) -> float:
        """Time to 63 % of a step, s: dead time and lags."""
        return self.settings.supervision.response_lag_s


def judge_noise(noise_n: float, known: Known) -> Finding:
    """Judge the noise of the cell at rest against what the calibration has measured."""
    tolerance_n = known.tolerance_n
    if known.noise_n > 0.0:
        warns_n = max(NOISE_WARNS * known.noise_n, _TOLERANCE_WARNS * tolerance_n)
        fails_n = max(NOISE_FAILS * known.noise_n, _TOLERANCE_FAILS * tolerance_n)
        origin = f"{known.noise_n:.3f} N when it was calibrated"
    else:
        warns_n, fails_n = _UNKNOWN_WARNS * tolerance_n, _UNKNOWN_FAILS * tolerance_n
        origin = f"in_band_tolerance_n {tolerance_n:g} N"
    text = f"{noise_n:.3f} N rms at rest, {bounds(warns_n, fails_n, 'N', 3)} ({origin})"
    return Finding(Item.NOISE, above(noise_n, warns_n, fails_n), text)


def judge_resolution(count_n: float, readings: int, known: Known) -> Finding:
    """Judge one count of the amplifier; count_n 0: all readings were the same."""
    settings = known.settings
    if count_n == 0.0:
        return _judge_constant(readings, known)
    warns_n = _COUNTS_WARN * settings.supervision.sample_quantum_n
    fails_n = max(warns_n, _COUNT_FAILS * known.tolerance_n)
    text = f"counts of {count_n:.3g} N, {bounds(warns_n, fails_n, 'N', 3)}"
    return Finding(Item.RESOLUTION, above(count_n, warns_n, fails_n), text)


def _judge_constant(readings: int, known: Known) -> Finding:
    quantum_n = known.settings.supervision.sample_quantum_n
    text = f"all of {readings} readings are the same"
    if readings < _FEWEST_EQUAL:
        return Finding(Item.RESOLUTION, NOT_TESTED, f"{text}: too few to tell")
    if known.noise_n >= _VISIBLE_NOISE * quantum_n:
        why = (
            f"a noise of {known.noise_n:.3f} N, as when it was calibrated, would show: amplifier in hold, or cell dead"
        )
        return Finding(Item.RESOLUTION, FAILED, f"{text}; {why}")
    return Finding(Item.RESOLUTION, NOT_TESTED, f"{text}: this cell is too quiet, only a force could tell")


def judge_zero(rest_n: float, known: Known, weight_n: float = 0.0, outside_n: float = 0.0) -> Finding:
    """Judge the force at rest: not more than what friction may keep pressed, and the bound of the rig. weight_n: of the
    payload along the tool, negative where it points up: in the air the cell feels it, on a workpiece it does not. outside_n:
    what the plant in use knows of tilt and feed, which may have been there at the last tare."""
    assert known.settings.self_test
    fails_n = known.settings.self_test.zero_n
    rising_n, falling_n = known.model.branch_forces_n(known.rest_v)
    kept_n = _KEPT * max(falling_n, 0.0)
    least_n = min(rising_n, 0.0) - max(weight_n, 0.0) + min(outside_n, 0.0)
    most_n = kept_n + max(-weight_n, 0.0) + max(outside_n, 0.0)
    off_n = max(least_n - rest_n, rest_n - most_n)
    what = "the safe voltage and friction" if known.rest_v > 0.0 else "friction"
    kept = f", both beyond the {kept_n:.1f} N that {what} may keep" if kept_n > 0.05 else ""
    kept += f" and the payload's {abs(weight_n):.1f} N" if abs(weight_n) > 0.05 else ""
    kept += f" and the {abs(outside_n):.1f} N that tilt and feed bring" if abs(outside_n) > 0.05 else ""
    text = f"{rest_n:+.2f} N at rest, {bounds(0.5 * fails_n, fails_n, 'N', 2)}{kept}"
    cure = "; lift the tool and tare" if off_n > 0.5 * fails_n else ""
    return Finding(Item.ZERO, above(off_n, 0.5 * fails_n, fails_n), text + cure)


def judge_scale(change_n: float, span_n: float, error_n: float, friction_n: float) -> Finding:
    """Judge the change of force between two levels, of which span_n is expected. error_n: of the difference of the
    means; friction_n: width of the loop, of which the first level may not have passed all."""
    slope = change_n / span_n
    warns = SCALE_WARNS + (_UNSURE_N + _FRICTION_LEFT * friction_n + 3.0 * error_n) / span_n
    text = f"{slope:.0%} of the change that the calibration expects ({span_n:.1f} N)"
    is_unsure = warns > _UNSURE_SCALE
    if not is_unsure:
        fails = f"fails outside {SCALE_LOW:.0%} .. {SCALE_HIGH:.0%}"
        text += f", allowed {1.0 - warns:.0%} .. {1.0 + warns:.0%}, {fails}"
    if not SCALE_LOW <= slope <= SCALE_HIGH and abs(slope - 1.0) > warns:
        return Finding(
            Item.SCALE, FAILED, f"{text}: span or unit of the amplifier, or another slide than was calibrated"
        )
    if is_unsure:
        why = f"a friction of {friction_n:.1f} N leaves too little room: raise self_test.force_n"
        return Finding(Item.SCALE, NOT_TESTED, f"{text}; {why}")
    is_off = abs(slope - 1.0) > warns
    return Finding(Item.SCALE, WARNED if is_off else PASSED, text + ("; calibrate again" if is_off else ""))


def friction_slack_n(rising_n: float, falling_n: float) -> float:
    """Return by how much a healthy machine may be above the rising branch, N: the loop's width, and what stays unsure."""
    return _KEPT * max(0.0, falling_n - rising_n) + 2.0 * _UNSURE_N


def judge_step(trace: Trace, first_n: float, second_n: float, noise_n: float, known: Known) -> Finding:
    """Judge the readings after a step of the voltage; first_n, second_n: settled before and after."""
    step_n = second_n - first_n
    if step_n < _VISIBLE_STEP * noise_n:
        text = f"a step of {step_n:.1f} N does not stand out of a noise of {noise_n:.2f} N"
        return Finding(Item.RESPONSE, NOT_TESTED, text)
    return judge_response(time_to_share_s(trace, first_n, second_n, _SHARE_OF_STEP, noise_n), known)


def still_rising(waited_s: float) -> Finding:
    """Return the verdict on a force that has not settled."""
    text = f"the force still rises {waited_s:g} s after a step: regulator, hose or throttle, or a cell that drifts"
    return Finding(Item.RESPONSE, FAILED, text)


def judge_response(time_s: float, known: Known) -> Finding:
    """Judge the time to 63 % of a step."""
    if known.has_measured_response:
        warns, fails, origin = RESPONSE_WARNS, RESPONSE_FAILS, "measured by the calibration"
    else:
        warns, fails, origin = _GUESS_WARNS, _GUESS_FAILS, "supervision.response_lag_s"
    warns_s, fails_s = (share * known.response_s + _GRACE_S for share in (warns, fails))
    text = (
        f"{1e3 * time_s:.0f} ms to 63 % of a step, {bounds(1e3 * warns_s, 1e3 * fails_s, 'ms', 0)} "
        f"({1e3 * known.response_s:.0f} ms {origin})"
    )
    return Finding(Item.RESPONSE, above(time_s, warns_s, fails_s), text)


def judge_hold(held: Trace, pressures: Trace) -> Finding:
    """Judge the readings and pressures, Pa, of a voltage that stood."""
    pressure = fit_slope(pressures)
    lost_per_s = -pressure.n_per_s / pressures[0][1] if len(pressures) >= _FEWEST_PRESSURES else nan
    hold_s = held[-1][0] - held[0][0]
    return judge_leak(fit_slope(held), max(mean_n(held), _LEAST_HELD_N), hold_s, lost_per_s)


def judge_leak(slope: Slope, force_n: float, hold_s: float, pressure_per_s: float = nan) -> Finding:
    """Judge the loss at a constant voltage. pressure_per_s: share of the pressure lost per second, nan where it is not
    measured."""
    lost_per_s = -slope.n_per_s / force_n
    unsure_per_s = 3.0 * slope.error_n_per_s / force_n
    warns, fails = LEAK_WARNS + unsure_per_s, LEAK_FAILS + unsure_per_s
    verdict = above(lost_per_s, warns, fails)
    text = f"{-slope.n_per_s:+z.3f} N/s lost at {force_n:.1f} N over {hold_s:.0f} s, "
    text += bounds(warns * force_n, fails * force_n, "N/s", 3)
    if pressure_per_s == pressure_per_s:
        warns, fails = LEAK_WARNS + _PRESSURE_NOISE, LEAK_FAILS + _PRESSURE_NOISE
        verdict = max(verdict, above(pressure_per_s, warns, fails))
        text += f"; pressure {100.0 * pressure_per_s:+z.1f} % per second lost, " + bounds(
            100 * warns, 100 * fails, "%", 1
        )
    return Finding(Item.LEAK, verdict, text)


def judge_output_line(counts: WireCounts | None, slowest_s: float, known: Known) -> Finding:
    """Judge the answers of the output device. counts: of this test."""
    if counts is None or not counts.asked:
        return Finding(Item.OUTPUT_LINE, NOT_TESTED, "no exchange was counted")
    lost = max(0, counts.asked - counts.heard - 1)  # one may be out
    bound_s = known.settings.supervision.output_timeout_s
    verdict = max(_of_lost(max(lost, counts.garbled), counts.asked), above(slowest_s, _SLOW_SHARE * bound_s, bound_s))
    took = f", the slowest within {1e3 * slowest_s:.0f} ms of {1e3 * bound_s:.0f} ms" if slowest_s > 0.0 else ""
    text = f"{lost} of {counts.asked} questions without an answer, {counts.garbled} answers unreadable{took}"
    return Finding(Item.OUTPUT_LINE, verdict, f"{text}, {_LOST_BOUNDS}")


def judge_cell_line(intervals: Intervals, counts: WireCounts | None, known: Known, heard_for_s: float) -> Finding:
    """Judge how regularly the cell was heard. counts: of this test, which has listened for heard_for_s. One that is asked
    misses what it did not answer: its readings come as often as somebody asks."""
    bound_s = known.settings.supervision.sample_timeout_s
    if intervals.median_s <= 0.0:
        if heard_for_s <= bound_s:
            return Finding(Item.CELL_LINE, NOT_TESTED, "it ended before a second reading was due")
        return Finding(Item.CELL_LINE, FAILED, "no reading came")
    asked, heard, garbled = (counts.asked, counts.heard, counts.garbled) if counts else (0, 0, 0)
    missing = max(0, asked - heard - 1) if asked else intervals.missing  # one may be out
    total = asked or (heard + garbled if heard else round(1.0 / intervals.median_s))
    late = intervals.longest_s - intervals.median_s
    verdict = max(
        _of_lost(max(garbled, missing), max(total, 1)),
        above(late, _SLOW_SHARE * bound_s + intervals.median_s, bound_s),
    )
    text = (
        f"{1.0 / intervals.median_s:.0f} readings per second, {missing} missing, {garbled} unreadable, longest gap "
        f"{1e3 * intervals.longest_s:.0f} ms of {1e3 * bound_s:.0f} ms, {_LOST_BOUNDS}"
    )
    return Finding(Item.CELL_LINE, verdict, text)


_LOST_BOUNDS: Final = f"allowed {100.0 * LOST_WARNS:g} % lost, fails above {100.0 * LOST_FAILS:g} %"


def _of_lost(lost: int, total: int) -> SelfTestVerdict:
    return above(lost / total, LOST_WARNS, LOST_FAILS) if lost >= _LEAST_LOST else PASSED


def above(value: float, warns: float, fails: float) -> SelfTestVerdict:
    """Return the verdict on a value that two bounds limit from above."""
    if value > fails:
        return FAILED
    return WARNED if value > warns else PASSED


def bounds(warns: float, fails: float, unit: str, digits: int) -> str:
    """Return the words for two bounds."""
    return f"allowed {warns:.{digits}f} {unit}, fails above {fails:.{digits}f} {unit}"


def mean_error_n(noise_n: float, *readings: int) -> float:
    """Return the standard error of the difference of means of so many readings each."""
    return noise_n * sqrt(sum(1.0 / max(1, count) for count in readings))
