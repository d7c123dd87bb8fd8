"""What the list of recordings says of each."""

import json
import os
from math import inf, nan
from pathlib import Path

import pytest

from gateway.bsfm.ladder.plan import LABELS
from gateway.profiles.recordings_section import Retention
from gateway.recording import Recorder, read_recording, recording_paths
from gateway.recording.calibrations_used import tell_changes
from gateway.recording.care import summaries
from gateway.recording.care.keeping import choose_prunable
from gateway.recording.care.summaries import list_summaries
from gateway.recording.label import check_name, check_note
from gateway.recording.tables.column_names import CALIBRATION, DERIVED, PULLING
from gateway.registers.words import CalibrationPhase


@pytest.mark.parametrize(("groups", "words"), [(1, "1 group"), (2, "2 groups")])
def test_a_ladder_that_was_cut_says_how_far_it_has_climbed(tmp_path: Path, groups: int, words: str) -> None:
    """It read like a whole one; and `1 × 0.5 V stairs` like one stair."""
    for last in (CalibrationPhase.LADDER, CalibrationPhase.FITTING):
        header = {"ladder": {"groups": groups, "step_v": 0.5, "stairs": 85}}
        recorder = Recorder(tmp_path / "recordings", header, ("time_s", *LABELS))
        for row in range(46):
            recorder.append((float(row), float(last if row == 45 else CalibrationPhase.LADDER), 0.0, float(row)))
        recorder.close()
    cut, whole = (summary["happened"] for summary in list_summaries(tmp_path))
    assert cut == f"calibration ladder of {words} of 0.5 V stairs, 45 of 85 stairs climbed"
    assert whole == f"calibration ladder of {words} of 0.5 V stairs"


def test_a_recording_lasts_from_its_first_row_to_its_last(tmp_path: Path) -> None:
    """Times count from the start of the gateway: one of 2 s read like one of half a minute."""
    recorder = Recorder(tmp_path / "recordings", {}, ("time_s", "force_n"))
    for row in range(21):
        recorder.append((30.0 + 0.1 * row, 1.0))
    recorder.close()
    (summary,) = list_summaries(tmp_path)
    assert summary["duration_s"] == pytest.approx(2.0)


def test_the_largest_setpoint_is_told_wherever_it_was(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "recordings", {}, ("time_s", "setpoint_n"))
    for row, setpoint_n in enumerate((0.0, 12.0, 30.0, 5.0)):
        recorder.append((0.1 * row, setpoint_n))
    recorder.close()
    (summary,) = list_summaries(tmp_path)
    assert "3 changes of setpoint, up to 30 N" in summary["happened"]


def test_of_two_limits_the_tighter_one_counts(tmp_path: Path) -> None:
    """What `service install` advises: bytes and days."""
    for _ in range(3):
        Recorder(tmp_path / "recordings", {}, ("time_s", "force_n")).close()
    paths = recording_paths(tmp_path)
    now_s = paths[-1].stat().st_mtime + 86_400.0
    size = paths[0].stat().st_size
    for limits, gone in (((2 * size, 30.0), paths[:1]), ((9 * size, 0.5), paths), ((9 * size, 30.0), [])):
        chosen = choose_prunable(paths, Retention(bytes=limits[0], days=limits[1]), "", now_s)
        assert [one.path for one in chosen] == gone


def test_what_somebody_will_read_again_stays_and_takes_the_room_of_others(tmp_path: Path) -> None:
    """A calibration's ladder, by the name of its file."""
    for _ in range(3):
        Recorder(tmp_path / "recordings", {}, ("time_s", "force_n")).close()
    paths = recording_paths(tmp_path)
    now_s = paths[-1].stat().st_mtime + 86_400.0
    chosen = choose_prunable(paths, Retention(days=0.5), "", now_s, frozenset({paths[0].name}))
    assert [one.path for one in chosen] == paths[1:]


def test_a_file_that_has_grown_within_one_tick_of_the_clock_is_read_again(tmp_path: Path) -> None:
    """Clocks of file systems go by milliseconds, some by two seconds."""
    recorder = Recorder(tmp_path / "recordings", {}, ("time_s",))
    status = recorder.path.stat()
    for rows in (1, 2):
        recorder.append((float(rows),))
        recorder.write()
        os.utime(recorder.path, ns=(status.st_atime_ns, status.st_mtime_ns))
        assert [summary["rows"] for summary in list_summaries(tmp_path)] == [rows]
    recorder.close()


def test_a_file_that_another_one_has_replaced_within_a_second_is_read_again(tmp_path: Path) -> None:
    path = tmp_path / "recordings" / "0001.fgr"
    for at_ns, calibration in enumerate((3, 4, 4), 1_700_000_000 * 10**9):
        recorder = Recorder(tmp_path / "beside", {"calibration": calibration}, ("time_s",))
        recorder.close()
        path.parent.mkdir(exist_ok=True)
        recorder.path.replace(path)
        os.utime(path, ns=(at_ns, at_ns))
        assert [summary["calibration"] for summary in list_summaries(tmp_path)] == [calibration]


def test_what_has_changed_is_read_once_and_what_is_gone_is_forgotten(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As many recordings as before, or fewer, are no reason to keep what was known of them."""
    for _ in range(2):
        Recorder(tmp_path / "recordings", {}, ("time_s",)).close()
    first, second = recording_paths(tmp_path)
    list_summaries(tmp_path)
    os.utime(first, (1, 1))
    list_summaries(tmp_path)
    monkeypatch.setattr(summaries, "summary_of", lambda path: pytest.fail(f"{path} was read again"))
    assert len(list_summaries(tmp_path)) == 2
    second.unlink()
    assert len(list_summaries(tmp_path)) == 1
    assert second.name not in (tmp_path / "recordings" / ".summaries.json").read_text()


def test_a_change_of_calibration_is_told_by_the_time_since_the_first_row(tmp_path: Path) -> None:
    """Times count from the start of the gateway."""
    recorder = Recorder(tmp_path / "recordings", {}, ("time_s", *DERIVED, CALIBRATION))
    for row, number in enumerate((3.0, 3.0, 4.0, 4.0)):
        recorder.append((100.0 + row, *(0.0 for _ in DERIVED), number))
    recorder.close()
    (path,) = recording_paths(tmp_path)
    assert tell_changes(read_recording(path)) == "calibration 4 from 2.00 s on"


@pytest.mark.parametrize("text", ["", " ", "17", "a\x1b[2Jb", 61 * "n"])
def test_what_is_no_name_is_refused_and_what_is_one_stands_on_one_line(text: str) -> None:
    """A number would be looked for as one, and what a terminal obeys is no name."""
    with pytest.raises(ValueError, match="is no name"):
        check_name(text)
    assert (check_name(60 * "n"), check_name(" worn\n seal 2 ")) == (60 * "n", "worn seal 2")


@pytest.mark.parametrize("text", ["", "\n", "a\x1b[2Jb", 1001 * "n"])
def test_what_is_no_note_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="a note has 1 to 1000"):
        check_note(text)
    assert check_note("new seals,\n17 cells") == "new seals, 17 cells"


@pytest.mark.parametrize("spoilt", [nan, inf, -inf])
def test_what_a_list_says_of_another_programs_recording_is_json(tmp_path: Path, spoilt: float) -> None:
    """A time, a force or a residual that is no number took the whole list from the page."""
    columns = ("time_s", "force_n", *DERIVED, PULLING)
    recorder = Recorder(tmp_path / "recordings", {}, columns)
    for row in range(6):
        others = (spoilt if row % 3 else 1.0 for _ in columns[2:])
        recorder.append((spoilt if row % 2 else float(row), *others, 1.0))
    recorder.close()
    (summary,) = list_summaries(tmp_path)
    assert summary["duration_s"] == 0.0 and summary["facts"]["force_range_n"] == [1.0, 1.0]
    assert json.loads(json.dumps(list_summaries(tmp_path), allow_nan=False))[0]["rows"] == 6
