"""Serves the staging block: a commit is checked, written and put to use, a slot is selected; and the control socket's
wish for another calibration. The part in the loop.

One at a time. A worker thread checks (up to milliseconds at order 15) and waits for the disk; `committed` is shown when
the directory's fsync is through and the set is in use. Whether the output is enabled does not matter, for the controller
swaps models without a bump. On any failure the active set stays, in the controller and on the disk. A set that the store
has, or the rig's own, keeps its number and name, so that a master which uploads its recipe for every part does not fill
the disk, and reading the active set back and committing it changes nothing.

A commit fills its slot and is in use from then on. A dry run ends in `idle` when the set would be accepted. A failure
that is no coefficient's fault (a full disk, a damaged slot) has failing_index -1 and a reason of its own. commit_notice
tells what a success does not: a set of the older, shorter form (W330), a set that was known already. Force limits are
kept with the set: while it is in use the smaller of its limit and the rig's holds. What a tool of this machine asks for
shows in the active block, not in commit_status, which is the masters'.
"""

import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

from gateway.bsfm import Calibration
from gateway.calibrations.activation import Activation, ActiveCalibration, UnusableCalibration, make_uploaded
from gateway.codes.refusals import RefusalReason
from gateway.modbus import Peer
from gateway.numbered_documents.store import SelectedDocument, StoreError
from gateway.plain_file import tell_place_and_refusal
from gateway.processes.disk_worker import DiskWorker, Done, Work, keep_end
from gateway.registers.map.register_map import RegisterMap
from gateway.registers.refusal import Refusal
from gateway.registers.upload.coefficients import HEAD_WORDS
from gateway.registers.upload.staging import Staged, StagedFault, check_staged
from gateway.registers.upload.staging_block import StagingBlock
from gateway.registers.words import NO_NOTICE, CommitAction, CommitNotice, CommitStatus, UploadReason

_NO_COEFFICIENT: Final = -1
_NO_ROOM: Final = "E431"


@dataclass(frozen=True, slots=True, kw_only=True)
class UploadRules:
    """What rig and map add. today: the date of a new calibration, UTC, as 2026-11-21; doubts_on: why its forces are a guess."""

    rig_name: str
    commit_address: int
    select_address: int
    today: Callable[[], str]
    doubts_on: Callable[[Calibration], str] = lambda calibration: ""

    @classmethod
    def of(
        cls,
        rig_name: str,
        register_map: RegisterMap,
        today: Callable[[], str],
        doubts_on: Callable[[Calibration], str] = lambda calibration: "",
    ) -> "UploadRules":
        """Return the rules of a rig whose map has these addresses."""
        commit, select = register_map.find("commit").address, register_map.find("slot_select").address
        return cls(rig_name=rig_name, commit_address=commit, select_address=select, today=today, doubts_on=doubts_on)


class UploadService:
    """on_use: called in the loop with what is in use from now on; on_failure: with what was accepted and came to nothing, and
    why. run_in_background: runs work elsewhere and comes back."""

    def __init__(
        self,
        staging: StagingBlock,
        activation: Activation,
        selected: SelectedDocument[Calibration],
        rules: UploadRules,
        log: Callable[[str, str], None],
    ) -> None:
        if selected.document is None:
            raise ValueError("a gateway has a calibration, at least the rig's own")
        self.on_use: Callable[[ActiveCalibration], None] = lambda in_use: None
        self.on_failure: Callable[[str, str], None] = lambda what, sentence: None
        self._thread = DiskWorker()
        self.run_in_background: Callable[[Work, Done], None] = self._thread
        self._staging = staging
        self._activation = activation
        self._rules = rules
        self._log = log
        self._calibration = selected.document
        self._pointer = replace(selected.pointer, active=selected.selection)
        self._doing = ""
        self._shows = False  # whether commit_status tells of what is being done
        self._notice = NO_NOTICE
        self._jobs = 0
        self._outcome, self._failed_last, self._reason = "", False, 0
        self._ends: dict[str, dict[str, Any]] = {}
        staging.on_commit = self._on_commit
        staging.on_select = self._on_select

    def close(self) -> None:
        """Begin nothing more; what is under way ends on the disk as it would have."""
        self._thread.close()

    # -- asked by a master

    def _on_commit(self, action: CommitAction, words: bytes, peer: Peer) -> None:
        self._check_free(self._rules.commit_address)
        if action is CommitAction.ROLLBACK:
            self._begin(f"rollback by {peer}", CommitStatus.WRITING)
            self.run_in_background(self._activation.roll_back, self._on_taken)
            return
        self._begin(f"{'dry run' if action is CommitAction.DRY_RUN else 'upload'} by {peer}", CommitStatus.CHECKING)
        limits = self._activation.limits
        self.run_in_background(
            lambda: check_staged(words, limits), lambda result: self._on_checked(result, action, peer)
        )

    def _on_checked(self, result: Any, action: CommitAction, peer: Peer) -> None:
        if isinstance(result, Exception):
            self._fail(result)
        elif isinstance(result, StagedFault):
            self._fail(UnusableCalibration(result))
        else:
            self._notice = CommitNotice.WITHOUT_STOPS if result.without_stops else NO_NOTICE
            if action is CommitAction.DRY_RUN:
                self._end(CommitStatus.IDLE, self._describe_success("the set would be accepted"))
            else:
                self._take(result, peer)

    def _take(self, staged: Staged, peer: Peer) -> None:
        fresh = make_uploaded(
            staged,
            name=f"slot-{staged.slot}",
            rig=self._rules.rig_name,
            date_utc=self._rules.today(),
            source=f"upload over Modbus by {peer.host}",
        )
        known = self._pointer
        self._staging.show_commit(CommitStatus.WRITING)
        self.run_in_background(lambda: self._activation.use_uploaded(fresh, staged.slot, known), self._on_taken)

    def _on_select(self, slot: int, peer: Peer) -> None:
        self._check_free(self._rules.select_address)
        chosen = self._pointer.in_slot(slot)
        if chosen is None:
            filled = ", ".join(str(k) for k, number in enumerate(self._pointer.slots) if number is not None) or "none"
            text = f"slot {slot} is empty, filled: {filled}; active set {self._calibration.number} unchanged"
            raise Refusal(RefusalReason.EMPTY_SLOT, self._rules.select_address, text, value=slot)
        self._begin(f"slot {slot} selected by {peer}", CommitStatus.WRITING)
        self.run_in_background(lambda: self._activation.use(chosen.number, slot), self._on_taken)

    def _check_free(self, address: int) -> None:
        if self._doing:
            raise Refusal(RefusalReason.BUSY, address, f"{self._doing} is under way: wait until it has ended")

    # -- asked by a tool of this machine

    def use(self, number: int, *, force: bool = False) -> dict[str, Any]:
        """Begin to take a calibration by its number; `status` tells how it goes. force: a rejected one, too. ValueError while
        another is under way."""
        return self._ask(f"calibration use {number}", lambda: self._activation.use_offered(number, force=force))

    def rollback(self) -> dict[str, Any]:
        """Begin to go back to what was in use before."""
        return self._ask("calibration rollback", self._activation.roll_back)

    def status(self) -> dict[str, Any]:
        """Return what is in use, and how the last job went; job is its number; reason as failing_reason. ends: of the jobs
        before as well."""
        return {
            "active": self._calibration.number,
            "name": self._calibration.name,
            "slot": self._pointer.active.slot,
            "built_in": self._pointer.active.number is None,
            "job": self._jobs,
            "busy": bool(self._doing),
            "said": self._outcome,
            "failed": self._failed_last,
            "reason": self._reason,
            "ends": self._ends,
        }

    def _ask(self, what: str, work: Work) -> dict[str, Any]:
        if self._doing:
            raise ValueError(f"{self._doing} is under way: try again when it has ended")
        self._begin(what, None)
        self.run_in_background(work, self._on_taken)
        return self.status()

    # -- how it goes

    def _begin(self, what: str, status: CommitStatus | None) -> None:
        self._jobs += 1
        self._doing, self._shows, self._notice = what, status is not None, NO_NOTICE
        if status is not None:
            self._staging.show_commit(status)

    def _on_taken(self, result: Any) -> None:
        if isinstance(result, Exception):
            self._fail(result)
            return
        active: ActiveCalibration = result
        self._calibration = active.calibration
        self._pointer = active.pointer
        self.on_use(active)
        self._notice |= active.notice
        doubts = self._rules.doubts_on(active.calibration)
        what = "; ".join(filter(None, (_describe_active(active), doubts)))
        self._end(CommitStatus.COMMITTED, self._describe_success(what))

    def _fail(self, error: Exception) -> None:
        """UnusableCalibration, StoreError and OSError are answers; anything else, an internal error, must not stop control."""
        index, reason, active = _NO_COEFFICIENT, int(UploadReason.DEFECT), self._calibration.number
        self._notice = NO_NOTICE
        if isinstance(error, UnusableCalibration):
            index, reason, sentence = error.fault.index, int(error.fault.reason), error.fault.sentence(active)
        elif isinstance(error, StoreError):
            sentence = f"{error}; active set {active} unchanged"
            reason = int(UploadReason.STORAGE if error.code == _NO_ROOM else UploadReason.NOT_STORED)
        elif isinstance(error, OSError):
            sentence, reason = (
                f"{_NO_ROOM} {tell_place_and_refusal(error)}; active set {active} unchanged",
                int(UploadReason.STORAGE),
            )
        else:
            trace = "".join(traceback.format_exception(error))
            sentence = f"A499 internal error, please report it; active set {active} unchanged:\n{trace}"
        self.on_failure(self._doing, sentence)
        self._end(CommitStatus.FAILED, sentence, index, reason)

    def _end(self, status: CommitStatus, sentence: str, index: int = 0, reason: int = 0) -> None:
        self._doing, self._outcome, self._reason = "", sentence, reason
        self._failed_last = status is CommitStatus.FAILED
        keep_end(self._ends, self._jobs, said=sentence, failed=self._failed_last, reason=reason)
        if self._shows:
            self._staging.show_commit(status, index, reason, self._notice)
        self._log("calibration", sentence)

    def _describe_success(self, what: str) -> str:
        """Return the log line of something that went well, with what the notice says."""
        known = "; known here, it keeps number and name" if self._notice & CommitNotice.KNOWN_SET else ""
        if self._notice & CommitNotice.WITHOUT_STOPS:
            old = f"length {HEAD_WORDS}, as of map version 1: no slip stops, no response"
            return f"W330 {self._doing}: {what}; {old}{known}"
        return f"{self._doing}: {what}{known}"


def _describe_active(active: ActiveCalibration) -> str:
    """`calibration 17 (slot-3) in use, slot 3: bsfm n=2, slip, 7 stops, 1.2 .. 65.1 N`."""
    calibration, slot = active.calibration, active.pointer.active.slot
    where = "" if slot is None else f", slot {slot}"
    low_n, high_n = calibration.allowed_n
    return (
        f"calibration {calibration.number} ({calibration.name}) in use{where}: "
        f"{calibration.kind}, {calibration.reversal_kind}, {low_n:.1f} .. {high_n:.1f} N"
    )
