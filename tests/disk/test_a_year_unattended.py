"""A year without anybody: recordings, events and audit stay within their bounds, hour by hour, in virtual time."""

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from gateway.audit.audit_file import AuditFile
from gateway.audit.audit_reader import read_audit, verify_audit
from gateway.processes.event import encode_event, make_event
from gateway.processes.event_file import KEPT, EventFile, EventReader
from gateway.profiles.recordings_section import Retention
from gateway.recording import list_recordings, recording_paths
from gateway.recording.care.keeping import keep_recording, prune_recordings
from gateway.recording.label import RecordingLabel
from gateway.service.running_rig.recording.recordings import RUN_COLUMNS, Recordings
from tests.audit.appending import append
from tests.disk.at_once import AtOnce
from tests.disk.failing_disks import FailingDisk
from tests.disk.watched_disk import watching
from tests.recording.care.test_care import record
from tests.service.rigs import demo

HOUR_S, DAY_S = 3600.0, 86400.0
ROWS_AN_HOUR = 150
LIMIT = Retention(bytes=1_000_000, days=20.0)
ROW = (1.0,) * len(RUN_COLUMNS)


class Calendar:
    """The wall clock, and the times of what is written."""

    def __init__(self) -> None:
        self.now_s = 1.7e9

    def hours(self, days: int, folder: Path) -> Iterator[float]:
        """Each hour; what was written in it has its time afterwards."""
        before: dict[Path, int] = {}
        for _ in range(24 * days):
            self.now_s += HOUR_S
            yield self.now_s
            for path in recording_paths(folder):
                if before.get(path) != (size := path.stat().st_size):
                    before[path] = size
                    os.utime(path, (self.now_s, self.now_s))


@pytest.fixture
def calendar(monkeypatch: pytest.MonkeyPatch) -> Calendar:
    calendar = Calendar()
    monkeypatch.setattr("time.time", lambda: calendar.now_s)
    for user in ("retention", "recordings"):
        monkeypatch.setattr(f"gateway.service.running_rig.recording.{user}.DiskWorker", AtOnce)
    monkeypatch.setattr(
        "gateway.service.running_rig.recording.run_recording.sync_recording", lambda path: None
    )  # the power-cut tests ask for it
    return calendar


def sizes(folder: Path) -> list[int]:
    return [path.stat().st_size for path in recording_paths(folder)]


@pytest.mark.parametrize(
    "limit",
    [
        pytest.param(LIMIT, id="both"),
        pytest.param(replace(LIMIT, days=None), id="bytes", marks=pytest.mark.long),
        pytest.param(replace(LIMIT, bytes=None), id="days", marks=pytest.mark.long),
    ],
)
def test_a_year_of_recording_takes_no_more_room_than_the_limit(
    fast_folder: Path, calendar: Calendar, budget: int, limit: Retention
) -> None:
    """One recording that goes on for ever, and nobody ends it. One of them is kept; it stays, and counts."""
    rig = replace(demo(), retention=limit)
    said: list[str] = []
    recordings = Recordings(fast_folder / "recordings", rig, lambda cause, sentence: said.append(sentence))
    recordings.start(RecordingLabel("for ever"))
    days, most_bytes, oldest_s, numbers = (365 if budget > 1 else 25), 0, 0.0, set()
    for now_s in calendar.hours(days, fast_folder):
        for _ in range(ROWS_AN_HOUR):
            recordings._current._gathered.append(ROW)
        recordings.flush(now_s)
        recordings.flush(now_s + 0.2)
        recordings.flush(now_s + 0.3)
        most_bytes = max(most_bytes, sum(sizes(fast_folder)))
        young = [path for path in recording_paths(fast_folder) if path.stem != "0002"]
        oldest_s = max([oldest_s, *(now_s - path.stat().st_mtime for path in young)])
        numbers |= {path.stem for path in young}
        if (fast_folder / "recordings" / "0002.fgr").exists() and not numbers & {"0003"}:
            keep_recording(fast_folder / "recordings" / "0002.fgr")
    recordings.stop()
    written = days * 24 * ROWS_AN_HOUR * 8 * len(RUN_COLUMNS)
    files = len(sizes(fast_folder))
    print(
        f"{days} days: {written / 1e6:.0f} MB of rows, at most {most_bytes / 1e6:.2f} MB kept, {files} files at the end"
    )
    assert len(numbers) > 10 and "pruned" in "".join(said)
    if limit.bytes:
        assert most_bytes <= limit.bytes * (1 + 2 / 8), "and two files: one being written, one just ended"
        assert written > 5 * most_bytes
    if limit.days:
        assert oldest_s <= limit.days * DAY_S + 2 * HOUR_S
    assert {entry.fault for entry in list_recordings(fast_folder)} == {""}
    assert (fast_folder / "recordings" / "0002.fgr").exists()
    assert len(list((fast_folder / "recordings").iterdir())) <= len(sizes(fast_folder)) + 3


def test_a_year_of_events_takes_no_more_than_five_files(fast_folder: Path, budget: int) -> None:
    longest, most = 1 << 14, 0
    file = EventFile(fast_folder, longest)
    count = 2000 * budget
    for number in range(count):
        file.append(encode_event(make_event(float(number), "control", "link 10.0.0.5", f"event {number}, and so on")))
        if number % 50 == 0:
            most = max(most, sum(path.stat().st_size for path in fast_folder.iterdir()))
    file.close()
    assert len(list(fast_folder.iterdir())) == KEPT + 1
    assert most <= (KEPT + 1) * (longest + 200)
    with EventReader(fast_folder) as reader:
        numbers = [int(event.text.split()[1].rstrip(",")) for event in reader.read_stored()]
    assert numbers == list(range(numbers[0], count)), "the newest, without a gap"


def test_a_year_of_audit_takes_no_more_than_its_files_and_still_holds(fast_folder: Path, budget: int) -> None:
    longest, kept, most = 1 << 13, 4, 0
    file = AuditFile(fast_folder, longest, kept)
    for number in range(200 * budget):
        append(file, [{"what": "force_setpoint", "old": number, "new": number + 1, "peer": "10.0.0.5:4711"}] * 2)
        most = max(most, sum(path.stat().st_size for path in (fast_folder / "audit").iterdir()))
    file.close()
    assert most <= kept * (longest + 1000)
    assert len(list((fast_folder / "audit").glob("*.jsonl"))) == kept
    assert verify_audit(fast_folder).broken is None
    assert any(record["what"] == "dropped" for record in read_audit(fast_folder))


def test_what_is_deleted_on_a_full_disk_needs_no_room(fast_folder: Path) -> None:
    """Else a disk that is full would stay so: only the highest number needs a mark, and that one goes last."""
    for days_ago in (4, 3, 2, 1):
        record(fast_folder, days_ago=days_ago)
    size = sizes(fast_folder)[0]
    with watching(FailingDisk(fast_folder, "full", 1)):
        gone = prune_recordings(fast_folder, Retention(bytes=2 * size), "")
    assert [one.path.stem for one in gone] == ["0001", "0002"]


def test_one_that_cannot_be_deleted_keeps_no_other_one(fast_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for days_ago in (40, 39, 38):
        record(fast_folder, days_ago=days_ago)
    unlink = Path.unlink

    def refuse(path: Path, missing_ok: bool = False) -> None:
        if path.name == "0001.fgr":
            raise OSError("a bad sector")
        unlink(path, missing_ok)

    monkeypatch.setattr(Path, "unlink", refuse)
    gone = prune_recordings(fast_folder, Retention(days=30.0), "")
    assert [one.path.stem for one in gone] == ["0002", "0003"]
