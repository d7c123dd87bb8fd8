"""Files that stand for themselves, and the archive of a whole state directory, each as an act (acts.py)."""

import json
import shutil
import tarfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from gateway.cli.state_archive import ArchiveError, pack_state, unpack_state
from gateway.cli.support_bundle import pack_bundle
from gateway.processes.durable_file import replace_text
from gateway.recording import Recording
from gateway.recording.export import export_csv
from gateway.service.clean_shutdown_marker import CleanShutdownMarker
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


class CleanEnd(Act):
    """A gateway that runs, and ends cleanly with what masters begin nothing by; often the machine is switched off with it."""

    BEFORE, AFTER = ({"lost_beats": {"10.0.0.1": [beat]}} for beat in (1, 2))

    def prepare(self) -> None:
        self.state.mkdir(exist_ok=True)
        CleanShutdownMarker(self.state).clear(self.BEFORE)

    def run(self, say: Say) -> None:
        marker = CleanShutdownMarker(self.state)
        marker.mark_running()
        say("runs")
        marker.clear(self.AFTER)
        say("ended")

    def check(self, said: Sequence[Any]) -> None:
        marker = CleanShutdownMarker(self.state)
        is_unclean, left = marker.mark_running(), marker.left
        assert said or is_unclean or left == self.BEFORE
        assert "ended" in said or not said or is_unclean or left == self.AFTER
        assert "ended" not in said or (left == self.AFTER and not is_unclean)
        marker.clear(left)


class CleanEndOfNobody(CleanEnd):
    """It leaves nothing: what was left before counts no more, or the master of then is refused once more."""

    AFTER: ClassVar[dict[str, dict[str, list[int]]]] = {}


class Exported(Act):
    """A recording is exported over an export of before."""

    def prepare(self) -> None:
        self._export(1.0)

    def run(self, say: Say) -> None:
        self._export(2.0)
        say("exported")

    def check(self, said: Sequence[Any]) -> None:
        lines = self._target.read_text().splitlines()[-900:]
        assert {line.split(",")[1] for line in lines} in ([{"2"}] if said else [{"1"}, {"2"}])
        assert len(lines) == 900

    def _export(self, force_n: float) -> None:
        columns = {"time_s": np.arange(900.0), "force_n": np.full(900, force_n)}
        export_csv(Recording(self._target, {"rig": "demo"}, columns, 900, False), self._target)

    @property
    def _target(self) -> Path:
        return self.state / "demo-0001.csv"


class Bundled(Act):
    """A bundle for who helps replaces the one before."""

    def prepare(self) -> None:
        self._pack("old")

    def run(self, say: Say) -> None:
        self._pack("new")
        say("packed")

    def check(self, said: Sequence[Any]) -> None:
        with tarfile.open(self._target) as archive:
            texts = {stream.read() for one in archive if (stream := archive.extractfile(one))}
        assert texts in ([{b"new" * 2000}] if said else [{b"old" * 2000}, {b"new" * 2000}])

    def _pack(self, word: str) -> None:
        pack_bundle({"events.jsonl": word * 2000, "state.txt": word * 2000}, self._target)

    @property
    def _target(self) -> Path:
        return self.state / "support.tar.gz"
