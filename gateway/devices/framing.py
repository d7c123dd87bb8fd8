"""Bytes into lines: half a line is normal, an endless one is not.

However a stream is cut into chunks, the same lines come out: each decision looks only at the bytes from the start of a
line, never at how many have arrived (a property test says so).
"""

import re
from dataclasses import dataclass
from typing import Final

LONGEST_LINE_BYTES: Final = 128  # the longest sentence of the shipped grammars is 40

_SPELT: Final = re.compile(r"<?(CR|LF|STX|ETX|EOT|\\[rnx])", re.IGNORECASE)
_SHOWN: Final = r'"\r\n", ETX "\x03", EOT "\x04"'


def no_terminator(text: str) -> str:
    """Return why this ends no line: it is spelt as manuals spell it. Empty where it may."""
    if not _SPELT.match(text):
        return ""
    return f"'{text}' would be {len(text)} characters on the wire: between double quotes CR LF is {_SHOWN}"


@dataclass(frozen=True, slots=True)
class Line:
    """data with its terminator, as it came; body without; is_whole is False for a piece of an overlong line."""

    data: bytes
    body: bytes
    is_whole: bool


class LineSplitter:
    """Feed bytes, get the lines that they complete. At most LONGEST_LINE_BYTES and a terminator are kept."""

    def __init__(self, terminator: bytes) -> None:
        self._terminator = terminator
        self._window = LONGEST_LINE_BYTES + len(terminator)
        self._buffer = b""
        self._is_skipping = False

    @property
    def is_between_lines(self) -> bool:
        """Decide whether nothing is kept: what comes next begins a line."""
        return not self._buffer and not self._is_skipping

    def forget(self) -> int:
        """Drop the unfinished line; how many bytes that was."""
        dropped, self._buffer, self._is_skipping = len(self._buffer), b"", False
        return dropped

    def skip(self) -> None:
        """Take what comes up to the next end for the rest of a line that began before: it is no whole one."""
        self._is_skipping = True

    def feed(self, chunk: bytes) -> list[Line]:
        """Return the lines that these bytes complete; an unfinished one waits."""
        self._buffer += chunk
        lines = []
        while self._buffer and (line := self._next()) is not None:
            lines.append(line)
        return lines

    def _next(self) -> Line | None:
        end = self._buffer.find(self._terminator, 0, self._window)
        if end >= 0:
            data = self._take(end + len(self._terminator))
            was_skipping, self._is_skipping = self._is_skipping, False
            return Line(data, data[:end], not was_skipping)
        if len(self._buffer) < self._window:
            return None
        self._is_skipping = True
        data = self._take(LONGEST_LINE_BYTES)
        return Line(data, data, False)

    def _take(self, length: int) -> bytes:
        data, self._buffer = self._buffer[:length], self._buffer[length:]
        return data
