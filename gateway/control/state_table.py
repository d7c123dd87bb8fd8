"""The control states as a table. A pair that is missing is an internal error and raises: no state is entered by accident.

OFF: output disabled, safe voltage (after start, disable, reset, restart). READY: enabled with nothing to pursue:
setpoint 0, or waiting at the pre-contact force for contact. RAMPING: the target moves or the force is out of band.
HOLDING: in band for the in-band time. CALIBRATING: a calibration or an experiment has the output, until the ramp after
its end has reached 0; it waits and settles by its own rules. FAULT: latched; there is no (FAULT, FAILED), so that a fault
has exactly one first cause.
"""

from enum import StrEnum
from typing import Final

from gateway.registers.words import State


class StateEvent(StrEnum):
    """Event that makes a state go over into another."""

    ENABLE = "enable"  # rise of control_word bit 0, accepted
    DISABLE = "disable"  # fall of it, or the end of a ramp down
    WAIT = "wait"  # nothing to pursue
    MOVE = "move"  # target moving, or force out of band
    SETTLE = "settle"  # in band for the in-band time
    FAILED = "failed"  # supervision found a first cause
    RESET = "reset"  # accepted fault reset
    CALIBRATE = "calibrate"  # a run begins


_OFF, _READY, _RAMPING, _HOLDING, _FAULT = State.OFF, State.READY, State.RAMPING, State.HOLDING, State.FAULT
_CALIBRATING = State.CALIBRATING

TRANSITIONS: Final[dict[tuple[State, StateEvent], State]] = {
    (_OFF, StateEvent.ENABLE): _READY,
    (_OFF, StateEvent.FAILED): _FAULT,  # an internal error, or a safe voltage that is not confirmed
    (_OFF, StateEvent.CALIBRATE): _CALIBRATING,
    (_READY, StateEvent.CALIBRATE): _CALIBRATING,
    (_READY, StateEvent.WAIT): _READY,
    (_READY, StateEvent.MOVE): _RAMPING,
    (_READY, StateEvent.SETTLE): _HOLDING,
    (_READY, StateEvent.DISABLE): _OFF,
    (_READY, StateEvent.FAILED): _FAULT,
    (_RAMPING, StateEvent.WAIT): _READY,
    (_RAMPING, StateEvent.MOVE): _RAMPING,
    (_RAMPING, StateEvent.SETTLE): _HOLDING,
    (_RAMPING, StateEvent.DISABLE): _OFF,
    (_RAMPING, StateEvent.FAILED): _FAULT,
    (_HOLDING, StateEvent.WAIT): _READY,
    (_HOLDING, StateEvent.MOVE): _RAMPING,
    (_HOLDING, StateEvent.SETTLE): _HOLDING,
    (_HOLDING, StateEvent.DISABLE): _OFF,
    (_HOLDING, StateEvent.FAILED): _FAULT,
    (_CALIBRATING, StateEvent.MOVE): _CALIBRATING,
    (_CALIBRATING, StateEvent.DISABLE): _OFF,
    (_CALIBRATING, StateEvent.FAILED): _FAULT,
    (_FAULT, StateEvent.RESET): _OFF,
}

ENABLED_STATES: Final = frozenset({_READY, _RAMPING, _HOLDING, _CALIBRATING})


class TransitionError(Exception):
    """A pair that the table does not have: an internal error."""


def next_state(state: State, event: StateEvent) -> State:
    """Return the state after an event. TransitionError for a pair that is not in the table."""
    try:
        return TRANSITIONS[state, event]
    except KeyError:
        raise TransitionError(f"state {state.name} has no event {event.name}") from None
