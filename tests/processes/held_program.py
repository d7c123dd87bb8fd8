"""A program whose disk hangs: whoever opens its file waits."""

import contextlib
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

_HELD = (
    "import fcntl, os, select, signal, sys; signal.signal(signal.SIGIO, signal.SIG_IGN); "
    "program = os.open(sys.argv[1], os.O_RDONLY); fcntl.fcntl(program, fcntl.F_SETLEASE, fcntl.F_WRLCK); "
    "print('held', flush=True); select.select([sys.stdin], [], [], 3.0)"
)


@contextlib.contextmanager
def held_program(program: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Hold it by a lease until the input of what is yielded is closed, at most for three seconds."""
    command = [sys.executable, "-c", _HELD, str(program)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as disk:
        assert disk.stdout and disk.stdout.readline() == b"held\n"
        yield disk
