"""Sentences for the log that are told once, when something begins: target unreachable, trim at its limit, trim hunting, force
stuck at rest.

Each `..._event` answers with its sentence the first time, and with nothing as long as it goes on.
"""

from math import inf, isfinite, nan
from typing import Final

from gateway.control.force_loop.force_loop import ForceLoop
from gateway.control.force_loop.measured_trim import MOST_TURNS
from gateway.control.inputs import LineStatus, LoopInputs
from gateway.control.messages import (
    hunting_sentence,
    noisy_sentence,
    saturated_sentence,
    stuck_sentence,
    swinging_sentence,
    unreachable_sentence,
)
from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.unreachable_force import Evidence, lacks_air

_LEARNING: Final = 0.02  # of each new ratio of pressure to voltage
_AT_LIMIT_S: Final = 3.0  # that a trim stands at its limit until it is told
_LEAST_V: Final = 0.2  # below it the ratio is offset and noise


class OneShotEvents:
    """Remembers what has been told. stuck_n: measured at the safe voltage, from which a force counts as stuck. direction: as
    that of FaultDetector."""

    def __init__(self, stuck_n: float) -> None:
        self.direction = 1.0
        self._was_unreachable = False
        self._was_stuck = self._was_hunting = self._has_told_noise = self._has_told_limit = False
        self._at_limit_since_s = inf
        self._stuck_n = stuck_n
        self._was_in_band = False
        self._pressure_pa = self._profile_pa_per_v = self._learned_pa_per_v = nan

    def start(self) -> None:
        """Begin a new enable: nothing has been in band since."""
        self._was_in_band = self._has_told_noise = self._has_told_limit = False

    def observe_line(self, line: LineStatus) -> None:
        """Take over the pressure that the output device measures."""
        self._pressure_pa, self._profile_pa_per_v = line.pressure_pa, line.pressure_pa_per_v

    def lacks_air(self, voltage_v: float) -> bool:
        """Decide whether the pressure is too low to move the tool at this voltage, as far as it is measured."""
        if not isfinite(self._pressure_pa):
            return False
        return lacks_air(self._pressure_pa, self._expected_pa(voltage_v), learned=isfinite(self._learned_pa_per_v))

    def _expected_pa(self, voltage_v: float) -> float:
        learned = isfinite(self._learned_pa_per_v)
        return voltage_v * (self._learned_pa_per_v if learned else self._profile_pa_per_v)

    def movement_events(self, loop: ForceLoop, measured_n: float, inputs: LoopInputs) -> tuple[str, ...]:
        """Return what a step in force or voltage mode is the first to show. measured_n: contact force, smoothed."""
        noisy = (
            ""
            if self._has_told_noise or not loop.settling.is_noisy
            else noisy_sentence(loop.applied_n, loop.leaps.two_values)
        )
        self._has_told_noise = self._has_told_noise or loop.settling.is_noisy
        saturated = self.saturated_event(loop, measured_n, inputs)
        return self.unreachable_event(loop, measured_n, inputs), self.hunting_event(loop), noisy, saturated

    def saturated_event(self, loop: ForceLoop, measured_n: float, inputs: LoopInputs) -> str:
        """Return a sentence, once in an enable, where a force is in band and the trim has stood at its limit for a while: what
        is not in band is unreachable. Ask after each step in force or voltage mode. measured_n: contact force, smoothed."""
        self._at_limit_since_s = min(self._at_limit_since_s, inputs.now_s) if loop.is_trim_at_limit else inf
        has_lasted = inputs.now_s - self._at_limit_since_s >= _AT_LIMIT_S
        if self._has_told_limit or not (has_lasted and loop.settling.holds_force):
            return ""
        self._has_told_limit = True
        shown_n, model_n = self.direction * measured_n, self.direction * inputs.expected_n
        return saturated_sentence(loop.voltage_v, loop.trim_v, shown_n, model_n)

    def unreachable_event(self, loop: ForceLoop, measured_n: float, inputs: LoopInputs) -> str:
        """Return a sentence where the target has just become unreachable, else nothing. Ask after each step in force or
        voltage mode. measured_n: contact force, smoothed."""
        is_unreachable = loop.unreachable
        is_first, self._was_unreachable = is_unreachable and not self._was_unreachable, is_unreachable
        sentence = self._unreachable_sentence(loop, measured_n, inputs.expected_n) if is_first else ""
        if loop.settling.holds_force:
            self._learn(loop.voltage_v)
        return sentence

    def _learn(self, voltage_v: float) -> None:
        """Learn the pressure per volt: the force is in band, so the pressure at this voltage is right, too."""
        self._was_in_band = True
        if isfinite(self._pressure_pa) and voltage_v >= _LEAST_V:
            ratio, known = self._pressure_pa / voltage_v, self._learned_pa_per_v
            self._learned_pa_per_v = known + _LEARNING * (ratio - known) if isfinite(known) else ratio

    def _unreachable_sentence(self, loop: ForceLoop, measured_n: float, expected_n: float) -> str:
        evidence = Evidence(
            voltage_v=loop.voltage_v,
            measured_n=measured_n,
            expected_n=expected_n,
            pressure_pa=self._pressure_pa,
            expected_pa=self._expected_pa(loop.voltage_v),
            learned=isfinite(self._learned_pa_per_v),
            was_in_band=self._was_in_band,
            target_n=loop.applied_n,
            is_lowest=loop.is_lowest,
            two_values=loop.leaps.two_values,
        )
        return unreachable_sentence(evidence, self.direction)

    def hunting_event(self, loop: ForceLoop) -> str:
        """Return a sentence where the trim has just begun to hunt. Ask after each step in force or voltage mode."""
        is_hunting = loop.is_hunting
        is_first, self._was_hunting = is_hunting and not self._was_hunting, is_hunting
        if not is_first:
            return ""
        if loop.is_gain_own:
            return swinging_sentence(loop.applied_n, is_trim_off=loop.is_trim_off)
        return hunting_sentence(loop.applied_n, MOST_TURNS)

    def stuck_event(self, is_stuck: bool, reading: Reading) -> str:
        """Return a sentence where a force has just been found stuck at the safe voltage. Ask while the output is off."""
        is_first, self._was_stuck = is_stuck and not self._was_stuck, is_stuck
        return stuck_sentence(self.direction * reading.contact_n, self._stuck_n) if is_first else ""
