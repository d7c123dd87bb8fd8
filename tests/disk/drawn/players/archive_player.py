"""Backup and restore of a state directory, also one that is in use, half full or gone: the old one wholly, or the new one."""

import re
import shutil
from pathlib import Path
from typing import Any

from click.testing import CliRunner

from gateway.cli.main import command
from gateway.cli.state_archive import unpack_state
from gateway.processes.state_directory import put_back
from gateway.processes.state_lock import hold_state_lock
from tests.disk.drawn.players.player import Player

Snapshot = dict[str, bytes] | None
"""Content of each file by its name; None: there is no directory."""
NAMES = ("calibrations/0001.yaml", "events.jsonl", "recordings/0001.fgr", "audit/audit.jsonl")


def snapshot(folder: Path) -> Snapshot:
    """What is there, but for the lock, which belongs to who runs."""
    if not folder.is_dir():
        return None
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != "lock")
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


class ArchivePlayer(Player):
    """cells, archives: what the directory and the archive may hold; durable: the same behind a power cut."""

    def __init__(self, scene: Any) -> None:
        super().__init__(scene)
        self.cell, self.archive = scene.outside / "cell", scene.outside / "kept.tar.gz"
        self.number = 0
        self.cells: list[Snapshot] = [None]
        self.archives: list[Snapshot] = [None]
        self._is_busy = False
        self._seen: tuple[float, Snapshot] = 0.0, None
        self._change()

    def act(self) -> None:
        if self._is_busy:  # beside itself
            return
        self._is_busy = True
        try:
            self._take_back()
            self.rng.choice(
                [self._change, self._pack, self._pack, self._restore, self._restore, self._restore_in_use]
            )()
        finally:
            self._is_busy = False

    def _change(self) -> None:
        """What a gateway has made meanwhile; or what somebody has left of it."""
        self.number += 1
        count = self.rng.choice([4, 4, 4, 1, 0])
        with self.disk.aside():
            shutil.rmtree(self.cell, ignore_errors=True)
            for name in self.rng.sample(NAMES, count):
                (self.cell / name).parent.mkdir(parents=True, exist_ok=True)
                (self.cell / name).write_bytes(b"%d %s\n" % (self.number, name.encode()) * 200)
            if not count and self.rng.random() < 0.5:
                self.cell.mkdir()
        self.disk.note_all()
        self.cells = [self._now()]
        self.archives = self.archives[-1:] if len(self.archives) == 1 else self.archives

    def _now(self) -> Snapshot:
        with self.disk.aside():
            return snapshot(self.cell)

    def _ask(self, *words: str) -> tuple[int, str]:
        result = CliRunner().invoke(command, [*words, "--state", str(self.cell), "--rig", "demo"])
        self.scene.note(f"{words[0]}: {result.exit_code} {result.output[:300]!r}")
        if result.exception and not isinstance(result.exception, SystemExit):
            self.complain(f"{words[0]} raises {result.exception!r}")
        if result.exit_code:
            self.judge_words(result.output)
        return result.exit_code, result.output

    def _pack(self) -> None:
        before, now = self.archives, self._now()
        self.archives = [*before, now]
        self.disk.refused.clear()
        code, _ = self._ask("backup", str(self.archive), "--force")
        self.archives = [now] if not code else self.archives if self._is_in_doubt() else before

    def _restore(self) -> None:
        before, wanted = self._now(), self.archives
        self.cells = [before, *wanted]
        self.disk.refused.clear()
        code, said = self._ask("restore", str(self.archive), "--force")
        now = self._now()
        self.cells = [now]
        if not code:
            if now not in wanted or now is None:
                self.complain(f"what is restored is none of {len(wanted)} backups")
            if before and (not (place := re.search(r"is in (\S+)", said)) or snapshot(Path(place[1])) != before):
                self.complain(f"what was there before is not where it is said to be: {said}")
        elif now is None and before and "before-restore" in said:
            self._take_back(is_told=True)
        elif now != before and not (self._is_in_doubt() and now in wanted):
            self.complain(f"a restore was refused, and {self.cell} is another one: {said}")

    def _restore_in_use(self) -> None:
        if not (before := self._now()):
            return
        with self.disk.aside():
            held = hold_state_lock(self.cell)
            held.__enter__()
        try:
            code, _ = self._ask("restore", str(self.archive), "--force")
        finally:
            with self.disk.aside():
                held.__exit__(None, None, None)
        if not code or self._now() != before:
            self.complain("a state directory in use was exchanged")

    def _is_in_doubt(self) -> bool:
        """All was done but the folder's fsync."""
        return any(call.what in ("fsync", "open") for call in self.disk.refused)

    def _take_back(self, *, is_told: bool = False) -> None:
        """The next start finds what a killed restore has set aside; a person, what a refused one has told of."""
        with self.disk.aside():
            put_back(self.cell)
            aside = sorted(self.scene.outside.glob("cell.before-restore-*"), key=lambda path: path.stat().st_ino)
            if aside and not self.cell.exists() and is_told:
                aside[-1].rename(self.cell)
            for path in self.scene.outside.glob("cell.before-restore-*"):
                shutil.rmtree(path)
        self.disk.note_all()

    def judge(self) -> None:
        if not self.disk.is_well or self._is_busy:
            return
        self._take_back()
        now = self._now()
        if now not in self.cells:
            self.complain(f"{self.cell} holds {now and list(now)}, none of what it may")
        self.cells = [now]
        packed = self._packed()
        if packed not in self.archives:
            self.complain(f"{self.archive} holds {packed and list(packed)}, none of what it may")
        self.archives = [packed]

    def _packed(self) -> Snapshot:
        if not self.archive.exists():
            return None
        copy = self.scene.unseen / "copy"
        unpack_state(self.archive, copy)
        try:
            return snapshot(copy)
        finally:
            shutil.rmtree(copy)

    def judge_healed(self) -> None:
        """A backup and a restore, and nothing is left beside them."""
        self._change()
        while not self._now():
            self._change()
        self._pack()
        self._restore()
        self._take_back()
        self.judge()
        if left := [path.name for path in self.scene.outside.iterdir() if path.name.startswith(".")]:
            self.complain(f"{left} are left beside for ever")
