"""What a gateway and its tools write to a state directory, each as something that somebody asks for and is told of.

`prepare` makes what is there before; `run` does it, and tells `say` what it acknowledges, as soon as it does; `check` reads
the directory as whoever comes next would, and fails when something is neither the old nor the new, or acknowledged and gone.
"""

import contextlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ClassVar

from gateway.audit.audit_file import AuditFile, Place
from gateway.audit.audit_reader import read_audit, verify_audit
from gateway.bsfm import Calibration
from gateway.calibrations.store import CalibrationStore
from gateway.numbered_documents.store import NumberedStore, StoreError
from gateway.plants.force_reference import ForceReference, keep_reference, read_reference
from gateway.plants.store import PlantStore
from tests.calibrations.coefficients import calibration, mark_of
from tests.plants.test_plant_store import bowed, numbered

Say = Callable[[Any], None]


class Act(ABC):
    """One of them. refusals: what it may raise, with a sentence for people."""

    refusals: ClassVar[tuple[type[Exception], ...]] = (OSError,)

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
    """Batches of the audit, over several files of which the oldest go; each second one is synced with the one before it."""

    BATCHES = 19

    def run(self, say: Say) -> None:
        first = 1 + max((record.get("old", 0) for record in read_audit(self.state)), default=0)
        file, refusals, again = AuditFile(self.state, longest_bytes=1200, kept=2), [], False
        written, place = list[dict[str, Any]](), Place()
        with contextlib.closing(file):
            for number in range(first, first + self.BATCHES):
                written.append({"what": "force_setpoint", "old": number, "new": number + 1})
                try:
                    if not (put := file.write(written if again else written[-1:], again=again)):
                        file.sync(place)
                        del written[:-1]
                        put = file.write(written)
                    assert put
                    place, again = put.place, False
                    if number % 2:
                        file.sync(place)
                        written.clear()
                        say(number)
                except OSError as refusal:  # as long as the gateway runs it goes on with the same file
                    refusals.append(refusal)
                    again = True
        if refusals:
            raise refusals[0]

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
