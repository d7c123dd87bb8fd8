"""A TCP stream has no segments: whatever cuts it, the frames are the same."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.modbus.mbap import Adu, FramingLost, MbapFramer, encode
from gateway.modbus.pdu import read_request
from gateway.modbus.rtu import encode_adu

adus = st.builds(Adu, st.integers(0, 0xFFFF), st.integers(0, 255), st.binary(min_size=1, max_size=253))


def reference(stream: bytes) -> tuple[list[Adu], bool]:
    """The same rules over the whole stream at once, as plainly as possible: frames, and whether the framing was lost."""
    frames = []
    while True:
        if len(stream) >= 4 and stream[2:4] != b"\x00\x00":
            return frames, True
        if len(stream) >= 6 and not 2 <= int.from_bytes(stream[4:6], "big") <= 254:
            return frames, True
        if len(stream) < 6 or len(stream) < 6 + int.from_bytes(stream[4:6], "big"):
            return frames, False
        end = 6 + int.from_bytes(stream[4:6], "big")
        frames.append(Adu(int.from_bytes(stream[:2], "big"), stream[6], stream[7:end]))
        stream = stream[end:]


def fed(chunks: list[bytes]) -> tuple[list[Adu], bool]:
    framer, frames = MbapFramer(), []
    for chunk in chunks:
        try:
            frames += framer.feed(chunk)
        except FramingLost as lost:
            return frames + list(lost.frames), True
    return frames, False


def cut(stream: bytes, places: list[int]) -> list[bytes]:
    edges = [0, *sorted(place % (len(stream) + 1) for place in places), len(stream)]
    return [stream[start:end] for start, end in pairwise(edges)]


@given(st.lists(adus, max_size=8), st.lists(st.integers(0, 4000), max_size=12))
def test_cutting_the_stream_elsewhere_changes_nothing(sent: list[Adu], places: list[int]) -> None:
    assert fed(cut(b"".join(map(encode, sent)), places)) == (sent, False)


@given(st.lists(adus, min_size=1, max_size=3))
def test_one_byte_at_a_time_is_enough(sent: list[Adu]) -> None:
    stream = b"".join(map(encode, sent))
    assert fed([stream[at : at + 1] for at in range(len(stream))]) == (sent, False)


nearly_frames = st.one_of(
    adus.map(encode),
    st.binary(max_size=12),
    st.tuples(st.sampled_from([0, 0, 0, 7, 256]), st.sampled_from([0, 1, 2, 3, 6, 254, 255, 65535])).map(
        lambda header: b"\x00\x01" + header[0].to_bytes(2, "big") + header[1].to_bytes(2, "big") + b"\x01\x03"
    ),
)


@given(st.lists(nearly_frames, max_size=8).map(b"".join), st.lists(st.integers(0, 3000), max_size=10))
def test_noise_is_read_exactly_as_an_independent_parser_reads_it(stream: bytes, places: list[int]) -> None:
    assert fed(cut(stream, places)) == reference(stream)


@pytest.mark.parametrize("length", [0, 1, 255, 65535])
def test_a_length_that_no_frame_can_have_loses_the_framing(length: int) -> None:
    with pytest.raises(FramingLost, match=f"length {length}"):
        MbapFramer().feed(b"\x00\x01\x00\x00" + length.to_bytes(2, "big"))


def test_another_protocol_loses_the_framing_as_soon_as_it_shows() -> None:
    with pytest.raises(FramingLost, match="protocol id 7"):
        MbapFramer().feed(b"\x00\x01\x00\x07")


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (bytes.fromhex("16 03 01 02 00 01 00 01 fc"), "this is TLS"),
        (b"GET / HTTP/1.1\r\n", "this is HTTP"),
        (encode_adu(1, read_request(3, 100, 10)), "this is Modbus RTU over TCP"),  # as a serial server hands it on
    ],
)
def test_a_client_that_is_set_to_another_protocol_is_told_by_its_bytes(data: bytes, told: str) -> None:
    with pytest.raises(FramingLost, match=f"Modbus is 0; {told}"):
        MbapFramer().feed(data)
    with pytest.raises(FramingLost, match=r"Modbus is 0$"):
        MbapFramer().feed(b"\x00" + data[1:])


def test_frames_before_the_loss_are_not_lost() -> None:
    before = Adu(5, 1, b"\x03\x00\x00\x00\x01")
    with pytest.raises(FramingLost) as caught:
        MbapFramer().feed(encode(before) + b"\x00\x06\x00\x00\xff\xff")
    assert caught.value.frames == (before,)


def test_the_longest_frame_passes_and_is_as_long_as_said() -> None:
    longest = encode(Adu(1, 1, bytes(253)))
    assert len(longest) == 260  # MODBUS Messaging on TCP/IP V1.0b, section 4.1: 7 of header and a PDU of 253
    assert MbapFramer().feed(longest) == [Adu(1, 1, bytes(253))]


@pytest.mark.parametrize("size", [0, 254])
def test_a_pdu_that_fits_no_frame_is_our_mistake(size: int) -> None:
    with pytest.raises(ValueError, match="253"):
        encode(Adu(1, 1, bytes(size)))


def test_the_framer_holds_no_more_than_it_was_given() -> None:
    framer = MbapFramer()
    framer.push(bytes(5))
    assert (framer.take(), len(framer)) == (None, 5)
