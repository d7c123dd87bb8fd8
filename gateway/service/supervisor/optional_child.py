"""The guardian's part in a child that control can do without (the residual watch, the page, metrics, MQTT, OPC UA): start it,
start it again when it dies, each time later, and give up in time.

Such a child is a luxury: nothing here may keep the guardian from its work. It is started between two heartbeats (a spawn
takes a few milliseconds), its death is read like any other event, and a start that fails counts as a death. Standard
library only.
"""

import contextlib
import socket
from collections.abc import Callable
from math import inf
from typing import Final

from gateway.service.supervisor.child_process import Child, describe_exit
from gateway.service.supervisor.guardian_sentences import tell_no_process
from gateway.service.supervisor.restart_policy import HELPER_PAUSES_S

_LONG_LIFE_S: Final = 900.0  # a child that lived this long begins to count anew


class OptionalChildSupervisor:
    """what: the child in words; spawn: starts the process, OSError when that fails; say: a sentence for people; listen: the
    listening socket that is kept for it. Times are monotonic seconds."""

    def __init__(
        self, what: str, spawn: Callable[[], Child], say: Callable[[str], None], listen: int | None = None
    ) -> None:
        self._what = what
        self._spawn = spawn
        self._say = say
        self._listen = listen
        self._child: Child | None = None
        self._due_s = inf
        self._began_s = 0.0
        self._deaths = 0

    @property
    def pid(self) -> int | None:
        """Process number of the child, None without one."""
        return self._child.pid if self._child else None

    @property
    def due_s(self) -> float:
        """Time at which `poll_child` has something to do without an event; infinite where nothing is planned."""
        return self._due_s

    @property
    def sources(self) -> list[int]:
        """Descriptors that become readable when the child has died."""
        return [self._child.died] if self._child else []

    def start(self, now_s: float) -> None:
        """Start the child for the first time; one that runs goes on."""
        if self._child is None and self._deaths == 0:
            self._begin(now_s)

    def poll_child(self, readable: set[int], now_s: float) -> None:
        """Note its death, and start it again when it is time; to be called after each wait."""
        if self._child is not None and self._child.died in readable:
            code = self._child.wait()
            self._child.close()
            self._child = None
            self._on_death_of_child(f"ended ({describe_exit(code)})", now_s)
        elif now_s >= self._due_s:
            self._begin(now_s)

    def end(self) -> None:
        """End the child."""
        if self._child is not None:
            self._child.end()
            self._child = None

    def _begin(self, now_s: float) -> None:
        self._due_s, self._began_s = inf, now_s
        try:
            self._child = self._spawn()
        except OSError as error:
            self._on_death_of_child(f"did not start ({tell_no_process(error)})", now_s)

    def _on_death_of_child(self, how: str, now_s: float) -> None:
        if now_s - self._began_s >= _LONG_LIFE_S:
            self._deaths = 0
        self._deaths += 1
        if self._deaths > len(HELPER_PAUSES_S):
            self._say(f"A346 {self._what} {how} {self._deaths} times: it stays off, control goes on without it")
            if self._listen is not None:
                _refuse_callers(self._listen)
            return
        pause_s = HELPER_PAUSES_S[self._deaths - 1]
        self._due_s = now_s + pause_s
        self._say(f"A346 {self._what} {how}: it is started again in {pause_s:g} s, control goes on")


def _refuse_callers(listen: int) -> None:
    """Let the kernel refuse who calls from now on, and who waits already. The descriptor stays ours: without it the next
    control process would open another one, which nobody answers either."""
    with contextlib.suppress(OSError):  # then they wait, and the guardian goes on
        listener = socket.socket(fileno=listen)
        try:
            listener.shutdown(socket.SHUT_RD)
        finally:
            listener.detach()
