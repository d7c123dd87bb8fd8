"""The short cuts answer exactly what the long way answers, or leave it alone."""

from struct import pack

from hypothesis import example, given
from hypothesis import strategies as st

from gateway.modbus import Adu, FramingLost, MbapFramer, Peer, answer
from gateway.modbus.fast import whole_answer, whole_read_answer
from gateway.modbus.mbap import encode
from tests.modbus.memory_bank import MemoryBank

PEER = Peer("127.0.0.1", 4711)
UNITS = frozenset((0, 1, 255))


def bank() -> MemoryBank:
    made = MemoryBank(words=200, bits=20, identity={0: b"v"})
    made.image[:] = bytes(index * 7 & 0xFF for index in range(400))
    return made


def the_long_way(frame: bytes) -> bytes | None:
    """Framer and answer(); None when it is not exactly one frame for a served unit."""
    try:
        frames = MbapFramer().feed(frame)
    except FramingLost:
        return None
    if len(frames) != 1 or len(frames[0].pdu) + 7 != len(frame) or frames[0].unit not in UNITS:
        return None
    return encode(Adu(frames[0].transaction, frames[0].unit, answer(frames[0].pdu, bank(), PEER)))


nearly = st.tuples(
    st.integers(0, 0xFFFF),
    st.sampled_from([0, 0, 0, 0, 7]),
    st.sampled_from([6, 6, 6, 6, 0, 1, 5, 7, 262]),
    st.sampled_from([1, 1, 0, 255, 2]),
    st.one_of(st.sampled_from([3, 4]), st.integers(0, 255)),
    st.one_of(st.integers(0, 210), st.integers(0, 0xFFFF)),
    st.one_of(st.integers(0, 127), st.integers(0, 0xFFFF)),
).map(lambda fields: pack(">HHHBBHH", *fields))


@given(nearly)
@example(pack(">HHHBBHH", 1, 0, 6, 1, 3, 0, 125))
@example(pack(">HHHBBHH", 1, 0, 6, 1, 4, 0, 126))
@example(pack(">HHHBBHH", 1, 0, 6, 1, 3, 199, 2))
@example(pack(">HHHBBHH", 1, 0, 6, 1, 1, 0, 8))  # coils are no registers
@example(pack(">HHHBBHH", 1, 0, 6, 1, 2, 0, 8))
@example(pack(">HHHBBHH", 1, 7, 6, 1, 3, 0, 8))  # another protocol
def test_a_read_is_answered_as_the_long_way_or_left_to_it(frame: bytes) -> None:
    quick = whole_read_answer(frame, UNITS, bank(), PEER)
    assert quick is None or quick == the_long_way(frame)


@given(
    st.integers(0, 0xFFFF),
    st.sampled_from(sorted(UNITS)),
    st.sampled_from([3, 4]),
    st.integers(0, 250),
    st.integers(1, 125),
)
def test_every_plain_read_takes_the_short_cut(
    transaction: int, unit: int, function: int, address: int, count: int
) -> None:
    frame = pack(">HHHBBHH", transaction, 0, 6, unit, function, address, count)
    assert whole_read_answer(frame, UNITS, bank(), PEER) == the_long_way(frame) is not None


frames = st.builds(Adu, st.integers(0, 0xFFFF), st.sampled_from([1, 2]), st.binary(min_size=1, max_size=253)).map(
    encode
)


@given(st.one_of(nearly, frames, st.binary(max_size=40)))
@example(pack(">HHHBB", 1, 0, 255, 1, 0x41) + bytes(253))  # longer than any frame
@example(pack(">HHHBBHHB", 1, 0, 255, 1, 16, 0, 124, 248) + bytes(248))  # and a write of more than is allowed
@example(pack(">HHHBBHHB", 1, 7, 9, 1, 16, 0, 1, 2) + bytes(2))  # another protocol, of a block
@example(pack(">HHHBBHH", 1, 7, 6, 1, 6, 0, 1))  # and of one word
@example(pack(">HHHBBHHB", 1, 0, 10, 1, 16, 0, 1, 2) + bytes(2))  # a byte of it is still to come
@example(pack(">HHHBBHHB", 1, 0, 8, 1, 16, 0, 1, 2) + bytes(2))  # it is one too many
def test_any_segment_is_answered_as_the_long_way_or_left_to_it(segment: bytes) -> None:
    assert whole_answer(segment, UNITS, bank(), PEER) == the_long_way(segment)


@given(st.integers(0, 126), st.integers(0, 255), st.binary(max_size=250))
@example(2, 6, bytes(4))  # a byte count that is not the data's
@example(2, 4, bytes(6))
@example(3, 4, bytes(4))
def test_a_write_is_executed_as_the_long_way_or_left_to_it(count: int, data_bytes: int, data: bytes) -> None:
    segment = encode(Adu(7, 1, pack(">BHHB", 16, 0, count, data_bytes) + data[:247]))
    quick = bank()
    assert whole_answer(segment, UNITS, quick, PEER) == the_long_way(segment)
    is_sound = data_bytes == 2 * count == len(data) and 1 <= count <= 123
    assert quick.image[: len(data)] == data if is_sound else quick.image == bank().image


def test_what_is_kept_of_reads_is_bounded_and_no_refusal() -> None:
    """Who reads here and there would have the memory, and a refusal that is known already leaves no reason."""
    made = bank()
    assert whole_read_answer(pack(">HHHBBHH", 1, 0, 6, 1, 3, 199, 2), UNITS, made, PEER) and not made.known_answers
    for address in range(190):
        assert whole_read_answer(pack(">HHHBBHH", 1, 0, 6, 1, 3, address, 1), UNITS, made, PEER)
        assert 0 < len(made.known_answers) <= 64
