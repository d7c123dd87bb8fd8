"""How a process of ours is started: with the modules of the one that starts it, and with no others; and without a wait for the
disk that its program is on.

`python -m` looks into the current folder first. Somebody's serial.py or json.py there was taken for the real one: the gateway
did not start, or, where the file came later, did not start again. Whoever may write there had the wire. Standard library only.
"""

import os
import signal
import sys
import warnings
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Final, NoReturn

_NO_PROGRAM: Final = 127


def module_command(module: str) -> list[str]:
    """Return the words that run this module. The current folder counts where it does for this process (`python -m gateway` in
    a checkout)."""
    return [sys.executable, *(() if _is_current_folder_searched() else ("-P",)), "-m", module]


def _is_current_folder_searched() -> bool:
    try:
        return not {"", str(Path.cwd())}.isdisjoint(sys.path)
    except OSError:  # it has been removed
        return "" in sys.path


def start_program(
    command: list[str], *passed: int, output: int | None = None, blocked: Sequence[signal.Signals] = ()
) -> int:
    """Start a program in a session of its own, without an input; return its process number. OSError without a process for it.

    passed: descriptors that it inherits under their numbers; output: its stdout, None: ours; blocked: signals besides ours.
    Forked: behind posix_spawn, vfork and Popen the caller stands still until the program has been opened, however long its disk
    takes; a guardian that started the watch again saw no control die meanwhile, and control that started a fit was taken for
    hung.
    """
    mask = signal.pthread_sigmask(signal.SIG_SETMASK, signal.valid_signals())  # none of the child's is taken for ours
    try:
        # of 3.12, for a process with threads: no lock is taken in the child
        with warnings.catch_warnings(action="ignore", category=DeprecationWarning):
            pid = os.fork()
        if pid:
            return pid
        _become(command, passed, 1 if output is None else output, mask | set(blocked))
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _become(command: list[str], passed: tuple[int, ...], output: int, mask: set[int]) -> NoReturn:
    """Become another program, or end with the shell's code for one that is not there. What is not passed is closed before the
    disk is waited for: control would not hear of the guardian's death by a line whose end is held here, too."""
    try:
        signal.set_wakeup_fd(-1)
        os.setsid()
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(output, 1)
        kept = sorted({0, 1, 2, *passed})
        for low, high in pairwise((*kept, os.sysconf("SC_OPEN_MAX"))):
            os.closerange(low + 1, high)
        for descriptor in passed:
            os.set_inheritable(descriptor, True)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        os.execve(command[0], command, os.environ)
    except BaseException as error:
        os.write(2, f"{command[0]}: {error}\n".encode(errors="replace"))
    finally:
        os._exit(_NO_PROGRAM)
