"""Starting, watching and ending the guardian's children: every system call of the guardian that talks to a child.

Each may fail at any point, because a child may die at any point: a death is an answer here, never an exception. Only a
child that the machine has no process for is an OSError. No call waits longer than its bound. Standard library only.
"""

import contextlib
import json
import os
import select
import signal
import socket
import warnings
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Final, NoReturn

from gateway.processes import message_link as guardian_link
from gateway.processes.module_command import module_command
from gateway.processes.scheduling.scheduler_counters import SchedulerCounters

_END_BOUND_S: Final = 1.0
_REAP_BOUND_S: Final = 2.0  # a killed process is gone in milliseconds, unless a driver holds it
_BLOCKED: Final = (signal.SIGHUP, signal.SIGINT)  # the guardian's to answer: some send them to every process
_NO_PROGRAM: Final = 127
LOST: Final = -1000
"""The exit code of a child that nobody could ask: it does not go, or somebody else has reaped it."""


@dataclass
class Child:
    """A child process. link: our end of its line; pid 0: asked for and not attach yet; died: its pidfd, readable once it
    is gone, -1 before its birth; turns: what the kernel gives it."""

    link: socket.socket
    pid: int = 0
    died: int = -1
    counters: SchedulerCounters | None = None
    _code: int | None = field(default=None, repr=False)

    def attach(self, pid: int) -> None:
        """Follow this process from now on; OSError when it has died already."""
        self.died = os.pidfd_open(pid)
        self.pid, self.counters = pid, SchedulerCounters(pid)

    def adopt(self, pid: int) -> None:
        """Follow a forked process that has told of its birth, and let it begin; OSError when it has died already."""
        self.attach(pid)
        guardian_link.send(self.link, guardian_link.ADOPTED)

    def kill(self) -> None:
        """Kill the process, if it still runs."""
        if self.pid and self._code is None:
            with contextlib.suppress(OSError):
                os.kill(self.pid, signal.SIGKILL)

    def wait(self, bound_s: float = _REAP_BOUND_S) -> int:
        """Return its exit code (-9: by SIGKILL), LOST when there is none to be had within the bound."""
        if self._code is None and self.pid:
            if self.died >= 0:
                _wait_readable(self.died, bound_s)
            self._code = _reap(self.pid)
        return LOST if self._code is None else self._code

    def end(self) -> None:
        """Ask, by the end of its line and by a signal, then insist; leaves nothing behind."""
        if self.pid and self._code is None:
            with contextlib.suppress(OSError):  # it is gone
                self.link.shutdown(socket.SHUT_RDWR)
            with contextlib.suppress(OSError):
                os.kill(self.pid, signal.SIGTERM)
            if self.wait(_END_BOUND_S) == LOST:
                self.kill()
                self.wait()
        self.close()

    def close(self) -> None:
        """Close everything held of the process."""
        self.link.close()
        if self.counters:
            self.counters.close()
        if self.died >= 0:
            os.close(self.died)
            self.died = -1


def describe_exit(code: int) -> str:
    """Return an exit code in words: `exit 1`, `SIGKILL`."""
    if code == LOST:
        return "no exit code"
    if code >= 0:
        return f"exit {code}"
    try:
        return signal.Signals(-code).name
    except ValueError:
        return f"signal {-code}"


def spawn_child(module: str, arguments: dict[str, Any], *shared: int, room: int = 0) -> Child:
    """Start `python -m MODULE LINK ARGUMENTS` in a session of its own: Ctrl-C reaches the guardian alone.

    shared: descriptors that it inherits under their numbers; room: bytes that the arguments take at least, for a
    process that will show other ones. OSError when there is no process for it.
    """
    ours, theirs = guardian_link.create_link()
    try:
        with theirs:
            words = [str(theirs.fileno()), json.dumps(arguments).ljust(room)]
            pid = _spawn_process([*module_command(module), *words], (theirs.fileno(), *shared))
        child = Child(ours, pid)
    except OSError:
        ours.close()
        raise
    try:
        child.attach(pid)
    except OSError:
        child.end()
        raise
    return child


def _spawn_process(command: list[str], passed: tuple[int, ...]) -> int:
    """Forked: behind posix_spawn and vfork the caller stands still until the program has been opened, however long its disk
    takes, and a guardian that starts the watch again would see no control die meanwhile."""
    mask = signal.pthread_sigmask(signal.SIG_SETMASK, signal.valid_signals())  # none of the child's is taken for ours
    try:
        with warnings.catch_warnings(
            action="ignore", category=DeprecationWarning
        ):  # of 3.12: no lock is taken in the child
            pid = os.fork()
        if pid:
            return pid
        _become(command, passed)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _become(command: list[str], passed: tuple[int, ...]) -> NoReturn:
    """Become another program, or end with the shell's code for one that is not there. What is not passed is closed before the
    disk is waited for: control would not hear of the guardian's death by a line whose end is held here, too."""
    try:
        signal.set_wakeup_fd(-1)
        os.setsid()
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        kept = sorted({0, 1, 2, *passed})
        for low, high in pairwise((*kept, os.sysconf("SC_OPEN_MAX"))):
            os.closerange(low + 1, high)
        for descriptor in passed:
            os.set_inheritable(descriptor, True)
        signal.pthread_sigmask(signal.SIG_SETMASK, _BLOCKED)
        os.execve(command[0], command, os.environ)
    except BaseException as error:
        os.write(2, f"{command[0]}: {error}\n".encode(errors="replace"))
    finally:
        os._exit(_NO_PROGRAM)


def reap_orphans(known: set[int]) -> None:
    """Reap the orphans of our children, whose subreaper we are, but none that somebody still asks for."""
    with contextlib.suppress(OSError):
        while (ended := os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)) and ended.si_pid not in known:
            os.waitpid(ended.si_pid, os.WNOHANG)


def create_shared_memory() -> int | None:
    """Return memory without a name and without a disk, for more than one process; None where the kernel has none."""
    try:
        return os.memfd_create("force-gateway")
    except (OSError, AttributeError):
        return None


def _wait_readable(descriptor: int, bound_s: float) -> bool:
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    return bool(poll.poll(bound_s * 1e3))


def _reap(pid: int) -> int | None:
    try:
        reaped, status = os.waitpid(pid, os.WNOHANG)
    except ChildProcessError:  # not ours: a fork server that could not hand it over
        return LOST
    return os.waitstatus_to_exitcode(status) if reaped else None
