"""One reader for all viewers: each gets every row, one that does not read is dropped, and nothing is read for nobody."""

import asyncio
import json
import os
import time
from collections.abc import AsyncGenerator, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gateway.live.ring_rows import RingRows
from gateway.processes.event_file import EventFile
from gateway.processes.event_log import EventLog
from gateway.recording.ring import SampleRing
from gateway.service.running_rig.recording.recorded_row import COLUMNS
from gateway.web import events
from gateway.web.events import EventSource


class Control:
    """Answers a state; counts how often it was asked."""

    def __init__(self) -> None:
        self.asked = 0
        self.is_gone = False

    async def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        self.asked += 1
        if self.is_gone:
            raise ConnectionError("no gateway answers")
        return {"state": "off", "residual": float("nan")}


class Context:
    def __init__(self, state: Path) -> None:
        self.state, self.control = state, Control()


class Commands:
    commander = ""

    def __init__(self) -> None:
        self.present: list[str] = []

    def join(self, name: str) -> None:
        self.present.append(name)

    def leave(self, name: str) -> None:
        self.present.remove(name)

    async def words(self, block: str) -> list[int]:
        return [1, 2]


@pytest.fixture
def ring() -> Iterator[tuple[int, SampleRing]]:
    number = os.memfd_create("ring")
    ring = SampleRing(number, COLUMNS, 4096)
    yield number, ring
    ring.close()
    os.close(number)


def put(ring: SampleRing, first: int, count: int) -> None:
    for number in range(first, first + count):
        ring.append((number / 100, *(float(number) for _ in COLUMNS[1:])))


def read(event: bytes) -> tuple[str, Any]:
    head, _, data = event.decode().partition("\ndata: ")
    return head.removeprefix("event: "), json.loads(data) if data else None


def test_a_state_says_when_it_was_told_by_the_clock_of_the_samples(tmp_path: Path) -> None:
    """The page takes a force for old by it."""

    async def scene() -> float:
        source = EventSource(Context(tmp_path), None, Commands())  # type: ignore[arg-type]
        await source._tell_state()
        await source.close()
        return float(read(source._state)[1]["clock_s"])

    assert asyncio.run(scene()) == pytest.approx(time.monotonic(), abs=60.0)


async def collect(source: EventSource, name: str, until: int) -> list[float]:
    """Times of the rows that one viewer was sent, history included, until it has had as many samples."""
    times: list[float] = []
    stream = source.stream(name)
    async for event in stream:
        kind, data = read(event)
        if kind in ("history", "samples"):
            times += data.get("time_s", [])
        if len(times) >= until:
            break
    await stream.aclose()
    return times


def test_every_viewer_gets_every_row_and_control_is_asked_once_for_all(
    tmp_path: Path, ring: tuple[int, SampleRing], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(events, "_SAMPLES_S", 0.005)

    async def scene() -> None:
        context, commands = Context(tmp_path), Commands()
        source = EventSource(context, RingRows(ring[0]), commands)  # type: ignore[arg-type]
        put(ring[1], 0, 50)

        async def feed() -> None:
            for number in range(60):
                put(ring[1], 50 + number, 1)
                await asyncio.sleep(0.003)

        viewers = [collect(source, f"viewer {number}", 90) for number in range(5)]
        times, *_ = await asyncio.gather(asyncio.gather(*viewers), feed())
        for each in times:
            assert sorted(set(each)) == [pytest.approx(number / 100) for number in range(len(set(each)))]
        asked = context.control.asked
        assert 1 <= asked < 30, "twice a second for all, not for each"
        assert source.viewers == 0 and commands.present == []
        await asyncio.sleep(0.03)
        assert context.control.asked == asked, "nothing is read while nobody looks"
        await source.close()

    asyncio.run(scene())


def test_a_browser_that_closes_one_of_two_tabs_is_still_there(tmp_path: Path) -> None:
    async def scene() -> None:
        commands = Commands()
        source = EventSource(Context(tmp_path), None, commands)  # type: ignore[arg-type]
        tabs = [source.stream("me"), source.stream("me")]
        for tab in tabs:
            await anext(tab)
        await tabs[0].aclose()
        assert commands.present == ["me", "me"], "it has not left"
        await tabs[1].aclose()
        assert commands.present == ["me"]
        await source.close()

    asyncio.run(scene())


def test_more_viewers_than_are_served_are_told_so_and_keep_no_connection(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(events, "MOST_VIEWERS", 2)

    async def scene() -> None:
        source = EventSource(Context(tmp_path), None, Commands())  # type: ignore[arg-type]
        first = [source.stream(name) for name in "ab"]
        for one in first:
            await anext(one)
        told = [read(event) async for event in source.stream("c")]
        assert told[-1][0] == "gone" and "close one" in told[-1][1]["sentence"]
        assert source.viewers == 2
        for one in first:
            await one.aclose()
        await source.close()

    asyncio.run(scene())


def test_a_viewer_that_does_not_read_is_dropped_and_the_others_go_on(
    tmp_path: Path, ring: tuple[int, SampleRing], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(events, "_SAMPLES_S", 0.001)

    async def scene() -> None:
        source = EventSource(Context(tmp_path), RingRows(ring[0]), Commands())  # type: ignore[arg-type]
        put(ring[1], 0, 5)
        stuck = source.stream("stuck")
        await anext(stuck)
        for number in range(150):
            put(ring[1], 5 + number, 1)
            await asyncio.sleep(0.0015)
        async with asyncio.timeout(5.0):
            rest = [event async for event in stuck]
        assert 0 < len(rest) <= 110, "what waited is still sent, and then the stream ends"
        assert len(await collect(source, "reads", 50)) >= 50
        await source.close()

    asyncio.run(scene())


def test_who_comes_while_the_gateway_is_gone_is_shown_no_state_of_before(
    tmp_path: Path, ring: tuple[int, SampleRing], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(events, "_SAMPLES_S", 0.001)

    async def until(stream: AsyncGenerator[bytes], wanted: str) -> list[str]:
        kinds: list[str] = []
        while wanted not in kinds:
            kinds.append(read(await anext(stream))[0])
        return kinds

    async def scene() -> None:
        context = Context(tmp_path)
        source = EventSource(context, RingRows(ring[0]), Commands())  # type: ignore[arg-type]
        first, late = source.stream("first"), source.stream("late")
        await until(first, "state")
        context.control.is_gone = True
        await until(first, "gone")
        assert "state" not in await until(late, "gone")
        await first.aclose()
        await late.aclose()
        await source.close()

    asyncio.run(asyncio.wait_for(scene(), 20.0))


def test_a_gateway_that_does_not_answer_is_said_and_what_it_logged_is_shown(
    tmp_path: Path, ring: tuple[int, SampleRing]
) -> None:
    async def scene() -> list[tuple[str, Any]]:
        context = Context(tmp_path)
        context.control.is_gone = True
        source = EventSource(context, RingRows(ring[0]), Commands())  # type: ignore[arg-type]
        told = []
        stream = source.stream("me")
        async for event in stream:
            told.append(read(event))
            if told[-1][0] == "gone":
                break
        await stream.aclose()
        await source.close()
        return told

    with EventLog(lambda line: None, source="control", file=EventFile(tmp_path)) as log:
        log("control", "A310 master lost")
    told = asyncio.run(scene())
    assert [(data["code"], data["text"]) for kind, data in told if kind == "note"] == [("A310", "master lost")]
    assert "does not answer" in told[-1][1]["sentence"]


@pytest.mark.parametrize("count", [0, 1, 11, 12, 13, 24, 25, 999])
def test_a_screen_gets_no_more_rows_than_it_can_show_evenly_spaced_and_the_newest_one(count: int) -> None:
    times = np.arange(count, dtype=float)
    shown = events._shown({"time_s": times, "unknown": times}, 12) if count else events._shown({}, 12)
    rows = shown.get("time_s", [])
    assert set(shown) <= {"time_s"}
    assert min(count, 12) / 2 <= len(rows) <= 12 or count == 0 == len(rows)
    assert rows[-1:] == list(times[-1:])
    assert len(set(np.diff(rows))) <= 1


def test_who_comes_late_is_shown_the_last_minute_and_what_was_logged(
    tmp_path: Path, ring: tuple[int, SampleRing], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The ring holds more than a minute where rows are few."""
    monkeypatch.setattr(events, "_KEPT_NOTES", 3)
    for number in range(2000):
        ring[1].append((number / 10, *(0.0 for _ in COLUMNS[1:])))
    with EventLog(lambda line: None, source="control", file=EventFile(tmp_path)) as log:
        for number in range(5):
            log("control", f"line {number}")

    async def scene() -> list[tuple[str, Any]]:
        source = EventSource(Context(tmp_path), RingRows(ring[0]), Commands())  # type: ignore[arg-type]
        told = []
        for _ in range(2):  # the second comes back: what was logged is shown again, once
            stream = source.stream("me")
            told = [read(await anext(stream)) for _ in range(5)]
            await stream.aclose()
        await source.close()
        return told

    _, (kind, history), *notes = asyncio.run(scene())
    assert kind == "history"
    assert history["time_s"][-1] - history["time_s"][0] == pytest.approx(60.0, abs=0.2)
    assert [data["text"] for _, data in notes] == [f"line {number}" for number in range(2, 5)]


def test_one_that_leaves_does_not_end_the_reading_for_the_others(
    tmp_path: Path, ring: tuple[int, SampleRing], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(events, "_SAMPLES_S", 0.001)

    async def scene() -> None:
        source = EventSource(Context(tmp_path), RingRows(ring[0]), Commands())  # type: ignore[arg-type]
        stays, leaves = source.stream("stays"), source.stream("leaves")
        for one in (stays, leaves):
            await anext(one)
        await leaves.aclose()
        put(ring[1], 0, 50)
        async with asyncio.timeout(5.0):
            while read(await anext(stays))[0] != "samples":
                pass
        await stays.aclose()
        assert source._task is None, "nobody looks any more"
        await source.close()

    asyncio.run(scene())
