"""Sentences that are told once, when something begins to be so: target unreachable, force stuck at rest."""

from gateway.control.pursuit import Pursuit
from gateway.control.reading import Reading
from gateway.control.reasons import stuck_sentence, unreachable_sentence


class Telling:
    """stuck_n: measured at the safe voltage, from which a force counts as stuck."""

    def __init__(self, stuck_n: float) -> None:
        self.said_unreachable = False
        self._said_stuck = False
        self._stuck_n = stuck_n

    def unreachable(self, pursuit: Pursuit, measured_n: float, expected_n: float, events: list[str]) -> None:
        if pursuit.unreachable and not self.said_unreachable:
            events.append(unreachable_sentence(pursuit.stage.voltage_v, measured_n, expected_n))
        self.said_unreachable = pursuit.unreachable

    def stuck(self, is_stuck: bool, reading: Reading, events: list[str]) -> None:
        if is_stuck and not self._said_stuck:
            events.append(stuck_sentence(reading.contact_n, self._stuck_n))
        self._said_stuck = is_stuck
