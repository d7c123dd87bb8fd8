"""What a gateway and its tools write to a state directory, each as something that somebody asks for and is told of.

`prepare` makes what is there before; `run` does it, and tells `say` what it acknowledges, as soon as it does; `check` reads
the directory as whoever comes next would, and fails when something is neither the old nor the new, or acknowledged and gone.
"""

import contextlib
import shutil
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any, ClassVar

from gateway.audit.audit_file import AuditFile
from gateway.audit.audit_reader import read_audit, verify_audit
from gateway.bsfm import Calibration
from gateway.calibrations.store import CalibrationStore
from gateway.cli.state_archive import ArchiveError, pack, unpack
from gateway.numbered_documents.store import NumberedStore, StoreError
from gateway.plants.force_reference import ForceReference, keep_reference, read_reference
from gateway.plants.store import PlantStore
from gateway.recording import Recorder, list_recordings, read_recording
from gateway.recording.care.keeping import delete_recording, is_kept, keep_recording
from gateway.recording.recorder import sync_recording
from gateway.watch.reference_recording import keep_reference_recording, read_reference_recording, reference_path
from tests.calibrations.coefficients import calibration, mark_of
from tests.plants.test_plant_store import bowed, numbered

Say = Callable[[Any], None]


class Act(ABC):
    """One of them. refusals: what it may raise, with a sentence for people; is_synced: whether what it acknowledges is to be
    there after a power cut, too."""

    refusals: ClassVar[tuple[type[Exception], ...]] = (OSError,)
    is_synced: ClassVar[bool] = True

    def __init__(self, state: Path) -> None:
        self.state = state

    def prepare(self) -> None:  # noqa: B027 - most begin with nothing
        """Make what is there before."""

    @abstractmethod
    def run(self, say: Say) -> None:
        """Do it, and say what is acknowledged. Raises one of the refusals."""

    @abstractmethod
    def check(self, said: Sequence[Any]) -> None:
        """Judge what is there. said: what was acknowledged, in order."""


class StoredCalibrations(Act):
    """Two commits and a rollback: the mark in use is the last one acknowledged, or the one that was under way."""

    refusals = (StoreError,)
    WAY = (1, 4, 5, 4)

    def prepare(self) -> None:
        store = self._store()
        store.use(store.add(calibration(1)), 1)

    def run(self, say: Say) -> None:
        for mark in self.WAY[1:3]:
            store = self._store()
            store.use(store.add(calibration(mark)), mark)
            say(mark)
        store.use(store.previous().number)
        say(self.WAY[3])

    def check(self, said: Sequence[Any]) -> None:
        store = self._store()
        damaged = [entry.fault for entry in store.list() if entry.fault]
        assert not damaged, damaged
        selected = store.find_selected()
        assert selected.notes == () and selected.document is not None
        allowed = self.WAY[len(said) :][:2]
        assert mark_of(selected.document) in allowed, f"{selected.document.name} after {said}"

    def _store(self) -> NumberedStore[Calibration]:
        return CalibrationStore(self.state)


class StoredPlants(Act):
    """Plant use, with the reference of the force before."""

    refusals = (StoreError, OSError)

    def prepare(self) -> None:
        store = PlantStore(self.state)
        for bow in (1e-3, 2e-3):
            store.add(numbered(bowed(cell__quadratic_per_n=bow)))
        store.use(1)
        keep_reference(self.state, ForceReference(1, "0001.fgr", 0, ()))

    def run(self, say: Say) -> None:
        PlantStore(self.state).use(2)
        say("used")
        keep_reference(self.state, ForceReference(2, "0002.fgr", 1, ()))
        say("kept")

    def check(self, said: Sequence[Any]) -> None:
        store = PlantStore(self.state)
        assert [entry.fault for entry in store.list()] == ["", ""]
        selected = store.find_selected()
        assert selected.notes == ()
        assert selected.selection.number in ((2,) if said else (1, 2))
        references = [read_reference(self.state, plant) for plant in (1, 2)]
        assert references[1] if "kept" in said else any(references), "neither the old reference nor the new one"


class AuditedWrites(Act):
    """Batches of the audit, over several files of which the oldest go."""

    BATCHES = 9

    def run(self, say: Say) -> None:
        first = 1 + max((record.get("old", 0) for record in read_audit(self.state)), default=0)
        file = AuditFile(self.state, longest_bytes=700, kept=2)
        with contextlib.closing(file):
            for number in range(first, first + self.BATCHES):
                file.append([{"what": "force_setpoint", "old": number, "new": number + 1}])
                say(number)

    def check(self, said: Sequence[Any]) -> None:
        if not said and not (self.state / "audit").is_dir():
            return
        with contextlib.suppress(FileNotFoundError):
            assert verify_audit(self.state).broken is None, verify_audit(self.state)
        kept = [record["old"] for record in read_audit(self.state) if "old" in record]
        assert kept == sorted(set(kept)), "twice, or out of order"
        told = [record for record in read_audit(self.state) if record["what"] == "chain broken"]
        assert not told, told
        assert not said or (kept and kept[-1] >= said[-1]), f"{said[-1]} was acknowledged, {kept} are kept"


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
        recorder.flush(0.0)
        for batch in range(4):
            for row in range(batch * self.ROWS, (batch + 1) * self.ROWS):
                recorder.append((0.01 * row, 1.0, float(row)))
            recorder.flush(1.0 + batch)
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

    is_synced = True

    def run(self, say: Say) -> None:
        told: list[tuple[str, int]] = []
        recorder = self._begin()
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


class Archived(Act):
    """What backup and restore have in common: a small state directory, and an archive of it."""

    def _fill(self, word: str) -> None:
        for name in ("calibrations/0001.yaml", "events.jsonl", "recordings/0001.fgr"):
            (self._cell / name).parent.mkdir(parents=True, exist_ok=True)
            (self._cell / name).write_text(word * 2000)

    def _words_in(self, folder: Path) -> set[str]:
        """The words of the files, each of which holds one word only."""
        texts = [path.read_text() for path in sorted(folder.rglob("*")) if path.is_file()]
        assert len(texts) == 3, f"{len(texts)} files"
        assert all(text == text[:3] * 2000 for text in texts), "torn"
        return {text[:3] for text in texts}

    @property
    def _cell(self) -> Path:
        return self.state / "cell"

    @property
    def _archive(self) -> Path:
        return self.state / "kept.tar.gz"


class BackedUp(Archived):
    """A backup replaces the one before."""

    def prepare(self) -> None:
        self._fill("old")
        pack(self._cell, self._archive)
        self._fill("new")

    def run(self, say: Say) -> None:
        pack(self._cell, self._archive)
        say("packed")

    def check(self, said: Sequence[Any]) -> None:
        target = self.state / "elsewhere"
        unpack(self._archive, target)
        assert self._words_in(target) in (({"new"},) if said else ({"old"}, {"new"}))
        shutil.rmtree(target)
        assert self._words_in(self._cell) == {"new"}


class Restored(Archived):
    """A backup is restored over what has changed since."""

    refusals = (OSError, ArchiveError)

    def prepare(self) -> None:
        self._fill("new")
        pack(self._cell, self._archive)
        self._fill("old")

    def run(self, say: Say) -> None:
        unpack(self._archive, self._cell)
        say("restored")

    def check(self, said: Sequence[Any]) -> None:
        if not self._cell.exists():  # set aside, and the disk took no other rename: the refusal has said where
            self._cell.with_name("cell.before-restore-1").rename(self._cell)
        assert self._words_in(self._cell) in (({"new"},) if said else ({"old"}, {"new"}))


ACTS = (
    StoredCalibrations,
    StoredPlants,
    AuditedWrites,
    OneRecording,
    KeptRecordings,
    ReferenceRecordingKept,
    BackedUp,
    Restored,
)
