"""`events.jsonl` in the state directory: what was said, one JSON object per line, kept within a bound.

Guardian and control process write the same file: each line is one `write` to a descriptor opened with O_APPEND, which the
kernel does not mix with another's. Whoever finds the file full renames it (`events.jsonl.1` is the newest of the old
ones), under a lock of the very file that is renamed; the other notices that its file has another name and opens anew, so
no line is lost. Nothing is ever synced: a power cut may cost the last seconds, a killed process costs nothing. A
file that ends in a piece of a line, as a power cut leaves it, costs that line: the reader finds the one behind it.
Standard library only: the guardian imports this.
"""

import contextlib
import fcntl
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO, Final, Self

from gateway.plain_file import open_plain, open_plain_stream, write_whole
from gateway.processes.event import EventRecord, parse_event

NAME: Final = "events.jsonl"
LONGEST_BYTES: Final = 4 << 20
KEPT: Final = 4
"""Old files beside the current one."""


class EventFile:
    """One process's way to the file. Not for two threads at once."""

    def __init__(self, directory: Path, longest_bytes: int = LONGEST_BYTES) -> None:
        self._path = directory / NAME
        self._longest_bytes = longest_bytes
        self._descriptor = -1
        self._is_torn = False

    def append(self, line: bytes) -> None:
        """Put one whole line at the end. OSError when the disk does not take it; the next line begins anew then."""
        descriptor = self._current()
        data = b"\n" + line if self._is_torn else line
        self._is_torn = True  # until all of it is written
        write_whole(descriptor, data)
        self._is_torn = False
        if os.fstat(descriptor).st_size >= self._longest_bytes:
            self._rotate()

    def close(self) -> None:
        """Close the file."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    def _current(self) -> int:
        if self._descriptor < 0 or not self._is_named():
            self.close()
            self._descriptor = open_plain(self._path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
        return self._descriptor

    def _is_named(self) -> bool:
        """Return whether the path still leads to the file that we have open."""
        try:
            return os.path.samestat(self._path.stat(), os.fstat(self._descriptor))
        except OSError:
            return False

    def _rotate(self) -> None:
        """Give the full file its old name. Only who holds the lock of the file at the path may: so one does."""
        with contextlib.suppress(OSError):  # somebody else is at it, or the disk is: it grows a little longer then
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if self._is_named():
                for number in range(KEPT, 0, -1):
                    with contextlib.suppress(FileNotFoundError):
                        _rotated_path(self._path, number - 1).replace(_rotated_path(self._path, number))
        self.close()


class EventReader:
    """Reads what is stored, oldest first, then what has come since, as often as wanted. Torn lines are passed over.

    A rotation meanwhile neither hides a line nor shows one twice.
    """

    def __init__(self, directory: Path) -> None:
        self._path = directory / NAME
        self._stream: IO[bytes] | None = None
        self._rest = b""

    def read_stored(self) -> Iterator[EventRecord]:
        """Yield every event that is stored, oldest first."""
        old = _open_files(self._path)
        self._stream = old.pop() if old else None
        with contextlib.ExitStack() as stack:
            for stream in old:
                stack.enter_context(stream)
            for stream in old:
                yield from _events(stream)
        yield from self.read_new()

    def read_new(self) -> Iterator[EventRecord]:
        """Yield what has been written since, also to a file that has been begun anew since."""
        while True:
            fresh = self._fresh()  # looked for first: what comes into the old file after its new name is read below
            yield from self._whole_lines()
            if fresh is None:
                return
            self.close()
            self._stream = fresh

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None

    def _whole_lines(self) -> Iterator[EventRecord]:
        if self._stream is not None:
            *lines, self._rest = (self._rest + self._stream.read()).split(b"\n")
            yield from _events(lines)

    def _fresh(self) -> IO[bytes] | None:
        """Return the file at the path, where it is not the one that is open."""
        try:
            fresh = open_plain_stream(self._path)
        except FileNotFoundError:
            return None
        if self._stream is None or not os.path.sameopenfile(fresh.fileno(), self._stream.fileno()):
            return fresh
        fresh.close()
        return None


def _events(lines: Iterable[bytes]) -> Iterator[EventRecord]:
    for line in lines:
        if (event := parse_event(line)) is not None:
            yield event


def _open_files(path: Path) -> list[IO[bytes]]:
    """Return the files that there are, oldest first. Opened newest first: one that gets its next number meanwhile is met again,
    and known by its inode."""
    opened: dict[tuple[int, int], IO[bytes]] = {}
    with contextlib.ExitStack() as stack:  # where one is refused the others are closed
        for number in range(KEPT + 1):
            with contextlib.suppress(FileNotFoundError):
                stream = stack.enter_context(open_plain_stream(_rotated_path(path, number)))
                status = os.fstat(stream.fileno())
                if opened.setdefault((status.st_dev, status.st_ino), stream) is not stream:
                    stream.close()
        stack.pop_all()
    return list(reversed(opened.values()))


def _rotated_path(path: Path, number: int) -> Path:
    return path.with_name(f"{path.name}.{number}") if number else path
