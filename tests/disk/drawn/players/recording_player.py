"""Recordings of a gateway, and what people do with them: what was told to be there is, in order, and no more goes than must."""

import os
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

from gateway.profiles.recordings_section import Retention
from gateway.recording import RecordingError, list_recordings, read_recording
from gateway.recording.care.keeping import delete_recording, is_kept, keep_recording, let_recording_go, prune_recordings
from gateway.recording.care.summaries import list_summaries
from gateway.recording.label import RecordingLabel
from gateway.service.running_rig.recording.recordings import Recordings
from gateway.watch.reference_recording import read_reference_recording
from tests.disk.drawn.players.player import Player
from tests.disk.drawn.players.recording_laws import broken_rows, marked, out_of_turn, spared
from tests.service.rigs import demo

LABELS = ("", "vor der Reparatur", "a/b", "ä 'x' \"y\"")
FEW_BYTES, MANY_BYTES = 6000, 60_000


class RecordingPlayer(Player):
    """told: rows that were acknowledged, by file; durable: rows that were synced; gone: names that somebody has deleted."""

    folders: ClassVar = ("recordings",)

    def __init__(self, scene: Any) -> None:
        super().__init__(scene)
        rng = self.rng
        limits = Retention(
            days=rng.choice([None, None, 0.5, 30.0]), bytes=rng.choice([None, None, FEW_BYTES, MANY_BYTES])
        )
        self.rig = replace(demo(), retention=limits)
        self.number = 0
        self.told: dict[str, int] = {}
        self.durable: dict[str, int] = {}
        self.recordings: Recordings | None = None
        self.is_wanted = False
        self.deleted, self.used, self.gone = (
            set[str](),
            set[str](),
            set[str](),
        )  # used: that had been synced; gone: told so

    def begin(self) -> None:
        self.recordings = Recordings(self.path("recordings"), self.rig, self.scene.say)
        self.recordings.on_wanted = self._note_wanted
        self.is_wanted, self.goes_on = False, False

    def _note_wanted(self, wanted: object) -> None:
        self.goes_on = wanted is not None

    def tick(self) -> None:
        if not self.recordings:
            return
        for _ in range(self.rng.choice([0, 1, 3])):
            self.number += 1
            sample = SimpleNamespace(time_s=self.scene.now_s, number=self.number)
            self.recordings.append(sample, None, None)  # type: ignore[arg-type]
        self.recordings.flush(self.scene.now_s)
        said = self.recordings.status()
        self.judge_words(f"{said.get('recording') or ''}{said.get('waits', '')}" or "-")
        held = sum(len(one._gathered) for one in (self.recordings._current, *self.recordings._closing) if one)
        if held > 2000:
            self.complain(f"{held} rows in memory")

    def _await(self, what: str, answer: Future[Any]) -> None:
        answer.add_done_callback(lambda done: self._hear(what, done))

    def _hear(self, what: str, answer: Future[Any]) -> None:
        if error := answer.exception():
            self.scene.note(f"{what}: {error}")
            self.judge_words(str(error))
            if not isinstance(error, OSError):
                self.complain(f"{what}: {error!r}")
            assert self.recordings
            if what == "start" and not self.recordings._current and not self.recordings._again.why:
                self.is_wanted = False
            return
        facts = answer.result()
        self.scene.note(f"{what}: {facts}")
        self.judge_words(
            " ".join(str(facts[key]) for key in ("recording", "written", "fault") if facts.get(key)) or "-"
        )
        name = Path(facts.get("written", "")).name
        if name and name not in self.deleted:
            self.told[name] = facts["rows"]

    def note_synced(self, path: Path) -> None:
        """A file and its names were synced."""
        if path.name in self.used and not self.is_touched:
            self.complain(f"{path.name} was deleted, and its number is given again")
        with self.disk.aside():
            try:
                self.durable[path.name] = read_recording(path).rows
            except (OSError, RecordingError):
                return

    def act(self) -> None:
        """The gateway is asked for one, or for its end."""
        assert self.recordings
        if self.rng.random() < 0.65:
            try:
                label = RecordingLabel(self.rng.choice(LABELS))
                answer = self.recordings.start(label, self.rng.choice([0.0, 0.0, 0.0, 7.0]))
            except ValueError as refusal:
                self.judge_words(str(refusal))
                return
            self._await("start", answer)
            self.is_wanted = True
        else:
            self.is_wanted = False
            self._await("stop", self.recordings.stop())

    def verb(self) -> None:
        """A person at a terminal, or the page."""
        verb: Callable[[], None] = self.rng.choice(
            [self._list, self._keep, self._keep, self._let_go, self._delete, self._prune]
        )
        try:
            verb()
        except FileNotFoundError as refusal:
            self.judge_words(str(refusal.strerror))
        except (OSError, RecordingError) as refusal:
            self.judge_words(str(getattr(refusal, "strerror", "") or refusal))

    def _any(self) -> Path:
        with self.disk.aside():
            folder = self.path("recordings")
            paths = sorted(folder.glob("[0-9][0-9][0-9][0-9].fgr")) if folder.is_dir() else []
        return self.rng.choice(paths) if paths else self.path("recordings", "0001.fgr")

    def _list(self) -> None:
        for entry in list_recordings(self.state):
            if entry.fault:
                self.judge_words(entry.fault)
        list_summaries(self.state, reads_growing=self.rng.random() < 0.5)
        read_reference_recording(self.state)

    def _keep(self) -> None:
        path = self._any()
        if self._is_there(path):
            keep_recording(path)
            self.scene.kept.add(path.name)

    def _let_go(self) -> None:
        path = self._any()
        self.scene.kept.discard(path.name)
        let_recording_go(path)
        self.scene.kept.discard(path.name)  # of who kept it meanwhile

    def _delete(self) -> None:
        path = self._any()
        is_open = self._is_open(path)
        reference = self.scene.reference
        told, durable = (
            kept.pop(path.name, None) for kept in (self.told, self.durable)
        )  # a refusal may come at its end
        why = delete_recording(path, reference)
        self.scene.note(f"delete {path.name}: {why or 'gone'}")
        if why and told is not None:
            self.told[path.name] = told
        if why and durable is not None:
            self.durable[path.name] = durable
        if not why:
            if (
                (is_open and self._is_open(path))
                or path.name == reference
                or (path.name in self.scene.kept and not self.is_touched)
            ):
                self.complain(f"{path.name} was deleted, and had to stay")
            self.deleted.add(path.name)
            self.gone |= {path.name} if durable is not None else set()
            self.used |= {path.name} if durable is not None else set()
            self._forget(path.name)
            if self._is_there(path):
                self.complain(f"{path.name} is said to be deleted, and is there")

    def _prune(self) -> None:
        limits = self.rig.retention
        if not limits.is_unlimited:
            prune_recordings(self.state, limits, self.scene.reference)

    def _is_there(self, path: Path) -> bool:
        with self.disk.aside():
            return path.is_file()

    def _is_open(self, path: Path) -> bool:
        """The gateway writes it, as far as nobody has put another file there."""
        if self.is_touched:
            return False
        ours = (self.recordings._current, *self.recordings._closing) if self.recordings else ()
        return any(one and one._file and one._file.is_open and one._file.path == path for one in ours)

    def _forget(self, name: str) -> None:
        self.told.pop(name, None)
        self.durable.pop(name, None)

    def watch_pruning(self, prune: Callable[..., Any], state: Path, retention: Retention, *rest: Any) -> Any:
        """Judge what goes: nothing that must stay, and no more than the limits have no room for."""
        before = self._sizes()
        open_before = {path.name for path in self._paths() if self._is_open(path)}
        must_stay = {self.scene.reference}
        if not self.is_touched:
            must_stay |= self.scene.kept
        refused = len(self.disk.refused)
        try:
            pruned = prune(state, retention, *rest)
            self.gone |= (names := {one.path.name for one in pruned}) & set(self.durable)
            if len(self.disk.refused) == refused and not self.is_touched:
                with self.disk.aside():
                    stay = {*rest[:1]} | marked(self.path("recordings")) | open_before | self.deleted
                self.complain_if(out_of_turn(before, names, stay))
            return pruned
        finally:
            after = self._sizes()
            gone = {name for name in before if name not in after}
            self.used |= gone & set(self.durable)
            for name in gone:
                self._forget(name)
            must_stay |= {name for name in open_before if self._is_open(self.path("recordings", name))}
            self.deleted |= gone
            if gone & must_stay:
                self.complain(f"{gone & must_stay} went, and had to stay")
            if len(self.disk.refused) == refused and (why := spared(before, after, retention, self.scene.wall_s)):
                self.complain(why)

    def _paths(self) -> list[Path]:
        with self.disk.aside():
            folder = self.path("recordings")
            return [path for path in sorted(folder.glob("*.fgr")) if path.is_file()] if folder.is_dir() else []

    def _sizes(self) -> dict[str, tuple[int, float]]:
        with self.disk.aside():
            return {path.name: (path.stat().st_size, path.stat().st_mtime) for path in self._paths()}

    def die(self) -> None:
        if self.recordings:
            for one in (self.recordings._current, *self.recordings._closing):
                if one and one._file and one._file._descriptor is not None:
                    os.close(one._file._descriptor)
                    one._file._descriptor = None
        self.recordings = None

    def lose_power(self) -> None:
        self.told = dict(self.durable)
        self.scene.kept &= set(self.durable)

    # -- what is asked

    def judge(self) -> None:
        if not self.disk.is_well:
            return
        try:
            entries = list_recordings(self.state)
            summaries = list_summaries(self.state)
        except OSError as refusal:
            if not self.is_touched:
                raise
            self.judge_words(str(refusal.strerror))
            return
        if len(summaries) != len(entries):
            self.complain(f"{len(summaries)} are summarised of {len(entries)}")
        if not self.is_touched:
            if back := self.gone & {entry.path.name for entry in entries}:
                self.complain(f"{back} were deleted, and are back")
            for words in broken_rows(entries, self.told, set(self.durable), self.number):
                self.complain(words)
            for entry in entries:
                if entry.path.name in self.scene.kept and not is_kept(entry.path):
                    self.complain(f"{entry.path.name} is kept no more")

    def judge_healed(self) -> None:
        """A recording that was wanted goes on; one can be begun and ended; there is no more than the limits have room for."""
        assert self.recordings
        if self.is_wanted and not self.recordings._wanted.for_s and not self.recordings.status().get("recording"):
            self.complain(f"it does not go on on a disk that is well: {self.recordings.status()}")
        if self.goes_on and not self.is_wanted:
            self.complain("it was ended, and would go on in the next process")
        if not self.recordings.status().get("recording"):
            self._await("start", self.recordings.start())
            self.scene.go_on_all()
        for _ in range(4):
            self.scene.now_s += 0.2
            self.scene.go_on_all()
        answer = self.recordings.stop()
        self.scene.go_on_all()
        facts = answer.result(0)
        if facts.get("fault") or "written" not in facts:
            self.complain(f"no recording on a disk that is well: {facts}")
            return
        name = Path(facts["written"]).name
        self.told[name] = facts["rows"]
        if not self.is_touched and self.durable.get(name, -1) != facts["rows"]:
            self.complain(f"{name} was ended with {facts['rows']} rows, {self.durable.get(name)} were synced")
        self.judge()
