"""The rig's reference recording is the one that was chosen, and what is kept is kept, whatever the disk did meanwhile."""

import contextlib
from hashlib import sha256
from pathlib import Path

from gateway.recording import Recorder
from gateway.recording.care.keeping import is_kept, keep_recording
from gateway.watch.reference_recording import (
    drop_reference_recording,
    keep_reference_recording,
    read_reference_recording,
    reference_path,
)
from tests.disk.failing_disks import FailingDisk, describe
from tests.disk.power_cut import JournaledDisk
from tests.disk.watched_disk import watching


def test_the_same_recording_chosen_again_when_it_has_grown_is_never_half_the_old_and_half_the_new(
    fast_folder: Path,
) -> None:
    for number in range(1, 40):
        (state := fast_folder / f"{number}").mkdir()
        (recording := state / "0007.fgr").write_bytes(b"rows")
        keep_reference_recording(state, recording)
        recording.write_bytes(b"rows and more")
        disk = FailingDisk(state, "broken", number)
        with watching(disk), contextlib.suppress(OSError):
            keep_reference_recording(state, recording)
        known = read_reference_recording(state)
        assert known and sha256(reference_path(state, known).read_bytes()).hexdigest() == known.sha256, describe(disk)
    assert not disk.has_failed


def test_a_reference_that_was_dropped_is_gone_after_a_power_cut(fast_folder: Path) -> None:
    (state := fast_folder / "state").mkdir()
    (recording := state / "0007.fgr").write_bytes(b"rows")
    keep_reference_recording(state, recording)
    disk = JournaledDisk(state)
    with watching(disk):
        assert drop_reference_recording(state)
    for mode, tree in disk.states(len(disk.changes), 0):
        tree.write_to(fast_folder / mode)
        assert read_reference_recording(fast_folder / mode) is None, mode


def test_a_recording_that_is_said_to_be_kept_is_kept_after_a_power_cut(fast_folder: Path) -> None:
    recorder = Recorder(fast_folder / "recordings", {"rig": "demo"}, ("time_s",))
    recorder.close()
    disk = JournaledDisk(fast_folder / "recordings")
    with watching(disk):
        keep_recording(recorder.path)
    for mode, tree in disk.states(len(disk.changes), 0):
        tree.write_to(fast_folder / mode)
        assert is_kept(fast_folder / mode / recorder.path.name), mode
