"""Any sequence of requests: nothing but ModbusError comes out, a refused write changes only the refusal registers, and what
control is handed is always finite, in range and the owner's."""

import math
import struct

from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.codes.refusals import RefusalReason
from gateway.modbus import ModbusError, Peer, Role
from gateway.registers import BankRules, Refusal, RegisterBank, Status
from gateway.registers.words import ControlBit, State
from gateway.registers.writes.proposed_write import EdgeRefusal, ProposedWrite
from tests.gate.budgets import examples

PEERS = [Peer("10.0.0.1", 1, role=Role.CALIBRATION), Peer("10.0.0.2", 2), Peer("fe80::1", 3, "press", Role.ADMIN)]
ADDRESSES = st.one_of(
    st.integers(0, 20),
    st.integers(98, 135),
    st.integers(198, 300),
    st.integers(300, 434),
    st.integers(998, 1200),
    st.integers(0, 65535),
)
WORD = st.one_of(st.integers(0, 15), st.integers(0, 0xFFFF), st.sampled_from([0x4140, 0x7FC0, 0x7F80, 0x8000, 6000]))
NUMBER = st.one_of(st.floats(width=32), st.sampled_from([0.0, 1.0, 12.0, 60.0, 1234.5]))


def words(values: list[int]) -> bytes:
    return struct.pack(f">{len(values)}H", *values)


def floats(values: list[float]) -> bytes:
    return struct.pack(f">{len(values)}f", *values)


DATA = st.one_of(
    st.lists(WORD, min_size=1, max_size=20).map(words),
    st.lists(st.just(0), min_size=1, max_size=40).map(words),
    st.lists(NUMBER, min_size=1, max_size=14).map(floats),
)
STEPS = st.one_of(
    st.tuples(st.just("write"), ADDRESSES, DATA),
    st.tuples(st.just("bits"), st.integers(0, 120), st.lists(st.booleans(), min_size=1, max_size=17)),
    st.tuples(st.just("mask"), ADDRESSES, st.tuples(WORD, WORD)),
    st.tuples(st.just("read"), ADDRESSES, st.integers(1, 125)),
    st.tuples(st.just("publish"), st.floats(), st.sampled_from(State)),
    st.tuples(st.just("clear"), st.just(0), st.just(0)),
)


def memory(bank: RegisterBank) -> bytes:
    """The whole image, as it is read, without the last-refusal registers."""
    bank.read_registers(100, 1)
    data = bytearray(bank._image.data)
    for first, count in ((118, 4), (268, 8), (368, 8)):
        data[2 * first : 2 * (first + count)] = bytes(2 * count)
    return bytes(data)


def control_says(asked: ProposedWrite) -> EdgeRefusal | None:
    """Now and then no, by what it is asked."""
    refuses = int(asked.command.force_setpoint_n) % 3 == 1
    return EdgeRefusal(RefusalReason.TARE_REFUSED, ControlBit.TARE, "tare refused") if refuses else None


def perform(bank: RegisterBank, step: tuple, peer: Peer) -> None:
    kind, address, argument = step
    if kind == "write":
        bank.write_registers(address, argument, peer)
    elif kind == "bits":
        bank.write_bits(address, argument, peer)
    elif kind == "mask":
        bank.mask_write(address, *argument, peer)
    elif kind == "read":
        assert len(bank.read_registers(address, argument)) == 2 * argument
    elif kind == "publish":
        bank.publish(Status(force_measured_n=address, pressure_pa=address, state=argument))
    else:
        bank.clear_command()
        bank.release_owner()


@settings(deadline=None, max_examples=examples(300))
@given(steps=st.lists(st.tuples(STEPS, st.sampled_from(PEERS)), max_size=25))
def test_no_sequence_of_requests_breaks_the_bank(register_map, steps):
    rules = BankRules(rig_name="demo", force_max_n=60.0)
    bank = RegisterBank(register_map, rules, now=lambda: 1.0)
    bank.on_accepted = lambda sentence, peer: None
    handed = []
    bank.on_command = handed.append
    bank.on_asked = control_says
    for step, peer in steps:
        before = memory(bank), bank.command, bank.owner, len(handed), dict(bank.last_writer)
        try:
            perform(bank, step, peer)
        except ModbusError as refusal:
            assert isinstance(refusal, Refusal)
            assert refusal.code in (1, 2, 3, 4, 6, 0x0B)
            assert (memory(bank), bank.command, bank.owner, len(handed), dict(bank.last_writer)) == before
            shown = struct.unpack(">HH", bank.read_registers(118, 2))
            assert shown == (refusal.address, refusal.reason)
        check(bank, handed, before[3], peer)


def check(bank: RegisterBank, handed: list, seen: int, peer: Peer) -> None:
    command = bank.command
    assert all(not isinstance(value, float) or math.isfinite(value) for value in command)
    assert 0.0 <= command.force_setpoint_n <= 60.0
    assert command.control_word & ControlBit.ENABLE or bank._commands.values[0] == 0
    if len(handed) > seen:
        assert len(handed) == seen + 1
        assert handed[-1].peer == peer.identity
        assert bank.owner in (None, peer.identity)


CYCLES = st.lists(
    st.tuples(
        st.sampled_from((0, 0, 1, 4, 200, 300)),
        st.lists(st.sampled_from((0, 1, 2, 3, 8, 9, 33, 100, 1200, 0x8001)), min_size=1, max_size=13),
        st.sampled_from(PEERS[:2]),
    ),
    max_size=30,
)


@settings(deadline=None, max_examples=examples(100))
@given(writes=CYCLES)
def test_the_short_way_of_a_plain_write_ends_where_the_long_one_does(register_map, writes):
    rules = BankRules(rig_name="demo", force_max_n=60.0)
    short, long = (RegisterBank(register_map, rules, now=lambda: 1.0) for _ in range(2))
    long._admission._is_plain = lambda host, word: False
    long._is_command = lambda address, count, peer: False
    for address, words, peer in writes:
        data = struct.pack(f">{len(words)}H", *words)
        said = []
        for bank in (short, long):
            bank.on_asked = control_says
            try:
                bank.write_registers(address, data, peer)
                said.append("")
            except Refusal as refusal:
                said.append(str(refusal))
        assert said[0] == said[1]
        assert memory(short) == memory(long)
        assert (short.command, short.owner, short.last_writer) == (long.command, long.owner, long.last_writer)
