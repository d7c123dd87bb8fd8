"""The staging block of the coefficient upload and the read-back of the active set.

Staging takes words one at a time, for masters that have only FC06; nothing there is judged until the commit word is
written. commit and slot_select act when written and are passed on; who serves them reports with `show_commit`. While a
commit is under way staging writes are refused (06), and so is a commit of words of which another master has staged some: it
would be told as committed what that one has staged, or its set would go into that one's slot, which no CRC-32 covers. An
upload needs no ownership of the setpoint, but the calibration role (gateway.registers.roles), which plain faces have only where
the rig allows it.
"""

from collections.abc import Callable
from typing import Final

from gateway.bsfm.model import Calibration
from gateway.codes.refusals import RefusalReason
from gateway.modbus import Peer
from gateway.registers.image import RegisterImage
from gateway.registers.map.register_map import Register, RegisterMap
from gateway.registers.refusal import Refusal
from gateway.registers.upload.coefficients import (
    BLOCK_BYTES,
    HEAD_BYTES,
    HEAD_WORDS,
    SET_WORDS,
    TAIL_FROM,
    CoefficientSet,
    model_hash,
)
from gateway.registers.values import WordOrder
from gateway.registers.words import NO_NOTICE, CommitAction, CommitNotice, CommitStatus
from gateway.registers.writes.command_block import check_zeros

NO_SLOT: Final = 0xFFFF

_PLACES: Final = {
    "range_low": 2, "range_high": 4, "rising_b_0": 6, "rising_w_0": 38, "falling_b_0": 70, "falling_w_0": 102,
    "force_low": 134, "force_high": 136, "blend_span": 138, "length": 140, "crc32": 142, "target_slot": 144,
    "slip_stops": 150, "dead_time": 152, "lag": 154, "second_lag": 156, "damping": 158, "slip_radius_0": 160,
    "slip_share_0": 180,
}  # fmt: skip
"""In words behind `order`: a CRC-32 over words in their order leaves no map the choice."""

_OF_ONE_WORD: Final = ("length", "target_slot", "slip_stops")

OnCommit = Callable[[CommitAction, bytes, Peer], None]
"""on_commit(action, words of the staging block, peer); raises Refusal to refuse."""
OnSelect = Callable[[int, Peer], None]


class StagingBlock:
    """on_act(name, what, peer): a commit or a choice of slot that was passed on, for the audit.

    ValueError for a map without the staging or the active block, or with a part of an upload elsewhere in them."""

    def __init__(self, register_map: RegisterMap, image: RegisterImage) -> None:
        self.on_commit: OnCommit | None = None
        self.on_select: OnSelect | None = None
        self.on_act: Callable[[str, str, Peer], None] = lambda name, text, peer: None
        self._image = image
        self._first = register_map.find("order@staging").address
        self._commit = register_map.find("commit").address
        self._select = register_map.find("slot_select").address
        self._shown = [register_map.find(name) for name in ("commit_status", "failing_index", "failing_reason")]
        self._notice = register_map.find("commit_notice")
        self._active = [
            register_map.find(name) for name in ("length@active", "crc32@active", "model_hash", "active_slot")
        ]
        self._active_first = register_map.find("order@active").address
        self._status = CommitStatus.IDLE
        self._staged_by: dict[int, str] = {}  # address -> who has staged its word last
        self._no_words = (self._commit, self._select)
        for block, first in (("staging", self._first), ("active", self._active_first)):
            for register in register_map.registers_of(block):
                at = first + _PLACES.get(register.name, register.address - first)
                if register.address != at:
                    raise ValueError(f"{register.name}@{block} is at {register.address}, an upload has it at {at}")
                _check_number(register)

    def write(self, address: int, data: bytes, peer: Peer) -> None:
        """Store these words, then act on commit and slot_select if they are among them. Refusal: 03, 06."""
        if self._status in (CommitStatus.CHECKING, CommitStatus.WRITING):
            text = f"a commit is {self._status.name.lower()}: wait until commit_status is committed or failed"
            raise Refusal(RefusalReason.BUSY, address, text)
        self._check_reserved(address, data)
        self._store(address, data, peer)

    def show_commit(
        self,
        status: CommitStatus,
        failing_index: int = 0,
        failing_reason: int = 0,
        notice: CommitNotice = NO_NOTICE,
    ) -> None:
        """Show how far a commit is, from whoever serves it; checking and writing lock the block."""
        self._status = status
        self._image.put(self._notice, notice)
        for register, value in zip(self._shown, (status, failing_index, failing_reason), strict=True):
            self._image.put(register, value)

    def show_active(self, calibration: Calibration, slot: int) -> None:
        """Show the set in use, with its model_hash; the same number is crc32."""
        words = CoefficientSet.of_calibration(calibration).to_words()
        self._image.write(self._active_first, words[:HEAD_BYTES])
        self._image.write(self._active_first + TAIL_FROM, words[HEAD_BYTES:])
        crc = model_hash(calibration)
        for register, value in zip(self._active, (SET_WORDS, crc, crc, slot), strict=True):
            self._image.put(register, value)

    def _check_reserved(self, address: int, data: bytes) -> None:
        for k in range(len(data) // 2):
            if address + k not in self._image.register_at:
                check_zeros(address + k, data[2 * k : 2 * k + 2])

    def _store(self, address: int, data: bytes, peer: Peer) -> None:
        """All or nothing, also when the commit is refused."""
        before, staged_by = self._image.read(address, len(data) // 2), self._staged_by
        self._image.write(address, data)
        self._staged_by = staged_by | dict.fromkeys(range(address, address + len(data) // 2), peer.identity)
        try:
            if address <= self._commit < address + len(data) // 2:
                self._act(peer)
            if address <= self._select < address + len(data) // 2:
                self._choose(peer)
        except Refusal:
            self._image.write(address, before)
            self._staged_by = staged_by
            raise

    def _act(self, peer: Peer) -> None:
        word = self._image.word(self._commit)
        if word > max(CommitAction):
            text = f"commit = {word}, known are 0 none, 1 commit, 2 dry_run, 3 rollback"
            raise Refusal(RefusalReason.OUT_OF_RANGE, self._commit, text, value=word)
        if word and self.on_commit is None:
            text = "this gateway takes no coefficients; the active set is unchanged"
            raise Refusal(RefusalReason.COEFFICIENTS, self._commit, text, value=word)
        if word and word != CommitAction.DRY_RUN:
            _check_in_time("commit", self._commit, peer)
        if word in (CommitAction.COMMIT, CommitAction.DRY_RUN):
            self._check_staged_by(peer)
        self._image.write(self._commit, b"\0\0")
        if word and self.on_commit is not None:
            staged = self._image.read(self._first, BLOCK_BYTES // 2)
            self.on_commit(CommitAction(word), staged, peer)
            self.on_act("commit", CommitAction(word).name.lower(), peer)

    def _check_staged_by(self, peer: Peer) -> None:
        has_tail = self._image.word(self._first + _PLACES["length"]) != HEAD_WORDS
        end = BLOCK_BYTES // 2 if has_tail else TAIL_FROM
        who = {by for at, by in self._staged_by.items() if at < self._first + end and at not in self._no_words}
        if others := sorted(who - {peer.identity}):
            text = f"commit refused: {', '.join(others)} has staged some of its words: stage all of them anew"
            raise Refusal(RefusalReason.BUSY, self._commit, text)

    def _choose(self, peer: Peer) -> None:
        slot = self._image.word(self._select)
        if slot > 7:
            raise Refusal(RefusalReason.OUT_OF_RANGE, self._select, f"slot_select = {slot}, allowed 0 .. 7", value=slot)
        if self.on_select is None:
            text = "this gateway has no slots; the active set is unchanged"
            raise Refusal(RefusalReason.COEFFICIENTS, self._select, text, value=slot)
        _check_in_time("slot_select", self._select, peer)
        self.on_select(slot, peer)
        self.on_act("slot_select", f"slot {slot}", peer)


def _check_in_time(name: str, address: int, peer: Peer) -> None:
    """Check that a change of the set in use has not waited in a pile: its master may be gone, or want another one by now."""
    if peer.is_behind:
        text = f"{name} refused: {peer} asks more than is answered, so that this has waited: wait for each answer"
        raise Refusal(RefusalReason.BUSY, address, text)


def _check_number(register: Register) -> None:
    """Check that a number of the set is what it is taken for. ValueError: the CRC-32 is over words in one order."""
    if register.type == "float32" and register.word_order is WordOrder.ABCD and register.name != "crc32":
        return  # as nearly all of two hundred
    stem, _, index = register.name.rpartition("_")
    name = f"{stem}_0" if index.isdigit() else register.name
    kind = "uint32" if name == "crc32" else "float32"
    if name not in _PLACES or name in _OF_ONE_WORD or (register.type, register.word_order) == (kind, WordOrder.ABCD):
        return
    there = f"{register.type}, {'high' if register.word_order is WordOrder.ABCD else 'low'} word first"
    raise ValueError(f"{register.name}@{register.block} is {there}, an upload has {kind}, high word first")
