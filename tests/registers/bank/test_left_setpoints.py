"""What of a former master's setpoints counts on under who takes over: what is pressed, in its mode and its direction."""

from dataclasses import replace

import pytest

from gateway.registers import Status
from gateway.registers.rig_rules import BASIC_BITS
from gateway.registers.words import ControlBit, Mode, State, StatusBit

ENABLE, TAKE, PULL = int(ControlBit.ENABLE), int(ControlBit.TAKE_OWNERSHIP), int(ControlBit.VALVE_PULL)
PUSHES, PULLS = int(StatusBit.ENABLED), int(StatusBit.ENABLED | StatusBit.PULLING)


@pytest.mark.parametrize(
    ("stood", "shown", "written", "left_n"),
    [
        (ENABLE | PULL, PULLS, ENABLE, 0.0),
        (ENABLE, PUSHES, ENABLE | PULL, 0.0),
        (ENABLE | PULL, PUSHES, ENABLE | PULL, 0.0),
        (ENABLE | PULL, PULLS, ENABLE | PULL, 20.0),
        (ENABLE, PUSHES, ENABLE, 20.0),
    ],
    ids=["a pull becomes a push", "a push becomes a pull", "amid the switch", "pulled on", "pushed on"],
)
def test_a_takeover_that_turns_the_valve_presses_nothing_the_other_way(
    make_bank, master_of, stood, shown, written, left_n
):
    """20 N that were pulled were pushed 1.5 s behind a takeover by bits 0 and 3 alone, as the refusal of before says."""
    bank = make_bank(supported_bits=BASIC_BITS | ControlBit.VALVE_PULL)
    owner, other = master_of(bank, "10.0.0.1"), master_of(bank, "10.0.0.2")
    owner.write(0, stood, 2000)
    bank.publish(Status(State.HOLDING, shown, force_accepted_n=20.0))
    other.write(0, written | TAKE)
    assert (bank.owner, bank.command.force_setpoint_n) == ("10.0.0.2", left_n)


@pytest.mark.parametrize("state", [State.RAMPING, State.HOLDING])
@pytest.mark.parametrize("mode", Mode)
def test_a_takeover_keeps_no_setpoint_of_the_mode_that_does_not_press(bank, master, other, mode, state):
    """12 N became 57 N when the next master chose the mode: 8 V had been left there by the one before."""
    master.write(0, ENABLE, 1200, 0, int(mode), 0, 8000)
    bank.publish(Status(state, PUSHES, force_accepted_n=12.0 if mode is Mode.FORCE else 0.0))
    other.write(0, ENABLE | TAKE)
    pressed = (12.0, 0.0) if mode is Mode.FORCE else (0.0, 8.0)
    assert (bank.command.force_setpoint_n, bank.command.voltage_setpoint_v) == pressed


def test_a_takeover_that_chooses_the_mode_presses_no_voltage_that_another_has_left(bank, master, other):
    master.write(0, ENABLE, 1200, 0, 0, 0, 8000)
    bank.publish(Status(State.HOLDING, PUSHES, force_accepted_n=12.0))
    other.write(0, ENABLE | TAKE, 1200, 0, int(Mode.VOLTAGE))
    assert (bank.command.mode, bank.command.voltage_setpoint_v) == (Mode.VOLTAGE, 0.0)


@pytest.mark.parametrize(("host", "asked_n"), [("10.0.0.1", 20.0), ("10.0.0.2", 8.0)])
def test_who_beats_where_a_lost_master_s_force_is_held_goes_on_with_that_and_no_more(
    make_bank, master_of, host, asked_n
):
    """It has asked for nothing: 8 N are held of the 20 N that the lost one wanted, and wants still where it beats itself."""
    bank = make_bank()
    master_of(bank, "10.0.0.1").write(0, ENABLE, 2000)
    bank.publish(Status(State.HOLDING, PUSHES, force_accepted_n=8.0))
    bank.release_owner()
    master_of(bank, host).write(4, 7)
    assert (bank.owner, bank.command.force_setpoint_n) == (host, asked_n)


def test_a_stop_that_has_waited_in_a_pile_stops_and_its_heartbeat_is_none(bank, master, commands):
    """A reset wants a beat of behind the fault: one of a pile may be of long before."""
    master.write(0, ENABLE, 1200)
    master.peer = replace(master.peer, is_behind=True)
    master.write(0, 0, 0, 0, 0, 77)
    assert (commands[-1].stops, commands[-1].heartbeat, commands[-1].has_waited) == (True, 77, True)
