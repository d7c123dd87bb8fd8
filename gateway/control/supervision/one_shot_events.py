"""Sentences that are told once, when something begins to be so: target unreachable, trim hunting, force stuck at rest."""

from math import isfinite, nan
from typing import Final

from gateway.control.force_loop.force_loop import ForceLoop, LoopInputs
from gateway.control.force_loop.measured_trim import MOST_TURNS, MeasuredTrim
from gateway.control.inputs import LineStatus
from gateway.control.messages import hunting_sentence, stuck_sentence, unreachable_sentence
from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.unreachable_force import Evidence

_LEARNING: Final = 0.02  # of each new ratio of pressure to voltage
_LEAST_V: Final = 0.2


class OneShotEvents:
    """stuck_n: measured at the safe voltage, from which a force counts as stuck."""

    def __init__(self, stuck_n: float) -> None:
        self.said_unreachable = False
        self._said_stuck = self._said_hunting = False
        self._stuck_n = stuck_n
        self._was_right = False
        self._pressure_pa = self._profile_pa_per_v = self._learned_pa_per_v = nan

    def start(self) -> None:
        """At enable."""
        self._was_right = False

    def hear(self, line: LineStatus) -> None:
        """What the output device measures."""
        self._pressure_pa, self._profile_pa_per_v = line.pressure_pa, line.pressure_pa_per_v

    def unreachable(self, pursuit: ForceLoop, measured_n: float, moment: LoopInputs, events: list[str]) -> None:
        """After each step in force or voltage mode."""
        if pursuit.unreachable and not self.said_unreachable:
            events.append(unreachable_sentence(self._evidence(pursuit.stage.voltage_v, measured_n, moment.expected_n)))
        self.said_unreachable = pursuit.unreachable
        if pursuit.in_band and moment.touching:
            self._learn(pursuit.stage.voltage_v)

    def _learn(self, voltage_v: float) -> None:
        """The force is right, so the pressure at this voltage is, too."""
        self._was_right = True
        if isfinite(self._pressure_pa) and voltage_v >= _LEAST_V:
            ratio, known = self._pressure_pa / voltage_v, self._learned_pa_per_v
            self._learned_pa_per_v = known + _LEARNING * (ratio - known) if isfinite(known) else ratio

    def _evidence(self, voltage_v: float, measured_n: float, expected_n: float) -> Evidence:
        learned = isfinite(self._learned_pa_per_v)
        return Evidence(
            voltage_v=voltage_v,
            measured_n=measured_n,
            expected_n=expected_n,
            pressure_pa=self._pressure_pa,
            expected_pa=voltage_v * (self._learned_pa_per_v if learned else self._profile_pa_per_v),
            learned=learned,
            was_right=self._was_right,
        )

    def hunting(self, pursuit: ForceLoop, events: list[str]) -> None:
        trim = pursuit.trim
        hunted = isinstance(trim, MeasuredTrim) and trim.hunted
        if hunted and not self._said_hunting:
            events.append(hunting_sentence(pursuit.law.applied_n, MOST_TURNS))
        self._said_hunting = hunted

    def stuck(self, is_stuck: bool, reading: Reading, events: list[str]) -> None:
        if is_stuck and not self._said_stuck:
            events.append(stuck_sentence(reading.contact_n, self._stuck_n))
        self._said_stuck = is_stuck
