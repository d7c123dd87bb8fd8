"""What may stand where a plain file belongs, made by kind; and a bound for who waits for it."""

import os
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import chdir, contextmanager
from pathlib import Path
from typing import Final

import pytest

_BOUND_S: Final = 20.0


def _bind(path: Path) -> None:
    """By its name alone: a whole path may be too long for a socket."""
    with socket.socket(socket.AF_UNIX) as listener, chdir(path.parent):
        listener.bind(path.name)


MAKERS: Final[dict[str, Callable[[Path], object]]] = {
    "a pipe": os.mkfifo,
    "a socket": _bind,
    "a device": lambda path: path.symlink_to("/dev/zero"),
    "a directory": Path.mkdir,
}


def put(kind: str, path: Path) -> Path:
    """Put it where a file may be."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    MAKERS[kind](path)
    return path


@contextmanager
def never_waiting() -> Iterator[None]:
    """Fail what waits for ever, or reads without an end."""

    def fail(*_: object) -> None:
        pytest.fail("it waits, or reads without an end")

    before = signal.signal(signal.SIGALRM, fail)
    signal.setitimer(signal.ITIMER_REAL, _BOUND_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
