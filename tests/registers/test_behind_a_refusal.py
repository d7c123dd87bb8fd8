"""What a refused write leaves behind: its heartbeat is none of a program that goes on, unless that holds a force; and only what
was refused as a start is held against the next one."""

from collections.abc import Callable

from gateway.codes.refusals import RefusalReason
from gateway.registers.words import ControlBit
from gateway.registers.writes.proposed_write import EdgeRefusal, ProposedWrite

ENABLE, TARE = ControlBit.ENABLE, ControlBit.TARE


def _refuse(bit: ControlBit, reason: RefusalReason) -> Callable[[ProposedWrite], EdgeRefusal | None]:
    return lambda write: EdgeRefusal(reason, bit, "not now") if write.command.control_word & bit else None


def test_a_beat_that_came_with_a_refused_tare_is_one_while_a_force_is_held(make_bank, master_of) -> None:
    """The robot's next frame brings it again without the tare: as a beat that was none the lease would run out on it."""
    bank = make_bank(has_lease=True)
    master = master_of(bank, "10.0.0.1")

    bank.on_asked = _refuse(TARE, RefusalReason.TARE_REFUSED)
    master.write(0, ENABLE, 1200, 300, 0, 7)
    assert master.refusal(master.write, 0, ENABLE | TARE, 1200, 300, 0, 8).reason is RefusalReason.TARE_REFUSED
    master.write(0, ENABLE, 1200, 300, 0, 8)
    assert (bank.command.heartbeat, bank.command.repeats) == (8, False)
    master.write(0, 0, 0, 0, 0, 9)
    assert master.refusal(master.write, 0, ENABLE | TARE, 1200, 300, 0, 10).reason is RefusalReason.TARE_REFUSED
    master.write(0, ENABLE, 1200, 300, 0, 10)
    assert bank.command.repeats, "with nothing held it is what the refused frame has brought"


def test_a_start_with_the_heartbeat_of_another_frame_that_was_refused_behind_it_counts_once(
    make_bank, master_of
) -> None:
    """Of a program with a frame for its start and one for its tare: it has gone on since, and both may stand still by now."""
    bank = make_bank(has_lease=True)
    master = master_of(bank, "10.0.0.1")
    bank.on_asked = _refuse(ENABLE, RefusalReason.NOT_READY)
    master.write(4, 1)
    assert master.refusal(master.write, 0, ENABLE, 1200, 0, 0, 2).reason is RefusalReason.NOT_READY
    bank.on_asked = _refuse(TARE, RefusalReason.TARE_REFUSED)
    assert master.refusal(master.write, 0, TARE, 0, 0, 0, 3).reason is RefusalReason.TARE_REFUSED
    bank.on_asked = _refuse(ENABLE, RefusalReason.NOT_READY)
    assert master.refusal(master.write, 0, ENABLE, 1200, 0, 0, 3).reason is RefusalReason.NOT_READY
    bank.on_asked = lambda write: None
    master.write(0, ENABLE, 1200, 0, 0, 3)
    assert bank.command.repeats
    master.write(0, ENABLE, 1200, 0, 0, 4)
    assert not bank.command.repeats, "its program goes on"


def test_an_enable_that_waited_for_its_proof_of_the_byte_order_begins_with_the_same_heartbeat(make_bank, master_of):
    """What was refused for want of the proof is sent again behind it, as every client does, and in the same cycle."""
    bank = make_bank(has_lease=True, require_byte_order_echo=True)
    master = master_of(bank, "10.0.0.1")
    refusal = master.refusal(master.write, 0, int(ENABLE), 1200, 0, 0, 2)
    assert refusal.reason is RefusalReason.BYTE_ORDER_UNPROVEN
    master.write_float(416, 1234.5)
    master.write(0, int(ENABLE), 1200, 0, 0, 2)
    assert (bank.command.control_word, bank.command.repeats) == (ENABLE, False)


def test_a_run_that_was_refused_over_a_fault_holds_up_no_enable_behind_its_reset(make_bank, master_of) -> None:
    """Only an enable that was kept at 1 over the fault would press by the reset alone."""
    for bit, is_held in ((ControlBit.START_SELF_TEST, False), (ENABLE, True)):
        bank = make_bank(has_lease=True, supported_bits=ControlBit(127))
        master = master_of(bank, "10.0.0.1")
        bank.on_asked = _refuse(bit, RefusalReason.FAULT_LATCHED)
        master.write(4, 1)
        assert master.refusal(master.write, 0, int(bit), 0, 0, 0, 2).reason is RefusalReason.FAULT_LATCHED
        bank.on_asked = lambda write: None
        master.write(4, 3)
        if is_held:
            refusal = master.refusal(master.write, 0, int(ENABLE))
            assert (refusal.reason, refusal.value) == (RefusalReason.CALIBRATION_HELD, float(ENABLE))
        else:
            master.write(0, int(ENABLE))
            assert bank.command.control_word == ENABLE


def test_a_start_that_was_refused_counts_again_behind_a_heartbeat_that_came_with_a_refused_reset(make_bank, master_of):
    bank = make_bank(has_lease=True)
    master = master_of(bank, "10.0.0.1")
    master.write(4, 1)
    bank.on_asked = _refuse(ENABLE, RefusalReason.NOT_READY)
    assert master.refusal(master.write, 0, int(ENABLE)).reason is RefusalReason.NOT_READY
    bank.on_asked = _refuse(ControlBit.RESET_FAULT, RefusalReason.RESET_NEEDS_ZERO)
    for beat in (2, 3):
        assert master.refusal(master.write, 0, ControlBit.RESET_FAULT, 0, 0, 0, beat)
    bank.on_asked = lambda write: None
    master.write(0, int(ENABLE))
    assert not bank.command.repeats


def test_what_was_refused_for_another_reason_than_its_tare_holds_up_no_tare(make_bank, master_of) -> None:
    """Of a program that tares when it may not start: the heartbeat of its frame is the one that was refused."""
    bank = make_bank(has_lease=True)
    master = master_of(bank, "10.0.0.1")
    bank.on_asked = _refuse(ENABLE, RefusalReason.NOT_READY)
    master.write(4, 1)
    assert master.refusal(master.write, 0, ENABLE, 1200, 0, 0, 5).reason is RefusalReason.NOT_READY
    master.write(0, int(TARE), 0, 0, 0, 5)
    assert bank.command.control_word == TARE
