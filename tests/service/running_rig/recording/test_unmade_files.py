"""A recording whose file the disk makes late, never, or without a row: what is said of it is so, and its number is used."""

import contextlib
from pathlib import Path

from gateway.recording import Recorder, recording_paths
from gateway.recording.care.keeping import delete_recording
from gateway.service.running_rig.recording.recordings import Recordings
from gateway.service.running_rig.recording.run_recording import HANGS_S
from tests.disk.at_once import AtOnce
from tests.disk.failing_disks import FailingDisk
from tests.disk.watched_disk import watching
from tests.service.kept_log import Log
from tests.service.rigs import demo
from tests.service.running_rig.recording.test_run_recording import HangingDisk, disk, log, recordings, rows_until

__all__ = ["disk", "log", "recordings"]


def test_a_recording_whose_file_a_disk_that_hung_never_made_is_refused_and_begins_by_itself_no_more(
    recordings: Recordings, disk: HangingDisk, log: Log
) -> None:
    """It was said to record to `None`, and to go on for ever."""
    begun = recordings.start()
    rows_until(recordings, HANGS_S + 1.0)
    disk.let_go()
    assert "the disk has taken nothing for 30 s" in str(begun.exception())
    rows_until(recordings, 3 * HANGS_S, HANGS_S + 1.1)
    disk.let_go()
    assert recordings.status() == {"recording": None}
    assert [line for line in log if "None" in line or "recording  " in line] == []


def test_one_that_was_refused_behind_its_first_tick_does_not_begin_in_the_next_process(
    recordings: Recordings, disk: HangingDisk, tmp_path: Path
) -> None:
    wanted: list[object] = []
    recordings.on_wanted = wanted.append
    begun = recordings.start(for_s=60.0)
    rows_until(recordings, 1.0)
    with watching(FailingDisk(tmp_path, "full", 1)):
        disk.let_go()
    assert begun.exception() and wanted[-1] is None


def test_one_that_goes_on_in_another_file_which_a_disk_that_hangs_never_makes_waits_for_it(
    recordings: Recordings, disk: HangingDisk, log: Log
) -> None:
    recordings.start()
    disk.let_go()
    rows_until(recordings, 1.0)
    disk.let_go()
    recordings.use_plant(demo())
    rows_until(recordings, HANGS_S + 2.0, 1.1)
    disk.let_go()
    assert "taken nothing" in recordings.status()["waits"]
    rows_until(recordings, 2 * HANGS_S + 3.0, HANGS_S + 2.1)
    disk.let_go()
    assert recordings.status()["recording"]
    recordings.stop()
    disk.let_go()
    assert [line for line in log if "None" in line] == []


def test_one_that_ends_by_its_time_before_it_has_a_file_is_told_so(
    recordings: Recordings, disk: HangingDisk, log: Log
) -> None:
    recordings.start(for_s=5.0)
    rows_until(recordings, HANGS_S + 7.0)
    disk.let_go()
    assert [line for line in log if "ends after 5 s, 0 rows" in line and "None" not in line]


def test_one_that_was_stopped_before_its_file_was_made_does_not_begin_in_the_next_process(
    recordings: Recordings, disk: HangingDisk
) -> None:
    wanted: list[object] = []
    recordings.on_wanted = wanted.append
    recordings.start()
    recordings.stop()
    disk.let_go()
    assert wanted == [None]


def test_an_empty_recording_that_the_disk_has_ended_leaves_its_number_used(tmp_path: Path, log: Log) -> None:
    """The one before it was deleted without a mark, for it was not the highest."""
    recordings = Recordings(tmp_path / "recordings", demo(), log, AtOnce())  # type: ignore[arg-type]
    recordings.start(), recordings.stop(), recordings.start()
    first, second = recording_paths(tmp_path)
    assert delete_recording(first, "") == ""
    with watching(FailingDisk(tmp_path, "full", 1)):
        rows_until(recordings, 1.0)
    assert not second.exists()
    with contextlib.closing(Recorder(tmp_path / "recordings", {}, ("time_s",))) as following:
        assert following.number == 3
