"""Events on a disk that fails: what is not kept is counted, and what comes afterwards is kept and read."""

from pathlib import Path

import pytest

from gateway.processes.event import EventRecord, make_event
from gateway.processes.event_file import EventFile, EventReader
from gateway.processes.event_log import _EventFileWriter
from tests.disk.failing_disks import FailingDisk, describe
from tests.disk.power_cut import JournaledDisk
from tests.disk.test_failing_calls import STRIDE, disks
from tests.disk.watched_disk import watching

EVENTS = 24
FILE_BYTES = 600
"""So that files are full after a few events, and get their next names."""


class Writer:
    """One process's events on their way to the file. alarms: codes of what it said where people look."""

    def __init__(self, state: Path, longest_bytes: int = FILE_BYTES) -> None:
        self.alarms: list[str] = []
        self._file = EventFile(state, longest_bytes)
        self._write = _EventFileWriter(self._file, lambda event: self.alarms.append(event.code), self._event)

    def _event(self, cause: str, sentence: str) -> EventRecord:
        return make_event(0.0, "control", cause, sentence)

    def write(self, number: int) -> None:
        """One event, as the queue's thread does: an error of the disk is none of the loop's."""
        try:
            self._write(self._event("test", f"event {number}"))
        except OSError:
            pass

    def close(self) -> None:
        self._file.close()


def stored(state: Path) -> list[str]:
    with EventReader(state) as reader:
        return [event.text for event in reader.read_stored()]


def lost_of(text: str) -> int:
    words = text.split()
    return int(words[1] if words[0] == "E150" else words[0]) if "not kept before" in text else 0


@pytest.mark.parametrize("kind", FailingDisk.KINDS)
def test_what_is_not_kept_is_counted(fast_folder: Path, kind: str, budget: int) -> None:
    worst = 0
    for state, disk in disks(fast_folder, kind, 1 if budget > 1 else STRIDE):
        writer = Writer(state, 1 << 20)
        with watching(disk):
            for number in range(EVENTS):
                writer.write(number)
        for number in range(EVENTS, EVENTS + 2):
            writer.write(number)
        writer.close()
        texts = stored(state)
        kept = [int(text.split()[1]) for text in texts if text.startswith("event ")]
        counted = sum(lost_of(text) for text in texts)
        assert kept == sorted(set(kept)), describe(disk)
        assert len(kept) + counted == EVENTS + 2, f"{describe(disk)}: {texts}"
        assert kept[-2:] == [EVENTS, EVENTS + 1], "the disk is well again"
        assert bool(counted) == bool(writer.alarms), "lost, and said"
        assert set(writer.alarms) <= {"E150"}
        worst = max(worst, counted)
    assert worst > 0


def test_whatever_fails_in_a_rotation_the_files_stay_few_and_readable(fast_folder: Path, budget: int) -> None:
    for kind in FailingDisk.KINDS:
        (fast_folder / kind).mkdir()
        for state, disk in disks(fast_folder / kind, kind, 1 if budget > 1 else 5 * STRIDE):
            writer = Writer(state)
            with watching(disk):
                for number in range(2 * EVENTS):
                    writer.write(number)
            for number in range(2 * EVENTS, 2 * EVENTS + 12):
                writer.write(number)
            writer.close()
            assert f"event {2 * EVENTS + 11}" in stored(state), describe(disk)
            files = list(state.glob("events.jsonl*"))
            assert len(files) <= 5
            assert max(path.stat().st_size for path in files) <= 2 * FILE_BYTES or kind == "read-only"


def test_after_a_power_cut_the_next_ones_first_event_is_read(fast_folder: Path, budget: int) -> None:
    state = fast_folder / "state"
    state.mkdir()
    disk, writer = JournaledDisk(state), Writer(state)
    with watching(disk):
        for number in range(EVENTS):
            writer.write(number)
    writer.close()
    torn = 0
    for cut in range(0, len(disk.changes) + 1, 1 if budget > 1 else 5):
        for mode, tree in disk.states(cut, 0):
            after = fast_folder / f"{cut}-{mode}"
            tree.write_to(after)
            before = stored(after)
            file = after / "events.jsonl"
            torn += file.exists() and not file.read_bytes().endswith(b"\n")
            following = Writer(after, 1 << 20)
            following.write(1000)
            following.close()
            texts = stored(after)
            assert texts[-1] == "event 1000", (cut, mode)
            assert set(before) <= set(texts)
    assert torn > 0, "no cut has left a piece of a line"
