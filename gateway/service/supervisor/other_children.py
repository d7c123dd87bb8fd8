"""What the guardian keeps besides control: the prepared process, the simulated rig, and children that control can do without.

Each looks after itself (see its supervisor); together they say what to wait for and until when, and who is there. Standard
library only.
"""

from collections.abc import Callable
from functools import partial
from math import inf
from typing import Any, Final

from gateway.processes.event_log import EventLog
from gateway.service.supervisor.child_process import memory_kills
from gateway.service.supervisor.child_starter import ChildStarter
from gateway.service.supervisor.optional_child import OptionalChildSupervisor
from gateway.service.supervisor.simulated_rig_child import Answer, RigSupervisor

_WORDS: Final = {
    "watch": "the residual watch",
    "web": "the page",
    "metrics": "the metrics",
    "mqtt": "the MQTT client",
    "opcua": "the OPC UA server",
}


class OtherChildren:
    """tell: an answer for control about the simulated rig. is_stopping: the gateway ends, so none that ends now is started
    again, or said to be; but the simulated rig, on which the force is ramped down. Times are monotonic seconds."""

    is_stopping = False

    def __init__(self, starter: ChildStarter, log: EventLog, tell: Callable[[Answer], None]) -> None:
        self._starter, self._log, self._tell = starter, log, tell
        self._rig: RigSupervisor | None = None
        self._optional: dict[str, OptionalChildSupervisor] = {}
        self._all: list[ChildStarter | RigSupervisor | OptionalChildSupervisor] = [starter]

    @property
    def sources(self) -> list[int]:
        """Descriptors that become readable when a child says something or has died."""
        return [source for one in self._watched for source in one.sources]

    @property
    def due_s(self) -> float:
        """Time at which `poll_children` has something to do without an event, s."""
        return min([one.due_s for one in self._watched], default=inf)

    @property
    def pids(self) -> dict[str, int | None]:
        """Process numbers by name; None for a child that is not there."""
        return {
            "rig": self._rig.pid if self._rig else None,
            **{name: child.pid for name, child in self._optional.items()},
            "fork_server": self._starter.server_pid,
        }

    def poll_children(self, readable: set[int], now_s: float) -> None:
        """Let each look after its process; to be called after each wait."""
        memory_kills.look()
        for one in self._watched:
            one.poll_child(readable, now_s)

    def provide_rig(self, now_s: float) -> None:
        """Provide the simulated rig's ports, which control asks for."""
        if self._rig is None:
            starter = self._starter
            self._rig = RigSupervisor(lambda first: starter.rig(prepared=first), self._tell, partial(self._log, "rig"))
            self._all.append(self._rig)
        self._rig.ask(now_s)

    def provide_optional(self, name: str, arguments: dict[str, Any], now_s: float) -> None:
        """Start a child that control can do without, now that control is ready. The first arguments count."""
        if name not in self._optional:
            spawn = partial(self._starter.optional, name, arguments)
            self._optional[name] = OptionalChildSupervisor(
                _WORDS[name], spawn, partial(self._log, name), arguments.get("listen")
            )
            self._all.append(self._optional[name])
        self._optional[name].start(now_s)

    def end(self) -> None:
        """Ask each, then insist."""
        for one in (self._rig, *self._optional.values(), self._starter):
            if one:
                one.end()

    @property
    def _watched(self) -> list[ChildStarter | RigSupervisor | OptionalChildSupervisor]:
        return [one for one in self._all if one is self._rig] if self.is_stopping else self._all
