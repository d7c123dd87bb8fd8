"""A run that this machine has begun holds no bit: what ends it then, what does not, and who lets a held bit go."""

from collections.abc import Callable

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.registers import Command, RegisterBank, Status
from gateway.registers.words import ControlBit, State
from tests.calibrations.coefficients import calibration

ALL = ControlBit(127)
RESET, CALIBRATE, TEST = (
    int(bit) for bit in (ControlBit.RESET_FAULT, ControlBit.START_CALIBRATION, ControlBit.START_SELF_TEST)
)
PULL = int(ControlBit.VALVE_PULL)


@pytest.fixture
def running(make_bank: Callable[..., RegisterBank]) -> tuple[RegisterBank, list[Command]]:
    """A bank beside a calibration that somebody at this machine has begun, and what control is handed."""
    bank, handed = make_bank(supported_bits=ALL), list[Command]()
    bank.publish(Status(state=State.CALIBRATING))
    bank.on_command = handed.append
    return bank, handed


def test_a_0_that_is_meant_for_enable_stops_the_run_from_everywhere(running, master_of) -> None:
    bank, handed = running
    for host in ("10.0.0.1", "10.0.0.2"):
        master = master_of(bank, host)
        master.write(0, 0)
        master.write_float(200, 0.0)
        bank.write_bits(0, [False], master.peer)
        bank.mask_write(0, 0xFFFE, 0, master.peer)
    assert len(handed) == 8 and all(command.stops for command in handed)


@pytest.mark.parametrize("run", [CALIBRATE, TEST])
@pytest.mark.parametrize("host", ["10.0.0.1", "10.0.0.2"])
@pytest.mark.parametrize("way", ["coil", "mask"])
@pytest.mark.parametrize("state", [State.CALIBRATING, State.OFF], ids=["running", "about to run"])
def test_enable_cleared_by_its_name_stops_a_run_that_its_bit_has_begun(make_bank, master_of, run, host, way, state):
    """Whoever clears it: it has not been 1, and the run's own bit stays as it was."""
    bank, handed = make_bank(supported_bits=ALL), list[Command]()
    master_of(bank, "10.0.0.1").write(0, run)
    bank.publish(Status(state=state))
    bank.on_command = handed.append
    peer = master_of(bank, host).peer
    if way == "coil":
        bank.write_bits(0, [False], peer)
    else:
        bank.mask_write(0, 0xFFFE, 0, peer)
    (command,) = handed
    assert command.stops and not int(command.control_word) & (run | int(ControlBit.ENABLE))
    assert bank.read_registers(0, 1) == b"\0\0"


def test_a_row_of_coils_that_holds_the_runs_bit_lets_it_go_on(make_bank, master_of) -> None:
    bank, handed = make_bank(supported_bits=ALL), list[Command]()
    master = master_of(bank, "10.0.0.1")
    master.write(0, CALIBRATE)
    bank.publish(Status(state=State.CALIBRATING))
    bank.on_command = handed.append
    bank.write_bits(0, [False] * 5 + [True, False], master.peer)
    assert not any(command.stops for command in handed)


def test_a_0_in_another_bit_or_beside_other_registers_stops_nothing(running, master_of) -> None:
    """A cyclic block of zeros, and a coil that is cleared in passing."""
    bank, handed = running
    master = master_of(bank, "10.0.0.1")
    bank.write_bits(1, [False], master.peer)
    bank.mask_write(0, 0xFFFD, 0, master.peer)
    master.write(0, 0, 0, 0, 0, 7)
    master.write(0, RESET)
    master.write(0, 1)
    assert not any(command.stops for command in handed)


def test_the_run_s_own_bit_ends_a_run_and_stops_no_other(make_bank, master_of, running) -> None:
    """Cleared it ramps the force to 0, as no stop does; set beside a run of this machine it is a start, which is control's."""
    bank, handed = make_bank(supported_bits=ALL), list[Command]()
    master = master_of(bank, "10.0.0.1")
    master.write(0, CALIBRATE)
    bank.publish(Status(state=State.CALIBRATING))
    bank.on_command = handed.append
    master.write(0, 0)
    assert not handed[0].stops and not handed[0].control_word
    bank, handed = running
    master_of(bank, "10.0.0.1").write(0, CALIBRATE)
    assert not handed[0].stops and handed[0].control_word == CALIBRATE


@pytest.mark.parametrize("host", ["10.0.0.1", "10.0.0.2"])
def test_enable_that_falls_beside_a_run_s_bit_that_stands_is_a_stop(make_bank, master_of, host) -> None:
    bank, handed = make_bank(supported_bits=ALL), list[Command]()
    master_of(bank, "10.0.0.1").write(0, 1 | CALIBRATE)
    bank.on_command = handed.append
    master_of(bank, host).write(0, CALIBRATE)
    assert handed[0].stops


def test_of_somebody_else_s_stop_nothing_else_is_taken(make_bank, master_of) -> None:
    """No bit that is not enable."""
    bank, handed = make_bank(supported_bits=ALL), list[Command]()
    owner, other = master_of(bank, "10.0.0.1"), master_of(bank, "10.0.0.2")
    owner.write(0, 1 | PULL, 1200)
    bank.on_command = handed.append
    assert other.refusal(other.write, 0, 1).reason is RefusalReason.NOT_OWNER, "the valve is none of its business"
    other.write(0, PULL)
    assert handed[0].stops and not handed[0].control_word


def test_who_writes_other_coils_beside_a_run_does_not_hold_its_bit(make_bank, master_of) -> None:
    bank = make_bank(supported_bits=ALL)
    master = master_of(bank, "10.0.0.1")
    for _ in range(2):
        bank.write_bits(5, [True], master.peer)
        assert int(bank.command.control_word) & CALIBRATE, "it begins each time"
        bank.write_bits(4, [True], master.peer)
        bank.write_bits(4, [False], master.peer)
        bank.clear_command()  # the run has ended


def test_without_a_run_a_0_where_nothing_stands_is_no_stop(make_bank, master_of) -> None:
    bank, handed = make_bank(), list[Command]()
    bank.on_command = handed.append
    master_of(bank, "10.0.0.1").write(0, 0)
    assert not any(command.stops for command in handed)


def test_only_the_owners_own_0_lets_a_held_bit_go(make_bank, master_of) -> None:
    bank = make_bank(supported_bits=ALL)
    owner, other = master_of(bank, "10.0.0.1"), master_of(bank, "10.0.0.2")
    for _ in range(2):
        owner.write(0, CALIBRATE | int(ControlBit.TAKE_OWNERSHIP))
    other.write(0, 0)  # anybody may end a run
    refusal = owner.refusal(owner.write, 0, CALIBRATE)
    assert refusal.reason is RefusalReason.CALIBRATION_HELD


def test_of_two_bits_that_were_held_the_lower_one_is_named(make_bank, master_of) -> None:
    bank = make_bank(supported_bits=ALL)
    master = master_of(bank, "10.0.0.1")
    for _ in range(2):
        master.write(0, CALIBRATE | TEST)
    bank.clear_command()
    assert master.refusal(master.write, 0, CALIBRATE | TEST).sentence.split()[1] == "start_calibration"


@pytest.mark.parametrize(
    ("limits_n", "taken", "refused"),
    [
        ((5.0, 40.0), (0, 500, 4000), (499, 4001)),
        ((-5.0, 40.0), (0, 1, 4000), (4001,)),
        ((5.0, 90.0), (0, 500, 6000), (499, 6001)),
        ((70.0, 90.0), (0,), (1, 5999, 6000, 6001, 7000)),
    ],
)
def test_a_calibration_narrows_what_may_be_set_at_both_ends(make_bank, master_of, limits_n, taken, refused) -> None:
    bank = make_bank()
    master = master_of(bank, "10.0.0.1")
    bank._commands.allow_force(limits_n, "calibration 7")
    for word in taken:
        master.write(1, word)
    for word in refused:
        refusal = master.refusal(master.write, 1, word)
        assert refusal.reason is RefusalReason.OUT_OF_RANGE
        assert "calibration 7" in refusal.sentence


def test_a_calibration_that_only_pulls_lowers_no_setpoint_below_0(make_bank, master_of) -> None:
    master_of(bank := make_bank(), "10.0.0.1").write(0, 1, 0)
    assert bank.set_active_model(calibration(force_limits_n=(-20.0, -5.0))) == ""
    assert bank.command.force_setpoint_n == 0.0


def test_a_setpoint_that_is_the_largest_allowed_is_not_told_as_lowered(make_bank, master_of) -> None:
    bank = make_bank()
    master_of(bank, "10.0.0.1").write(0, 1, 4000)
    assert bank.set_active_model(calibration(force_limits_n=(0.0, 40.0))) == ""
    assert bank.command.force_requested_n in (0.0, 40.0)


def test_who_has_proven_its_byte_order_is_told_as_the_last_writer(bank, master, register_map) -> None:
    master.write_float(register_map.find("byte_order_echo").address, 1234.5)
    assert bank.last_writer == {"byte_order_echo": (master.peer, 7.0)}


@pytest.mark.parametrize("place", [0, 4, 5, 6])
def test_each_coil_is_that_bit_whether_it_is_read_set_or_cleared(make_bank, master_of, place) -> None:
    bank = make_bank(supported_bits=ALL)
    master = master_of(bank, "10.0.0.1")
    bank.write_bits(place, [True], master.peer)
    assert master.word(0) == 1 << place
    for first in range(8):
        read = int.from_bytes(bank.read_bits(first, 8), "little")
        assert read == (1 << place >> first) & 0xFF
    bank.write_bits(place, [False], master.peer)
    assert master.word(0) == 0


def test_a_coil_that_is_cleared_leaves_its_neighbours(make_bank, master_of) -> None:
    bank = make_bank(supported_bits=ALL)
    master = master_of(bank, "10.0.0.1")
    stands = int(ControlBit.ENABLE | ControlBit.VALVE_PULL) | CALIBRATE
    master.write(0, stands)
    for place in range(1, 7):
        if stands >> place & 1:
            bank.write_bits(place, [False], master.peer)
            stands &= ~(1 << place)
            assert master.word(0) == stands


def test_each_status_bit_is_a_coil_of_its_own(bank) -> None:
    for place in range(16):
        bank.publish(Status(status_word=1 << place))
        assert [bank.read_bits(100 + k, 1) == b"\1" for k in range(16)] == [k == place for k in range(16)]


def test_what_control_has_cleared_is_told_with_what_was_asked_for_then(make_bank, master_of) -> None:
    """The number of the command stays, and neither its force nor what it was lowered from."""
    bank = make_bank()
    master = master_of(bank, "10.0.0.1")
    master.write(0, 1, 5000)
    bank.set_active_model(calibration(force_limits_n=(0.0, 40.0)))
    assert (bank.command.force_setpoint_n, bank.command.lowered_from_n) == (40.0, 50.0)
    assert not bank.command.stops, "a lower limit is no stop"
    bank.clear_command()
    assert (bank.command.force_setpoint_n, bank.command.lowered_from_n) == (0.0, 0.0)
    master.write(0, 1, 1000)
    assert (bank.command.force_setpoint_n, bank.command.force_requested_n) == (10.0, 10.0)


def test_a_setpoint_that_rests_is_lowered_with_the_calibration_and_told_as_asked_for(make_bank, master_of) -> None:
    bank = make_bank()
    master_of(bank, "10.0.0.1").write(1, 5000)
    bank.set_active_model(calibration(force_limits_n=(0.0, 40.0)))
    assert (bank.command.force_setpoint_n, bank.command.force_requested_n) == (40.0, 50.0)


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        (float("nan"), RefusalReason.NOT_FINITE),
        (float("-inf"), RefusalReason.NOT_FINITE),
        (5e-4, RefusalReason.TOO_SMALL),
    ],
)
def test_a_float_that_is_none_is_kept_beside_its_reason(master, value, reason) -> None:
    refusal = master.refusal(master.write_float, 202, value)
    assert refusal.reason is reason
    assert refusal.value == pytest.approx(value, nan_ok=True)


def test_an_echo_without_end_is_no_number(bank, master, register_map) -> None:
    address = register_map.find("byte_order_echo").address
    for value in (float("inf"), float("-inf"), float("nan")):
        assert master.refusal(master.write_float, address, value).reason is RefusalReason.NOT_FINITE
    assert master.refusal(master.write_float, address, 1234.0).reason is RefusalReason.OUT_OF_RANGE


def test_only_what_begins_something_wants_the_byte_order_proven(make_bank, master_of) -> None:
    bank = make_bank(supported_bits=ALL, require_byte_order_echo=True)
    master = master_of(bank, "10.0.0.1")
    for address, word in ((1, 1200), (4, 7), (0, RESET)):
        master.write(address, word)
    for bit, name in ((1, "enable"), (CALIBRATE, "start_calibration"), (TEST, "start_self_test")):
        refusal = master.refusal(master.write, 0, bit)
        assert refusal.reason is RefusalReason.BYTE_ORDER_UNPROVEN
        assert refusal.sentence.startswith(f"W218 {name} refused: "), "what was asked for, and not another thing"


def test_a_refusal_names_the_register_of_the_bad_float_and_not_the_first_one(master) -> None:
    assert master.refusal(master.write_float, 200, 0.0, 70.0).address == 202
    assert master.refusal(master.write_float, 200, 0.0, 12.0, 1e9).address == 204
    for words in ((226, 1.0), (224, 0.0, 1.0)):
        refusal = master.refusal(master.write_float, *words)
        assert (refusal.reason, refusal.address) == (RefusalReason.RESERVED, 226)


@pytest.mark.parametrize("other_word", [0, 1, RESET])
def test_behind_a_run_no_other_master_lets_its_bit_go(make_bank, master_of, other_word: int) -> None:
    """Else a Stop or a reset from the page would have the controller that holds the bit begin the next run at once."""
    bank = make_bank(supported_bits=ALL)
    holder, other = master_of(bank, "10.0.0.1"), master_of(bank, "10.0.0.2")
    for _ in range(2):
        holder.write(0, TEST)
    bank.clear_command()  # the run has ended, and nobody owns
    assert holder.refusal(holder.write, 0, TEST).reason is RefusalReason.CALIBRATION_HELD
    other.write(0, other_word)
    other.write(0, 0)
    assert holder.refusal(holder.write, 0, TEST).reason is RefusalReason.CALIBRATION_HELD
    other.write(0, TEST)  # it has held nothing
    bank.clear_command()
    assert holder.refusal(holder.write, 0, TEST).reason is RefusalReason.CALIBRATION_HELD
    holder.write(0, 0)
    holder.write(0, TEST)
    assert bank.command.control_word == TEST
