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
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import Any, Final

from gateway.processes import message_link as guardian_link
from gateway.processes.module_command import module_command, start_program
from gateway.processes.scheduling.scheduler_counters import SchedulerCounters

_END_BOUND_S: Final = 1.0
_REAP_BOUND_S: Final = 2.0  # a killed process is gone in milliseconds, unless a driver holds it
_BLOCKED: Final = (signal.SIGHUP, signal.SIGINT)  # the guardian's to answer: some send them to every process
_ONE_SHORTAGE_S: Final = 10.0
_STARVED: Final = ", while the kernel killed for want of memory: see dmesg"
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


class MemoryKills:
    """Whether the kernel has just killed for want of memory, be it a container's or the machine's: who is killed so is told
    nothing. count: how many it has killed."""

    def __init__(self, count: Callable[[], int], clock: Callable[[], float] = time.monotonic) -> None:
        self._count, self._clock = count, clock
        self._known, self._looked_s, self._last_s = count(), clock(), -inf

    def look(self) -> None:
        """Count now and then, that one of an hour ago is not taken for the reason of a death; to be called often."""
        if self._clock() - self._looked_s >= _ONE_SHORTAGE_S:
            self._read()

    def have_just_happened(self) -> bool:
        """Asked at each death: those of one shortage come one after the other."""
        self._read()
        return self._looked_s - self._last_s <= _ONE_SHORTAGE_S

    def _read(self) -> None:
        self._looked_s = self._clock()
        if (now := self._count()) != self._known:
            self._known, self._last_s = now, self._looked_s


def count_memory_kills() -> int:
    """Return how many processes the kernel has killed for want of memory since it began, see proc_vmstat(5); 0 where it does
    not say."""
    with contextlib.suppress(OSError, ValueError):
        for line in Path("/proc/vmstat").read_text().splitlines():
            if line.startswith("oom_kill "):
                return int(line.split()[1])
    return 0


memory_kills = MemoryKills(count_memory_kills)


def describe_exit(code: int) -> str:
    """Return an exit code in words: `exit 1`, `SIGKILL`, and of the last one whether memory may have been the reason."""
    if code == LOST:
        return "no exit code"
    if code >= 0:
        return f"exit {code}"
    is_starved = -code == signal.SIGKILL and memory_kills.have_just_happened()
    try:
        return signal.Signals(-code).name + _STARVED * is_starved
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
            pid = start_program([*module_command(module), *words], theirs.fileno(), *shared, blocked=_BLOCKED)
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
