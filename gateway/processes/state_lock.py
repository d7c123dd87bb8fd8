"""The lock of a state directory: its file `lock`, held by the gateway that runs there, or by who changes what it would read."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from gateway.plain_file import open_plain

NAME: Final = "lock"


@contextmanager
def hold_state_lock(directory: Path) -> Iterator[bool]:
    """Yield whether the lock is ours; while it is nobody else gets it. OSError where its file cannot be opened, or is none."""
    descriptor = _open(directory / NAME)
    try:
        yield _is_taken(descriptor)
    finally:
        os.close(descriptor)


def _open(path: Path) -> int:
    """A disk that has become read-only still has the file, and is no reason not to control."""
    try:
        return open_plain(path, os.O_WRONLY | os.O_CREAT, 0o644)
    except OSError:
        if not path.exists():
            raise
        return open_plain(path)


def _is_taken(descriptor: int) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
