"""A real bank with an upload service behind it, whose worker is stepped by hand."""

import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from gateway.bsfm import Calibration, CoefficientLimits
from gateway.calibrations.activation import Activation, ActiveCalibration
from gateway.calibrations.store import CalibrationStore
from gateway.calibrations.upload import UploadRules, UploadService
from gateway.modbus import Peer, Role
from gateway.registers import BankRules, Refusal, RegisterBank, RegisterMap
from gateway.registers.upload.coefficients import CoefficientSet, words_of_block
from gateway.registers.words import CommitNotice, CommitStatus
from tests.calibrations.coefficients import calibration, requests_of, staged

PEER = Peer("10.0.0.1", 40000, role=Role.CALIBRATION)
OWN = calibration(8, number=1)
COMMIT, DRY_RUN = 1, 2


@dataclass
class Bench:
    """Masters write to `bank`; `work` waits until `run` does it, as the thread would."""

    state: Path
    register_map: RegisterMap
    own: Calibration = OWN
    work: list[tuple[Callable[[], Any], Callable[[Any], None]]] = field(default_factory=list)
    log: list[str] = field(default_factory=list)
    used: list[ActiveCalibration] = field(default_factory=list)
    failed: list[tuple[str, str]] = field(default_factory=list)  # what was accepted and came to nothing, and why
    shown: list[CommitStatus] = field(default_factory=list)  # what a master reads in the moment of each

    def __post_init__(self) -> None:
        self.store = CalibrationStore(self.state, self.own)
        rules = BankRules(rig_name="demo", force_max_n=60.0)
        self.bank = RegisterBank(self.register_map, rules, now=lambda: 0.0)
        activation = Activation(self.store, CoefficientLimits(cell_range_n=100.0))
        self.selected = self.store.find_selected(activation.why_unusable)
        upload_rules = UploadRules.of("demo", self.register_map, lambda: "2026-11-22")
        self.upload = UploadService(
            self.bank.staging,
            activation,
            self.selected,
            upload_rules,
            lambda cause, sentence: self.log.append(sentence),
        )
        self.upload.run_in_background = lambda work, done: self.work.append((work, done))
        self.upload.on_use = self._on_use
        self.upload.on_failure = lambda what, sentence: self.failed.append((what, sentence))
        assert self.selected.document
        self.bank.set_active_model(self.selected.document, self.selected.selection.slot_word)

    def _on_use(self, taken: ActiveCalibration) -> None:
        self.used.append(taken)
        self.shown.append(self.status)
        self.bank.set_active_model(taken.calibration, taken.pointer.active.slot_word)

    def run(self, steps: int = 10) -> None:
        """Up to so many pieces of work."""
        while self.work and steps:
            steps -= 1
            work, done = self.work.pop(0)
            try:
                result = work()
            except Exception as error:
                result = error
            done(result)

    # -- as a master

    def write(self, address: int, *words: int) -> None:
        self.bank.write_registers(address, struct.pack(f">{len(words)}H", *words), PEER)

    def refused(self, address: int, *words: int) -> Refusal:
        with pytest.raises(Refusal) as caught:
            self.write(address, *words)
        return caught.value

    def stage(self, words: bytes, most: int = 123) -> None:
        """A staging block, `most` words at a time."""
        for address, part in requests_of(words, most):
            self.bank.write_registers(address, part, PEER)

    def commit(self, words: bytes, action: int = COMMIT) -> tuple[CommitStatus, int, int]:
        """Stage, commit and let it end; the outcome."""
        self.stage(words)
        self.write(1145, action)
        self.run()
        return self.outcome

    def upload_of(self, given: Calibration, slot: int = 0) -> tuple[CommitStatus, int, int]:
        return self.commit(staged(CoefficientSet.of_calibration(given), slot=slot))

    @property
    def outcome(self) -> tuple[CommitStatus, int, int]:
        status, index, reason = struct.unpack(">HhH", self.bank.read_registers(1146, 3))
        return CommitStatus(status), index, reason

    @property
    def status(self) -> CommitStatus:
        return self.outcome[0]

    @property
    def active_words(self) -> bytes:
        return words_of_block(self.active_block)

    @property
    def active_block(self) -> bytes:
        return self.bank.read_registers(1500, 100) + self.bank.read_registers(1600, 100)

    @property
    def model_hash(self) -> int:
        return int.from_bytes(self.bank.read_registers(414, 2), "big")

    @property
    def notice(self) -> CommitNotice:
        return CommitNotice(int.from_bytes(self.bank.read_registers(1645, 1), "big"))

    @property
    def active_slot(self) -> int:
        return int.from_bytes(self.bank.read_registers(1644, 1), "big")

    def restarted(self) -> "Bench":
        """The next process on the same state directory."""
        return Bench(self.state, self.register_map, self.own)
