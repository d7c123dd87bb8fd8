"""What may change while a force is held, and what of the command it may not touch: another calibration, a takeover, a count."""

import struct

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.registers import Status
from gateway.registers.words import ControlBit, State
from gateway.registers.writes.proposed_write import ProposedWrite
from tests.calibrations.coefficients import calibration

ENABLE, TAKE, PULL = (int(bit) for bit in (ControlBit.ENABLE, ControlBit.TAKE_OWNERSHIP, ControlBit.VALVE_PULL))


@pytest.mark.parametrize("word", [ENABLE, ENABLE | PULL])
def test_a_calibration_that_lowers_the_setpoint_leaves_every_bit_of_the_control_word(
    make_bank, master_of, word
) -> None:
    """A bit that fell beside it would be a disable that nobody has asked for, in the middle of a path."""
    bank = make_bank(supported_bits=ControlBit(127))
    master = master_of(bank, "10.0.0.1")
    master.write(0, word, 5000)
    bank.set_active_model(calibration(force_limits_n=(0.0, 40.0)))
    assert (master.word(0), master.word(1), master.float(200)) == (word, 4000, float(word))
    assert int(bank.command.control_word) == word and not bank.command.stops
    handed = []
    bank.on_command = handed.append
    master.write(0, word, 3000)
    assert [int(command.control_word) for command in handed] == [word] and bank.owner == "10.0.0.1"


def test_the_smallest_force_of_a_calibration_bounds_setpoints_and_no_pre_contact_force(make_bank, master_of) -> None:
    """A tool is led to the workpiece with less than what it may be held with."""
    bank = make_bank()
    master = master_of(bank, "10.0.0.1")
    bank.set_active_model(calibration(force_limits_n=(2.5, 40.0)))
    master.write(7, 100)
    assert bank.command.precontact_force_n == 1.0
    assert master.refusal(master.write, 1, 100).reason is RefusalReason.OUT_OF_RANGE
    assert master.refusal(master.write, 7, 4001).reason is RefusalReason.OUT_OF_RANGE


def test_who_takes_over_with_an_enable_needs_a_proof_of_its_own(make_bank, master_of) -> None:
    """That of the owner before is of the owner's word order: a setpoint of the other order would be another force."""
    bank = make_bank(require_byte_order_echo=True)
    proven, other = master_of(bank, "10.0.0.1"), master_of(bank, "10.0.0.2")
    proven.write_float(416, 1234.5)
    proven.write(0, ENABLE)
    bank.clear_command()
    proven.write(1, 1000)
    refusal = other.refusal(other.write, 0, ENABLE | TAKE)
    assert refusal.reason is RefusalReason.BYTE_ORDER_UNPROVEN and bank.owner == "10.0.0.1"
    other.write_float(416, 1234.5)
    other.write(0, ENABLE | TAKE)
    assert bank.owner == "10.0.0.2"


def test_a_count_of_cycles_beside_a_heartbeat_asks_control_for_nothing(make_bank, master_of) -> None:
    """So it is taken while a run has the output: a robot counts on, and what it asks for is told by its names."""
    bank, asked = make_bank(), list[tuple[str, ...]]()
    master = master_of(bank, "10.0.0.1")
    bank.publish(Status(state=State.CALIBRATING))

    def decide(proposal: ProposedWrite) -> None:
        asked.append(proposal.changes())

    bank.on_asked = decide
    for k in (1, 2):
        bank.write_registers(4, struct.pack(">7H", k, 0, 0, 0, 0, 0, k), master.peer)
    master.write(10, 3)
    master.write(1, 1000)
    assert asked == [(), (), (), ("force_setpoint",)]


def test_another_s_stop_is_remembered_with_the_owner_s_last_heartbeat_and_its_own_is_not(make_bank, master_of):
    """Who has stopped may enable again with the heartbeat that stands; a program that hung beside another's stop may not."""
    bank = make_bank(has_lease=True)
    owner, other = master_of(bank, "10.0.0.1"), master_of(bank, "10.0.0.2")
    lost = []
    bank.held_enables.on_lost = lost.append
    owner.write(0, 1, 0, 0, 0, 5)
    owner.write(0, 0)
    assert lost == []
    owner.write(0, 1)
    other.write(0, 0)
    assert lost == [{"10.0.0.1": [5]}]
