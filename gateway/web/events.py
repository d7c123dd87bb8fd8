"""What every open page is sent: one reader of the ring and of control's state for all viewers, as server-sent events.

Events: `history` (once: the last minute), `samples` (the new rows, 15 times a second), `state` (twice a second: LiveState,
register words, viewers), `note` (a line of the gateway's log), `gone` (control does not answer). A viewer that does not read is
dropped; its browser comes back by itself. Nothing is read while nobody looks.

The log's file is read in a thread: a disk that hangs would keep all requests waiting, a Stop among them. The page goes on with
the lines that it has, and says so.
"""

import asyncio
import contextlib
import time
from collections import deque
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from typing import Any, Final

from gateway.live.ring_rows import Columns, RingRows
from gateway.processes.event import make_event
from gateway.processes.event_file import EventReader
from gateway.processes.json_socket.messages import encode_answer
from gateway.web.commands import Commands
from gateway.web.context import WebContext

SHOWN: Final = (
    "time_s",
    "force_n",
    "setpoint_n",
    "applied_n",
    "command_v",
    "sent_v",
    "trim_v",
    "state",
    "model_residual_n",
    "pulling",
)
"""Columns of the ring that the page draws."""
_SAMPLES_S: Final = 1.0 / 15.0
_STATE_EVERY: Final = 7  # of the above: about twice a second
_HISTORY_S: Final = 60.0
_HISTORY_ROWS: Final = 1200
_MOST_ROWS: Final = 12  # of one event: what a screen can show
_WAITING: Final = 100  # events of a viewer: six seconds that its line may be busy
_KEPT_NOTES: Final = 60
_PATIENCE_S: Final = 1.0
"""How long who comes waits for the lines of before."""
_HANGS_S: Final = 10.0
_HANGS: Final = f"the disk has not given the log for {_HANGS_S:g} s: lines of since are missing here until it does"
MOST_VIEWERS: Final = 128
"""Half of the connections that the page's process serves at a time: whoever opens more must not shut out a Stop."""
LIVE_BLOCKS: Final = ("command", "status")


@dataclass(eq=False)
class Viewer:
    """An open page. name: which browser's; ended: it did not read, or has left."""

    name: str
    waiting: "asyncio.Queue[bytes]" = field(default_factory=lambda: asyncio.Queue(_WAITING))
    ended: asyncio.Event = field(default_factory=asyncio.Event)


class EventSource:
    """Reads for all viewers. rows: the ring, None where there is none."""

    def __init__(self, context: WebContext, rows: RingRows | None, commands: Commands) -> None:
        self._context, self._rows, self._commands = context, rows, commands
        self._viewers: set[Viewer] = set()
        self._task: asyncio.Task[None] | None = None
        self._notes: list[dict[str, Any]] = []
        self._log = EventReader(context.state)
        self._read = self._log.read_stored
        self._reading: asyncio.Task[None] | None = None
        self._state = b""

    @property
    def viewers(self) -> int:
        """Number of open pages."""
        return len(self._viewers)

    async def stream(self, name: str) -> AsyncIterator[bytes]:
        """Yield the events of one viewer until it leaves."""
        if len(self._viewers) >= MOST_VIEWERS:
            yield b"retry: 10000\n\n"
            yield _event("gone", {"sentence": f"{MOST_VIEWERS} pages are open, the most that are served: close one."})
            return
        viewer = Viewer(name)
        self._viewers.add(viewer)
        self._commands.join(name)
        try:
            if self._task is None:
                self._begin()
            for event in await self._first_events(viewer):
                yield event
            while not viewer.ended.is_set():
                yield await viewer.waiting.get()
        finally:
            self._viewers.discard(viewer)
            if not any(other.name == name for other in self._viewers):
                self._commands.leave(name)
            if not self._viewers and self._task:
                self._task.cancel()
                self._task = None

    async def _first_events(self, viewer: Viewer) -> list[bytes]:
        """Return what there is until now; only what comes behind it waits for the viewer."""
        if self._reading:
            await asyncio.wait([self._reading], timeout=_PATIENCE_S)
        viewer.waiting = asyncio.Queue(_WAITING)
        history = [b"retry: 1000\n\n", _event("history", self._history())]
        return [*history, *(_event("note", note) for note in self._notes), *([self._state] if self._state else [])]

    async def close(self) -> None:
        """End the reading; viewers end with their connections."""
        is_hung = self._reading is not None and not self._reading.done()
        for task in filter(None, (self._task, self._reading)):
            task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await task
        self._task = None
        if not is_hung:
            self._log.close()
        if self._rows:
            self._rows.close()

    # -- reading

    def _begin(self) -> None:
        self._look_for_notes()
        if self._rows:
            self._rows.fresh(1)  # what is there is history
        self._task = asyncio.create_task(self._run())

    async def _run(self) -> None:
        turn = 0
        while True:
            if turn % _STATE_EVERY == 0:
                await self._tell_state()
                self._look_for_notes()
            if self._rows and (columns := self._rows.fresh(10 * _MOST_ROWS)):
                self._send(_event("samples", _shown(columns, _MOST_ROWS)))
            turn += 1
            await asyncio.sleep(_SAMPLES_S)

    async def _tell_state(self) -> None:
        try:
            state = await self._context.control.ask({"do": "state"})
            words = {name: await self._commands.words(name) for name in LIVE_BLOCKS}
        except (OSError, ValueError, TimeoutError) as error:
            self._state = _event("gone", {"sentence": f"the gateway does not answer: {error}"})
            self._send(self._state)
            return
        more = {
            "words": words,
            "viewers": self.viewers,
            "commander": self._commands.commander,
            "clock_s": time.monotonic(),  # as the times of the samples: the newest may be old
        }
        self._state = _event("state", state | more)
        self._send(self._state)

    def _look_for_notes(self) -> None:
        """Begin to read what has been logged since, where the reading of before has come to its end."""
        if self._reading is None or self._reading.done():
            self._reading = asyncio.create_task(self._tell_notes())

    async def _tell_notes(self) -> None:
        reading = asyncio.ensure_future(asyncio.to_thread(self._read_notes))
        try:
            await asyncio.wait([reading], timeout=_HANGS_S)
            if not reading.done():
                self._add_notes([make_event(time.time(), "page", "events", _HANGS)._asdict()])
            self._add_notes(await reading)
        finally:
            reading.cancel()  # wait() leaves it be where the page's server ends first

    def _add_notes(self, fresh: list[dict[str, Any]]) -> None:
        self._notes = (self._notes + fresh)[-_KEPT_NOTES:]
        for note in fresh:
            self._send(_event("note", note))

    def _read_notes(self) -> list[dict[str, Any]]:
        """None where the disk gives none: force and state are shown all the same. Of a full log, 100 000 lines that would take
        80 MB, only the last are kept."""
        read, self._read = self._read, self._log.read_new
        fresh: deque[dict[str, Any]] = deque(maxlen=_KEPT_NOTES)
        with contextlib.suppress(OSError):
            fresh.extend(event._asdict() for event in read())
        return list(fresh)

    def _history(self) -> dict[str, Any]:
        if self._rows is None:
            return {}
        columns = self._rows.newest(1 << 16)
        if columns:
            recent = columns["time_s"] >= columns["time_s"][-1] - _HISTORY_S
            columns = {name: values[recent] for name, values in columns.items()}
        return _shown(columns, _HISTORY_ROWS)

    def _send(self, event: bytes) -> None:
        for viewer in tuple(self._viewers):
            try:
                viewer.waiting.put_nowait(event)
            except asyncio.QueueFull:
                viewer.ended.set()


def _shown(columns: Columns, most_rows: int) -> dict[str, Any]:
    """Return the drawn columns, rounded, every n-th row where there are too many; the newest is always there."""
    count = len(columns["time_s"]) if columns else 0
    step = max(1, -(-count // most_rows))
    first = (count - 1) % step if count else 0
    return {name: columns[name][first::step].round(4).tolist() for name in SHOWN if name in columns}


def _event(name: str, data: dict[str, Any]) -> bytes:
    return f"event: {name}\ndata: {encode_answer(data)}\n\n".encode()
