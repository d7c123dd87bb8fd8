"""What others put into the folder of the recordings, or take out of it, neither stops a recorder nor passes for a recording."""

import errno
import fcntl
import os
import shutil
from math import inf, nan
from pathlib import Path

import pytest

from gateway.recording import Recorder, RecordingError, find_recording, list_recordings, read_recording
from gateway.recording.care.keeping import is_being_recorded
from gateway.recording.care.summaries import list_summaries
from gateway.recording.reader import recording_paths
from gateway.service.fitting.ladder_source import rig_of_state
from tests.recording.test_recorder import COLUMNS, HEADER, record


@pytest.mark.parametrize("name", ["²", "٣.fgr", "9" * 200 + ".fgr", "-1.fgr", "1_0.fgr"])
def test_what_somebody_else_has_put_into_the_folder_is_no_number(name: str, tmp_path: Path) -> None:
    (tmp_path / "recordings").mkdir()
    (tmp_path / "recordings" / name).touch()
    path = record(tmp_path / "recordings", 1)
    assert path.name == "0001.fgr"
    assert [entry.number for entry in list_recordings(tmp_path)] == [1]


def test_a_pipe_or_a_device_among_the_recordings_is_not_read(tmp_path: Path) -> None:
    path = record(tmp_path / "recordings", 1)
    os.mkfifo(path.with_name("0002.fgr"))
    path.with_name("0003.fgr").symlink_to("/dev/zero")
    path.with_name("0004.fgr").mkdir()
    assert [entry.number for entry in list_recordings(tmp_path)] == [1]
    with pytest.raises(RecordingError, match=r"no recording 2 in .*; there: 1"):
        find_recording(tmp_path, 2)


@pytest.mark.parametrize("rows_left", [0, 1])
def test_who_deletes_a_recording_that_is_written_ends_it_and_it_says_so(rows_left: int, tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "recordings", HEADER, COLUMNS)
    recorder.append((0.0, 0.0, 0.0))
    recorder.write()
    shutil.rmtree(tmp_path / "recordings")
    for _ in range(rows_left):
        recorder.append((0.0, 0.0, 0.0))
    recorder.close()
    assert recorder.failure is not None
    assert recorder.failure.startswith("E402")
    assert "stopped after 1 rows: somebody has deleted its file; control goes on" in recorder.failure
    assert not recorder.is_open


def test_a_folder_that_may_not_be_read_is_not_an_empty_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its list said that there were no recordings, and how to make one."""
    (tmp_path / "recordings").mkdir()

    def refuse(path: object) -> list[str]:
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    assert recording_paths(tmp_path) == recording_paths(tmp_path / "none") == []
    with monkeypatch.context() as patched:
        for name in ("listdir", "scandir"):  # the one, or from Python 3.13 on the other
            patched.setattr(os, name, refuse)
        with pytest.raises(PermissionError):
            recording_paths(tmp_path)


def test_recordings_are_listed_by_number_and_not_by_the_letters_of_their_names(tmp_path: Path) -> None:
    first = record(tmp_path / "recordings", 1)
    for number in (9999, 10000, 123456):
        shutil.copy(first, first.with_name(f"{number:04d}.fgr"))
    assert [entry.number for entry in list_recordings(tmp_path)] == [1, 9999, 10000, 123456]
    assert record(tmp_path / "recordings", 1).name == "123457.fgr"


def test_a_recording_that_is_deleted_while_others_are_read_is_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A fit that looked for its ladder ended with `No such file` when old recordings were pruned at the same time."""
    paths = [record(tmp_path / "recordings", 1) for _ in range(3)]
    read = Path.read_bytes

    def prune_meanwhile(path: Path) -> bytes:
        if path == paths[0]:
            paths[1].unlink()
        return read(path)

    with monkeypatch.context() as patched:
        patched.setattr(Path, "read_bytes", prune_meanwhile)
        assert [(entry.number, entry.fault) for entry in list_recordings(tmp_path)] == [(1, ""), (3, "")]


@pytest.fixture
def unread(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Whoever reads a whole file fails: a year of them has gigabytes, which took minutes."""
    monkeypatch.setattr(Path, "read_bytes", lambda path: pytest.fail(f"{path} was read as a whole"))
    return monkeypatch


def test_what_is_asked_of_all_recordings_reads_no_row_of_them(tmp_path: Path, unread: pytest.MonkeyPatch) -> None:
    paths = [record(tmp_path / "recordings", 1) for _ in range(3)]
    with pytest.raises(RecordingError, match=r"no recording 7 in .*; there: 1, 2, 3$"):
        find_recording(tmp_path, 7)
    for spoilt in (b"no recording", b""):
        paths[2].write_bytes(spoilt)
        assert rig_of_state(tmp_path) == HEADER["rig"]


def test_who_looks_every_few_seconds_reads_no_recording_that_grows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The page read all of it every two seconds: 250 MB by the hour, and three times that in memory."""
    ended = record(tmp_path / "recordings", 2)
    recorder = Recorder(tmp_path / "recordings", HEADER | {"name": "all night"}, COLUMNS)
    recorder.append((0.0, 0.0, 0.0))
    recorder.write()
    whole, grows = list_summaries(tmp_path, reads_growing=False)
    assert (whole["file"], whole["rows"]) == (ended.name, 6)
    assert (grows["number"], grows["name"], grows["growing"], grows["rows"], grows["fault"]) == (
        2,
        "all night",
        True,
        0,
        "",
    )
    assert list_summaries(tmp_path)[1]["rows"] == 1, "who asks once is told all"
    recorder.append((1.0, 0.0, 0.0))
    recorder.write()
    with monkeypatch.context() as patched:
        patched.setattr(Path, "read_bytes", lambda path: pytest.fail(f"{path} was read as a whole"))
        assert list_summaries(tmp_path, reads_growing=False)[1]["growing"]
    recorder.close()
    assert list_summaries(tmp_path, reads_growing=False)[1]["rows"] == 2


@pytest.mark.parametrize("number", [nan, inf, -inf])
@pytest.mark.parametrize("place", ["zero_n", "ladder.step_v"])
def test_a_header_s_number_that_is_none_is_not_counted_with(number: float, place: str, tmp_path: Path) -> None:
    """JSON as Python reads it has such numbers."""
    header = {"zero_n": number} if place == "zero_n" else {"ladder": {"step_v": number}}
    recorder = Recorder(tmp_path, header, ("time_s", "force_n"))
    recorder.close()
    with pytest.raises(RecordingError, match=f"whose {place} is no number"):
        read_recording(recorder.path)


def test_who_looks_whether_a_recording_is_being_written_is_not_taken_for_who_writes_it(tmp_path: Path) -> None:
    """Two lists at once: each would have told that nothing may be deleted."""
    path = record(tmp_path / "recordings", 1)
    with path.open("rb") as other:
        fcntl.flock(other, fcntl.LOCK_SH)
        assert not is_being_recorded(path)


@pytest.mark.parametrize("earlier", [[True], [1.0], 3, ["1"]])
def test_what_a_recording_continues_are_numbers_of_others(earlier: object, tmp_path: Path) -> None:
    recorder = Recorder(tmp_path, {"continues": earlier}, ("time_s",))
    recorder.close()
    with pytest.raises(RecordingError, match="continues is no list of recordings' numbers"):
        read_recording(recorder.path)
