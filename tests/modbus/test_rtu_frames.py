"""RTU frames and how long they will be, in both directions."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.modbus import Peer, answer
from gateway.modbus import pdu as P  # noqa: N812
from gateway.modbus.bits import pack_bits, unpack_bits
from gateway.modbus.crc import checksum_end, crc16
from gateway.modbus.rtu import (
    RtuFault,
    answer_length,
    decode_adu,
    encode_adu,
    is_broadcast_function,
    request_length,
)
from tests.modbus.host_answers import identification_request, write_coil_request, write_coils_request
from tests.modbus.memory_bank import MemoryBank

REQUESTS = [
    P.read_request(1, 3, 17),
    P.read_request(2, 3, 8),
    P.read_request(3, 3, 125),
    P.read_request(4, 3, 1),
    write_coil_request(3, True),
    write_coil_request(3, False),
    P.write_register_request(3, 5),
    write_coils_request(3, [True] * 11),
    P.write_registers_request(3, bytes(10)),
    P.mask_write_request(3, 1, 2),
    P.read_write_request(3, 6, 3, bytes(4)),
    identification_request(1),
    P.read_request(3, 9999, 1),
]


def test_the_checksum_is_the_catalogue_s() -> None:
    assert crc16(b"123456789") == 0x4B37


def test_a_frame_ends_where_its_checksum_does_and_nowhere_without_one() -> None:
    frame = encode_adu(1, P.read_request(3, 0, 2))
    assert checksum_end(frame + b"more", 4) == len(frame)
    assert checksum_end(frame, len(frame) + 1) == checksum_end(frame[:-1], 4) == checksum_end(b"", 4) == 0


@pytest.mark.parametrize("count", [0, 1, 7, 8, 9, 16, 17])
def test_coils_fill_as_many_bytes_as_they_need(count: int) -> None:
    coils = [place % 3 == 0 for place in range(count)]
    assert len(pack_bits(coils)) == -(-count // 8)
    assert unpack_bits(pack_bits(coils), count) == coils
    if count:
        with pytest.raises(ValueError, match="do not fit"):
            unpack_bits(pack_bits(coils)[:-1], count)


def test_a_frame_known_from_elsewhere() -> None:
    """Read holding registers, unit 1, address 0, two words: the frame of many manuals."""
    assert encode_adu(1, P.read_request(3, 0, 2)) == bytes.fromhex("01 03 0000 0002 c40b")


@given(st.integers(0, 255), st.binary(min_size=1, max_size=253))
def test_what_is_encoded_is_decoded(unit: int, pdu: bytes) -> None:
    assert decode_adu(encode_adu(unit, pdu)) == (unit, pdu)


@given(st.binary(min_size=1, max_size=60), st.integers(0, 500), st.integers(1, 255))
def test_one_damaged_byte_is_noticed(pdu: bytes, place: int, damage: int) -> None:
    frame = bytearray(encode_adu(1, pdu))
    frame[place % len(frame)] ^= damage
    with pytest.raises(RtuFault):
        decode_adu(bytes(frame))


@pytest.mark.parametrize("size", [0, 3, 257])
def test_what_cannot_be_a_frame_is_refused_by_its_length(size: int) -> None:
    with pytest.raises(RtuFault, match=f"{size} bytes"):
        decode_adu(bytes(size))


@pytest.mark.parametrize("request_pdu", REQUESTS, ids=lambda pdu: pdu.hex()[:10])
def test_lengths_are_known_before_the_frame_ends_and_never_wrong(request_pdu: bytes) -> None:
    bank = MemoryBank(words=200, bits=100, identity={0: b"vendor", 1: b"product", 2: b""})
    frames = [
        (encode_adu(1, request_pdu), request_length),
        (encode_adu(1, answer(request_pdu, bank, Peer("serial"))), answer_length),
    ]
    for frame, predict in frames:
        told = [predict(frame[:size]) for size in range(len(frame) + 1)]
        assert told[len(frame) - 2] == len(frame), "known at the latest when only the checksum is missing"
        assert set(told) == {None, len(frame)}, "and the same from then on"


def test_a_coil_is_written_as_the_specification_has_it() -> None:
    assert [write_coil_request(172, value).hex() for value in (True, False)] == ["0500acff00", "0500ac0000"]


def test_the_length_of_an_unknown_function_is_unknown() -> None:
    assert request_length(b"\x01\x41\x00\x00\x00\x00") is None
    assert request_length(b"\x01\x2b\x0d\x00\x00\x00\x00") is None, "of function 43 only the identification is known"


def test_a_length_beyond_the_longest_frame_is_no_length() -> None:
    assert answer_length(b"\x01\x03\xff") is None


def test_the_longest_frame_is_one_and_a_longer_one_is_none() -> None:
    longest = encode_adu(1, bytes(253))
    assert decode_adu(longest) == (1, bytes(253)) and len(longest) == 256
    for length in (0, 254):
        with pytest.raises(ValueError, match=f"not {length}"):
            encode_adu(1, bytes(length))
    with pytest.raises(RtuFault, match="257 bytes"):
        decode_adu(longest + b"\0")


def test_a_refusal_is_known_by_its_second_byte() -> None:
    assert [answer_length(bytes.fromhex(seen)) for seen in ("01", "0183", "018302")] == [None, 5, 5]


def test_only_what_writes_and_reads_nothing_may_be_said_to_everybody() -> None:
    assert [function for function in range(256) if is_broadcast_function(function)] == [5, 6, 15, 16, 22]


def test_a_checksum_the_other_way_round_is_none() -> None:
    frame = encode_adu(1, P.read_request(3, 0, 2))
    with pytest.raises(RtuFault, match="checksum"):
        decode_adu(frame[:-2] + frame[-1:] + frame[-2:-1])
