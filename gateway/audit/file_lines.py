"""Reading the lines of an audit's file piece by piece: a file of gigabytes, by a hole at its end or a writer of another kind,
takes time and no memory.

Where its end is wanted it is looked for from there. Pieces are read and searched by calls that let the loop's thread go on.
"""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Final, NamedTuple

from gateway.plain_file import open_plain_stream

LONGEST_LINE: Final = 1 << 20
"""Bytes without the newline; ours have some hundreds."""
_PIECE: Final = 1 << 20


class FileLine(NamedTuple):
    """text: without the newline, of a line longer than any of ours only its beginning; length: in bytes, without the newline;
    is_whole: it ends in a newline."""

    text: bytes
    length: int
    is_whole: bool


class FileEnd(NamedTuple):
    """last: the last whole line, empty where there is none; whole_bytes: of all whole lines; torn: what begins behind them;
    torn_bytes: how long it is."""

    last: bytes
    whole_bytes: int
    torn: bytes
    torn_bytes: int


def iterate_lines(path: Path) -> Iterator[FileLine]:
    """Yield the lines of a file, the last one whole or not."""
    with open_plain_stream(path) as stream:
        while text := stream.readline(LONGEST_LINE + 1):
            length, end = len(text), text
            while not end.endswith(b"\n") and (end := stream.readline(_PIECE)):
                length += len(end)
            is_whole = end.endswith(b"\n")
            yield FileLine(text.removesuffix(b"\n"), length - is_whole, is_whole)


def read_end(path: Path) -> FileEnd:
    """Return how a file ends; of a torn or a too long line its beginning."""
    with open_plain_stream(path) as stream:
        size = stream.seek(0, os.SEEK_END)
        last = _find_newline_before(stream, size)
        begin = _find_newline_before(stream, last) + 1 if last >= 0 else 0
        stream.seek(begin)
        line = stream.read(min(max(last, 0) - begin, LONGEST_LINE + 1))
        stream.seek(last + 1)
        return FileEnd(line, last + 1, stream.read(min(size - last - 1, LONGEST_LINE)), size - last - 1)


def read_line(path: Path, index: int) -> bytes:
    """Return one line by its place, from 0. IndexError where there is none."""
    with open_plain_stream(path) as stream:
        while index:
            piece = stream.read(_PIECE)
            if not piece:
                raise IndexError(index)
            if (count := piece.count(b"\n")) < index:
                index -= count
                continue
            stream.seek(_behind_newline(piece, index) - len(piece), os.SEEK_CUR)
            break
        if line := stream.readline(LONGEST_LINE + 1):
            return line.removesuffix(b"\n")
    raise IndexError(index)


def count_lines(path: Path) -> int:
    """Return how many whole lines a file has."""
    with open_plain_stream(path) as stream:
        return sum(piece.count(b"\n") for piece in iter(lambda: stream.read(_PIECE), b""))


def _find_newline_before(stream: BinaryIO, end: int) -> int:
    """Return where the last newline before this byte is; -1 where there is none."""
    while end > 0:
        begin = max(0, end - _PIECE)
        stream.seek(begin)
        if (at := stream.read(end - begin).rfind(b"\n")) >= 0:
            return begin + at
        end = begin
    return -1


def _behind_newline(piece: bytes, number: int) -> int:
    at = 0
    for _ in range(number):
        at = piece.index(b"\n", at) + 1
    return at
