"""What is recorded, kept and deleted, each as an act (acts.py)."""

import contextlib
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

from gateway.recording import Recorder, list_recordings, read_recording
from gateway.recording.care.keeping import delete_recording, is_kept, keep_recording
from gateway.recording.recorder import sync_recording
from gateway.watch.reference_recording import keep_reference_recording, read_reference_recording, reference_path
from tests.disk.acts.acts import Act, Say


class OneRecording(Act):
    """A recording of four batches, each acknowledged when it is written; a killed process loses none, a power cut may."""

    is_synced = False
    COLUMNS = ("time_s", "command_v", "force_n")
    ROWS = 5

    def run(self, say: Say) -> None:
        self._write(self._begin(), say)

    def _begin(self) -> Recorder:
        return Recorder(self.state / "recordings", {"rig": "demo", "rig_texts": {"demo.yaml": "é" * 200}}, self.COLUMNS)

    def _write(self, recorder: Recorder, say: Say) -> None:
        for batch in range(4):
            for row in range(batch * self.ROWS, (batch + 1) * self.ROWS):
                recorder.append((0.01 * row, 1.0, float(row)))
            recorder.write()
            if recorder.failure:
                assert recorder.failure.startswith("E402")
                raise OSError(recorder.failure)
            say((recorder.path.name, recorder.rows_written))
        recorder.close()

    def check(self, said: Sequence[Any]) -> None:
        for name, count in dict(said).items():
            assert self._rows_of(self.state / "recordings" / name) >= count
        assert not [entry.fault for entry in list_recordings(self.state) if entry.rows and entry.fault]

    def _rows_of(self, path: Path) -> int:
        """How many rows can be read: whole batches, in order, of which a power cut may leave some out."""
        recording = read_recording(path)
        rows = recording.columns["force_n"].astype(int).tolist()
        firsts = rows[:: self.ROWS]
        assert rows == [first + row for first in sorted(set(firsts)) for row in range(self.ROWS)]
        return recording.rows


class SyncedRecording(OneRecording):
    """The same, told when it has begun, and when it has ended, once that is on the disk."""

    def run(self, say: Say) -> None:
        told: list[tuple[str, int]] = []
        with contextlib.closing(self._begin()) as recorder:
            sync_recording(recorder.path)
            say((recorder.path.name, 0))
            self._write(recorder, told.append)
        sync_recording(recorder.path)
        say(told[-1])


class KeptRecordings(Act):
    """One is kept (again), another deleted; its number is not given again."""

    def prepare(self) -> None:
        for _ in range(3):
            Recorder(self.state / "recordings", {"rig": "demo"}, ("time_s",)).close()
        keep_recording(self._path(1))

    def run(self, say: Say) -> None:
        keep_recording(self._path(1))
        if self._path(3).exists():
            assert delete_recording(self._path(3), "") == ""
        say("deleted")

    def check(self, said: Sequence[Any]) -> None:
        assert is_kept(self._path(1)), "what was kept is not protected any more"
        assert self._path(2).exists()
        assert not (said and self._path(3).exists())
        recorder = Recorder(self.state / "recordings", {"rig": "demo"}, ("time_s",))
        recorder.close()
        recorder.path.unlink()
        assert recorder.number > 3, "the number of one that was deleted was given again"

    def _path(self, number: int) -> Path:
        return self.state / "recordings" / f"{number:04d}.fgr"


class ReferenceRecordingKept(Act):
    """Another recording is chosen as the rig's reference."""

    def prepare(self) -> None:
        for number in (1, 2):
            self._path(number).parent.mkdir(parents=True, exist_ok=True)
            self._path(number).write_bytes(b"%d" % number * 3000)
        keep_reference_recording(self.state, self._path(1))

    def run(self, say: Say) -> None:
        keep_reference_recording(self.state, self._path(2))
        say("chosen")

    def check(self, said: Sequence[Any]) -> None:
        reference = read_reference_recording(self.state)
        assert reference is not None, "neither the old reference nor the new one"
        assert reference.name in (("0002.fgr",) if said else ("0001.fgr", "0002.fgr"))
        assert sha256(reference_path(self.state, reference).read_bytes()).hexdigest() == reference.sha256

    def _path(self, number: int) -> Path:
        return self.state / "recordings" / f"{number:04d}.fgr"
