"""What a gateway says of itself to its next start and to people: the marker of its run, and the events of two processes."""

from pathlib import Path
from typing import Any, ClassVar

from gateway.plain_file import tell_place_and_refusal
from gateway.processes.event import EventRecord, make_event, parse_event
from gateway.processes.event_file import KEPT, NAME, EventFile, EventReader
from gateway.processes.event_log import _EventFileWriter
from gateway.service.clean_shutdown_marker import CleanShutdownMarker
from tests.disk.drawn.drawn_disk import Killed
from tests.disk.drawn.players.player import Player

SECRET = "s3cr3t"
SOURCES = "control", "guardian"


class NotedFile(EventFile):
    """kept: texts that were taken, in their order; rotations: how often a full file was to get its next name."""

    def __init__(self, directory: Path, longest_bytes: int, kept: list[str]) -> None:
        super().__init__(directory, longest_bytes)
        self.kept, self.rotations = kept, 0

    def append(self, line: bytes) -> None:
        super().append(line)
        event = parse_event(line)
        assert event
        self.kept.append(event.text)

    def _rotate(self) -> None:
        self.rotations += 1
        super()._rotate()


class EventWriter:
    """One process's events on their way. given: numbers of this life; lost: how many were said not to be kept."""

    def __init__(self, player: "EventsPlayer", source: str) -> None:
        self.source, self._player = source, player
        self.given, self.taken = 0, list[str]()
        self.file = NotedFile(player.state, player.longest_bytes, self.taken)
        self._write = _EventFileWriter(self.file, self._tell, self._event)

    def _event(self, cause: str, sentence: str) -> EventRecord:
        return make_event(self._player.scene.wall_s, self.source, cause, sentence)

    def _tell(self, event: EventRecord) -> None:
        self._player.judge_words(event.text)

    def say(self, number: int) -> None:
        """One event; an error of the disk is none of its thread's."""
        self.given += 1
        before = len(self.taken)
        try:
            self._write(self._event("test", f"event {number} mqtt://robot:{SECRET}@broker {self.source}"))
        except OSError:
            pass
        finally:
            self._player.kept += self.taken[before:]

    @property
    def lost(self) -> int:
        """How many it has said were not kept."""
        return sum(int(text.split()[0]) for text in self.taken if "were not kept before" in text)


class EventsPlayer(Player):
    """kept: texts that the file took, in their order, since the power was cut; seen: what a follower has been shown."""

    folders: ClassVar = (f"{NAME}*",)

    def __init__(self, scene: Any) -> None:
        super().__init__(scene)
        self.longest_bytes = self.rng.choice([700, 2500, 1 << 20])
        self.number = self.cut_number = 0
        self.kept: list[str] = []
        self.writers: list[EventWriter] = []
        self.is_saying = False
        self._follow()

    def _follow(self) -> None:
        self.follower, self.seen = EventReader(self.state), list[str]()
        self.is_following = self.is_looking = False

    def begin(self) -> None:
        self.writers = [EventWriter(self, source) for source in SOURCES]

    def act(self) -> None:
        self._say(self.writers[0])

    def _say(self, writer: EventWriter) -> None:
        for _ in range(self.rng.choice([1, 1, 2, 4])):
            self.number += 1
            writer.say(self.number)

    def verb(self) -> None:
        """`events`, and `events --follow`; or the guardian says something."""
        if self.rng.random() < 0.4 and not self.is_saying:  # beside itself
            self.is_saying = True
            try:
                self._say(self.writers[1])
            except Killed:  # another one is started
                self.writers[1].file.close()
                self.writers[1] = EventWriter(self, SOURCES[1])
                raise
            finally:
                self.is_saying = False
            return
        try:
            with EventReader(self.state) as reader:
                list(reader.read_stored())
            self._look()
        except OSError as refusal:
            self.judge_words(tell_place_and_refusal(refusal))
            self.follower.close()
            self._follow()

    def _look(self) -> None:
        if self.is_looking:  # beside itself
            return
        self.is_looking = True
        try:
            read = self.follower.read_new if self.is_following else self.follower.read_stored
            self.is_following = True
            self.seen += [event.text for event in read()]
        finally:
            self.is_looking = False
        self._judge_order(self.seen, "a follower was shown")

    def die(self) -> None:
        for writer in self.writers:
            writer.file.close()
        self.writers = []

    def close(self) -> None:
        self.follower.close()

    def lose_power(self) -> None:
        """None is synced: of what was said before, and of its files' names, anything may be there."""
        self.kept.clear()
        self.cut_number = self.number
        self.follower.close()
        self._follow()

    def judge(self) -> None:
        if self.disk.is_well:
            self._judge_stored()

    def _judge_stored(self) -> list[str]:
        """Return what there is; nothing where a person has put what is no file."""
        try:
            with EventReader(self.state) as reader:
                texts = [event.text for event in reader.read_stored()]
        except OSError as refusal:
            if not self.is_touched:
                raise
            self.judge_words(tell_place_and_refusal(refusal))
            return []
        if self.is_touched:
            return texts
        self._judge_order(texts, "there are")
        gone = [text for text in self.kept if text not in set(texts)]
        for source in SOURCES:  # what two say at once is in no order
            kept, lost = ([text for text in one if text.endswith(source)] for one in (self.kept, gone))
            if lost != kept[: len(lost)]:
                self.complain(f"{lost[-1]} is gone, and older ones are there")
        if gone and len(list(self.state.glob(f"{NAME}.*"))) < KEPT - 1:
            self.complain(f"{len(gone)} events went, and there was room for them")
        return texts

    def _judge_order(self, texts: list[str], what: str) -> None:
        for source in SOURCES:
            told = [int(text.split()[1]) for text in texts if text.startswith("event ") and text.endswith(source)]
            numbers = [number for number in told if number > self.cut_number]
            if numbers != sorted(set(numbers)) and not self.is_touched:
                self.complain(f"{what} events of {source} twice, or out of order: {numbers[-9:]}")

    def judge_healed(self) -> None:
        """All of this life is there or counted; files are few and short; and what is said now is read."""
        for writer in self.writers * 6:
            self.number += 1
            writer.say(self.number)
        last = self._judge_stored()[-1:]
        for writer in self.writers:
            taken = sum(text.startswith("event ") for text in writer.taken)
            if taken + writer.lost != writer.given:
                self.complain(f"{writer.source}: {writer.given} were said, {taken} kept, {writer.lost} counted")
        if last and not last[0].startswith(f"event {self.number} "):
            self.complain(f"the newest is {last}, {self.number} was said")
        sizes = [path.stat().st_size for path in self.state.glob(f"{NAME}*") if path.is_file()]
        if not self.is_touched and len(sizes) > KEPT + 1:
            self.complain(f"{len(sizes)} files of events")


class MarkerPlayer(Player):
    """Did the last run end cleanly, and which masters' bits begin nothing: a start knows both, or takes the worse.

    left: what the last clean end has left. was_killed: how the life before ended, None where nobody can know; is_marked: it
    said that it ran, on a disk that took it; is_left: `left` is that of an end that was not clean, but surely stored."""

    folders: ClassVar = ("running", "left.json")

    def __init__(self, scene: Any) -> None:
        super().__init__(scene)
        self.left: dict[str, Any] = {}
        self.was_killed: bool | None = False
        self.is_marked, self.is_left = True, False
        self.number = 0

    def begin(self) -> None:
        self.disk.refused.clear()
        self.marker = CleanShutdownMarker(self.state)
        was_killed, self.was_killed = self.was_killed, None
        was_unclean = self.marker.mark_running()
        found = self.marker.left
        if not self.disk.refused and not self.is_touched:
            if was_killed is not None and was_unclean is not was_killed:
                self.complain(f"the run before was {'killed' if was_killed else 'ended'}; told: {was_unclean}")
            if self.is_marked and (self.is_left or not was_unclean) and found != self.left:
                self.complain(f"a start knows {found}, {self.left} was left")
        self.is_left = False
        self.is_marked = not self.disk.refused and not self.is_touched
        self.was_killed = True if self.is_marked else None

    def act(self) -> None:
        """A clean end, or one at which control stands still, and another start, of the machine say."""
        self.number += 1
        if self.is_marked and self.rng.random() < 0.3:
            self.disk.refused.clear()
            left = {"lost_beats": {"10.0.0.1": [self.number]}}
            self.marker.leave(left)
            if not self.disk.refused and not self.is_touched:
                self.left, self.is_left = left, True
            self.scene.note(f"the guardian has left {self.number}")
            self.scene.lose_power() if self.rng.random() < 0.5 else self.begin()
            return
        self.left = {"lost_beats": {"10.0.0.1": [self.number] * 40}} if self.rng.random() < 0.7 else {}
        self.disk.refused.clear()
        was_killed, self.was_killed = self.was_killed, None
        self.marker.clear(self.left)
        self.scene.note(f"ended cleanly, {self.number if self.left else 'nothing'} is left")
        if not self.disk.refused and was_killed is not None:
            self.was_killed = False
        if self.rng.random() < 0.5:
            self.scene.lose_power()
        else:
            self.begin()

    def verb(self) -> None: ...

    def judge(self) -> None: ...

    def judge_healed(self) -> None:
        """What it leaves is there at the next start."""
        self.number += 1
        self.left = {"lost_beats": {"10.0.0.1": [self.number]}}
        self.marker.clear(self.left)
        self.was_killed, self.is_marked = None if self.is_touched else False, True
        self.begin()
