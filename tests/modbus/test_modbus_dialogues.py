"""Bytes on the wire, from the examples of MODBUS Application Protocol V1.1b3 section 6 (addresses there count from 0 too)."""

import pytest

from gateway.modbus import Peer, ServerId, answer
from gateway.modbus import pdu as P  # noqa: N812
from tests.modbus.host_answers import (
    answer_bits,
    answer_data,
    loopback_request,
    report_request,
    write_coil_request,
    write_coils_request,
)
from tests.modbus.memory_bank import MemoryBank

PEER = Peer("127.0.0.1", 4711)


def bank() -> MemoryBank:
    """What the specification's examples find: values at their example addresses."""
    found = MemoryBank(words=300, bits=300)
    for first, data in ((0x13, "cd6b05"), (0xC4, "acdb35")):
        for index in range(8 * len(bytes.fromhex(data))):
            found.bits[first + index] = bool(int.from_bytes(bytes.fromhex(data), "little") >> index & 1)
    found.write_registers(0x6B, bytes.fromhex("022b00000064"), PEER)
    found.write_registers(0x04, bytes.fromhex("0012"), PEER)
    found.write_registers(0x08, bytes.fromhex("000a"), PEER)
    return found


DIALOGUES = [
    pytest.param("01 0013 0013", "01 03 cd6b05", id="6.1 read coils"),
    pytest.param("02 00c4 0016", "02 03 acdb35", id="6.2 read discrete inputs"),
    pytest.param("03 006b 0003", "03 06 022b 0000 0064", id="6.3 read holding registers"),
    pytest.param("04 0008 0001", "04 02 000a", id="6.4 read input registers"),
    pytest.param("05 00ac ff00", "05 00ac ff00", id="6.5 write single coil"),
    pytest.param("06 0001 0003", "06 0001 0003", id="6.6 write single register"),
    pytest.param("08 0000 a537", "08 0000 a537", id="6.8 diagnostics, return query data"),
    pytest.param("0f 0013 000a 02 cd01", "0f 0013 000a", id="6.11 write multiple coils"),
    pytest.param("10 0001 0002 04 000a 0102", "10 0001 0002", id="6.12 write multiple registers"),
    pytest.param("16 0004 00f2 0025", "16 0004 00f2 0025", id="6.16 mask write register"),
    pytest.param("17 0003 0006 000e 0003 06 00ff 00ff 00ff", "17 0c 0000 0012 0000 0000 0000 000a", id="6.17"),
]


@pytest.mark.parametrize(("request_hex", "answer_hex"), DIALOGUES)
def test_the_specification_s_examples_are_answered_as_printed(request_hex: str, answer_hex: str) -> None:
    assert answer(bytes.fromhex(request_hex), bank(), PEER) == bytes.fromhex(answer_hex)


@pytest.mark.parametrize(("request_hex", "answer_hex"), DIALOGUES)
def test_the_host_takes_the_printed_answers_as_its_own(request_hex: str, answer_hex: str) -> None:
    request, reply = bytes.fromhex(request_hex), bytes.fromhex(answer_hex)
    is_read = request[0] <= 4 or request[0] == 23
    assert answer_data(request, reply) == (reply[2:] if is_read else b"")


@pytest.mark.parametrize(
    ("built", "request_hex"),
    [
        (P.read_request(1, 0x13, 0x13), "01 0013 0013"),
        (P.read_request(3, 0x6B, 3), "03 006b 0003"),
        (write_coil_request(0xAC, True), "05 00ac ff00"),
        (P.write_register_request(1, 3), "06 0001 0003"),
        (loopback_request(b"\xa5\x37"), "08 0000 a537"),
        (report_request(), "11"),
        (write_coils_request(0x13, [bool(int(bit)) for bit in "1011001110"]), "0f 0013 000a 02 cd01"),
        (P.write_registers_request(1, bytes.fromhex("000a0102")), "10 0001 0002 04 000a 0102"),
        (P.mask_write_request(4, 0xF2, 0x25), "16 0004 00f2 0025"),
        (P.read_write_request(3, 6, 14, b"\x00\xff" * 3), "17 0003 0006 000e 0003 06 00ff 00ff 00ff"),
    ],
)
def test_the_host_s_requests_are_the_printed_ones(built: bytes, request_hex: str) -> None:
    assert built == bytes.fromhex(request_hex)


def test_writes_have_happened_when_they_are_answered() -> None:
    served = bank()
    for request in ("0500acff00", "0600010003", "0f0013000a02cd01", "160004 00f2 0025"):
        answer(bytes.fromhex(request), served, PEER)
    assert served.bits[0xAC]
    assert served.read_bits(0x13, 10) == bytes.fromhex("cd01")
    assert served.read_registers(1, 1) == bytes.fromhex("0003")
    assert served.read_registers(4, 1) == bytes.fromhex("0017"), "the specification's own result of its mask example"


def test_read_write_reads_what_it_has_just_written() -> None:
    reply = answer(P.read_write_request(10, 2, 10, bytes.fromhex("12345678")), bank(), PEER)
    assert reply == bytes.fromhex("17 04 12345678")


def test_a_coil_written_is_a_discrete_input_read() -> None:
    served = bank()
    answer(write_coils_request(40, [True, False, True]), served, PEER)
    request = P.read_request(P.READ_DISCRETE_INPUTS, 40, 3)
    assert answer_bits(request, answer(request, served, PEER)) == [True, False, True]


@pytest.mark.parametrize("words", [0, 1, 2, 124, 125])
def test_return_query_data_returns_any_words(words: int) -> None:
    """6.8.1: "N x 2 bytes" of data, "the entire response message should be identical to the request"."""
    request = loopback_request(bytes(range(250))[: 2 * words])
    assert answer(request, bank(), PEER) == request
    assert answer_data(request, request) == b""


@pytest.mark.parametrize(
    ("server", "answer_hex"),
    [
        (ServerId(0x46, True, b"fg 1"), "11 07 46 ff 66672031 ff"),
        (ServerId(0x46, False, b"fg 1"), "11 07 46 00 66672031 00"),
        (ServerId(7, True, b""), "11 03 07 ff ff"),
    ],
)
def test_report_server_id_is_count_id_run_indicator_and_text(server: ServerId, answer_hex: str) -> None:
    """6.13: byte count, server id, 00 = OFF or FF = ON, additional data (whose last byte repeats the indicator)."""
    served = bank()
    served.server_id = server
    reply = answer(report_request(), served, PEER)
    assert reply == bytes.fromhex(answer_hex)
    assert answer_data(report_request(), reply) == reply[2:]


def test_a_long_server_id_fits_in_one_answer() -> None:
    served = bank()
    served.server_id = ServerId(1, True, b"x" * 1000)
    reply = answer(report_request(), served, PEER)
    assert len(reply) == 253 and reply[1] == 251 and reply[-1] == 0xFF
