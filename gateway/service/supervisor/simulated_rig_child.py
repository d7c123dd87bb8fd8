"""The guardian's part in the simulated rig: start it, hear its ports, start it again when it dies.

A real rig does not die with a process, so a simulated one is started again as well: it is another machine then, which
begins without pressure, and its ports have moved. Control is told where to; it finds its lines cut, as after an unplug.
Standard library only.
"""

import contextlib
from collections.abc import Callable
from math import inf
from typing import Any, Final

from gateway.processes import message_link
from gateway.service.supervisor.child_process import Child, describe_exit
from gateway.service.supervisor.guardian_sentences import tell_no_process

PAUSES_S: Final = (0.1, 1.0, 5.0)
"""Pauses before it is started again, short because control waits for it; one more death, and it stays off."""
_LONG_LIFE_S: Final = 60.0  # a rig that lived this long begins to count anew
_START_BOUND_S: Final = 20.0  # imports on a slow machine

Answer = dict[str, Any]


class RigSupervisor:
    """spawn: starts the process (True: it is the first, or the last one has worked), OSError when that fails; tell: an answer
    for control, as the RIG message has it; say: a sentence for people. Times are monotonic seconds."""

    def __init__(
        self, spawn: Callable[[bool], Child], tell: Callable[[Answer], None], say: Callable[[str], None]
    ) -> None:
        self._spawn, self._tell, self._say = spawn, tell, say
        self._child: Child | None = None
        self._answer: Answer | None = None  # None: it is on its way
        self._link_ended = False
        self._due_s = inf  # of the next start, or of the first word
        self._began_s = 0.0
        self._deaths = 0
        self._has_worked = True

    @property
    def pid(self) -> int | None:
        """Process number of the simulated rig, None without one."""
        return self._child.pid or None if self._child else None

    @property
    def due_s(self) -> float:
        """Time at which the simulated rig is started again, s."""
        return self._due_s

    @property
    def sources(self) -> list[int]:
        """Return the descriptors to wait for."""
        if self._child is None:
            return []
        link_end = [] if self._link_ended else [self._child.link.fileno()]
        return link_end + ([self._child.died] if self._child.died >= 0 else [])

    def ask(self, now_s: float) -> None:
        """Tell control the ports: at once where they are known, else as soon as they are."""
        if self._answer is not None:
            self._tell(self._answer)
        elif self._child is None and self._due_s == inf:
            self._begin(now_s)

    def poll_child(self, readable: set[int], now_s: float) -> None:
        """Take its messages, note its death, and start it again when it is time; to be called after each wait."""
        child = self._child
        if child and not self._link_ended and child.link.fileno() in readable:
            self._hear(child, now_s)
        if child and child is self._child and child.died >= 0 and child.died in readable:
            self._on_death_of_child(describe_exit(child.wait()), now_s)
        elif now_s >= self._due_s:
            self._overdue(now_s)

    def end(self) -> None:
        """End the simulated rig."""
        if self._child is not None:
            with contextlib.suppress(OSError):  # it is gone
                message_link.send(self._child.link, message_link.STOP)
            self._child.end()
            self._child = None

    def _begin(self, now_s: float) -> None:
        self._due_s, self._began_s, self._answer, self._link_ended = now_s + _START_BOUND_S, now_s, None, False
        try:
            self._child = self._spawn(self._has_worked)
        except OSError as error:
            self._on_death_of_child(tell_no_process(error), now_s)

    def _overdue(self, now_s: float) -> None:
        if self._child is None:
            self._begin(now_s)
            return
        self._child.kill()
        self._child.wait()
        self._on_death_of_child(f"no ports within {_START_BOUND_S:g} s", now_s)

    def _hear(self, child: Child, now_s: float) -> None:
        try:
            message = message_link.receive(child.link)
            if message is not None and message.tag == message_link.BORN:
                child.adopt(int(message.body["pid"]))
            elif message is not None and message.tag == message_link.PTYS:
                pid_field = {"pid": int(message.body["pid"])} if "pid" in message.body else {}
                self._due_s, self._answer = inf, {"ptys": dict(message.body["ptys"]), **pid_field}
        except (OSError, ValueError, KeyError, TypeError, OverflowError):
            child.kill()
            self._on_death_of_child("its first words made no sense", now_s)
            return
        if message is None:
            self._on_end_of_link(child, now_s)
        elif message.tag == message_link.PTYS and self._answer:
            self._tell(self._answer)

    def _on_end_of_link(self, child: Child, now_s: float) -> None:
        """Its death follows, which has the exit code; without a birth there is nothing to wait for."""
        self._link_ended = True
        if not child.pid:
            self._on_death_of_child("it could not be started", now_s)

    def _on_death_of_child(self, how: str, now_s: float) -> None:
        if self._child:
            self._child.close()
            self._child = None
        if now_s - self._began_s >= _LONG_LIFE_S:
            self._deaths = 0
        self._deaths += 1
        self._has_worked, self._answer = self._answer is not None, None
        if self._deaths > len(PAUSES_S):
            self._due_s, self._answer = inf, {"failed": True}
            self._say(
                f"A409 the simulated rig ended {self._deaths} times ({how}): it stays off; end the gateway and start it again"
            )
            self._tell(self._answer)
            return
        pause_s = PAUSES_S[self._deaths - 1]
        self._due_s = now_s + pause_s
        self._say(f"A408 the simulated rig ended ({how}): it is started again in {pause_s:g} s, without pressure")
