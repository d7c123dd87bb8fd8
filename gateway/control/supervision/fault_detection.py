"""Find the first cause of a fault, apart from the force law, and only while the output is enabled.

Checks run in a fixed order and the first one found is the cause: what makes others follow comes first (our own loop,
then the output line, then the cell, then what the cell says, then the master). While disabled the same facts only
refuse an enable, but for an output that does not confirm the safe voltage (`safe_voltage.py`): then the force may stand.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Final

from gateway.codes.explanation import BUSY_CURE, is_cause
from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.control.blame_for_silence import cause_of_silence
from gateway.control.inputs import LineStatus
from gateway.control.messages import fault_sentence, gain_sentence, sign_sentence, stuck_sentence
from gateway.control.sample_conditioning import Reading
from gateway.control.settings import ControlSettings, over_force_room_n
from gateway.control.supervision.plausibility import ExpectedForce, RiseCheck
from gateway.control.supervision.stuck_sensor import StuckSensorCheck
from gateway.units import format_ms

_WRONG_SIGN, _WRONG_GAIN = FaultCode.SIGN_INVERTED, FaultCode.GAIN_WRONG
_STUCK_S: Final = 1.0  # that a force must stay at the safe voltage, not only decay
_FAR_OFF: Final = 3.0  # measured over expected force that points at the cell rather than at the process


@dataclass(frozen=True, slots=True)
class StopCause:
    """A first cause and its sentence."""

    fault: FaultCode
    sentence: str


_LINE_WORDS: Final = {
    FaultCode.OUTPUT_REFUSED: "the output device refused a voltage: check its range, its channel and its profile",
    FaultCode.OUTPUT_ALTERED: "the output device accepted another voltage than asked: check wire and profile",
    FaultCode.OUTPUT_LOST: "the output's port went away: check the plug; it reopens by itself",
    FaultCode.WATCHDOG_TRIPPED: "the output device's own watchdog has tripped, it obeys nothing: look at the tool, then reset",
    FaultCode.WRONG_DEVICE: "another device answers than the rig names: check the plug and the profile",
    FaultCode.WATCHDOG_NOT_ARMED: "the output device's watchdog does not arm: check its profile, or accept it in the rig",
}
_NOT_OBEYED: Final = (FaultCode.OUTPUT_REFUSED, FaultCode.OUTPUT_ALTERED, FaultCode.OUTPUT_LOST)
_AWAKE: Final = "keep it awake while it works (systemctl mask sleep.target)"
_MAY_PRESS: Final = "the safe voltage is not confirmed, so what pressed may press still"


def line_words(line: LineStatus) -> str:
    """Return what the output line reports, and what the device said to it."""
    words = _LINE_WORDS.get(line.fault, "reported by the output line")
    return f"{words} (it says: {line.said})" if line.said else words


def stop_cause(fault: FaultCode, detail: str) -> StopCause:
    """Return a fault with its code before the sentence."""
    return StopCause(fault, fault_sentence(fault, detail))


def _unheard(excuse: str) -> str:
    return f"a device was not heard in time; {excuse}" if excuse else ""


def _lateness(line: LineStatus, allowed_s: float) -> StopCause:
    """Return the cause of a late loop: internal error or machine load, whichever made the larger part of the lateness."""
    observation = f"the loop came by {line.late_s * 1e3:.0f} ms late, allowed {allowed_s * 1e3:.0f} ms (stall_s)"
    dropped = "nothing that arrived meanwhile moves it"
    if is_cause(line.suspended_s, line.late_s):
        slept = f"this machine was suspended for {line.suspended_s:.1f} s of them"
        return stop_cause(FaultCode.LOOP_STALLED, f"{observation}: {slept}; {_AWAKE}; {dropped}")
    withheld_s, by_whom = line.withheld
    if is_cause(withheld_s, line.late_s):
        return stop_cause(FaultCode.MACHINE_BUSY, f"{observation}; {by_whom}; {dropped}")
    if line.waited_s is None:
        return stop_cause(FaultCode.LOOP_STALLED, f"{observation}: the machine is overloaded; {dropped}")
    waited = f"{line.waited_s * 1e3:.0f} ms of them it waited for a processor"
    if not is_cause(line.waited_s, line.late_s):
        return stop_cause(
            FaultCode.LOOP_STALLED,
            f"{observation}, only {waited}: stopped, or an internal error (please report); {dropped}",
        )
    return stop_cause(FaultCode.MACHINE_BUSY, f"{observation}, {waited}: {BUSY_CURE}; {dropped}")


class FaultDetector:
    """Counts on every new sample; `first_cause` is asked once per step while enabled. direction: -1 where the tool pulls; a
    pull counts as positive here, and sentences tell forces as the registers do."""

    def __init__(self, settings: ControlSettings) -> None:
        self._limits = settings.limits
        self.safe_voltage_v = settings.limits.safe_voltage_v
        self.direction = 1.0
        self._bounds = settings.supervision
        self._room_n = over_force_room_n(settings.limits, settings.defaults)
        self._rise = RiseCheck(settings.defaults.contact_threshold_n)
        self._frozen = StuckSensorCheck(settings.supervision)
        self._over, self._outside_n = 0, 0.0
        self._response_fault = FaultCode.NONE
        self._stuck_s = 0.0
        self._stood_still_s, self._stall_ended_s = 0.0, -inf

    def expect_noise(self, noise_n: float) -> None:
        """Begin with the cell's noise as the calibration in use has measured it, N; 0: not known."""
        self._frozen.expect_noise(noise_n)

    def start(self) -> None:
        """Forget what was counted before, at an enable; what is over its bound is so, and keeps the enable back."""
        self.start_rise()
        self._frozen.start()
        self._stuck_s = 0.0

    def start_rise(self) -> None:
        """Take the force of now for the one at rest, which the first rise is judged from."""
        self._rise.start()
        self._response_fault = FaultCode.NONE

    def observe(self, reading: Reading, response: ExpectedForce, branch_share: float, touching: bool) -> None:
        """Count a new sample, enabled or not."""
        self._outside_n = response.outside_n
        self._rise.smooth(reading)
        self._frozen.observe(reading, response, touching)
        is_over = reading.overload or abs(reading.contact_n) >= self._limits.over_force_n
        self._over = self._over + 1 if is_over else 0
        self._response_fault = self._rise.judge(response, branch_share, touching, reading.interval_s)

    def observe_lateness(self, now_s: float, line: LineStatus) -> None:
        """Note a stall of the loop: what a master has sent meanwhile comes now, in OFF as well, where nothing faults."""
        if line.late_s > self._bounds.stall_s:
            self._stood_still_s, self._stall_ended_s = line.late_s, now_s

    def observe_rest(self, reading: Reading) -> None:
        """Measure how long a force stays at the safe voltage, while disabled. Of either sign: behind a zero that was taken
        under force the cell reads far below 0, and what is pressed then is that much too much."""
        stuck = reading.is_usable and abs(reading.contact_n) > self._bounds.stuck_n
        self._stuck_s = self._stuck_s + reading.interval_s if stuck else 0.0

    @property
    def slow_words(self) -> str:
        """W234, empty where a frozen load cell is found soon."""
        return self._frozen.slow_words

    @property
    def repeats(self) -> str:
        """Observation of a load cell that repeats itself for longer than a living one does; empty where it does not."""
        return self._frozen.repeats

    @property
    def measured_n(self) -> float:
        """Cell force behind a low-pass, for judgement and sentences."""
        return self._rise.smooth_n

    @property
    def is_first_rise_too_high(self) -> bool:
        """The first rise since the enable is far above what the model expects: the target waits."""
        return self._rise.is_too_high

    def shift_zero(self, moved_n: float) -> None:
        """Take over a zero that has moved: what was measured before reads that much less now."""
        self._rise.shift(moved_n)

    @property
    def is_stuck(self) -> bool:
        """Decide whether the force has stayed at the safe voltage for too long."""
        return self._stuck_s >= _STUCK_S

    def enable_block(self, now_s: float, reading: Reading, line: LineStatus) -> RefusalReason:
        """Return why an enable would be refused now, apart from a latched fault."""
        if line.fault or self.is_silent(now_s, line):
            return RefusalReason.OUTPUT_FAULT
        if line.cell_lost or not reading.is_fresh:
            return RefusalReason.CELL_SILENT
        if line.valve is not None and (line.valve.stands is None or line.valve.lost):
            return RefusalReason.VALVE_UNKNOWN
        if self.stall_words(now_s, line):
            return RefusalReason.NOT_READY
        if line.acknowledged_v is None or not reading.is_usable or self.is_stuck or self._over:
            return RefusalReason.NOT_READY
        return RefusalReason.NONE

    def excuse(self, block: RefusalReason, now_s: float, reading: Reading, line: LineStatus) -> str:
        """Return why it is not the device that keeps an enable back, what a cell says in place of readings, or what force is
        there; else empty."""
        if block is RefusalReason.CELL_SILENT:
            return _unheard(cause_of_silence(FaultCode.SAMPLE_STALE, reading.age_s, line.cell_held, line.cell_says)[1])
        if block is RefusalReason.OUTPUT_FAULT and line.unanswered_since_s is not None and not line.fault:
            silent_s = now_s - line.unanswered_since_s
            return _unheard(cause_of_silence(FaultCode.OUTPUT_SILENT, silent_s, line.output_held, line.said)[1])
        return self.stall_words(now_s, line) or self._rest_words(reading) if block is RefusalReason.NOT_READY else ""

    def _rest_words(self, reading: Reading) -> str:
        """Which force at rest keeps an enable back, empty where there is none."""
        if self._over and reading.overload:
            return self._over_words(reading, 0.0)
        if self._over:
            shown_n = self.direction * reading.contact_n
            return f"{shown_n:.1f} N measured, over-force is {self._limits.over_force_n:.1f} N: free the tool"
        return stuck_sentence(self.direction * reading.contact_n, self._bounds.stuck_n) if self.is_stuck else ""

    def stall_words(self, now_s: float, line: LineStatus) -> str:
        """Return why nothing begins right behind a stall, empty where there was none: what is asked for may have waited in a
        socket, and a master that has given it up expects no force any more, nor a zero of later."""
        stall_s = self._bounds.stall_s
        if line.late_s > stall_s:
            late_s = line.late_s
        elif now_s - self._stall_ended_s < stall_s:
            late_s = self._stood_still_s
        else:
            return ""
        return f"the loop stood still for {format_ms(late_s)}, and this may have waited meanwhile: ask again"

    def first_cause(
        self, now_s: float, reading: Reading, line: LineStatus, expected_n: Callable[[], float]
    ) -> StopCause | None:
        """Return the first cause of a fault, None where there is none. expected_n: asked for the model's rise by sentences."""
        return self._of_line(now_s, line) or self._of_cell(reading, line) or self._of_force(reading, expected_n)

    def cause_at_rest(self, now_s: float, line: LineStatus, rest_s: float) -> StopCause | None:
        """Return why the safe voltage that was asked for rest_s ago does not stand, None where it may be on its way still."""
        has_had_time = line.fault is FaultCode.OUTPUT_LOST or rest_s > self._bounds.output_timeout_s
        if line.fault in _NOT_OBEYED and has_had_time:
            return stop_cause(line.fault, f"{line_words(line)}; {_MAY_PRESS}")
        if not line.fault and self.is_silent(now_s, line):
            cause = self._no_answer(now_s, line)
            return StopCause(cause.fault, f"{cause.sentence}; {_MAY_PRESS}")
        return None

    def is_silent(self, now_s: float, line: LineStatus) -> bool:
        """Decide whether the output device has not answered for longer than it may."""
        since_s = line.unanswered_since_s
        return since_s is not None and now_s - since_s > self._bounds.output_timeout_s

    def _of_line(self, now_s: float, line: LineStatus) -> StopCause | None:
        if line.late_s > self._bounds.stall_s:
            return _lateness(line, self._bounds.stall_s)
        if line.fault:
            return stop_cause(line.fault, line_words(line))
        if self.is_silent(now_s, line):
            return self._no_answer(now_s, line)
        return None

    def _no_answer(self, now_s: float, line: LineStatus) -> StopCause:
        silent_s, bound_s = now_s - (line.unanswered_since_s or 0.0), self._bounds.output_timeout_s
        observation = f"no answer from the output device for {silent_s * 1e3:.0f} ms, allowed {bound_s * 1e3:.0f} ms"
        suspects = line.said or "power or wires"
        if line.answer_late_s:
            suspects = (
                f"the answer before took {format_ms(line.answer_late_s)}, it may be too slow for that; else {suspects}"
            )
        fault, blamed = cause_of_silence(FaultCode.OUTPUT_SILENT, silent_s, line.output_held, suspects)
        return stop_cause(fault, f"{observation}: {blamed}")

    def _of_cell(self, reading: Reading, line: LineStatus) -> StopCause | None:
        if line.cell_lost:
            return stop_cause(
                FaultCode.CELL_LOST, "the load cell's port went away: check the plug; it reopens by itself"
            )
        if not reading.is_fresh:
            observation = (
                f"last sample {reading.age_s * 1e3:.0f} ms old, allowed {self._bounds.sample_timeout_s * 1e3:.0f} ms"
            )
            suspects = line.cell_says or "power, wires or stream mode of the amplifier"
            fault, blamed = cause_of_silence(FaultCode.SAMPLE_STALE, reading.age_s, line.cell_held, suspects)
            return stop_cause(fault, f"{observation}: {blamed}")
        if not (reading.is_usable or reading.overload):
            return stop_cause(FaultCode.NOT_FINITE, "the load cell's reading is not a number")
        return None

    def _of_force(self, reading: Reading, expected_n: Callable[[], float]) -> StopCause | None:
        if self._over >= self._limits.over_force_samples:
            return stop_cause(FaultCode.OVER_FORCE, self._over_words(reading, expected_n()))
        if words := self._frozen.words:
            self._frozen.note_trip()
            observation = f"{self.direction * reading.cell_n:.2f} N {words}: amplifier or cell is dead"
            return stop_cause(FaultCode.SAMPLE_FROZEN, observation)
        if self._response_fault is _WRONG_SIGN:
            rise_n, model_n = self.direction * self._rise.measured_rise_n, self.direction * expected_n()
            sentence = sign_sentence(rise_n, model_n, was_right=self._rise.is_proven, untared_n=reading.raw_n)
            return StopCause(FaultCode.SIGN_INVERTED, sentence)
        if self._response_fault is _WRONG_GAIN:
            return StopCause(
                FaultCode.GAIN_WRONG, gain_sentence(self._rise.wrong_rise_n, expected_n() + self._outside_n)
            )
        return None

    def _over_words(self, reading: Reading, expected_n: float) -> str:
        if reading.overload:
            return f"cell saturated ({self._bounds.saturation_n:.0f} N is 98 % of its range): over-force, open or shorted wires"
        shown_n, model_n = self.direction * reading.contact_n, self.direction * expected_n
        values = f"{shown_n:.1f} N measured, allowed {self._limits.over_force_n:.1f} N, {model_n:.1f} N expected"
        if abs(reading.cell_n) < self._limits.over_force_n:
            weight_n = self.direction * (reading.contact_n - reading.cell_n)
            return f"{values}: {weight_n:.1f} N of it are the payload's weight, is `payload` the tool's own mass?"
        if abs(reading.contact_n) > _FAR_OFF * abs(expected_n):
            return f"{values}: kgf and N mixed up, or a wrong span?"
        near = "" if self._room_n is None else f", or over_force_n is too near above force_max_n ({self._room_n:.2g} N)"
        return f"{values}: a jam, or the tool was pushed{near}"
