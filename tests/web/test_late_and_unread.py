"""Where control is slow nothing that comes late presses; where the log cannot be read the force is shown all the same."""

import asyncio
import json
import threading
import time
import weakref
from collections.abc import AsyncGenerator, Iterator
from pathlib import Path
from typing import Any

import pytest

from gateway.live.control_link import ANSWER_S, ControlLink
from gateway.live.ring_rows import RingRows
from gateway.processes.event import EventRecord
from gateway.processes.event_file import EventFile
from gateway.processes.event_log import EventLog
from gateway.recording.ring import SampleRing
from gateway.web import events
from gateway.web.commands import Commands
from gateway.web.context import WebContext
from gateway.web.events import EventSource
from gateway.web.security import PageAccess
from gateway.web.server import make_app
from tests.service.requests.test_hostile_requests import Stage
from tests.web import test_events
from tests.web.asgi import call, page
from tests.web.commanded_gateway import Link, play
from tests.web.test_events import Context, put, read, ring

__all__ = ["ring"]

TOKEN = "a token of sixteen characters"


@pytest.mark.parametrize("is_before", [True, False])
def test_a_log_that_cannot_be_read_keeps_nobody_from_force_and_state(
    tmp_path: Path, ring: tuple[int, SampleRing], monkeypatch: pytest.MonkeyPatch, is_before: bool
) -> None:
    """The reading for all ended: each page showed the force of then, and one that held lost its lease."""
    monkeypatch.setattr(events, "_SAMPLES_S", 0.001)

    async def scene() -> None:
        source = EventSource(Context(tmp_path), RingRows(ring[0]), test_events.Commands())  # type: ignore[arg-type]
        stream = source.stream("me")
        if not is_before:
            await anext(stream)
        (tmp_path / "events.jsonl").mkdir()
        kinds: list[str] = []
        async with asyncio.timeout(5.0):
            while kinds.count("state") < 4 or kinds.count("samples") < 4:
                put(ring[1], len(kinds), 2)
                kinds.append(read(await anext(stream))[0])
        assert "gone" not in kinds and "note" not in kinds
        await stream.aclose()
        await source.close()

    asyncio.run(scene())


def test_a_disk_that_hangs_under_the_log_keeps_nobody_waiting_and_is_said(
    tmp_path: Path, ring: tuple[int, SampleRing], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was read by the loop that serves the page: no request was answered, and no Stop came through, while it hung."""
    for name, value in (("_SAMPLES_S", 0.001), ("_PATIENCE_S", 0.01), ("_HANGS_S", 0.02)):
        monkeypatch.setattr(events, name, value)
    goes_on, read_stored = threading.Event(), events.EventReader.read_stored

    def hang(reader: events.EventReader) -> Iterator[EventRecord]:
        goes_on.wait(10.0)
        return read_stored(reader)

    monkeypatch.setattr(events.EventReader, "read_stored", hang)
    with EventLog(lambda line: None, source="control", file=EventFile(tmp_path)) as log:
        log("control", "A310 master lost")

    async def until(stream: AsyncGenerator[bytes], wanted: str) -> dict[str, Any]:
        while (event := read(await anext(stream)))[0] != wanted:
            pass
        return dict(event[1])

    async def scene() -> list[str]:
        source = EventSource(Context(tmp_path), RingRows(ring[0]), test_events.Commands())  # type: ignore[arg-type]
        stream = source.stream("me")
        async with asyncio.timeout(8.0):
            await until(stream, "history")
            await until(stream, "state")
            said = [(await until(stream, "note"))["text"]]
            await until(stream, "state")
            goes_on.set()
            said.append((await until(stream, "note"))["text"])
        await stream.aclose()
        await source.close()
        return said

    first, second = asyncio.run(scene())
    assert "the disk has not given the log" in first and second == "master lost"


def test_a_server_that_ends_while_the_log_is_read_leaves_no_reading_behind(
    tmp_path: Path, ring: tuple[int, SampleRing], monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a busy machine the reading of the log outlived the server, and a gate failed on it once in dozens of runs."""
    begun, goes_on = threading.Event(), threading.Event()

    def read_slowly(reader: events.EventReader) -> Iterator[EventRecord]:
        begun.set()
        goes_on.wait(10.0)
        return iter(())

    monkeypatch.setattr(events.EventReader, "read_stored", read_slowly)

    async def scene() -> set[str]:
        source = EventSource(Context(tmp_path), RingRows(ring[0]), test_events.Commands())  # type: ignore[arg-type]
        stream = source.stream("me")
        await anext(stream)
        await asyncio.to_thread(begun.wait, 10.0)
        await stream.aclose()
        await source.close()
        left_over = {task.get_name() for task in asyncio.all_tasks() if task is not asyncio.current_task()}
        goes_on.set()
        return left_over

    assert asyncio.run(scene()) == set()


class Fields(dict[str, Any]):
    """An event as it is shown, of which is known whether it is still there."""


class Line:
    """An event of the log."""

    def __init__(self, number: int, held: list["weakref.ref[Fields]"]) -> None:
        self.number, self.held = number, held

    def _asdict(self) -> Fields:
        fields = Fields(text=f"line {self.number}")
        self.held.append(weakref.ref(fields))
        return fields


def test_of_a_long_log_no_more_is_held_than_is_shown(tmp_path: Path) -> None:
    """All of it was, 80 MB of a full one, to show the last sixty lines."""
    held: list[weakref.ref[Fields]] = []

    def log() -> Iterator[Any]:
        for number in range(500):
            yield Line(number, held)
            assert sum(one() is not None for one in held) <= events._KEPT_NOTES + 1

    source = EventSource(Context(tmp_path), None, test_events.Commands())  # type: ignore[arg-type]
    source._read = log
    shown = source._read_notes()
    assert [note["text"] for note in shown] == [f"line {number}" for number in range(440, 500)]


def test_all_but_a_stop_says_until_when_it_is_wanted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[dict[str, Any]] = []
    ask = Link.ask
    monkeypatch.setattr(Link, "ask", lambda self, request: (asked.append(request), ask(self, request))[1])

    async def scene(commands: Commands, stage: Stage) -> None:
        commands.join("me")
        await commands.enable("me", 12.0)
        await commands.set_force("me", 8.0)
        await commands.stop()
        assert {request.get("until_s", 0.0) - stage.wired.now_s for request in asked[:-1]} == {ANSWER_S}
        assert "until_s" not in asked[-1]

    play(tmp_path, scene)


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [
        ("POST", "command/record", b'{"on": true}'),
        ("GET", "state", None),
        ("GET", "registers", None),
        ("GET", "words/status", None),
    ],
)
def test_a_stop_waits_neither_for_a_recording_whose_disk_hangs_nor_for_what_others_ask(
    tmp_path: Path, method: str, path: str, body: bytes | None
) -> None:
    """All went by one way, on which control answers one after the other. Beside a recording Esc came two seconds late, beside
    two hundred who asked for the state more than one, and so did each heartbeat, which is the end of a lease."""

    async def scene() -> bool:
        is_asked, served = asyncio.Event(), set[asyncio.Task[None] | None]()

        async def control(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            served.add(asyncio.current_task())
            while line := await reader.readline():
                if json.loads(line).get("pdu", "").startswith("10"):
                    writer.write(b'{"ok": true, "pdu": "1000000001"}\n')
                else:  # its answer never comes
                    is_asked.set()
            writer.close()

        context = WebContext(tmp_path, "demo", True, ControlLink(tmp_path))
        app, headers = (
            make_app(context, PageAccess("127.0.0.1", 8080, TOKEN), None),
            {"authorization": f"Bearer {TOKEN}"},
        )
        async with await asyncio.start_unix_server(control, tmp_path / "control.sock"):
            other = asyncio.create_task(call(app, method, f"/api/v1/{path}", headers, body))
            await is_asked.wait()
            stopped = await call(app, "POST", "/api/v1/command/stop", headers)
            is_first = stopped.status == 200 and not other.done()
            other.cancel()
            await asyncio.gather(other, return_exceptions=True)
            await context.control.close()
            await context.questions.close()
            await asyncio.gather(*filter(None, served), return_exceptions=True)
        return is_first

    assert asyncio.run(asyncio.wait_for(scene(), 10.0))


@pytest.mark.parametrize(
    ("path", "asked_before_s", "reason"),
    [
        ("/api/v1/command/enable", "5.5", "late"),
        ("/api/v1/calibrate/start", "60", "late"),
        ("/api/v1/command/enable", "nan", "late"),
        ("/api/v1/command/enable", "1", "gone"),  # nobody is behind this page
        ("/api/v1/command/enable", "-1", "gone"),
        ("/api/v1/command/stop", "60", "gone"),
    ],
)
def test_what_a_line_has_held_up_presses_nothing_and_a_stop_stops(
    tmp_path: Path, path: str, asked_before_s: str, reason: str
) -> None:
    """A browser gave its enable up after five seconds without a network; three later it came, and the tool pressed."""
    app, asked_s = page(tmp_path, TOKEN), time.monotonic() - float(asked_before_s)
    headers = {"authorization": f"Bearer {TOKEN}", "x-asked-s": str(asked_s)}
    told = asyncio.run(call(app, "POST", path, headers, b'{"force_n": 12}'))
    assert (told.status, told.json["reason"]) == (503, reason)
    headers["x-asked-s"] = "yesterday"
    told = asyncio.run(call(app, "POST", "/api/v1/command/enable", headers, b'{"force_n": 12}'))
    assert told.json["reason"] == "late"
