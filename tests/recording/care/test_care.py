"""Care for recordings: summaries are read once, and what must stay stays, whatever the limits say."""

import errno
import os
from math import nan
from pathlib import Path
from typing import Any

import pytest

from gateway.profiles.recordings_section import Retention
from gateway.recording import Recorder, recording_paths
from gateway.recording.care import keeping, summaries
from gateway.recording.care.keeping import (
    choose_prunable,
    delete_recording,
    is_being_recorded,
    keep_recording,
    let_recording_go,
    prune_recordings,
    why_protected,
)
from gateway.recording.care.summaries import list_summaries
from gateway.recording.tables.column_names import DERIVED, PULLING

NOW_S = 1_700_000_000.0
COLUMNS = ("time_s", "force_n", "setpoint_n", "applied_n", "model_residual_n", "fault_code")


def record(state: Path, *, days_ago: float = 0.0, force_n: float = 20.0, **header: Any) -> Path:
    """Write a recording of 10 rows that ended so long before NOW_S."""
    recorder = Recorder(state / "recordings", header, COLUMNS)
    for row in range(10):
        is_asked = row >= 5
        recorder.append((row * 0.1, force_n + row, 20.0 * is_asked, 20.0 * is_asked, 3.0 if is_asked else 99.0, 0.0))
    recorder.close()
    ended_s = NOW_S - days_ago * 86400.0
    os.utime(recorder.path, (ended_s, ended_s))
    return recorder.path


def numbers(state: Path) -> list[int]:
    return [int(path.stem) for path in recording_paths(state)]


def test_a_summary_says_what_happened_by_name_and_number(tmp_path: Path) -> None:
    record(tmp_path, name="before repair", note="new seals", rig="demo")
    (summary,) = list_summaries(tmp_path)
    assert [summary[key] for key in ("name", "note", "rig")] == ["before repair", "new seals", "demo"]
    told = "run, 1 change of setpoint, up to 20 N, 20.0 to 29.0 N measured, residual 3 N RMS, steps included"
    assert summary["happened"] == told
    assert (summary["facts"]["force_range_n"], summary["facts"]["residual_rms_n"]) == ([20.0, 29.0], pytest.approx(3.0))


def test_a_summary_says_how_long_the_tool_pulled(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "recordings", {}, ("time_s", *DERIVED, PULLING))
    for row in range(10):
        recorder.append((row * row * 0.1, *(0.0 for _ in DERIVED), float(2 <= row < 7)))  # each until the next row
    recorder.close()
    (summary,) = list_summaries(tmp_path)
    assert "pulled for 4.5 s" in summary["happened"] and summary["facts"]["pulled_s"] == 4.5


def test_a_plan_is_named_and_faults_by_their_codes(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "recordings", {"experiment": {"name": "creep"}}, ("time_s", "fault_code"))
    for row in range(3):
        recorder.append((float(row), 1.0 * row))
    recorder.close()
    (summary,) = list_summaries(tmp_path)
    assert summary["happened"].startswith("experiment creep, fault A")
    assert len(summary["facts"]["faults"]) == 2


def test_a_thousand_recordings_are_not_read_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = record(tmp_path).read_bytes()
    for number in range(2, 1001):
        (tmp_path / "recordings" / f"{number:04d}.fgr").write_bytes(source)
    before = list_summaries(tmp_path)
    monkeypatch.setattr(summaries, "summary_of", lambda path: pytest.fail(f"{path} was read again"))
    assert list_summaries(tmp_path) == before
    assert len(before) == 1000


def test_a_file_that_has_changed_is_read_again_although_it_is_as_long(tmp_path: Path) -> None:
    path = record(tmp_path, days_ago=2.0, force_n=20.0)
    first = list_summaries(tmp_path)
    other = record(tmp_path / "other", days_ago=1.0, force_n=30.0)
    assert other.stat().st_size == path.stat().st_size
    other.replace(path)
    assert list_summaries(tmp_path) != first


@pytest.mark.parametrize(
    "damage",
    [
        b"",
        b"no JSON",
        b"[]",
        b"[" * 60_000,
        b'{"format": 99, "recordings": {}}',
        b'{"format": 1}',
        b'{"format": 1, "recordings": [3]}',
        b'{"format": 1, "recordings": {"0001.fgr": 3}}',
    ],
    ids=range(8),
)
def test_a_damaged_cache_costs_time_only(tmp_path: Path, damage: bytes) -> None:
    record(tmp_path)
    before = list_summaries(tmp_path)
    (tmp_path / "recordings" / ".summaries.json").write_bytes(damage)
    assert list_summaries(tmp_path) == before


def test_who_records_holds_the_file_until_it_is_closed(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "recordings", {}, COLUMNS)
    assert is_being_recorded(recorder.path)
    assert delete_recording(recorder.path, "") == "it is being recorded"
    recorder.close()
    assert not is_being_recorded(recorder.path)
    assert delete_recording(recorder.path, "") == ""
    assert not recorder.path.exists()


def test_what_is_kept_or_the_reference_is_not_deleted(tmp_path: Path) -> None:
    path = record(tmp_path)
    keep_recording(path)
    assert delete_recording(path, "") == "it is kept"
    let_recording_go(path)
    assert delete_recording(path, path.name) == "it is the rig's reference"
    assert why_protected(path, "") == ""
    assert path.exists()


def test_days_take_the_older_ones_and_no_protected_one(tmp_path: Path) -> None:
    kept, reference, old, young = (record(tmp_path, days_ago=days) for days in (40, 39, 38, 2))
    keep_recording(kept)
    running = Recorder(tmp_path / "recordings", {}, COLUMNS)
    os.utime(running.path, (1_600_000_000.0, 1_600_000_000.0))
    chosen = choose_prunable(recording_paths(tmp_path), Retention(days=30.0), reference.name, NOW_S)
    running.close()
    assert [one.path for one in chosen] == [old]
    assert "30 days" in chosen[0].why
    assert young.exists()


def test_what_was_recorded_before_anybody_had_set_the_clock_is_not_old(tmp_path: Path) -> None:
    path = record(tmp_path)
    os.utime(path, (3600.0, 3600.0))
    assert choose_prunable([path], Retention(days=30.0), "", NOW_S) == []
    assert [one.path for one in choose_prunable([path], Retention(bytes=1), "", NOW_S)] == [path]


def test_what_was_recorded_while_the_clock_was_ahead_goes_in_its_turn(tmp_path: Path) -> None:
    """A clock was a year ahead and was set back: its recordings would have stayed for a year, and each new one gone."""
    paths = [record(tmp_path, days_ago=days_ago) for days_ago in (3, -365, -366, 1, 0.5)]
    size = paths[0].stat().st_size
    chosen = choose_prunable(recording_paths(tmp_path), Retention(bytes=2 * size), "", NOW_S)
    assert [one.path for one in chosen] == paths[:3]
    only_ahead = choose_prunable(paths[1:3], Retention(bytes=1), "", NOW_S)
    assert [one.path for one in only_ahead] == paths[1:3]
    assert choose_prunable(paths, Retention(days=0.75), "", NOW_S) == choose_prunable(
        [paths[0], paths[3]], Retention(days=0.75), "", NOW_S
    ), "nobody knows how old they are"


def test_bytes_take_the_oldest_first_and_only_as_many_as_it_needs(tmp_path: Path) -> None:
    for days_ago in (1, 4, 3, 2):
        record(tmp_path, days_ago=days_ago)
    keep_recording(tmp_path / "recordings" / "0002.fgr")
    size = (tmp_path / "recordings" / "0001.fgr").stat().st_size
    limit = Retention(bytes=3 * size)
    assert [one.path.stem for one in choose_prunable(recording_paths(tmp_path), limit, "", NOW_S)] == ["0003"]
    gone = prune_recordings(tmp_path, limit, "0003.fgr"), prune_recordings(tmp_path, Retention(bytes=2 * size), "")
    assert [[one.path.stem for one in each] for each in gone] == [["0004"], ["0003"]]
    assert numbers(tmp_path) == [1, 2]


def test_what_has_just_been_written_to_stays_although_nobody_holds_its_lock(tmp_path: Path) -> None:
    """Some file systems have no locks."""
    path = record(tmp_path)
    limit = Retention(days=None, bytes=1)
    assert choose_prunable([path], limit, "", NOW_S + 1.0) == []
    assert [one.path for one in choose_prunable([path], limit, "", NOW_S + 86400.0)] == [path]


def test_without_a_limit_everything_stays(tmp_path: Path) -> None:
    record(tmp_path, days_ago=10_000)
    assert prune_recordings(tmp_path, Retention(), "") == []
    assert numbers(tmp_path) == [1]


def test_a_number_whose_recording_was_kept_and_deleted_is_not_kept_again(tmp_path: Path) -> None:
    path = record(tmp_path)
    keep_recording(path)
    path.unlink()  # by hand; the mark stays behind
    again = record(tmp_path)
    assert why_protected(again, "") == ""


def test_the_number_of_a_deleted_recording_is_not_used_again(tmp_path: Path) -> None:
    paths = [record(tmp_path) for _ in range(3)]
    for path in (paths[2], paths[0], paths[1]):
        assert delete_recording(path, "") == ""
    assert record(tmp_path).stem == "0004"
    assert sorted(path.name for path in (tmp_path / "recordings").iterdir()) == ["0003.gone", "0004.fgr"]
    assert delete_recording(tmp_path / "recordings" / "0004.fgr", "") == ""
    assert record(tmp_path).stem == "0005"


def test_what_is_said_to_be_deleted_is_gone_after_a_power_cut_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The folder is synchronised behind the last name that goes."""
    _, path, _ = (record(tmp_path) for _ in range(3))
    keep_recording(path)
    let_recording_go(path)
    acts: list[str] = []
    sync, unlink = os.fsync, Path.unlink

    def noting_unlink(one: Path, missing_ok: bool = False) -> None:
        acts.append("unlink")
        unlink(one, missing_ok)

    monkeypatch.setattr(Path, "unlink", noting_unlink)
    monkeypatch.setattr(os, "fsync", lambda descriptor: (acts.append("fsync"), sync(descriptor)))
    assert delete_recording(path, "") == ""
    assert acts == ["unlink", "fsync"]


@pytest.mark.parametrize("part", ["delete_recording", "is_being_recorded"])
def test_one_recording_that_the_disk_does_not_let_go_keeps_no_other_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, part: str
) -> None:
    for days_ago in (40.0, 30.0, 20.0):
        record(tmp_path, days_ago=days_ago)
    whole = getattr(keeping, part)

    def refuse(path: Path, *more: str) -> Any:
        if int(path.stem) == 1:
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return whole(path, *more)

    monkeypatch.setattr(keeping, part, refuse)
    gone = prune_recordings(tmp_path, Retention(days=10.0), "")
    assert ([int(one.path.stem) for one in gone], numbers(tmp_path)) == ([2, 3], [1])
    with pytest.raises(PermissionError):
        prune_recordings(tmp_path, Retention(days=10.0), "")


def test_a_cache_of_another_format_is_not_believed(tmp_path: Path) -> None:
    path = record(tmp_path, name="mine")
    list_summaries(tmp_path)
    cache = path.with_name(".summaries.json")
    cache.write_text(cache.read_text().replace('"format": 1', '"format": 2').replace("mine", "another's"))
    assert [summary["name"] for summary in list_summaries(tmp_path)] == ["mine"]


def test_rows_without_a_setpoint_are_no_changes_of_it(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "recordings", {}, ("time_s", "setpoint_n"))
    for row, setpoint_n in enumerate((0.0, nan, nan, 0.0, 12.0, nan, 12.0)):
        recorder.append((0.1 * row, setpoint_n))
    recorder.close()
    (summary,) = list_summaries(tmp_path)
    assert summary["facts"]["setpoint_changes"] == 1


@pytest.mark.parametrize("vanishes", ["before it is looked at", "before it is asked for", "before it goes"])
def test_a_recording_that_somebody_deletes_meanwhile_keeps_no_other_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, vanishes: str
) -> None:
    """By the page, or a person at a terminal: there was no pruning for an hour then."""
    gone, old = record(tmp_path, days_ago=50.0), record(tmp_path, days_ago=40.0)
    paths = recording_paths(tmp_path)
    asked = keeping.why_protected
    times = iter(["before it is asked for", "before it goes"])

    def why(path: Path, reference: str) -> str:
        if path == gone and next(times) == vanishes:
            gone.unlink()
        return asked(path, reference)

    if vanishes == "before it is looked at":
        gone.unlink()
    monkeypatch.setattr(keeping, "why_protected", why)
    monkeypatch.setattr(keeping, "recording_paths", lambda state: paths)
    assert [one.path for one in prune_recordings(tmp_path, Retention(days=30.0), "")] == [old]
    assert numbers(tmp_path) == []


def test_a_mark_that_the_disk_does_not_take_is_named_by_its_whole_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(name: str, *_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied", name)

    path = record(tmp_path)
    monkeypatch.setattr(keeping, "open_plain", refuse)
    with pytest.raises(PermissionError) as raised:
        keep_recording(path)
    assert raised.value.filename == str(path.with_suffix(".keep")) and not keeping.is_kept(path)
