"""Numbered documents, calibrations or plants: which may be in use, and which numbers were given, after what was said."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, ClassVar, NamedTuple

from gateway.calibrations.store import CalibrationStore
from gateway.numbered_documents.store import NumberedStore, StoreError
from gateway.plants.store import PlantStore
from tests.calibrations.coefficients import calibration
from tests.disk.drawn.players.player import Player
from tests.plants.test_plant_store import numbered

BUILT_IN = calibration(0, number=1000)
_PLANT = numbered()


class InUse(NamedTuple):
    """What the selection says: the document in use, and the one before it; None for the built-in one."""

    active: int | None = None
    previous: int | None = None

    def after(self, number: int | None) -> "InUse":
        """Behind a change; one that is chosen again leaves what can be gone back to."""
        return self if number == self.active else InUse(number, self.active)


class StorePlayer(Player):
    """possible: what may be in use; documents: marks by the numbers that were told; seen: numbers that were ever there."""

    def __init__(self, scene: Any) -> None:
        super().__init__(scene)
        self.possible = {InUse()}
        self.documents: dict[int, str] = {}
        self.seen: set[int] = set()
        self.mark = 0
        self.changes = 0
        self.unsynced: set[InUse] = set()

    def store(self) -> NumberedStore[Any]:
        """As each process opens it."""
        raise NotImplementedError

    def document(self, mark: int) -> Any:
        """One that is known by its mark."""
        raise NotImplementedError

    def mark_of(self, document: Any) -> str:
        """The mark."""
        raise NotImplementedError

    # -- what is done

    def act(self) -> None:
        act: Callable[[], None] = self.rng.choice(
            [self._add, self._add, self._use, self._use, self._use, self._roll_back, self._look]
        )
        act()

    def _add(self) -> None:
        self.mark += 1
        mark, before = self.mark, self._numbers_there()
        try:
            number = self.store().add(self.document(mark))
        except (StoreError, OSError) as refusal:
            self._refused("add", refusal)
            return
        self.scene.note(f"added {self.folders[0]} {number}, mark {mark}")
        if number in (self.documents if not self.is_touched else ()) or number in before:
            self.complain(f"number {number} is given again")
        self.documents[number] = str(mark)

    def _use(self) -> None:
        numbers = [None, *self.documents, *self.documents, self.rng.randrange(1, 9)]
        self._change(self.rng.choice(numbers))

    def _change(self, number: int | None) -> None:
        slot = self.rng.choice([None, None, 0, 3])
        before = self.possible
        self.possible = before | {one.after(number) for one in before}
        self.changes += 1
        count = self.changes
        try:
            self.store().use(number, slot)
        except (StoreError, OSError) as refusal:
            self._refused(f"use {number}", refusal)
            if number in self.documents and str(refusal).startswith("E433") and not self.is_touched:
                self.complain(f"{number} was stored, and is not known: {refusal}")
            if any(call.what == "fsync" for call in self.disk.refused):
                self.unsynced |= self.possible  # neither the name is on the disk for certain, nor its removal
            if not self._may_stand() and count == self.changes:
                self.possible = before
            return
        self.unsynced = set()
        self.scene.note(f"in use {self.folders[0]} {number}")
        earlier = before if count == self.changes else self.possible
        self.possible = {one.after(number) for one in earlier}
        if number is not None and number not in self.documents and number != BUILT_IN.number and not self.is_touched:
            self.documents[number] = ""  # of an add that was killed

    def _roll_back(self) -> None:
        try:
            number = self.store().previous().number
        except (StoreError, OSError) as refusal:
            self._refused("roll back", refusal)
            return
        allowed = {one.previous for one in self.possible}
        if number not in allowed and not self.is_touched:
            self.complain(f"a rollback leads to {number}, {self.possible} may be in use")
        self._change(number)

    def _look(self) -> None:
        self.disk.refused.clear()
        store, count = self.store(), self.changes
        selected = store.find_selected()
        for note in selected.notes:
            self.judge_words(note)
            if not note.startswith("E4"):
                self.complain(f"a note without its code: {note}")
        try:
            store.list()
        except OSError as refusal:
            self.scene.judge_words(str(refusal.strerror))
        if self.disk.refused or not self.disk.is_well or self.is_touched or count != self.changes:
            return
        self._judge_selected(selected)

    def _refused(self, what: str, refusal: Exception) -> None:
        self.scene.note(f"refused {self.folders[0]} {what}: {refusal}")
        self.judge_words(str(refusal))
        if not isinstance(refusal, StoreError):
            self.complain(f"no refusal of a store: {refusal!r}")
        elif not str(refusal).startswith(f"{refusal.code} ") or self.folders[0][:-1] not in str(refusal):
            self.complain(f"a refusal without code or noun: {refusal}")

    def _may_stand(self) -> bool:
        """A name stands whose fsync was refused and whose removal was, too: the one thing that cannot be taken back."""
        return [call.what for call in self.disk.refused].count("unlink") > 0 or len(self.disk.refused) > 1

    def lose_power(self) -> None:
        self.possible |= self.unsynced

    # -- what is asked

    def judge(self) -> None:
        if not self.disk.is_well:
            return
        store = self.store()
        selected = store.find_selected()
        entries = store.list()
        there = {entry.number for entry in entries}
        if self.is_touched:
            for entry in entries:
                if entry.fault:
                    self.judge_words(entry.fault)
                elif not self._is_whole(entry):
                    self.complain(f"{entry.number} was altered, and is taken for whole")
            return
        self._judge_selected(selected)
        for entry in entries:
            if entry.fault or entry.document is None:
                self.complain(f"{entry.number} is damaged: {entry.fault}")
            elif self.documents.get(entry.number, "") not in ("", self.mark_of(entry.document)):
                self.complain(f"{entry.number} holds another document")
        if lost := set(self.documents) - there:
            self.complain(f"{sorted(lost)} were stored, and are gone")

    def _is_whole(self, entry: Any) -> bool:
        """All of it has the mark that it carries."""
        encode, number, mark = self.store().encode, entry.number, self.mark_of(entry.document)
        return mark.isdecimal() and encode(entry.document, number) == encode(self.document(int(mark)), number)

    def _judge_selected(self, selected: Any) -> None:
        if selected.notes:
            self.complain(f"notes without a cause: {selected.notes}")
        if selected.selection.number not in {one.active for one in self.possible}:
            self.complain(f"{selected.selection.number} is in use, {self.possible} may be")
        self.possible = {one for one in self.possible if one.active == selected.selection.number} or self.possible

    def judge_healed(self) -> None:
        """It works, whatever was."""
        self.judge()
        before = self._numbers_there()
        try:
            number = self.store().add(self.document(self.mark + 1))
            self.store().use(number)
        except (StoreError, OSError) as refusal:
            self.complain(f"it takes none on a disk that is well: {refusal}")
            return
        if number in before:
            self.complain(f"number {number} is given again")
        selected = self.store().find_selected()
        if selected.selection.number != number or selected.notes:
            self.complain(f"{number} was taken into use: {selected}")
        self.documents[number] = str(self.mark + 1)
        if not self.is_touched:
            self._judge_damaged()
        self.possible = {one.after(number) for one in self.possible}

    def _judge_damaged(self) -> None:
        """The newest selection is torn: the one before it counts, and that is told."""
        newest = max(self.path(self.folders[0]).glob("active.*[0-9]"), key=lambda path: int(path.suffix[1:]))
        data = newest.read_bytes()
        newest.write_bytes(data[: self.rng.randrange(len(data))])
        selected = self.store().find_selected()
        newest.write_bytes(data)
        if selected.selection.number not in {one.active for one in self.possible} or not selected.notes:
            self.complain(f"{newest.name} is torn, and {selected.selection.number} is in use: {selected.notes}")

    def _numbers_there(self) -> set[int]:
        """As the disk has them, by nobody's word but its own."""
        with self.disk.aside():
            folder = self.path(self.folders[0])
            names = [path.name for path in folder.iterdir()] if folder.is_dir() else []
            return {int(name[:-5]) for name in names if name.endswith(".yaml") and name[:-5].isdecimal()}


class CalibrationPlayer(StorePlayer):
    """Calibrations."""

    folders: ClassVar = ("calibrations",)

    def store(self) -> NumberedStore[Any]:
        return CalibrationStore(self.state, BUILT_IN)

    def document(self, mark: int) -> Any:
        return calibration(mark)

    def mark_of(self, document: Any) -> str:
        return str(document.name.removeprefix("mark "))


class PlantPlayer(StorePlayer):
    """Plants."""

    folders: ClassVar = ("plants",)

    def store(self) -> NumberedStore[Any]:
        return PlantStore(self.state)

    def document(self, mark: int) -> Any:
        return replace(_PLANT, provenance=replace(_PLANT.provenance, file=f"mark {mark}"))

    def mark_of(self, document: Any) -> str:
        return str(document.provenance.file.removeprefix("mark "))
