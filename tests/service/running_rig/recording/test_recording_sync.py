"""Putting a recording on the disk: once it has begun and once it has ended, in a thread that no row waits for."""

import asyncio
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from gateway.processes.disk_worker import DiskWorker
from gateway.recording import Recorder, read_recording
from gateway.service.running_rig.recording.recorded_row import COLUMNS
from gateway.service.running_rig.recording.recordings import Recordings
from gateway.service.running_rig.recording.run_recording import RunRecording
from tests.disk.at_once import AtOnce
from tests.disk.threads import join_disk_threads
from tests.service.kept_log import Log
from tests.service.rigs import demo
from tests.service.running_rig.recording.test_run_recording import rows_until


def test_rows_do_not_wait_for_a_sync(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the real threads: control that is killed meanwhile leaves them."""
    is_synced = threading.Event()
    monkeypatch.setattr(
        "gateway.service.running_rig.recording.run_recording.sync_recording", lambda path: is_synced.wait(20.0)
    )

    async def main() -> int:
        disk, syncing, opened, closed = DiskWorker(), DiskWorker(), asyncio.Event(), asyncio.Event()
        recording = RunRecording(disk, syncing, lambda: Recorder(tmp_path, {"rig": "demo"}, COLUMNS), Log())
        recording.begin(lambda error: opened.set())
        await opened.wait()
        rows_until(recording, 1.0)  # type: ignore[arg-type]
        recording.close(closed.set)
        try:
            await asyncio.wait_for(closed.wait(), 10.0)
            assert recording.path and not is_synced.is_set()
            return read_recording(recording.path).rows
        finally:
            is_synced.set()
            for worker in (disk, syncing):
                worker.close()

    assert asyncio.run(main()) == 11
    join_disk_threads()


def test_a_file_is_put_on_the_disk_once_it_has_begun_and_once_it_has_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without its header a file is nothing; a power cut in between may cost rows."""
    synced: list[int] = []
    monkeypatch.setattr(
        "gateway.service.running_rig.recording.run_recording.sync_recording",
        lambda path: synced.append(read_recording(path).rows),
    )
    recordings = Recordings(tmp_path / "recordings", demo(), Log(), AtOnce())  # type: ignore[arg-type]
    recordings.start()
    rows_until(recordings, 1.0)
    assert synced == [0]
    recordings.stop()
    assert synced == [0, 11]


def test_what_may_not_outlive_a_power_cut_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(path: Path) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr("gateway.service.running_rig.recording.run_recording.sync_recording", refuse)
    log = Log()
    recordings = Recordings(tmp_path / "recordings", demo(), log, AtOnce())  # type: ignore[arg-type]
    recordings.start()
    assert "0001.fgr may not outlive a power cut: Input/output error" in log[0]
    assert recordings.status()["recording"]
    recordings.stop()


def test_where_there_is_no_second_thread_the_one_that_writes_syncs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Refused(AtOnce):
        def begin(self, work: Callable[[], object]) -> None:
            raise OSError(11, "no thread for the disk")

    synced: list[Path] = []
    monkeypatch.setattr("gateway.service.running_rig.recording.run_recording.sync_recording", synced.append)
    make = lambda: Recorder(tmp_path, {"rig": "demo"}, COLUMNS)  # noqa: E731
    recording = RunRecording(AtOnce(), Refused(), make, Log())  # type: ignore[arg-type]
    recording.begin(lambda error: None)
    recording.close(lambda: None)
    assert synced == [recording.path, recording.path]
