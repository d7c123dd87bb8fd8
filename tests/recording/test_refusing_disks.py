"""Why a disk ends a recording is told by its cause: full, a quota, a limit on files, read-only, broken."""

import errno
import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from gateway.recording import Recorder, read_recording
from gateway.recording.care import keeping
from tests.recording.test_recorder import COLUMNS, HEADER, record


@contextmanager
def files_of_at_most(size_bytes: int) -> Iterator[None]:
    """No file of this process gets longer meanwhile, as under `ulimit -f` or on a FAT file system: nor does the report of the
    tests, so the limit ends with what it is for."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size_bytes, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("more_bytes", [0, 10])
def test_a_limit_on_the_length_of_files_is_told_as_one(tmp_path: Path, more_bytes: int) -> None:
    """It said that the disk is full: of the batch that reaches the limit a part still fits."""
    recorder = Recorder(tmp_path, HEADER, COLUMNS)
    recorder.append((0.0, 1.0, 2.0))
    recorder.write()
    with files_of_at_most(recorder.size_bytes + more_bytes):
        recorder.append((0.1, 1.0, 2.0))
        recorder.write()
    assert recorder.failure is not None
    assert "after 1 rows: File too large: longer than a process may write here (ulimit -f" in recorder.failure
    assert "full" not in recorder.failure
    assert recorder.rows_written == 1  # `record off` tells it
    recorder.close()
    assert read_recording(recorder.path).rows == 1


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.ENOSPC, "the disk is full"),
        (errno.EDQUOT, "Disk quota exceeded: this user may store no more"),
        (errno.EFBIG, "ulimit -f"),
        (errno.EROFS, "Read-only file system"),
        (errno.EIO, "the disk is broken, or gone"),
    ],
)
def test_what_ends_a_recording_is_told_by_its_cause(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, words: str
) -> None:
    """A part is taken first, and the cause is told by the call for the rest."""
    recorder = Recorder(tmp_path, HEADER, COLUMNS)
    write, calls = os.write, [10]

    def refuse(descriptor: int, data: bytes) -> int:
        if calls:
            return write(descriptor, data[: calls.pop()])
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "write", refuse)
    recorder.append((0.1, 1.0, 2.0))
    recorder.write()
    assert recorder.failure is not None and words in recorder.failure


@pytest.mark.parametrize("taken", [0, 20])
def test_a_disk_that_takes_no_header_is_left_without_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, taken: int
) -> None:
    """Each list would show a recording that nobody can read, and each try would leave one more."""
    write, parts = os.write, [taken]

    def refuse(descriptor: int, data: bytes) -> int:
        if parts and (part := parts.pop()):
            return write(descriptor, data[:part])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "write", refuse)
    with pytest.raises(OSError, match="No space left"):
        Recorder(tmp_path / "recordings", HEADER, COLUMNS)
    assert list((tmp_path / "recordings").iterdir()) == []


def test_a_link_to_a_disk_that_is_not_mounted_is_no_file_that_exists(tmp_path: Path) -> None:
    """`record on` said 'E141 .../recordings: File exists' where recordings lead to another disk, and that is away."""
    (tmp_path / "recordings").symlink_to(tmp_path / "not mounted")
    with pytest.raises(FileNotFoundError):
        Recorder(tmp_path / "recordings", HEADER, COLUMNS)
    (tmp_path / "not mounted").mkdir()
    Recorder(tmp_path / "recordings", HEADER, COLUMNS).close()
    assert [path.name for path in (tmp_path / "not mounted").iterdir()] == ["0001.fgr"]


def test_on_a_full_disk_room_is_made_by_what_needs_no_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Only the highest number would be given again, and is marked before its recording goes."""
    older, between, newest = (record(tmp_path / "recordings", 1) for _ in range(3))
    between.unlink()

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(keeping, "open_plain", full)
    assert keeping.delete_recording(older, "") == "" and not older.exists()
    with pytest.raises(OSError, match="No space"):
        keeping.delete_recording(newest, "")
    assert newest.exists()
