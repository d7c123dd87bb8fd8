"""Ownership by itself, and what a bank tells beside its registers: the state that runs, refusals, what is left of a command."""

from collections.abc import Callable

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.registers import Status
from gateway.registers.command import NO_CHANNEL
from gateway.registers.rig_rules import BASIC_BITS
from gateway.registers.words import ControlBit, State, StatusBit
from gateway.registers.writes.held_starts import HeldEnables, HeldRuns
from gateway.registers.writes.ownership import (
    LARGEST_SERIAL_PLACE,
    NOT_IPV4,
    Ownership,
    ip_number,
    serial_host,
    serial_place,
)
from tests.registers.conftest import Master

COMMANDS, COMMANDS_NOTHING = (
    {"takes_over": False, "stops": False, "asks": True},
    {"takes_over": False, "stops": False, "asks": False},
)
TEST, TAKE = int(ControlBit.START_SELF_TEST), int(ControlBit.TAKE_OWNERSHIP)
TAKES_OVER = {"takes_over": True, "stops": False, "asks": True}


def test_who_owned_before_is_remembered_however_often_nobody_is_made_the_owner() -> None:
    """Of a force that is held for a lost master each step does so: the one that comes back goes on with its own."""
    ownership = Ownership(None)
    ownership.take("a")
    for _ in range(2):
        ownership.release()
    assert (ownership.owner, ownership.former) == (None, "a")


def test_who_took_over_owns_until_it_stops_and_who_only_commanded_until_it_commands_nothing() -> None:
    explicit, plain = Ownership(None), Ownership(None)
    explicit.settle("a", **TAKES_OVER)
    for _ in range(2):
        explicit.settle("a", **COMMANDS)
        plain.settle("a", **COMMANDS)
    assert (explicit.owner, plain.owner) == ("a", "a")
    for one in (explicit, plain):
        one.settle("a", **COMMANDS_NOTHING)
    assert (explicit.owner, plain.owner) == ("a", None)
    explicit.settle("a", takes_over=False, stops=True, asks=False)
    assert explicit.owner is None
    explicit.settle("a", **COMMANDS)
    explicit.settle("a", **COMMANDS_NOTHING)
    assert explicit.owner is None, "a takeover of before the stop is over"


def test_the_owner_that_a_rig_names_may_say_so_and_no_other_one() -> None:
    named, free = Ownership("a"), Ownership(None)
    assert [named.may_take_over(host) for host in "ab"] == [True, False]
    assert [free.may_take_over(host) for host in "ab"] == [True, True]
    named.release()
    assert named.owner == "a"


@pytest.mark.parametrize(
    ("host", "place"),
    [
        (serial_host(1), 1),
        (serial_host(LARGEST_SERIAL_PLACE), LARGEST_SERIAL_PLACE),
        (serial_host(LARGEST_SERIAL_PLACE + 1), None),
        *[(host, None) for host in ("serial:0", "serial:01", "serial:", "serial:x", "1", "10.0.0.1", "certificate 1")],
    ],
)
def test_a_serial_face_is_known_by_its_place_alone(host: str, place: int | None) -> None:
    assert serial_place(host) == place
    if place is not None:
        assert ip_number(host) == place
    elif not host[0].isdecimal():
        assert ip_number(host) == NOT_IPV4


def test_a_gateway_runs_unless_a_fault_is_latched(bank) -> None:
    for state, word, runs in ((State.OFF, 0, True), (State.FAULT, StatusBit.FAULT, False), (State.OFF, 0, True)):
        bank.publish(Status(state=state, status_word=int(word)))
        assert bank.server_id.is_running is runs


@pytest.mark.parametrize(("address", "word"), [(0, 1), (1, 1200), (5, 3000)])
def test_whatever_alone_is_left_of_a_command_goes_with_it(bank, master, address: int, word: int) -> None:
    """A setpoint that waits would be the next enable's."""
    master.write(address, word)
    assert master.word(address) == word
    bank.clear_command()
    assert [master.word(at) for at in (0, 1, 5)] == [0, 0, 0]
    assert (bank.command.control_word, bank.command.force_setpoint_n, bank.command.voltage_setpoint_v) == (0, 0.0, 0.0)


def test_each_refused_write_is_told_to_who_audits_and_a_refused_read_is_not(bank, master) -> None:
    refused: list[int] = []
    bank.on_refused_write = lambda refusal, peer: refused.append(refusal.address)
    acts: list[tuple[Callable[..., None], tuple[object, ...]]] = [
        (master.write, (1, 6001)),
        (lambda: bank.write_bits(100, [True], master.peer), ()),
        (lambda: bank.mask_write(100, 0, 1, master.peer), ()),
        (lambda: bank.read_registers(9000, 1, master.peer), ()),
    ]
    for act, arguments in acts:
        master.refusal(act, *arguments)
    assert refused == [1, 100, 100]


def test_an_owner_that_takes_over_what_it_owns_keeps_it_when_it_commands_nothing(bank, master) -> None:
    master.write(1, 1200)
    master.write(0, int(ControlBit.TAKE_OWNERSHIP))
    master.write(1, 0)
    assert bank.owner == "10.0.0.1"


def test_the_watchdogs_that_are_shown_can_be_read(bank, master, register_map) -> None:
    register = register_map.find("watchdogs")
    for word in (3, 0):
        bank.show_watchdogs(word)
        assert master.word(register.address) == word


def test_a_stop_leaves_no_bit_of_the_control_word(make_bank, master_of) -> None:
    bank = make_bank(supported_bits=ControlBit.ENABLE | ControlBit.VALVE_PULL)
    owner = master_of(bank, "10.0.0.1")
    pull = int(ControlBit.VALVE_PULL)
    owner.write(0, int(ControlBit.ENABLE) | pull, 1200)
    owner.write(0, pull)
    assert (owner.word(0), owner.word(1)) == (0, 0) and bank.command.stops


def test_whoever_acts_on_a_command_sees_its_owner(bank, master) -> None:
    """Control takes it inside the write, and asks at once whether the owner is connected."""
    owners = list[str | None]()
    bank.on_command = lambda command: owners.append(bank.owner)
    master.write(0, 1, 1200)
    master.write(0, 0)
    assert owners == [master.peer.host, None]


def test_what_control_has_cleared_stands_nowhere_and_is_no_stop_again(make_bank, master_of) -> None:
    """A stop that leaves the valve's bit at 1: behind it the valve goes where the rig says."""
    bank, pull = make_bank(supported_bits=ControlBit(127)), int(ControlBit.VALVE_PULL)
    master = master_of(bank, "10.0.0.1")
    master.write(0, 1 | pull, 1200)
    master.write(0, pull)
    assert bank.command.stops and bank.command.control_word == pull
    bank.clear_command()
    assert not bank.command.stops and not bank.command.control_word


def test_behind_a_run_a_0_is_no_stop_any_more(make_bank, master_of) -> None:
    bank = make_bank()
    for state, stops in ((State.CALIBRATING, True), (State.OFF, False)):
        bank.publish(Status(state=state))
        master_of(bank, "10.0.0.1").write(0, 0)
        assert bank.command.stops is stops


def test_what_always_changes_is_not_told(bank, master) -> None:
    told = list[str]()
    bank.on_accepted = lambda sentence, peer: told.append(sentence)
    for word in (1, 2, 3):
        master.write(4, word)
        master.write(10, word)
    assert told == []
    master.write(1, 1200)
    assert len(told) == 1


def test_the_byte_order_of_sixty_four_hosts_is_remembered(make_bank, master_of, register_map) -> None:
    bank, address = make_bank(require_byte_order_echo=True), register_map.find("byte_order_echo").address
    for number in range(65):
        if number == 64:
            assert bank._echo.is_proven_by("10.0.1.0")
        master_of(bank, f"10.0.1.{number}").write_float(address, 1234.5)
    assert not bank._echo.is_proven_by("10.0.1.0") and bank._echo.is_proven_by("10.0.1.1")


def test_the_owner_s_address_is_that_of_its_last_command(make_bank, register_map) -> None:
    """One certificate, two addresses: a pair of controllers of which the other one has gone on."""
    bank, address = make_bank(), register_map.find("owner_ip").address
    first, second = (Master(bank, host, name="plc") for host in ("10.0.0.1", "10.0.0.2"))
    shown = []
    for master in (first, second, first):
        master.write(0, 1, 1200)
        shown.append(bank.read_registers(address, 2)[-1])
    assert shown == [1, 2, 1] and bank.owner == "certificate plc"


def test_the_owner_s_address_follows_cycles_that_change_nothing_but_the_heartbeat(make_bank, register_map) -> None:
    bank, address = make_bank(), register_map.find("owner_ip").address
    first, second = (Master(bank, host, name="plc") for host in ("10.0.0.1", "10.0.0.2"))
    shown = []
    for beat, master in enumerate((first, first, first, second, second, first)):
        master.write(0, 1, 1200, 0, 0, beat)
        shown.append(bank.read_registers(address, 2)[-1])
    assert shown == [1, 1, 1, 2, 2, 1] and bank.command.number == 6


def test_who_ends_another_s_run_takes_no_owner_s_address_away(make_bank, register_map) -> None:
    """A certificate's name says no address: the last write of the owner itself does."""
    bank = make_bank(supported_bits=BASIC_BITS | ControlBit.START_CALIBRATION)
    Master(bank, "10.0.0.1", name="plc").write(0, ControlBit.ENABLE | ControlBit.START_CALIBRATION, 1200)
    Master(bank, "10.0.0.2").write(0, 1)
    assert bank.owner == "certificate plc" and bank.command.control_word == ControlBit.ENABLE
    assert bank.read_registers(register_map.find("owner_ip").address, 2) == bytes([10, 0, 0, 1])


@pytest.mark.parametrize("how", ["a 0 that changes nothing", "a stop of the owner", "a takeover", "by its coil"])
def test_who_wrote_its_held_bit_as_0_while_another_owned_is_asked_for_no_other_0(make_bank, master_of, how) -> None:
    bank = make_bank(supported_bits=ControlBit(127))
    holder, owner = master_of(bank, "10.0.0.1"), master_of(bank, "10.0.0.2")
    for _ in range(2):
        holder.write(0, TEST)
    bank.clear_command()  # the run has ended
    owner.write(0, int(how == "a stop of the owner"), 500)
    assert bank.owner == "10.0.0.2"
    if how == "by its coil":
        bank.write_bits(6, [False], holder.peer)
    else:
        holder.write(0, TAKE if how == "a takeover" else 0)
    bank.release_owner()
    holder.write(0, TEST)
    assert bank.command.control_word == TEST


def test_a_0_that_is_refused_for_another_owner_lets_a_held_bit_go(make_bank, master_of) -> None:
    """It was told to write it as 0 once, did so, and was told so again, for as long as another one owned."""
    bank = make_bank(supported_bits=ControlBit(127))
    holder, owner = master_of(bank, "10.0.0.1"), master_of(bank, "10.0.0.2")
    for _ in range(2):
        holder.write(0, TEST)
    bank.clear_command()
    owner.write(0, 0, 500)
    assert holder.refusal(holder.write, 0, 0, 600).reason is RefusalReason.NOT_OWNER
    bank.release_owner()
    holder.write(0, TEST)
    assert bank.command.control_word == TEST


def test_a_coil_beside_the_held_bit_lets_it_not_go_while_another_owns(make_bank, master_of) -> None:
    """Its own 0 alone does: the coil of the valve says nothing of the run."""
    bank = make_bank(supported_bits=ControlBit(127))
    holder, owner = master_of(bank, "10.0.0.1"), master_of(bank, "10.0.0.2")
    for _ in range(2):
        holder.write(0, TEST)
    bank.clear_command()
    owner.write(0, 0, 500)
    bank.write_bits(0, [False], holder.peer)
    bank.release_owner()
    assert holder.refusal(holder.write, 0, TEST).reason is RefusalReason.CALIBRATION_HELD


def test_a_held_bit_that_stops_another_s_run_begins_none_in_the_next_cycle(make_bank, master_of) -> None:
    """The 1 beside the enable that it cleared was no 0 of its own."""
    bank, run = make_bank(supported_bits=ControlBit(127)), int(ControlBit.START_CALIBRATION)
    holder, owner = master_of(bank, "10.0.0.1"), master_of(bank, "10.0.0.2")
    for _ in range(2):
        holder.write(0, run)
    bank.clear_command()
    owner.write(0, run | ControlBit.ENABLE, 1200)
    holder.write(0, run)
    assert bank.command.stops
    assert holder.refusal(holder.write, 0, run).reason is RefusalReason.CALIBRATION_HELD


def test_whoever_keeps_what_is_held_is_told_of_each_end_and_the_oldest_of_too_many_is_forgotten() -> None:
    told: list[dict[str, int]] = []
    held = HeldRuns()
    held.on_change = told.append
    for bits, times in ((TEST, 1), (TEST, 1), (0, 2), (0, 2)):
        held.keep("a", bits)
        assert len(told) == times, "of what is as before nobody hears"
    assert told == [{"a": TEST}, {}]
    for number in range(64):
        held.keep(f"10.0.0.{number}", TEST)
    held.keep("10.0.0.0", TEST)  # it is there again, as each of its cycles says
    held.keep("new", TEST)
    assert [held.of(host) for host in ("10.0.0.0", "10.0.0.1", "10.0.0.2", "new")] == [TEST, 0, TEST, TEST]


def test_a_master_is_lost_once_with_each_heartbeat_and_found_by_another_one() -> None:
    told: list[dict[str, list[int]]] = []
    held = HeldEnables()
    held.on_lost = told.append
    for heartbeat, times in ((3, 1), (3, 1), (4, 2)):
        held.note_lost("a", heartbeat)
        assert len(told) == times
    held.hear("a", 4, NO_CHANNEL)
    assert held.knows("a"), "by its last frame, sent on and on"
    held.hear("a", 5, NO_CHANNEL)
    assert told == [{"a": [3]}, {"a": [3, 4]}, {}] and not held.knows("a")
