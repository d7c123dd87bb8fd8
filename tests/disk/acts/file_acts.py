"""Files that stand for themselves, and the archive of a whole state directory, each as an act (acts.py)."""

import json
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gateway.cli.state_archive import ArchiveError, pack_state, unpack_state
from gateway.processes.durable_file import replace_text
from gateway.telemetry.mqtt.kept_bd_seq import KeptBdSeq
from tests.disk.acts.acts import Act, Say


class CountedBirths(Act):
    """The number of a telemetry node's births goes on: one that is told was never told before."""

    def prepare(self) -> None:
        self.state.mkdir(exist_ok=True)
        for _ in range(5):
            KeptBdSeq(self.state).next()

    def run(self, say: Say) -> None:
        number = KeptBdSeq(self.state).next()
        if KeptBdSeq(self.state)._last == number:
            say(number)

    def check(self, said: Sequence[Any]) -> None:
        assert KeptBdSeq(self.state)._last in ((said[-1],) if said else (4, 5, 6))


class ReportedFit(Act):
    """The document of a fit, which the page reads, is replaced."""

    TEXTS = tuple(json.dumps({"fit": number, "text": "x" * 5000}) for number in (1, 2))

    def prepare(self) -> None:
        self._document.write_text(self.TEXTS[0])

    def run(self, say: Say) -> None:
        replace_text(self._document, self.TEXTS[1])
        say("written")

    def check(self, said: Sequence[Any]) -> None:
        assert self._document.read_text() in (self.TEXTS[1:] if said else self.TEXTS)

    @property
    def _document(self) -> Path:
        return self.state / "0001.json"


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
        pack_state(self._cell, self._archive)
        self._fill("new")

    def run(self, say: Say) -> None:
        pack_state(self._cell, self._archive)
        say("packed")

    def check(self, said: Sequence[Any]) -> None:
        target = self.state / "elsewhere"
        unpack_state(self._archive, target)
        assert self._words_in(target) in (({"new"},) if said else ({"old"}, {"new"}))
        shutil.rmtree(target)
        assert self._words_in(self._cell) == {"new"}


class Restored(Archived):
    """A backup is restored over what has changed since."""

    refusals = (OSError, ArchiveError)

    def prepare(self) -> None:
        self._fill("new")
        pack_state(self._cell, self._archive)
        self._fill("old")

    def run(self, say: Say) -> None:
        unpack_state(self._archive, self._cell)
        say("restored")

    def check(self, said: Sequence[Any]) -> None:
        if not self._cell.exists():  # set aside, and the disk took no other rename: the refusal has said where
            self._cell.with_name("cell.before-restore-1").rename(self._cell)
        assert self._words_in(self._cell) in (({"new"},) if said else ({"old"}, {"new"}))
