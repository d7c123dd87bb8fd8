"""A rig that records each part has 100 000 recordings in a year: what prunes them must not look through all for each."""

import os
from pathlib import Path

import pytest

from gateway.profiles.recordings_section import Retention
from gateway.recording import Recorder
from gateway.recording.care import keeping
from gateway.recording.care.keeping import delete_recording, prune_recordings


def make_recordings(state: Path, number: int) -> list[Path]:
    folder = state / "recordings"
    folder.mkdir()
    paths = [folder / f"{k:04d}.fgr" for k in range(1, number + 1)]
    for at_s, path in enumerate(paths, 1_700_000_000):
        path.touch()
        os.utime(path, (at_s, at_s))
    return paths


def test_each_of_the_oldest_goes_without_a_look_at_all_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of 100 000 the first 20 000 took an hour, and 3 of 4 turns of control's process all the while."""
    *old, newest = make_recordings(tmp_path, 60)
    looks: list[Path] = []
    listed = keeping._numbers
    monkeypatch.setattr(keeping, "_numbers", lambda folder: looks.append(folder) or listed(folder))
    gone = prune_recordings(tmp_path, Retention(days=1.0), newest.name)
    assert [one.path for one in gone] == old
    assert len(looks) <= 1


def test_the_highest_number_is_not_given_again_whatever_is_missing_before_it(tmp_path: Path) -> None:
    paths = make_recordings(tmp_path, 6)
    paths[3].unlink()  # by hand: number 3 has no next one, and is not the highest
    for path in (paths[2], paths[5], paths[4]):
        assert delete_recording(path, "") == "", path
    assert sorted(path.name for path in paths[0].parent.iterdir()) == ["0001.fgr", "0002.fgr", "0006.gone"]
    recorder = Recorder(paths[0].parent, {}, ("time_s",))
    recorder.close()
    assert recorder.number == 7


def test_of_the_numbers_that_are_not_given_again_the_highest_alone_is_marked(tmp_path: Path) -> None:
    """Who deletes each recording that he has made would have a mark of each for good."""
    folder = tmp_path / "recordings"
    for _ in range(3):
        recorder = Recorder(folder, {}, ("time_s",))
        recorder.close()
        assert delete_recording(recorder.path, "") == ""
    assert [path.name for path in folder.iterdir()] == ["0003.gone"]
