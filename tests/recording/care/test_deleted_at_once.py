"""Two who delete or keep one recording at once, and a disk that does not give one: told in words."""

from pathlib import Path
from typing import Any

import pytest

from gateway.recording import read_entry
from gateway.recording.care import keeping, summaries
from gateway.recording.care.keeping import delete_recording, keep_recording, let_recording_go
from gateway.watch.reference_recording import why_no_reference
from tests.disk.failing_disks import FailingDisk
from tests.disk.watched_disk import watching
from tests.recording.care.test_care import record


def test_one_that_is_kept_or_deleted_while_it_is_deleted_stays_or_is_not_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who is the first at the folder's lock is the first."""
    whole = keeping.lock_directory
    acts = [keep_recording, Path.unlink]

    def lock_late(folder: Path) -> Any:
        monkeypatch.setattr(keeping, "lock_directory", whole)
        acts.pop(0)(path)
        return whole(folder)

    path = record(tmp_path)
    monkeypatch.setattr(keeping, "lock_directory", lock_late)
    assert delete_recording(path, "") == "it is kept" and path.exists()
    let_recording_go(path)
    monkeypatch.setattr(keeping, "lock_directory", lock_late)
    with pytest.raises(FileNotFoundError):
        delete_recording(path, "")


def test_two_that_delete_the_only_one_meet_no_error_of_ours(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = record(tmp_path)
    monkeypatch.setattr(keeping, "why_protected", lambda one, reference: one.unlink() or "")
    with pytest.raises(FileNotFoundError):
        delete_recording(path, "")


def test_what_the_disk_does_not_give_is_told_in_words(tmp_path: Path) -> None:
    path = record(tmp_path)
    with watching(FailingDisk(tmp_path, "broken", 2)):
        faults = {read_entry(path).fault, summaries.summary_of(path)["fault"], why_no_reference(path)}
    assert faults == {f"{path}: Input/output error: the disk is broken, or gone (dmesg)"}
