"""What the page's parts share: where the gateway keeps its state, which rig it runs, and the way to it."""

import asyncio
import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from gateway.live.control_link import ControlLink
from gateway.processes.json_socket.connection import SocketLimits
from gateway.profiles import Rig
from gateway.profiles.kept_rig import unchanged_rig

_KEPT_S: Final = SocketLimits().idle_s / 3.0


@dataclass
class WebContext:
    """state: directory; rig: name or file, as `run` was given it; simulated: its devices are; control: the way to control's
    socket for commands and heartbeats; fingerprint: of the rig that runs, None: whatever it is; kept_rig: descriptor of the
    memory that it is in. tasks: work that a tab has begun, kept from being collected while it runs. viewers: how many pages are
    open, whatever tab they show."""

    state: Path
    rig: str
    simulated: bool
    control: ControlLink
    fingerprint: str | None = None
    kept_rig: int | None = None
    tasks: set["asyncio.Task[Any]"] = field(default_factory=set)
    viewers: Callable[[], int] = lambda: 0

    @cached_property
    def questions(self) -> ControlLink:
        """The way to control's socket for what any viewer asks: it answers one request of a way at a time, and however many
        ask, neither a Stop nor a heartbeat must wait with them."""
        return ControlLink(self.state)

    @cached_property
    def profile(self) -> Rig:
        """The rig that runs; read once, when it is first needed. ChangedRigError where it is not kept, and the files are
        others by now."""
        return unchanged_rig(self.rig, self.fingerprint, simulated=self.simulated, memory=self.kept_rig)

    def why_other(self, read_now: str) -> str:
        """Return the sentence to show with what the rig's files say, where that is not in use; empty where it is.
        read_now: their fingerprint."""
        if self.fingerprint in (None, read_now):
            return ""
        return "W247 the rig's files have changed since the gateway's start: what stands here is in use from the next start on"

    async def keep_ways_open(self) -> None:
        """Ask by each way now and then, until it is cancelled: control closes what has been idle, and where somebody has
        removed the state directory there is no other way for a Stop."""
        while True:
            for way in (self.control, self.questions):
                with contextlib.suppress(OSError, ValueError):
                    await way.ask({"do": "running"})
            await asyncio.sleep(_KEPT_S)

    def begin(self, work: Any) -> "asyncio.Task[Any]":
        """Run a coroutine beside the requests, and keep it until it has ended."""
        task: asyncio.Task[Any] = asyncio.create_task(work)
        self.tasks.add(task)
        task.add_done_callback(self.tasks.discard)
        return task

    async def end_work(self) -> None:
        """Cancel what runs beside the requests, and wait for its end."""
        for task in tuple(self.tasks):
            task.cancel()
        await asyncio.gather(*self.tasks, return_exceptions=True)
