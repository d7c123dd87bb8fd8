"""The audit of a gateway: two threads that write and sync; what was synced is in it, in order, once, and the chain holds."""

import os
from typing import Any, ClassVar

from gateway.audit.audit_file import AuditFile
from gateway.audit.audit_log import MOST_WAITING, AuditLog
from gateway.audit.audit_reader import read_audit, verify_audit
from tests.disk.drawn.players.player import Player


class NotedAuditLog(AuditLog):
    """Tells what it takes for synced."""

    def __init__(self, player: "AuditPlayer", file: AuditFile) -> None:
        scene = player.scene
        super().__init__(file, scene.say, lambda: scene.now_s, lambda: scene.wall_s)
        self._player = player

    def _on_synced(self, result: Any) -> None:
        if not isinstance(result, Exception):
            self._player.note_synced(self._written[: self._syncing])
        super()._on_synced(result)


class AuditPlayer(Player):
    """synced: numbers of records that outlive anything; put: of those since the gateway's start."""

    folders: ClassVar = ("audit",)

    def __init__(self, scene: Any) -> None:
        super().__init__(scene)
        self.longest_bytes, self.kept = self.rng.choice([500, 1500, 6000]), self.rng.choice([2, 3, 6])
        self.number = 0
        self.synced: set[int] = set()
        self.life: set[int] = set()
        self.log: NotedAuditLog | None = None

    def begin(self) -> None:
        self.file = AuditFile(self.state, self.longest_bytes, self.kept)
        self.log, self.life = NotedAuditLog(self, self.file), set()
        self._put(1)

    def note_synced(self, kept: list[Any]) -> None:
        """These were."""
        self.synced |= {one.record["k"] for one in kept if "k" in one.record}

    def tick(self) -> None:
        if self.log:
            self.log.flush()
            held = len(self.log._waiting) + len(self.log._written) + len(self.log._in_flight)
            if held > 3 * MOST_WAITING + 10:
                self.complain(f"{held} records in memory")

    def act(self) -> None:
        self._put(self.rng.choice([1, 1, 2, 5, 40, 40, 2500] if self.rng.random() < 0.1 else [1, 1, 2, 5]))
        self.tick()

    def _put(self, count: int) -> None:
        assert self.log
        for _ in range(count):
            self.number += 1
            self.life.add(self.number)
            self.log.put({"what": "force_setpoint", "k": self.number})

    def verb(self) -> None:
        """`audit verify`, `audit list`, while it is written."""
        self.disk.refused.clear()
        try:
            verdict = verify_audit(self.state)
            list(read_audit(self.state))
        except FileNotFoundError:
            if self.synced and not self.is_touched:
                self.complain("no audit is there, they say")
            return
        except OSError as refusal:
            self.judge_words(str(refusal.strerror))
            return
        if verdict.broken:
            self.scene.note(f"broken: {verdict.broken}")
            self.judge_words(verdict.broken.text)
            if not self.is_touched:
                self.complain(f"{verdict.broken}")

    def die(self) -> None:
        if self.log and self.file._descriptor >= 0:
            os.close(self.file._descriptor)
            self.file._descriptor = -1
        self.log, self.life = None, set()

    def judge(self) -> None:
        if not self.disk.is_well:
            return
        try:
            verdict = verify_audit(self.state)
            records = self._read()
        except FileNotFoundError:
            if self.synced and not self.is_touched:
                self.complain("no audit is there")
            return
        except OSError as refusal:
            if not self.is_touched:
                raise
            self.judge_words(str(refusal.strerror))
            return
        if verdict.broken:
            self.judge_words(verdict.broken.text)
        kept = [record["k"] for record in records if "k" in record]
        if self.is_touched:
            return
        if verdict.broken:
            self.complain(f"{verdict.broken}")
        if kept != sorted(set(kept)):
            self.complain(f"out of order, or twice: {kept}")
        has_dropped = any(record["what"] == "dropped" for record in records)
        first = kept[0] if kept and has_dropped else 0
        if missing := {one for one in self.synced if one >= first} - set(kept):
            self.complain(f"{sorted(missing)} were synced, and are missing from {kept[-5:]}")
        if told := [record for record in records if record["what"] == "chain broken"]:
            self.complain(f"nobody has broken it: {told}")

    def _read(self) -> list[dict[str, Any]]:
        return list(read_audit(self.state))

    def judge_healed(self) -> None:
        """All of this life is there, or counted."""
        self.judge()
        assert self.log
        self._put(1)
        self.scene.go_on_all()
        if self.log._waiting or self.log._written or self.log._in_flight:
            self.complain(f"{len(self.log._waiting)} records still wait on a disk that is well")
        records = self._read()
        kept = {record["k"] for record in records if "k" in record}
        lost = sum(record["count"] for record in records if record["what"] == "lost")
        first = min(kept, default=0)
        missing = {one for one in self.life if one > first} - kept
        if len(missing) > lost and not self.is_touched:
            self.complain(f"{len(missing)} records are missing, {lost} are counted as lost")
        if self.is_touched:
            for _ in range(2):  # the first line may stand behind a piece that somebody has put there
                self._put(1)
                self.scene.go_on_all()
            if self.number not in {record.get("k") for record in self._read()}:
                self.complain("it stores nothing any more behind what a person has done")
