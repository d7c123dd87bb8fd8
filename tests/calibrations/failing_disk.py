"""A disk that counts what gateway.processes.durable_file asks of it, fails the n-th call (lasting: and all after it; short: a
write takes half), and keeps a list for the order of things."""

import errno
import os
import pathlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from gateway.processes import durable_file

COUNTED = ("open", "write", "fsync", "rename", "unlink")


class Disk:
    """Stands for the module `os` inside gateway.processes.durable_file. calls: (name, file name or None), in order."""

    def __init__(
        self, fail_at: int = 0, error: int = errno.ENOSPC, *, short: bool = False, lasting: bool = False
    ) -> None:
        self.calls: list[tuple[str, str]] = []
        self._fail_at = fail_at
        self._error = error
        self._short = short
        self._lasting = lasting
        self._names: dict[int, str] = {}
        self.before_fsync: Callable[[str], None] = lambda name: None

    def __getattr__(self, name: str) -> Any:
        return self._counted(name) if name in COUNTED else getattr(os, name)

    def count(self, what: str, name: str) -> None:
        """One more call; raises when its turn to fail has come."""
        self.calls.append((what, name))
        its_turn = len(self.calls) == self._fail_at or (self._lasting and 0 < self._fail_at <= len(self.calls))
        if its_turn and not (self._short and what == "write"):
            raise OSError(self._error, os.strerror(self._error))

    def _counted(self, what: str) -> Callable[..., Any]:
        def call(first: Any, *rest: Any, **options: Any) -> Any:
            name = self._names.get(first, "?") if isinstance(first, int) else pathlib.Path(first).name
            self.count(what, name)
            if what == "fsync":
                self.before_fsync(name)
            if what == "write" and len(self.calls) == self._fail_at:
                return os.write(first, rest[0][: len(rest[0]) // 2])
            result = getattr(os, what)(first, *rest, **options)
            if what == "open":
                self._names[result] = name
            return result

        return call


@contextmanager
def disk(*arguments: Any, kind: type[Disk] = Disk, **options: Any) -> Iterator[Disk]:
    """The store's writes go through this disk meanwhile."""
    there = kind(*arguments, **options)
    make = pathlib.Path.mkdir

    def mkdir(path: pathlib.Path, *rest: Any, **more: Any) -> None:
        there.count("mkdir", path.name)
        make(path, *rest, **more)

    def open_plain(name: str, flags: int, mode: int, *, directory: int) -> Any:
        return there.open(name, flags, mode, dir_fd=directory)

    def write_whole(descriptor: int, data: bytes) -> None:
        if there.write(descriptor, data) < len(data):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(durable_file, "write_whole", write_whole)
        patch.setattr(durable_file, "os", there)
        patch.setattr(durable_file, "open_plain", open_plain)
        patch.setattr(pathlib.Path, "mkdir", mkdir)
        yield there
