"""See that a force that was let go has gone: behind a disable, a ramp's end or a reset the safe voltage must be confirmed.

Off is what everybody takes for "nothing presses", so it may not be said of an output that has not obeyed: a line that is
silent, lost, or refuses there is as much a fault as under force. Once the safe voltage stands, such a line only keeps an
enable back.
A start is no such end: nothing was let go, and the first command is the safe voltage.
"""

from typing import Final

from gateway.control.inputs import LineStatus
from gateway.control.supervision.fault_detection import FaultDetector, StopCause
from gateway.registers.words import State

_OFF: Final = State.OFF
NEAR_V: Final = 0.05  # a device answers in steps of its own


class SafeVoltageCheck:
    """Follows the state, and from its way to OFF on the line."""

    def __init__(self, faults: FaultDetector) -> None:
        self._faults = faults
        self._state = _OFF
        self._asked_s: float | None = None  # when the safe voltage was asked for, None once it stands

    def cause(self, now_s: float, state: State, line: LineStatus) -> StopCause | None:
        """Return what keeps the safe voltage from standing, None where nothing does, or where it is not asked for."""
        was_on, self._state = self._state is not _OFF, state
        if state is not _OFF:
            return None
        if was_on:
            self._asked_s = now_s
        if self._asked_s is None:
            return None
        # what was confirmed before the setting that is on its way may not stand any more
        stands_v = line.acknowledged_v if line.sent_v is None else line.standing_v
        if stands_v is not None and abs(stands_v - self._faults.safe_voltage_v) <= NEAR_V:
            self._asked_s = None
            return None
        return self._faults.cause_at_rest(now_s, line, now_s - self._asked_s)
