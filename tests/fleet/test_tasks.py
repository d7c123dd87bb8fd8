"""A file of a fleet, and the row of one that has no answer."""

from pathlib import Path

import pytest

from gateway.fleet.tasks import Task, error_row, find_tasks
from gateway.recording import RecordingError


def test_an_error_row_does_not_say_its_file_twice() -> None:
    """`bad.csv: E403 bad.csv: no column time_s` was told, of a long path over two lines of a terminal."""
    task = Task("recordings/bad.csv", "", "", "")
    row = error_row(task, RecordingError("recordings/bad.csv: no column time_s"))
    assert (row["file"], row["error_code"], row["error"]) == ("recordings/bad.csv", "E403", "no column time_s")
    assert error_row(task, RecordingError("recordings/bad.csv:3: 2 cells"))["error"] == "recordings/bad.csv:3: 2 cells"


def test_a_file_that_may_not_be_read_is_told_without_a_number_and_its_name_once() -> None:
    error = PermissionError(13, "Permission denied", "recordings/bad.fgr")
    assert error_row(Task("recordings/bad.fgr", "7", "", ""), error)["error"] == "Permission denied"


@pytest.mark.parametrize(
    ("written", "date"),
    [
        ("2026-11-01", "2026-11-01"),
        ("20261101", "2026-11-01"),
        ("2026-W44-7", "2026-11-01"),
        ("1.11.2026", "1.11.2026"),
    ],
)
def test_a_day_is_one_however_its_folder_spells_it(tmp_path: Path, written: str, date: str) -> None:
    """Of a cell with both spellings days were out of order, as texts are put, and one day was two."""
    folder = tmp_path / "cell=7" / f"date={written}"
    folder.mkdir(parents=True)
    (folder / "press.csv").write_text("time_s\n")
    assert [(one.cell, one.date) for one in find_tasks([f"{folder}/*.csv"])] == [("7", date)]


def test_a_link_that_leads_nowhere_is_a_recording_that_cannot_be_read_and_a_folder_is_none(tmp_path: Path) -> None:
    """Of a store that is not mounted: its day would be missing without a word."""
    (tmp_path / "gone.csv").symlink_to(tmp_path / "nowhere.csv")
    (tmp_path / "folder.csv").mkdir()
    assert [Path(one.path).name for one in find_tasks([f"{tmp_path}/*.csv"])] == ["gone.csv"]
