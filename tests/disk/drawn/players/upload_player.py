"""Coefficients that masters upload, whole or torn, into slots, and put to use: what is committed is in use, and stays."""

from functools import cache
from typing import Any, ClassVar

from gateway.calibrations.activation import ActiveCalibration
from gateway.profiles import load_register_map
from gateway.registers import Refusal, RegisterMap
from gateway.registers.upload.coefficients import CoefficientSet, words_of_block
from gateway.registers.words import CommitAction, CommitStatus
from tests.calibrations.coefficients import calibration, requests_of, staged
from tests.calibrations.upload_bench import OWN, PEER, Bench
from tests.disk.drawn.players.player import Player

SLOTS = (0, 3)
COMMIT, SELECT = 1145, "slot_select"


@cache
def register_map() -> RegisterMap:
    return load_register_map("force-v1")


@cache
def set_of(mark: int) -> CoefficientSet:
    return CoefficientSet.of_calibration(OWN if mark == 0 else calibration(mark))


@cache
def words_of(mark: int) -> bytes:
    """As they read back."""
    return words_of_block(staged(set_of(mark)))


class UploadPlayer(Player):
    """possible: marks of the sets that may be in use, 0 for the rig's own; slots: the same of each slot; asked: what is under
    way: mark and slot, None where it is not to be taken."""

    folders: ClassVar = ("uploads",)

    def __init__(self, scene: Any) -> None:
        super().__init__(scene)
        self.place = self.path("uploads")
        self.possible = {0}
        self.slots: dict[int, set[int]] = {slot: set() for slot in SLOTS}
        self.marks = {0}
        self.asked: tuple[int | None, int | None] | None = None
        self.before = self.possible, self.slots
        self.is_known = True
        self.bench: Bench | None = None

    def begin(self) -> None:
        self.disk.refused.clear()
        self.bench = Bench(self.place, register_map())
        self.bench.upload.run_in_background = self.bench.upload._thread
        self.bench.upload.on_failure = self._on_failure
        self.bench.upload.on_use = self._on_use
        self.asked, self.is_known = None, not self.disk.refused and not self.is_touched and self.disk.is_well
        if self.is_known:
            self._judge_active(f"behind a start, {self.bench.selected.notes}")

    def _active(self) -> int | None:
        assert self.bench
        return next((mark for mark in self.marks if words_of(mark) == self.bench.active_words), None)

    def _judge_active(self, when: str) -> None:
        if (active := self._active()) not in self.possible:
            self.complain(f"{active} is in use {when}, {self.possible} may be")

    # -- as a master

    def act(self) -> None:
        assert self.bench
        if self.asked is None:
            self.before = set(self.possible), {slot: set(marks) for slot, marks in self.slots.items()}
        try:
            self.rng.choice([self._upload, self._upload, self._upload, self._select, self._roll_back])()
        except Refusal as refusal:
            self.judge_words(str(refusal))

    def verb(self) -> None:
        """`calibration list`."""
        assert self.bench
        try:
            entries = self.bench.store.list()
        except OSError as refusal:
            self.judge_words(str(refusal.strerror))
            return
        for entry in entries:
            if entry.fault:
                self.judge_words(entry.fault)

    def _upload(self) -> None:
        assert self.bench
        bench, mark, slot = (
            self.bench,
            self.rng.choice([*self.marks, len(self.marks), len(self.marks)]),
            self.rng.choice(SLOTS),
        )
        block = staged(set_of(mark), slot=slot)
        for address, part in requests_of(block, self.rng.choice([20, 100])):
            bench.bank.write_registers(address, part, PEER)
        is_torn = False
        if self.rng.random() < 0.2:
            at, word = self.rng.randrange(1, 8), self.rng.choice([0x4100, 0x7FC0, 1])
            bench.write(1000 + at, word)
            is_torn = block[2 * at : 2 * at + 2] != word.to_bytes(2)
        action = self.rng.choice([CommitAction.COMMIT] * 4 + [CommitAction.DRY_RUN])
        bench.write(COMMIT, int(action))
        self.marks |= {mark}
        is_taken = not is_torn and action is CommitAction.COMMIT
        self.asked = (mark, slot) if is_taken else (None, None)
        if is_taken:
            self.possible |= {mark}
            self.slots[slot] |= {mark}

    def _select(self) -> None:
        assert self.bench
        slot = self.rng.choice(SLOTS)
        self.bench.write(register_map().find(SELECT).address, slot)
        if not self.slots[slot] and not self.is_touched:
            self.complain(f"slot {slot} was never filled, and is selected")
        self.asked = (min(self.slots[slot]), slot) if len(self.slots[slot]) == 1 else (None, slot)
        self.possible |= self.slots[slot]

    def _roll_back(self) -> None:
        assert self.bench
        self.bench.write(COMMIT, int(CommitAction.ROLLBACK))
        self.asked = (None, None)
        self.possible |= self.marks

    # -- as it ends

    def _on_use(self, taken: ActiveCalibration) -> None:
        bench, asked = self.bench, self.asked
        assert bench
        if bench.status is CommitStatus.COMMITTED:
            self.complain("committed is told before the set is in use")
        bench._on_use(taken)
        active = self._active()
        self.scene.note(f"in use: {active}, asked was {asked}")
        if asked is None or (asked[0] is not None and asked[0] != active):
            self.complain(f"{active} is in use, asked was {asked}")
        if active is not None:
            self.possible = {active}
        if asked and asked[0] is not None and asked[1] is not None:
            self.slots[asked[1]] = {asked[0]}
        self.asked = None

    def _on_failure(self, what: str, sentence: str) -> None:
        self.scene.note(f"failed: {what}: {sentence}")
        self.judge_words(sentence)
        is_undone = len(self.disk.refused) < 2 and not any(call.what == "fsync" for call in self.disk.refused)
        if is_undone and self.asked:
            self.possible, self.slots = self.before
        self.asked = None

    def die(self) -> None:
        self.bench = None

    def judge(self) -> None:
        assert self.bench
        if self.asked is None and self.is_known:
            self._judge_active("while it runs")
        if not self.disk.is_well or self.is_touched:
            return
        entries = self.bench.store.list()
        if faults := [entry.fault for entry in entries if entry.fault]:
            self.complain(f"stored sets are damaged: {faults}")
        if len(entries) > len(self.marks - {0}):
            self.complain(f"{len(entries)} sets are stored of {len(self.marks) - 1} that were uploaded")

    def judge_healed(self) -> None:
        """It takes another one, and that one is in use behind a start."""
        assert self.bench
        self.judge()
        mark = max(self.marks) + 1
        self.marks |= {mark}
        self.possible |= {mark}
        self.asked = (mark, 0)
        for address, part in requests_of(staged(set_of(mark), slot=0)):
            self.bench.bank.write_registers(address, part, PEER)
        self.bench.write(COMMIT, int(CommitAction.COMMIT))
        self.scene.go_on_all()
        if self.bench.outcome != (CommitStatus.COMMITTED, 0, 0) or self.bench.active_words != words_of(mark):
            self.complain(
                f"a whole set is not taken on a disk that is well: {self.bench.outcome}, {self.bench.log[-1:]}"
            )
