"""The lock of a state directory: its file `lock`, held by the gateway that runs there, or by who changes what it would read.

The directory itself is locked beside it, where its file system does that: a hand may delete the file, and the next gateway
would lock another one.
"""

import errno
import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from gateway.plain_file import closing_descriptor, exists, open_plain
from gateway.processes.durable_file import give_to_owner

NAME: Final = "lock"
_NO_LOCKS: Final = (errno.ENOLCK, errno.EBADF, errno.EINVAL, errno.ENOTSUP)  # network file systems, of a directory


@contextmanager
def hold_state_lock(directory: Path) -> Iterator[bool]:
    """Yield whether the lock is ours; while it is nobody else gets it. OSError where its file cannot be opened, or is none."""
    with (
        closing_descriptor(_open(directory / NAME)) as file,
        closing_descriptor(os.open(directory, os.O_RDONLY | os.O_DIRECTORY)) as whole,
    ):
        with suppress(OSError):  # a disk that has become read-only, say
            give_to_owner(file, NAME, whole)
        yield _is_taken(file) and _is_taken(whole, _NO_LOCKS)


def _open(path: Path) -> int:
    """A disk that has become read-only still has the file, and is no reason not to control."""
    try:
        return open_plain(path, os.O_WRONLY | os.O_CREAT, 0o644)
    except OSError:
        if not exists(path):
            raise
        return open_plain(path)


def _is_taken(descriptor: int, excused: tuple[int, ...] = ()) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError as error:
        if error.errno not in excused:
            raise
    return True
