"""A scene: several stores of one state directory, and what befalls them, all drawn from one seed."""

import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import Final

from tests.disk.drawn.drawn_disk import GATEWAY, VERB, DrawnDisk
from tests.disk.drawn.edges import edges_of
from tests.disk.drawn.people import People
from tests.disk.drawn.players.player import Player
from tests.disk.drawn.workers import DrawnWorker
from tests.disk.watched_disk import watching

_BEGAN_S: Final = 1.7e9
_UNFIT: Final = ("[Errno", "Traceback", "internal error", "None", "Error(")
_BESIDE: Final = (".new", ".part")
_HIDDEN: Final = frozenset((".summaries.json",))
DAY_S: Final = 86400.0
_MOST_WORK: Final = 300


class Scene:
    """now_s: monotonic; wall_s: of the epoch; said: what the gateway has told; broken: the laws that did not hold; outside: a
    folder of people's on the same disk; unseen: one that no scene's disk has."""

    def __init__(self, seed: int, folder: Path, kinds: list[type[Player]]) -> None:
        self.rng = Random(seed)
        self.unseen, root = folder, folder / "disk"
        self.state, self.outside = root / "state", root / "outside"
        self.state.mkdir(parents=True), self.outside.mkdir()
        self.disk = DrawnDisk(root)
        self.now_s, self.wall_s = 1000.0, _BEGAN_S
        self.said: list[str] = []
        self.trace: list[str] = []
        self.broken: list[str] = []
        self.lives = 0
        self._is_power_going = False
        self.kept: set[str] = set()  # recordings that somebody keeps
        self.reference = ""
        DrawnWorker.all.clear(), DrawnWorker.raised.clear()
        self.players = [kind(self) for kind in self.rng.sample(kinds, self.rng.randint(1, min(3, len(kinds))))]
        self.people = People(self)
        self._times: dict[Path, tuple[int, float]] = {}

    def note(self, words: str) -> None:
        """For who plays the scene again."""
        self.trace.append(f"{self.now_s:.2f} {words}")

    def complain(self, words: str) -> None:
        """Note a law that did not hold."""
        self.note(f"BROKEN {words}")
        self.broken.append(words)

    def say(self, cause: str, sentence: str) -> None:
        """The gateway's log."""
        self.said.append(sentence)
        self.note(f"said {sentence}")
        self.judge_words(sentence)

    def judge_words(self, sentence: str) -> None:
        """A refusal is a sentence for people."""
        if not sentence.strip() or any(words in sentence for words in _UNFIT):
            self.complain(f"no sentence for people: {sentence!r}")

    # -- the way

    def run(self) -> "Scene":
        """Play it to its end."""
        with edges_of(self), watching(self.disk):
            self._begin()
            for _ in range(self.rng.choice([10, 25, 60])):
                self._step()
                if self.broken:
                    break
            else:
                self._end()
            self._close()
        if DrawnWorker.raised:
            self.complain(f"a thread's work has raised {DrawnWorker.raised[0]!r}")
        return self

    def go_on_all(self) -> None:
        """All threads do all that they have to, and the loop turns once more."""
        for _ in range(3):
            self._go_on_with_all()
            self._tick()

    def _go_on_with_all(self) -> None:
        for _ in range(_MOST_WORK):
            if busy := DrawnWorker.busy():
                busy[0].go_on()
                self._touch_times()

    def _step(self) -> None:
        rng = self.rng
        steps: list[tuple[int, Callable[[], None]]] = [
            (10, self._act),
            (8, self.go_on),
            (3, self._refuse),
            (3, self._heal),
            (2, self._act_beside),
            (2, self._act_and_kill),
            (1, self.lose_power),
            (1, self._act_and_lose_power),
            (2, self._lose_power_amid),
            (1, self._turn_clock),
            (1, self._meddle),
        ]
        rng.choices([step for _, step in steps], [weight for weight, _ in steps])[0]()

    def _act(self) -> None:
        player = self.rng.choice(self.players)
        process = self.rng.choice([GATEWAY, VERB])
        self.do(process, player.act if process == GATEWAY else player.verb)

    def do(self, process: str, work: Callable[[], None]) -> None:
        """Have one process do something; a kill of the gateway's is followed by another start."""
        self.disk.refused.clear()
        with self.disk.as_process(process):
            work()
        self.disk.forget_plans()
        self._touch_times()
        if self.disk.dead and self._is_power_going:
            self._is_power_going = False
            self.lose_power()
        self.disk.dead.discard(VERB)
        if GATEWAY in self.disk.dead:
            self.note("killed")
            self._begin_anew()

    def go_on(self) -> None:
        """Some time passes, and threads do some of what they have to."""
        self.now_s += (step_s := self.rng.choice([0.05, 0.05, 0.3, 6.0, 40.0]))
        self.wall_s += step_s
        self.do(GATEWAY, self._tick)
        for _ in range(self.rng.choice([0, 1, 3, 20])):
            busy = DrawnWorker.busy()
            if not busy:
                break
            self.do(GATEWAY, self.rng.choice(busy).go_on)

    def _tick(self) -> None:
        for player in self.players:
            player.tick()

    def _refuse(self) -> None:
        places = ["", "", *(folder.rstrip("*") for player in self.players for folder in player.folders)]
        self.note(self.disk.refuse(self.rng, places))

    def _heal(self) -> None:
        if not self.disk.is_well:
            self.note("well")
        self.disk.heal()
        self._judge()

    def _act_beside(self) -> None:
        """Another process, or another thread of the same, does something between two calls of what is done next."""
        rng, other = self.rng, self.rng.choice(self.players)

        def beside() -> None:
            busy = DrawnWorker.busy()
            if busy and rng.random() < 0.5:
                self.note("beside: a thread")
                with self.disk.as_process(GATEWAY):
                    rng.choice(busy).go_on()
            else:
                self.note("beside: a verb")
                with self.disk.as_process(VERB + " beside"):
                    other.verb()
            self._touch_times()

        self.disk.do_between(rng.randrange(12), beside)
        rng.choice([self._act, self._act, self.go_on])()

    def _act_and_kill(self) -> None:
        rng = self.rng
        self.disk.kill_in(rng.choice([0, 1, 2, 3, 5, 8, 13, 21]), rng.choice([0.0, 0.5, 1.0]))
        rng.choice([self._act, self._act, self.go_on])()

    def _act_and_lose_power(self) -> None:
        """Right behind what was said to be stored."""
        self._act()
        for _ in range(self.rng.choice([0, 2])):
            self.go_on()
        self.lose_power()

    def _lose_power_amid(self) -> None:
        """Between two calls of what is done next."""
        self._is_power_going = True
        self._act_and_kill()
        self._is_power_going = False

    def lose_power(self) -> None:
        """Cut it; then a gateway starts."""
        for player in self.players:
            player.die()
        self.note(f"power cut: {self.disk.cut_power(self.rng)}")
        self._times.clear()
        for player in self.players:
            player.lose_power()
        self._begin_anew(is_killed=False)

    def _turn_clock(self) -> None:
        leap_s = self.rng.choice([3600.0, DAY_S, 40 * DAY_S, -3600.0, -40 * DAY_S, -50 * 365 * DAY_S, 1000 * DAY_S])
        self.wall_s = max(0.0, self.wall_s + leap_s)
        self.note(f"clock leaps by {leap_s:g} s")

    def _meddle(self) -> None:
        self.people.meddle(self.rng.choice(self.players))

    # -- processes

    def _begin(self) -> None:
        self.lives += 1
        self.do(GATEWAY, lambda: [player.begin() for player in self.players] and None)

    def _begin_anew(self, *, is_killed: bool = True) -> None:
        if is_killed:
            for player in self.players:
                player.die()
        self.disk.dead.clear()
        self.disk.forget_plans()
        DrawnWorker.all.clear()
        self._begin()

    def _judge(self) -> None:
        with self.disk.aside():
            for player in self.players:
                player.judge()

    def _end(self) -> None:
        """All is well: what heals by itself does, and then a gateway starts anew."""
        self.disk.heal()
        self.people.undo()
        self.note("the end: well")
        for wait_s in (0.1, 6.0, 6.0, 31.0, 61.0, 4000.0, 0.1, 31.0, 4000.0, 0.1, 0.2):
            self.now_s += wait_s
            self.wall_s += wait_s
            self.do(GATEWAY, self._tick)
            self.do(GATEWAY, self._go_on_with_all)
        with self.disk.aside():
            for player in self.players:
                player.judge_healed()
        if self.broken:
            return
        self._judge_leftovers()
        self.note("another start")
        for player in self.players:
            player.die()
        self._begin_anew(is_killed=False)
        self._judge()

    def _judge_leftovers(self) -> None:
        """What is written beside a file has gone with the next that was."""
        if any(player.is_touched for player in self.players):
            return
        with self.disk.aside():
            names = [path.name for path in Path(self.disk.folder).rglob("*")]
        if left := [name for name in names if name.endswith(_BESIDE) or (name[0] == "." and name not in _HIDDEN)]:
            self.complain(f"{left} are left for ever")

    def _close(self) -> None:
        with self.disk.aside():
            for player in self.players:
                player.die(), player.close()
        DrawnWorker.all.clear()

    def _touch_times(self) -> None:
        """What was written has the time of the scene's clock."""
        with self.disk.aside():
            for path in self.state.glob("recordings/*.fgr"):
                with suppress(OSError):
                    status = path.stat()
                    key = status.st_size, status.st_mtime
                    if path.is_file() and not path.is_symlink() and self._times.get(path) != key:
                        os.utime(path, (self.wall_s, self.wall_s))
                        self._times[path] = status.st_size, path.stat().st_mtime


def clean(folder: Path) -> None:
    """Make room for the next scene."""
    for name in ("disk", "elsewhere"):
        shutil.rmtree(folder / name, ignore_errors=True)
