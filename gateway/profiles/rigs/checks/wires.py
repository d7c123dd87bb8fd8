"""Whether the wires of a rig are fast enough, and their numbers fine enough, for what the rig asks of them."""

from math import inf
from typing import Final

from gateway.control.supervision.repeat_law import counts_found_within
from gateway.control.supervision.stuck_sensor import SLOW_S
from gateway.devices import DeviceProfile, DeviceRole, output_host
from gateway.profiles.rigs.checks.lines import of_role
from gateway.profiles.rigs.checks.parts import Check, Found, Parts
from gateway.profiles.rigs.checks.wire_times import output_cycle_s, readings_of, talks_of
from gateway.profiles.strict_yaml.fault_sentences import newton, number, second

_COUNTS_OF_NOISE: Final = 0.7  # a rate that needs more noise than this to find a frozen cell gets a warning
_LEAST_QUANTUM_COUNTS: Final = 0.5  # below half a count every repeated reading looks frozen; rounding stays above it
_MOST_QUANTUM_COUNTS: Final = 2.0  # above two counts the quantum was probably written for another amplifier
_LEAST_CYCLES: Final = 3  # exchanges within output_timeout_s, so that one that is late or lost is no fault
_LEAST_SAMPLES: Final = 2.0  # readings within sample_timeout_s, so that one that is late is no fault
_SLOWEST_HZ: Final = 20.0  # the pneumatics of the paper's rig settle in 0.27-0.49 s and need 20-50 Hz


def check_reply_timeout(parts: Parts) -> Found:
    """Yield a fault for a device whose reply_timeout_s is over before its answer can be through the wire."""
    if parts.output_device and parts.output:
        baud = parts.output_device.serial.at(parts.output.baud).baud
        for name, took_s in talks_of(parts):
            yield from check_reply_time("output.baud", parts.output_device, baud, (name, took_s))
    for reading in readings_of(parts):
        if reading.is_asked:
            yield from check_reply_time("load_cell.baud", reading.device, reading.baud, ("read_force", reading.wire_s))


def check_reply_time(path: str, device: DeviceProfile, baud: int, talk: tuple[str, float]) -> Found:
    """Yield a fault for a talk (its name, its time on the wire in s) that takes longer than the device is waited for."""
    if talk[1] > device.reply_timeout_s:
        reason = f"question and answer of {talk[0]} take {talk[1]:.3f} s on the wire"
        bound = f"{device.name} gives up after reply_timeout_s = {second(device.reply_timeout_s)}"
        yield path, f"{baud}: {reason}, {bound}: raise it in the profile, or set the device to a higher speed"


def check_output_timeout(parts: Parts) -> Found:
    """Yield a fault for a supervision.output_timeout_s that is shorter than one exchange with the output on the wire, and for
    a device that is waited for longer than that: behind an answer that is lost the safe voltage waits, too."""
    took_s = max((took_s for _, took_s in talks_of(parts)), default=0.0)
    device, bounds = of_role(parts.output_device, DeviceRole.OUTPUT), parts.supervision
    if bounds and device and device.reply_timeout_s > bounds.output_timeout_s:
        waits = f"{device.name} is waited for {second(device.reply_timeout_s)} (reply_timeout_s), and the safe voltage waits "
        yield (
            "output.device",
            f"{waits}behind a lost answer: at most {second(bounds.output_timeout_s)} (output_timeout_s)",
        )
    if bounds and bounds.output_timeout_s <= took_s:
        timeout = second(bounds.output_timeout_s)
        yield (
            "supervision.output_timeout_s",
            f"{timeout} is over before an answer can be there: {took_s:.3f} s on the wire",
        )


def check_wire_delay(parts: Parts) -> Found:
    """Yield a fault for a wire that is slower than supervision.response_lag_s: supervision would take the late force for a
    wrong gain."""
    if parts.supervision is None:
        return
    bound_s = parts.supervision.response_lag_s
    late = f"longer than supervision.response_lag_s = {second(bound_s)}: a force that is seen so late looks like a wrong gain"
    if (took_s := output_cycle_s(parts)) > bound_s:
        yield "output.baud", f"a setting and a reading take {took_s:.2f} s on the wire, {late}"
    for reading in readings_of(parts):
        if reading.period_s > bound_s:
            yield "load_cell.baud", f"a reading of {reading.device.name} takes {reading.period_s:.2f} s, {late}"


def check_sample_timeout(parts: Parts) -> Found:
    """Yield a fault for a supervision.sample_timeout_s that is shorter than two readings of the load cell."""
    for reading in readings_of(parts):
        if parts.supervision and parts.supervision.sample_timeout_s < _LEAST_SAMPLES * reading.period_s:
            bound, rate = second(parts.supervision.sample_timeout_s), f"{1.0 / reading.period_s:.3g} readings/s"
            talk = f"{_LEAST_SAMPLES * reading.period_s:.3g} s ({rate} at {reading.baud} baud)"
            yield (
                "supervision.sample_timeout_s",
                f"{bound} is too short: two readings of {reading.device.name} take {talk}",
            )


def check_display_range(parts: Parts) -> Found:
    """Yield a fault for a display that ends below the bound on force: it would show its last number for ever."""
    if (limits := parts.limits) is None or parts.load_cell is None:
        return
    for reading in readings_of(parts):
        message = reading.device.reading
        per_count = reading.host.resolution_n / message.step
        key = "force_max_n" if message.says_overload else "over_force_n"
        offset = max(0.0, parts.load_cell.sign * message.zero_count)  # which a push begins at
        wanted_n, end_n = getattr(limits, key), (message.largest_shown - offset) * per_count
        if wanted_n > end_n:
            yield f"limits.{key}", f"{newton(wanted_n)} is beyond what {reading.device.name} can show: {end_n:.4g} N"


def check_reading_resolution(parts: Parts) -> Found:
    """Yield a fault for a sample_quantum_n or an in_band_tolerance_n that is finer than the load cell's counts.

    sample_quantum_n decides when a reading counts as frozen, the band whether the force is held.
    """
    for reading in readings_of(parts):
        count_n = reading.host.resolution_n
        one = f"one count of {reading.device.name}, {count_n:.3g} N"
        if parts.supervision and parts.supervision.sample_quantum_n < _LEAST_QUANTUM_COUNTS * count_n:
            quantum = newton(parts.supervision.sample_quantum_n)
            yield (
                "supervision.sample_quantum_n",
                f"{quantum} is less than {one}: a held force would look like a frozen reading; write {count_n:.3g}",
            )
        if parts.defaults and parts.defaults.in_band_tolerance_n < count_n:
            band = newton(parts.defaults.in_band_tolerance_n)
            yield (
                "defaults.in_band_tolerance_n",
                f"{band} is less than {one}: nobody could tell whether the force is in band",
            )


def check_frozen_detection(parts: Parts) -> Found:
    """Yield a warning for a rate of readings at which a frozen cell is slow to find.

    The noise itself shows when the cell is read (W234 at a calibration's end).
    """
    if parts.supervision and parts.supervision.frozen_equal_samples is not None:
        return
    for reading in readings_of(parts):
        rate_hz = 1.0 / reading.period_s
        counts = counts_found_within(SLOW_S, rate_hz)
        if counts > _COUNTS_OF_NOISE:
            reason = f"noise of {counts:.2g} counts or more" if counts < inf else "no noise whatever: too few readings"
            rate_text = f"{reading.device.name} gives {rate_hz:.3g} readings/s"
            consequence = (
                f"at a force that stands still a frozen cell is found within {SLOW_S:.0f} s by {reason} (W234)"
            )
            yield "load_cell.device", f"{rate_text}: {consequence}"


def check_output_resolution(parts: Parts) -> Found:
    """Yield a fault for an output whose steps are too coarse for the band.

    Half a step, as the calibration's mean slope makes newtons of it, must fit into the band.
    """
    device, calibration, defaults = of_role(parts.output_device, DeviceRole.OUTPUT), parts.calibration, parts.defaults
    if not device or not calibration or not defaults:
        return
    low_n, high_n = calibration.model().force_range_n
    step_v = output_host(device).resolution_v
    step_n = step_v * (high_n - low_n) / (calibration.x1_v - calibration.x0_v)
    if step_n / 2.0 > defaults.in_band_tolerance_n:
        reason = f"sets in steps of {step_v:.3g} V, about {step_n:.2g} N"
        band = f"defaults.in_band_tolerance_n = {newton(defaults.in_band_tolerance_n)}"
        yield (
            "output.device",
            f"{device.name} {reason}: {band} cannot be held; more decimals in the template, or a wider band",
        )


def check_output_speed(parts: Parts) -> Found:
    """Yield a warning for an output wire that is too slow for the pneumatics, or for its timeout."""
    took_s = output_cycle_s(parts)
    if took_s > 1.0 / _SLOWEST_HZ:
        reason = f"a setting and a reading take {took_s * 1e3:.0f} ms on the wire, {1 / took_s:.0f} Hz"
        yield "output.baud", f"{reason}; the pneumatics need {number(_SLOWEST_HZ)} Hz"
    if parts.supervision and parts.supervision.output_timeout_s < _LEAST_CYCLES * took_s:
        timeout = second(parts.supervision.output_timeout_s)
        yield (
            "supervision.output_timeout_s",
            f"{timeout} is less than three settings with readings on the wire: {_LEAST_CYCLES * took_s:.2f} s",
        )


def check_sample_rate(parts: Parts) -> Found:
    """Yield a warning for a load-cell wire that carries fewer readings than the device sends, or than the pneumatics need."""
    for reading in readings_of(parts):
        rate_hz, possible_hz = reading.device.rate_hz, 1.0 / reading.wire_s
        if rate_hz > possible_hz:
            yield (
                "load_cell.baud",
                f"{reading.baud} carries {possible_hz:.0f} readings/s, {reading.device.name} sends {number(rate_hz)}",
            )
        elif reading.period_s > 1.0 / _SLOWEST_HZ:
            own = "" if reading.period_s <= reading.wire_s else " by its `rate_hz`, at any baud"
            reason = f"{reading.device.name} gives {1.0 / reading.period_s:.3g} readings/s{own}"
            yield "load_cell.baud", f"{reading.baud}: {reason}; the pneumatics need {number(_SLOWEST_HZ)}"


def check_lost_answer(parts: Parts) -> Found:
    """Yield a warning for a supervision.sample_timeout_s that one lost answer of the load cell uses up."""
    for reading in readings_of(parts):
        gap_s = reading.device.reply_timeout_s + reading.period_s
        if reading.is_asked and parts.supervision and parts.supervision.sample_timeout_s < gap_s:
            bound = second(parts.supervision.sample_timeout_s)
            reason = (
                f"one lost answer leaves a gap of {gap_s:.3g} s ({reading.device.name}: reply_timeout_s and a reading)"
            )
            yield "supervision.sample_timeout_s", f"{bound}: {reason}, and that is a fault"


def check_sample_quantum(parts: Parts) -> Found:
    """Yield a warning for a supervision.sample_quantum_n far above one count of the load cell."""
    for reading in readings_of(parts):
        count_n = reading.host.resolution_n
        if parts.supervision and parts.supervision.sample_quantum_n > _MOST_QUANTUM_COUNTS * count_n:
            reason = f"is far from one count of {reading.device.name}, {count_n:.3g} N: write {count_n:.3g}"
            yield "supervision.sample_quantum_n", f"{newton(parts.supervision.sample_quantum_n)} {reason}"


FAULTS: Final[tuple[Check, ...]] = (
    check_reply_timeout,
    check_output_timeout,
    check_wire_delay,
    check_sample_timeout,
    check_display_range,
    check_reading_resolution,
    check_output_resolution,
)
WARNINGS: Final[tuple[Check, ...]] = (
    check_output_speed,
    check_sample_rate,
    check_lost_answer,
    check_sample_quantum,
    check_frozen_detection,
)
