"""Lines out of a stream, however it is cut."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from gateway.devices.framing import LONGEST_LINE_BYTES, LineSplitter

STREAMS = st.lists(
    st.one_of(
        st.sampled_from([b"\r\n", b"\r", b"\n", b"ST,GS,+0012.34kg\r\n", b"x" * 127, b"y" * 128, b"z" * 129]),
        st.binary(max_size=40),
    ),
    max_size=12,
).map(b"".join)


def lines(chunks: list[bytes]) -> list[tuple[bytes, bytes, bool]]:
    splitter = LineSplitter(b"\r\n")
    return [(line.data, line.body, line.is_whole) for chunk in chunks for line in splitter.feed(chunk)]


@given(STREAMS, st.lists(st.integers(0, 600), max_size=8))
def test_cutting_the_stream_elsewhere_changes_nothing(stream: bytes, cuts: list[int]) -> None:
    places = sorted({0, *(cut for cut in cuts if cut < len(stream)), len(stream)})
    pieces = [stream[start:end] for start, end in pairwise(places)]
    assert lines(pieces) == lines([stream]) == lines([stream[i : i + 1] for i in range(len(stream))])


@given(STREAMS)
def test_no_byte_is_lost_and_little_is_kept(stream: bytes) -> None:
    splitter = LineSplitter(b"\r\n")
    out = b"".join(line.data for line in splitter.feed(stream))
    dropped = splitter.forget()
    assert dropped == len(stream) - len(out) <= LONGEST_LINE_BYTES + 1
    assert stream.startswith(out)


def test_an_endless_line_is_dropped_in_pieces_and_the_next_one_is_read() -> None:
    found = lines([b"a" * 1000, b"\r\n", b"next\r\n"])
    assert [whole for _, _, whole in found] == [False] * (len(found) - 1) + [True]
    assert found[-1] == (b"next\r\n", b"next", True)


def test_the_longest_line_is_still_a_line() -> None:
    assert lines([b"a" * LONGEST_LINE_BYTES + b"\r\n"]) == [(b"a" * 128 + b"\r\n", b"a" * 128, True)]


def test_behind_a_line_that_was_forgotten_the_next_is_whole_however_long_that_was() -> None:
    """A port that was opened again while somebody shouted: the first answer counts."""
    for lost in (b"51", b"x" * 200):
        splitter = LineSplitter(b"\r\n")
        splitter.feed(lost)
        assert 0 < splitter.forget() <= LONGEST_LINE_BYTES and splitter.is_between_lines
        (line,) = splitter.feed(b"512\r\n")
        assert line.is_whole and line.body == b"512"
