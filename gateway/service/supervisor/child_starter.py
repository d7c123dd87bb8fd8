"""Starts the guardian's children: forked from a prepared process where there is one, else as new processes.

Nothing here may cost a restart: a fork server that dies, hangs or cannot fork is dropped and the child is started the long
way; it is started again after a while, and given up when it keeps dying. Standard library only.
"""

import os
import time
from collections.abc import Callable
from math import inf
from pathlib import Path
from typing import Any, Final

from gateway.service.supervisor import fork_server
from gateway.service.supervisor.child_process import Child, create_shared_memory, describe_exit, spawn_child
from gateway.service.supervisor.restart_policy import HELPER_PAUSES_S

_START_TIMEOUT_S: Final = 5.0  # from asking a prepared server: a busy machine is no reason to import everything again
_FIRST_START_TIMEOUT_S: Final = 30.0  # imports on a slow machine
_COMMAND_ROOM: Final = 1024
OPTIONAL: Final = {
    "watch": "gateway.watch.watch_process",
    "web": "gateway.web.web_process",
    "metrics": "gateway.telemetry.metrics_process",
    "mqtt": "gateway.telemetry.mqtt_process",
    "opcua": "gateway.telemetry.opcua_process",
}
"""Modules of the children that control can do without, by name."""


class ChildStarter:
    """rig, simulate: what the fork server reads once in advance; the first child leaves the rig in memory of ours, too, for
    those that come when that process is gone. Times are monotonic seconds."""

    def __init__(self, rig: str, *, simulate: bool, state: Path, say: Callable[[str], None]) -> None:
        self._options = {"rig": rig, "simulate": simulate}
        self._state = state
        self._say = say
        self._run = f"{os.getpid()}-{time.time_ns()}"  # what is set on the simulated rig holds for this long
        self._kept_rig: int | None = None
        self._server: Child | None = None
        self._is_proven = False
        self._is_doubted = False  # the last child came to nothing: the next one is started the long way
        self._deaths = 0
        self._due_s = inf

    @property
    def sources(self) -> list[int]:
        """Return the descriptors to wait for."""
        return [self._server.died] if self._server else []

    @property
    def due_s(self) -> float:
        """Time at which the fork server is started again, s."""
        return self._due_s

    @property
    def server_pid(self) -> int | None:
        """Process number of the fork server, None without one."""
        return self._server.pid if self._server else None

    @property
    def start_timeout_s(self) -> float:
        """Time that a requested child may take until it reports its birth: longer from a server that never gave one."""
        return _START_TIMEOUT_S if self._is_proven else _FIRST_START_TIMEOUT_S

    def open(self) -> None:
        """Start the fork server; without one everything works, and takes longer."""
        self._due_s = inf
        if not fork_server.become_subreaper():
            return
        try:
            self._server = spawn_child("gateway.service.supervisor.fork_server", self._options, room=_COMMAND_ROOM)
        except OSError:
            self._server = None

    def control(self, arguments: dict[str, Any]) -> Child:
        """Start the control process. OSError where no process can be started; so do the two below."""
        return self._child(fork_server.CONTROL, arguments)

    def rig(self, *, prepared: bool) -> Child:
        """Start the simulated rig; it outlives a kill of control, as a real rig does, and ends when its link does.

        prepared: with the rig as it was read at the start; not after a try that came to nothing, to avoid whatever went wrong.
        """
        arguments = {**self._options, "state": str(self._state), "run": self._run}
        return self._child(fork_server.RIG, arguments) if prepared else spawn_child(fork_server.RIG, arguments)

    def optional(self, name: str, arguments: dict[str, Any]) -> Child:
        """Start a child that control can do without; it speaks to control through the control socket."""
        arguments = {**arguments, "kept_rig": self._kept_rig}
        shared = (arguments[key] for key in ("ring", "listen", "kept_rig") if arguments.get(key) is not None)
        return spawn_child(OPTIONAL[name], arguments, *shared)

    def on_born(self) -> None:
        """Note that the server has given a child: later ones need less time."""
        self._is_proven = True

    def on_not_born(self) -> None:
        """Note that a requested child ended before its first message: the next one is started as a new process."""
        self._is_doubted = True

    def drop_server(self, how: str, now_s: float) -> None:
        """Kill a server that failed; children are started as new processes until it runs again. how: for the log."""
        if self._server is None:
            return
        self._server.kill()
        self._server.wait()
        self._server.close()
        self._server, self._is_proven = None, False
        self._deaths += 1
        is_last = self._deaths > len(HELPER_PAUSES_S)
        self._due_s = inf if is_last else now_s + HELPER_PAUSES_S[self._deaths - 1]
        then = "it stays off" if is_last else f"another one in {HELPER_PAUSES_S[self._deaths - 1]:g} s"
        self._say(f"A407 the prepared process {how}: {then}; a restart takes longer without it")

    def poll_child(self, readable: set[int], now_s: float) -> None:
        """Drop a fork server that has died, and start another one when it is time; to be called after each wait."""
        if self._server and self._server.died in readable:
            self.drop_server(f"ended ({describe_exit(self._server.wait())})", now_s)
        elif now_s >= self._due_s:
            self.open()

    def end(self) -> None:
        """End the fork server, and forget the rig."""
        if self._server:
            self._server.end()
            self._server = None
        if self._kept_rig is not None:
            os.close(self._kept_rig)
            self._kept_rig = None

    def _child(self, module: str, arguments: dict[str, Any]) -> Child:
        if self._kept_rig is None:
            self._kept_rig = create_shared_memory()
        arguments = {**arguments, "kept_rig": self._kept_rig}
        shared = [arguments[name] for name in fork_server.SHARED if arguments.get(name) is not None]
        if self._server and not self._is_doubted:
            try:
                return Child(fork_server.request_child(self._server.link, module, arguments, *shared))
            except OSError:
                pass  # it is about to be found dead
        self._is_doubted = False
        return spawn_child(module, arguments, *shared)
