"""A recording beside the loop: whatever the disk does, the loop goes on, and no row that it can still take is lost."""

import asyncio
import threading
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.codes.faults import FaultCode
from gateway.control import CalibrationInUse, Controller
from gateway.devices.messages import ForceSample, Quality
from gateway.processes.disk_worker import DiskWorker
from gateway.recording import Recorder, list_recordings, read_recording
from gateway.recording.label import RecordingLabel
from gateway.service.running_rig.lines.output_line import LineState
from gateway.service.running_rig.recording.recorded_row import COLUMNS
from gateway.service.running_rig.recording.recordings import Recordings
from gateway.service.running_rig.recording.run_recording import HANGS_S, RunRecording
from gateway.service.running_rig.recording.wanted_recording import WantedRecording
from tests.control.bench import bsfm
from tests.disk.at_once import AtOnce
from tests.disk.threads import join_disk_threads
from tests.service.kept_log import Log
from tests.service.rigs import demo

DECISION = Controller(demo().control, CalibrationInUse(bsfm(), 1)).safe_output(FaultCode.NONE)
LINE = LineState(0.0, 0.0, 0.0)


class HangingDisk:
    """Stands for `DiskWorker`: it takes everything and does nothing, until it is let go."""

    def __init__(self) -> None:
        self._waiting: list[Callable[[], None]] = []

    def __call__(self, work: Callable[[], Any], done: Callable[[Any], None]) -> None:
        def answered() -> None:
            try:
                result = work()
            except OSError as error:
                result = error
            done(result)

        self._waiting.append(answered)

    def begin(self, work: Callable[[], None]) -> None:
        self._waiting.append(work)

    def close(self) -> None: ...

    def let_go(self, all_but: int = 0) -> None:
        while len(self._waiting) > all_but:
            self._waiting.pop(0)()


def rows_until(recording: RunRecording | Recordings, end_s: float, begin_s: float = 0.0) -> None:
    for step in range(round(begin_s * 10), round(end_s * 10) + 1):
        recording.append(ForceSample(1.0, 1.0, Quality.OK, step / 10), DECISION, LINE)
        recording.flush(step / 10)


@pytest.fixture
def disk() -> HangingDisk:
    return HangingDisk()


@pytest.fixture
def log() -> Log:
    return Log()


@pytest.fixture
def recordings(tmp_path: Path, disk: HangingDisk, log: Log) -> Recordings:
    return Recordings(tmp_path / "recordings", demo(), log, disk)  # type: ignore[arg-type]


def test_rows_wait_for_a_disk_that_is_slow_and_none_is_lost(
    recordings: Recordings, disk: HangingDisk, tmp_path: Path, log: Log
) -> None:
    begun = recordings.start()
    rows_until(recordings, HANGS_S - 1.0)
    assert not begun.done() and recordings.status() == {"recording": None}
    disk.let_go()
    assert begun.result()["recording"].endswith("0001.fgr")
    ended = recordings.stop()
    assert not ended.done()
    disk.let_go()
    rows = round(HANGS_S - 1.0) * 10 + 1
    assert ended.result() == {"recording": None, "written": begun.result()["recording"], "rows": rows}
    recording = read_recording(Path(ended.result()["written"]))
    assert recording.columns["time_s"].tolist() == pytest.approx([step / 10 for step in range(rows)])
    assert log == []


def test_a_disk_that_hangs_ends_the_recording_and_it_goes_on_in_another_when_the_disk_does(
    recordings: Recordings, disk: HangingDisk, tmp_path: Path, log: Log
) -> None:
    recordings.start(RecordingLabel("long one"))
    disk.let_go()
    rows_until(recordings, HANGS_S + 1.0)
    assert [line for line in log if "E402" in line and "the disk has taken nothing for 30 s; control goes on" in line]
    assert "taken nothing" in recordings.status()["waits"]
    rows_until(recordings, 2 * HANGS_S + 2.0, HANGS_S + 1.1)
    disk.let_go()
    rows_until(recordings, 3 * HANGS_S, 2 * HANGS_S + 2.1)
    assert "it goes on: recording to" in log[-1]
    disk.let_go()
    recordings.stop()
    disk.let_go()
    first, second = list_recordings(tmp_path)
    assert (first.fault, second.fault) == ("", "")
    assert second.rows > 200


def test_rows_are_handed_over_each_tenth_of_a_second(tmp_path: Path, log: Log, monkeypatch: pytest.MonkeyPatch) -> None:
    """At most so many are lost with the process, and no disk is asked at each tick."""
    batches: list[int] = []
    write = Recorder.write
    monkeypatch.setattr(Recorder, "write", lambda file: (batches.append(file._rows), write(file)))
    recordings = Recordings(tmp_path / "recordings", demo(), log, AtOnce())  # type: ignore[arg-type]
    recordings.start()
    for tick in range(256):
        recordings.append(ForceSample(1.0, 1.0, Quality.OK, tick / 256), DECISION, LINE)
        recordings.flush(tick / 256)
    recordings.stop()
    assert batches == [1, *[26] * 9, 21]
    [recording] = list_recordings(tmp_path)
    assert recording.rows == 256


def test_whoever_ends_one_before_its_file_is_there_gets_it_whole(recordings: Recordings, disk: HangingDisk) -> None:
    begun = recordings.start()
    rows_until(recordings, 1.0)
    ended = recordings.stop()
    another = recordings.start()
    with pytest.raises(ValueError, match=r"^already recording to .*recordings$"):
        recordings.start()  # it said: to None
    disk.let_go()
    assert ended.result()["written"] == begun.result()["recording"] != another.result()["recording"]
    assert ended.result()["rows"] == 11
    recordings.stop()
    disk.let_go()


def test_a_start_that_has_ended_before_the_disk_answers_is_told_nothing(
    recordings: Recordings, disk: HangingDisk, caplog: pytest.LogCaptureFixture
) -> None:
    assert recordings.try_start(WantedRecording()).cancel()
    disk.let_go()
    assert recordings.status()["recording"] and not caplog.records
    recordings.stop()
    disk.let_go()


def test_one_that_the_disk_refuses_after_somebody_has_ended_it_does_not_come_again(
    recordings: Recordings, disk: HangingDisk, tmp_path: Path
) -> None:
    (tmp_path / "recordings").write_text("no folder")
    begun = recordings.try_start(WantedRecording())
    ended = recordings.stop()
    disk.let_go()
    assert "not recording" in begun.result()[0]
    assert ended.result() == {"recording": None}
    assert "waits" not in recordings.status()


def test_whoever_waits_for_the_end_on_a_disk_that_hangs_is_told(recordings: Recordings, disk: HangingDisk) -> None:
    recordings.start()
    disk.let_go()
    rows_until(recordings, 1.0)
    ended = recordings.stop()
    rows_until(recordings, HANGS_S, 1.1)
    assert not ended.done()
    rows_until(recordings, HANGS_S + 2.0, HANGS_S + 0.1)
    assert "the disk has taken nothing" in ended.result()["fault"]
    disk.let_go()


def test_the_loop_goes_on_while_a_thread_waits_for_the_disk(tmp_path: Path) -> None:
    """With the real thread: a file whose making takes as long as it likes."""
    is_free = threading.Event()

    def make() -> Recorder:
        assert is_free.wait(20.0)
        return Recorder(tmp_path, {"rig": "demo"}, COLUMNS)

    async def main() -> Path | None:
        worker, opened, closed = DiskWorker(), asyncio.Event(), asyncio.Event()
        recording = RunRecording(worker, worker, make, Log())
        recording.begin(lambda error: opened.set())
        rows_until(recording, 1.0)  # type: ignore[arg-type]
        assert recording.path is None and not opened.is_set()
        is_free.set()
        await opened.wait()
        recording.close(closed.set)
        await closed.wait()
        worker.close()
        return recording.path

    path = asyncio.run(main())
    assert path and read_recording(path).rows == 11
    join_disk_threads()  # it still syncs the file


def test_a_disk_that_is_always_one_batch_behind_does_not_hang(recordings: Recordings, disk: HangingDisk) -> None:
    recordings.start()
    disk.let_go()
    for step in range(round(HANGS_S * 10) + 20):
        rows_until(recordings, step / 10, step / 10)
        disk.let_go(all_but=1)
    assert recordings.status()["rows"] > HANGS_S * 10
    recordings.stop()
    disk.let_go()


def test_one_whose_time_is_over_while_it_waits_for_the_disk_does_not_come_again(
    recordings: Recordings, disk: HangingDisk, tmp_path: Path
) -> None:
    recordings.start(for_s=HANGS_S + 10.0)
    disk.let_go()
    rows_until(recordings, HANGS_S + 1.0)
    assert "waits" in recordings.status()
    disk.let_go()
    rows_until(recordings, 3.0 * HANGS_S, HANGS_S + 1.1)
    disk.let_go()
    assert recordings.status() == {"recording": None}
    assert len(list_recordings(tmp_path)) == 1


def test_a_file_that_nobody_waits_for_any_more_is_not_made(
    recordings: Recordings, disk: HangingDisk, tmp_path: Path
) -> None:
    recordings.start()
    rows_until(recordings, HANGS_S + 1.0)
    assert "waits" in recordings.status()
    disk.let_go()
    assert list_recordings(tmp_path) == []


def test_a_disk_that_comes_back_behind_the_end_is_no_internal_error(
    recordings: Recordings, disk: HangingDisk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gateway.service.running_rig.recording.recordings.END_BOUND_S", 0.0)

    async def main() -> None:
        recordings.start()
        disk.let_go()
        rows_until(recordings, 1.0)
        await recordings.close()
        [path] = (tmp_path / "recordings").glob("*.fgr")
        assert read_recording(path).rows == 0, "the disk has not come back"
        disk.let_go()
        assert read_recording(path).rows == 11

    asyncio.run(main())


def test_a_recording_that_ends_before_its_first_tick_is_not_blamed_on_the_disk(
    tmp_path: Path, disk: HangingDisk
) -> None:
    """The clock of the ticks began days ago."""
    log = Log()
    recordings = Recordings(tmp_path, demo(), log, disk)  # type: ignore[arg-type]
    recordings.start()
    stopped = recordings.stop()
    for tick in range(3):
        recordings.flush(400_000.0 + tick / 100)
    disk.let_go()
    assert "fault" not in stopped.result(0) and not log


def test_a_defect_of_ours_in_the_disk_s_thread_is_no_disk_that_hangs(
    tmp_path: Path, disk: HangingDisk, log: Log
) -> None:
    def fail() -> None:
        raise ZeroDivisionError

    file = SimpleNamespace(
        path=tmp_path / "0001.fgr", failure=None, rows_written=0, append=lambda row: None, write=fail
    )
    recording = RunRecording(disk, disk, lambda: file, log)  # type: ignore[arg-type, return-value]
    recording.begin(lambda error: None)
    disk.let_go()
    rows_until(recording, 0.0)
    with pytest.raises(ZeroDivisionError):
        disk.let_go()
    recording.flush(HANGS_S + 5.0)
    assert recording.failure is None
