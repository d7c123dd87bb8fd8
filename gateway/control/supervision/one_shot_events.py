"""Sentences for the log that are told once, when something begins: target unreachable, trim hunting, force stuck at rest.

Each `..._event` answers with its sentence the first time, and with nothing as long as it goes on.
"""

from math import isfinite, nan
from typing import Final

from gateway.control.force_loop.force_loop import ForceLoop
from gateway.control.force_loop.measured_trim import MOST_TURNS
from gateway.control.inputs import LineStatus, LoopInputs
from gateway.control.messages import (
    hunting_sentence,
    noisy_sentence,
    stuck_sentence,
    swinging_sentence,
    unreachable_sentence,
)
from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.unreachable_force import Evidence

_LEARNING: Final = 0.02  # of each new ratio of pressure to voltage
_LEAST_V: Final = 0.2  # below it the ratio is offset and noise


class OneShotEvents:
    """Remembers what has been told. stuck_n: measured at the safe voltage, from which a force counts as stuck. direction: as
    that of FaultDetector."""

    def __init__(self, stuck_n: float) -> None:
        self.direction = 1.0
        self._was_unreachable = False
        self._was_stuck = self._was_hunting = self._has_told_noise = False
        self._stuck_n = stuck_n
        self._was_in_band = False
        self._pressure_pa = self._profile_pa_per_v = self._learned_pa_per_v = nan

    def start(self) -> None:
        """Begin a new enable: nothing has been in band since."""
        self._was_in_band = self._has_told_noise = False

    def observe_line(self, line: LineStatus) -> None:
        """Take over the pressure that the output device measures."""
        self._pressure_pa, self._profile_pa_per_v = line.pressure_pa, line.pressure_pa_per_v

    def movement_events(self, loop: ForceLoop, measured_n: float, inputs: LoopInputs) -> tuple[str, str, str]:
        """Return what a step in force or voltage mode is the first to show. measured_n: contact force, smoothed."""
        noisy = "" if self._has_told_noise or not loop.settling.is_noisy else noisy_sentence(loop.applied_n)
        self._has_told_noise = self._has_told_noise or loop.settling.is_noisy
        return self.unreachable_event(loop, measured_n, inputs), self.hunting_event(loop), noisy

    def unreachable_event(self, loop: ForceLoop, measured_n: float, inputs: LoopInputs) -> str:
        """Return a sentence where the target has just become unreachable, else nothing. Ask after each step in force or
        voltage mode. measured_n: contact force, smoothed."""
        is_unreachable = loop.unreachable
        is_first, self._was_unreachable = is_unreachable and not self._was_unreachable, is_unreachable
        sentence = self._unreachable_sentence(loop, measured_n, inputs.expected_n) if is_first else ""
        if loop.settling.holds_force and inputs.touching:
            self._learn(loop.voltage_v)
        return sentence

    def _learn(self, voltage_v: float) -> None:
        """Learn the pressure per volt: the force is in band, so the pressure at this voltage is right, too."""
        self._was_in_band = True
        if isfinite(self._pressure_pa) and voltage_v >= _LEAST_V:
            ratio, known = self._pressure_pa / voltage_v, self._learned_pa_per_v
            self._learned_pa_per_v = known + _LEARNING * (ratio - known) if isfinite(known) else ratio

    def _unreachable_sentence(self, loop: ForceLoop, measured_n: float, expected_n: float) -> str:
        learned, voltage_v = isfinite(self._learned_pa_per_v), loop.voltage_v
        evidence = Evidence(
            voltage_v=voltage_v,
            measured_n=measured_n,
            expected_n=expected_n,
            pressure_pa=self._pressure_pa,
            expected_pa=voltage_v * (self._learned_pa_per_v if learned else self._profile_pa_per_v),
            learned=learned,
            was_in_band=self._was_in_band,
            target_n=loop.applied_n,
            is_lowest=loop.is_lowest,
        )
        return unreachable_sentence(evidence, self.direction)

    def hunting_event(self, loop: ForceLoop) -> str:
        """Return a sentence where the trim has just begun to hunt. Ask after each step in force or voltage mode."""
        is_hunting = loop.is_hunting
        is_first, self._was_hunting = is_hunting and not self._was_hunting, is_hunting
        if not is_first:
            return ""
        return swinging_sentence(loop.applied_n) if loop.is_gain_own else hunting_sentence(loop.applied_n, MOST_TURNS)

    def stuck_event(self, is_stuck: bool, reading: Reading) -> str:
        """Return a sentence where a force has just been found stuck at the safe voltage. Ask while the output is off."""
        is_first, self._was_stuck = is_stuck and not self._was_stuck, is_stuck
        return stuck_sentence(self.direction * reading.contact_n, self._stuck_n) if is_first else ""
