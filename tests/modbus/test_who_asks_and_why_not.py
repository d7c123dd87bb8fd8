"""What a bank is told of who asks, and what an exception says to people."""

import pytest

from gateway.modbus import Adu, ModbusError, Peer, RequestError, answer
from gateway.modbus import pdu as P  # noqa: N812
from gateway.modbus.diagnostics import ServerId, report_answer
from gateway.modbus.errors import NAMES
from gateway.modbus.fast import whole_answer, whole_read_answer
from gateway.modbus.mbap import encode
from gateway.modbus.peer import NOBODY
from gateway.modbus.server import refuse_unit
from tests.modbus.memory_bank import MemoryBank
from tests.modbus.test_modbus_refusals import PEER, FussyBank


def test_the_bank_is_told_at_each_turn_who_asks() -> None:
    class Asked(FussyBank):
        def read_registers(self, address: int, count: int, _peer: Peer = NOBODY) -> bytes:
            peers.append(_peer)
            return super().read_registers(address, count)

        def check_registers_readable(self, address: int, count: int, _peer: Peer = PEER) -> None:
            peers.append(_peer)

    for request in (P.read_request(3, 0, 1), P.read_request(4, 0, 1), P.read_write_request(0, 1, 0, b"\x12\x34")):
        peers: list[Peer] = []
        answer(request, Asked(), PEER)
        assert set(peers) == {PEER}


def test_the_bank_is_told_on_the_short_way_too_who_asks() -> None:
    class Asked(MemoryBank):
        def read_registers(self, address: int, count: int, peer: Peer = NOBODY) -> bytes:
            peers.append(peer)
            return bytes(2 * count)

        def write_registers(self, address: int, data: bytes, peer: Peer) -> None:
            peers.append(peer)

    peers, bank = list[Peer](), Asked(words=10, bits=10, identity={})
    read, write = (
        encode(Adu(7, 1, pdu)) for pdu in (P.read_request(3, 0, 1), P.write_registers_request(0, b"\x12\x34"))
    )
    assert whole_read_answer(read, (1,), bank, PEER) and whole_answer(write, (1,), bank, PEER)
    assert peers == [PEER, PEER]


@pytest.mark.parametrize("code", [*NAMES, 99])
def test_an_exception_without_a_sentence_of_its_own_says_what_its_code_means(code: int) -> None:
    assert str(ModbusError(code)) == NAMES.get(code, "exception 99")
    assert str(ModbusError(code, "no such thing")) == "no such thing"


def test_a_request_of_a_wrong_length_is_told_both_lengths() -> None:
    with pytest.raises(RequestError, match=r"3 bytes.*5"):
        P.parse_read(bytes(3), 10)
    with pytest.raises(RequestError, match=r"2 bytes.*1"):
        report_answer(b"\x11\x00", ServerId(0, True, b""))


@pytest.mark.parametrize("function", [5, 6, 15, 16, 22, 23, 1, 2, 3, 4, 8, 17, 43])
def test_the_bank_is_told_whether_what_was_refused_wanted_to_write(function: int) -> None:
    """Of a write the owner and the audit hear, too."""
    bank, told = MemoryBank(words=200, bits=16, identity={0: b"v"}), list[bool]()
    bank.note_refusal = lambda refusal, peer: told.append(refusal.is_write)  # type: ignore[method-assign]
    answer(bytes((function, 0)), bank, PEER)
    refuse_unit((9, bytes((function, 0, 4, 0, 1))), (1,), bank, PEER)
    assert told == [function in (5, 6, 15, 16, 22, 23)] * 2


def test_a_master_is_its_address_or_what_its_certificate_says_and_never_both() -> None:
    """All plain masters under one name would be one owner."""
    plain, other, named = Peer("10.0.0.5", 5), Peer("10.0.0.6", 5), Peer("10.0.0.5", 6, "cell")
    assert [each.identity for each in (plain, other, named)] == ["10.0.0.5", "10.0.0.6", "certificate cell"]
    assert [str(each) for each in (plain, named)] == ["10.0.0.5:5", "cell (10.0.0.5:6)"]


@pytest.mark.parametrize(
    ("peer", "words"),
    [
        (Peer("10.0.0.5", 40001), "10.0.0.5:40001"),
        (Peer("::1", 40001), "[::1]:40001"),
        (Peer("::1"), "::1"),
        (Peer("::1", 40001, "cell-7"), "cell-7 ([::1]:40001)"),
        (Peer("/dev/ttyS0"), "/dev/ttyS0"),
    ],
)
def test_who_asks_is_told_as_addresses_are_written(peer: Peer, words: str) -> None:
    assert str(peer) == words
