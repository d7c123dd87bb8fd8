"""The gateway prunes at its start and every hour, in a thread of its own, and says what has gone."""

import asyncio
import os
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from gateway.profiles.recordings_section import Retention
from gateway.recording import recording_paths
from gateway.recording.care import keeping
from gateway.service.running_rig.recording import retention as module
from gateway.service.running_rig.recording.retention import RecordingRetention
from tests.recording.care.test_care import record


class Said:
    """A log that can be waited for."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.heard = asyncio.Event()

    def __call__(self, cause: str, sentence: str) -> None:
        self.lines.append(sentence)
        self.heard.set()


def record_of_late(state: Path) -> Path:
    """Record one by which the clock is believed: two days ago."""
    path = record(state)
    ended_s = time.time() - 2 * 86400.0
    os.utime(path, (ended_s, ended_s))
    return path


async def prune_at(state: Path, *times_s: float) -> list[str]:
    said = Said()
    record_of_late(state)
    retention = RecordingRetention(state, Retention(days=30.0), said)
    for now_s in times_s:
        record(state, days_ago=1_000)
        said.heard.clear()
        retention.tick(now_s)
        await asyncio.wait_for(said.heard.wait(), 10)
    retention.close()
    return said.lines


def test_it_prunes_at_the_start_and_again_an_hour_later(tmp_path: Path) -> None:
    lines = asyncio.run(prune_at(tmp_path, 50.0, 3650.0))
    assert [line.split(" (")[0] for line in lines] == ["pruned 1 recordings"] * 2
    assert "older than 30 days" in lines[0]
    assert [path.name for path in recording_paths(tmp_path)] == ["0001.fgr"]


def test_within_the_hour_and_without_a_limit_nothing_is_looked_at(tmp_path: Path) -> None:
    async def run() -> int:
        looks: list[object] = []
        for retention, ticks in ((Retention(days=1.0), 3), (Retention(), 3)):
            pruning = RecordingRetention(tmp_path, retention, Said())
            pruning._worker.close()
            pruning._worker = lambda work, done: looks.append(work)
            for tick in range(ticks):
                pruning.tick(10.0 + 1000.0 * tick)
        return len(looks)

    assert asyncio.run(run()) == 1


def test_a_disk_that_refuses_is_told_and_is_not_the_loops_business(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    threads: list[str] = []

    def refuse(*given: object) -> list[keeping.Prunable]:
        threads.append(threading.current_thread().name)
        raise OSError("read-only file system")

    monkeypatch.setattr("gateway.service.running_rig.recording.retention.prune_recordings", refuse)
    assert asyncio.run(prune_at(tmp_path, 1.0)) == ["recordings were not pruned: read-only file system"]
    assert threads != [threading.main_thread().name]


@pytest.mark.parametrize("is_reference", [True, False])
def test_the_rigs_reference_stays_however_old_it_is(
    tmp_path: Path, is_reference: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = record(tmp_path, days_ago=1_000)
    record_of_late(tmp_path)
    reference = SimpleNamespace(name=path.name) if is_reference else None
    monkeypatch.setattr(
        "gateway.service.running_rig.recording.retention.read_reference_recording", lambda state: reference
    )
    retention = RecordingRetention(tmp_path, Retention(days=30.0), Said())
    gone = retention._prune(0.0)
    retention.close()
    assert [one.path for one in gone] == ([] if is_reference else [path])


def test_what_has_gone_is_told_in_megabytes(tmp_path: Path) -> None:
    said = Said()
    gone = [keeping.Prunable(tmp_path / f"000{k}.fgr", 1_250_000 * k, "older than 30 days") for k in (1, 2)]
    RecordingRetention(tmp_path, Retention(days=30.0), said)._tell(gone)
    assert [line.split(":")[0] for line in said.lines] == ["pruned 2 recordings (3.8 MB)"]


def test_without_a_limit_and_behind_its_end_a_recording_that_has_ended_begins_nothing(tmp_path: Path) -> None:
    begun: list[object] = []
    for limit in (Retention(), Retention(days=30.0)):
        retention = RecordingRetention(tmp_path, limit, Said())
        if not limit.is_unlimited:
            retention.close()
        retention._worker = lambda work, done: begun.append(work)  # type: ignore[assignment]
        retention.hasten()
        retention.tick(1e6)
    assert begun == []


def test_a_recording_that_has_become_long_is_a_reason_to_look_where_there_is_a_limit(tmp_path: Path) -> None:
    async def run() -> list[int]:
        counts = []
        for retention in (Retention(days=1.0), Retention()):
            looks: list[object] = []
            pruning = RecordingRetention(tmp_path, retention, Said())  # type: ignore[arg-type]
            pruning._worker.close()
            pruning._worker = lambda work, done, looks=looks: looks.append(work)  # type: ignore[assignment,misc]
            pruning.tick(10.0)
            pruning.hasten()
            pruning.tick(11.0)
            pruning.tick(12.0)
            counts.append(len(looks))
        return counts

    assert asyncio.run(run()) == [2, 0]


def test_the_ladder_of_the_calibration_in_use_stays_however_old_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Kept by no mark: that it is needed is known by the calibrations alone."""
    paths = [record(tmp_path, days_ago=1_000) for _ in range(3)]
    record_of_late(tmp_path)
    monkeypatch.setattr(module, "kept_ladders", lambda state: frozenset({paths[1].name}))
    retention = RecordingRetention(tmp_path, Retention(days=30.0), Said())
    retention.close()
    assert [one.path for one in retention._prune(0.0)] == [paths[0], paths[2]]
    assert paths[1].is_file()


def test_why_nothing_was_pruned_is_told_in_words(tmp_path: Path) -> None:
    said = Said()
    RecordingRetention(tmp_path, Retention(days=30.0), said)._tell(
        PermissionError(13, "Permission denied", "/cell/0001.fgr")
    )
    assert said.lines == ["recordings were not pruned: /cell/0001.fgr: Permission denied"]
