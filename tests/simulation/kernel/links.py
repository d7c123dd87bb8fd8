"""The guardian's lines to its children without a kernel: what `message_link.create_link` gives, in memory.

Messages arrive at once and whole, with copies of the descriptors that go beside them; the end of one side is seen by the other.
"""

import os
import socket
from array import array
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from itertools import count
from typing import Any

from tests.simulation.kernel.virtual_time import VirtualLoop

_NUMBERS = count(1 << 20)  # no process has so many descriptors
_ENDS: dict[int, "LinkEnd"] = {}
Beside = Iterable[tuple[int, int, Any]]


class LinkEnd:
    """One end. on_readable: called for each message, and at the end of the other side."""

    def __init__(self) -> None:
        self._number = next(_NUMBERS)
        self._messages: deque[tuple[bytes, list[int]]] = deque()
        self._is_closed = False
        self.other: LinkEnd = self
        self.on_readable: Callable[[], object] = lambda: None
        _ENDS[self._number] = self

    def fileno(self) -> int:
        return self._number

    @property
    def is_readable(self) -> bool:
        return bool(self._messages) or self.other._is_closed

    def sendmsg(self, parts: list[bytes], beside: Beside = (), flags: int = 0) -> None:
        if self._is_closed or self.other._is_closed:
            raise BrokenPipeError(32, os.strerror(32))
        descriptors = [os.dup(number) for _, _, numbers in beside for number in array("i", bytes(numbers))]
        self.other._messages.append((b"".join(parts), descriptors))
        self.other.on_readable()

    def recvmsg(self, size: int, space: int = 0, flags: int = 0) -> tuple[bytes, list[Any], int, None]:
        if self._messages:
            data, descriptors = self._messages.popleft()
            beside = [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array("i", descriptors).tobytes())] if descriptors else []
            return data, beside, 0, None
        if self.other._is_closed:
            return b"", [], 0, None
        raise BlockingIOError

    def close(self) -> None:
        if self._is_closed:
            return
        self._is_closed = True
        for _, descriptors in self._messages:
            for number in descriptors:
                os.close(number)
        self._messages.clear()
        _ENDS.pop(self._number)
        self.other.on_readable()


def create_link() -> tuple[LinkEnd, LinkEnd]:
    """Return both ends of a new line."""
    ours, theirs = LinkEnd(), LinkEnd()
    ours.other, theirs.other = theirs, ours
    return ours, theirs


def readable_ends(numbers: Iterable[int]) -> set[int]:
    """Return which of these descriptors are ends with something to read."""
    return {number for number in numbers if number in _ENDS and _ENDS[number].is_readable}


def read_in_memory(loop: VirtualLoop) -> None:
    """Have this loop's `add_reader` follow the ends of such lines, too."""
    add_real, remove_real = loop.add_reader, loop.remove_reader

    def add_reader(number: int, callback: Callable[[], object], *_: Any) -> None:
        if number not in _ENDS:
            add_real(number, callback, *_)
            return
        _ENDS[number].on_readable = lambda: loop.call_soon(callback)
        if _ENDS[number].is_readable:
            loop.call_soon(callback)

    def remove_reader(number: int) -> bool:
        if number in _ENDS:
            _ENDS[number].on_readable = lambda: None
            return True
        with suppress(OSError, ValueError):
            return remove_real(number)  # type: ignore[no-any-return]
        return False

    loop.add_reader, loop.remove_reader = add_reader, remove_reader  # type: ignore[method-assign,assignment]
