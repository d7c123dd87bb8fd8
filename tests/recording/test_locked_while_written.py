"""What is recorded is locked, and so neither deleted nor pruned."""

import fcntl
from pathlib import Path

import pytest

from gateway.recording import Recorder
from gateway.recording.care.keeping import is_being_recorded
from gateway.recording.recorder import _create_next


def test_who_looks_at_a_new_recording_keeps_it_not_from_being_locked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    looked = []

    def create_and_look(directory: Path) -> tuple[int, Path, int]:
        made = _create_next(directory)
        looked.append(made[1].open("rb"))
        fcntl.flock(looked[0], fcntl.LOCK_SH)
        return made

    monkeypatch.setattr("gateway.recording.recorder._create_next", create_and_look)
    monkeypatch.setattr("gateway.recording.recorder.time.sleep", lambda _: looked[0].close())
    recorder = Recorder(tmp_path, {}, ("time_s",))
    assert looked[0].closed and is_being_recorded(recorder.path)
    recorder.close()
