"""A file of a fleet, and the row of one that has no answer."""

from gateway.fleet.tasks import Task, error_row
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
