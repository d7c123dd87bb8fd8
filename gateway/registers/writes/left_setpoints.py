"""Setpoints that a former master has left: the next one has asked for none of them that its own write does not bring.

What is pressed goes on as it is held, in its mode and in its direction; for a lost master that may be less than it asked for.
All else is cleared: a setpoint of the other mode, or one that the valve makes a pull of, would be pressed by a write that tells
of no force.
"""

from typing import Final

from gateway.registers.command import Status
from gateway.registers.words import ControlBit, Mode, State, StatusBit
from gateway.registers.writes.command_block import (
    CONTROL_WORD,
    FORCE_SETPOINT,
    MODE,
    VOLTAGE_SETPOINT,
    CommandBlock,
    Values,
)

_PRESSING: Final = (State.RAMPING, State.HOLDING)
_PULL, _PULLING = int(ControlBit.VALVE_PULL), int(StatusBit.PULLING)


def without_left_setpoints(commands: CommandBlock, values: Values, brought: range, told: Status) -> Values:
    """Return these values without what another master has left. commands: as they stand; brought: which words the write sets;
    told: by control, last."""
    is_pulled, pulls = bool(told.status_word & _PULLING), bool(int(values[CONTROL_WORD]) & _PULL)
    goes_on = told.state in _PRESSING and is_pulled is pulls and values[MODE] == commands.values[MODE]
    is_voltage, without = values[MODE] == Mode.VOLTAGE, values.copy()
    held_n = told.force_accepted_n if goes_on else 0.0
    is_on_its_way_to_0 = goes_on and not is_voltage and not held_n  # which clears all by itself
    if FORCE_SETPOINT not in brought and held_n < values[FORCE_SETPOINT] and not is_on_its_way_to_0:
        without[FORCE_SETPOINT] = commands.round_force(held_n)
    if VOLTAGE_SETPOINT not in brought and not (goes_on and is_voltage):
        without[VOLTAGE_SETPOINT] = 0.0
    return without
