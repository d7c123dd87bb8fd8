"""A disk on which a scene draws what happens: calls that are refused, short writes, kills, another's work between two calls.

Its files are real ones in memory; what was synced of them is noted call by call (power_cut.py), so that the power may be cut.
"""

import errno
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any, Final

from tests.disk.power_cut import MODES, JournaledDisk, Tree
from tests.disk.watched_disk import CHANGING, Call

GATEWAY: Final = "gateway"
VERB: Final = "verb"
EVERY: Final = CHANGING | {"open", "read", "list"}
KINDS: Final = (
    CHANGING,
    CHANGING,
    EVERY,
    frozenset(("write",)),
    frozenset(("fsync",)),
    frozenset(("rename", "unlink")),
)
ERRORS: Final = (errno.ENOSPC, errno.EIO, errno.EROFS, errno.EDQUOT)
_ROOM: Final = frozenset(("create", "write", "mkdir"))


class Killed(BaseException):
    """kill -9 of the process that has made this call: nothing of what it would still do reaches the disk."""


@dataclass
class Refusal:
    """Calls of these kinds beneath a place are refused: behind so many, so many of them."""

    kinds: frozenset[str]
    number: int
    skipped: int
    count: int
    beneath: str = ""

    def refuses(self, call: Call) -> bool:
        """Count the call, and decide."""
        if call.what not in self.kinds or not self.count or not (self.beneath in call.path or self.beneath in call.to):
            return False
        if self.number in (errno.ENOSPC, errno.EDQUOT) and not _needs_room(call):
            return False
        if self.skipped:
            self.skipped -= 1
            return False
        self.count -= 1
        return True


def _needs_room(call: Call) -> bool:
    if call.what == "create":
        return bool(call.flags & os.O_CREAT) and not os.path.lexists(call.path)
    return call.what == "fsync" or (call.what in _ROOM and bool(call.data or call.what != "write"))


class DrawnDisk(JournaledDisk):
    """process: whose calls come now; dead: who was killed; refused: what was refused since `refused` was cleared."""

    def __init__(self, folder: Path) -> None:
        self.is_aside = False
        super().__init__(folder)
        self.process = GATEWAY
        self.dead: set[str] = set()
        self.refusals: list[Refusal] = []
        self.unreadable: set[str] = set()
        self.refused: list[Call] = []
        self._short: tuple[int, float] | None = None
        self._kill: tuple[int, float] | None = None
        self._between: tuple[int, Callable[[], None]] | None = None
        self._share = 1.0

    # -- what is drawn

    def refuse(self, rng: Random, places: list[str]) -> str:
        """Refuse calls from now on, or write one short; return it in words."""
        if rng.random() < 0.15:
            self._short = rng.randrange(4), rng.choice([0.0, 0.3, 0.9])
            return f"short write {self._short}"
        count = rng.choice([1, 1, 2, 3, 8, 1 << 30])
        one = Refusal(rng.choice(KINDS), rng.choice(ERRORS), rng.choice([0, 0, 1, 2, 5, 12]), count, rng.choice(places))
        self.refusals.append(one)
        return f"{errno.errorcode[one.number]} of {count} {sorted(one.kinds)} behind {one.skipped} at {one.beneath!r}"

    def heal(self) -> None:
        """All calls come to their end from now on."""
        self.refusals.clear()
        self.unreadable.clear()
        self._short = None

    @property
    def is_well(self) -> bool:
        """Nothing is refused, now or later."""
        return not self.unreadable and not any(one.count for one in self.refusals) and self._short is None

    def kill_in(self, calls: int, share: float) -> None:
        """Kill whoever makes the call behind so many; share: of what a write has written by then."""
        self._kill = calls, share

    def do_between(self, calls: int, work: Callable[[], None]) -> None:
        """Have this done between two calls: behind so many from now."""
        self._between = calls, work

    def forget_plans(self) -> None:
        """Kill nobody any more, and do nothing between."""
        self._kill = self._between = None

    @contextmanager
    def as_process(self, process: str) -> Iterator[None]:
        """What is done meanwhile is done by this one; its kill ends here, and `dead` says so."""
        before, self.process = self.process, process
        try:
            yield
        except Killed:
            if before in self.dead and before != process:
                raise
        finally:
            self.process = before

    @contextmanager
    def aside(self) -> Iterator[None]:
        """What a person does meanwhile is not watched."""
        before, self.is_aside = self.is_aside, True
        try:
            yield
        finally:
            self.is_aside = before

    def cut_power(self, rng: Random) -> str:
        """Have the folder hold what a power cut leaves of it now; return how in a word."""
        mode = rng.choice(MODES)
        tree = self._state(len(self.changes), mode, rng)
        with self.aside():
            shutil.rmtree(self.folder)
            tree.write_to(Path(self.folder))
        self.note_all()
        return mode

    def note_all(self) -> None:
        """What is there now was synced."""
        with self.aside():
            self.begin, self.changes = Tree(), []
            self._read(Path(self.folder), 0)
            self._live = self.begin.copy()

    # -- each call

    def go(self, call: Call, door: Callable[[], Any]) -> Any:
        """One call, if somebody watches."""
        return door() if self.is_aside else super().go(call, door)

    def before(self, call: Call) -> None:
        """Refuse it, or kill who makes it."""
        if self.process in self.dead:
            raise Killed
        self._do_what_comes_between()
        self._share = 1.0
        if self._short and call.what == "write":
            calls, share = self._short
            self._short = (calls - 1, share) if calls else None
            self._share = 1.0 if calls else share
        self._kill_whose_turn_it_is(call)
        self._refuse(call)
        super().before(call)

    def length_of(self, call: Call) -> int:
        """Cut what is written short; not what is done aside, behind a write that was."""
        return len(call.data) if self.is_aside else int(self._share * len(call.data))

    def after(self, call: Call, result: Any) -> None:
        """Note it; what has no name any more is not noted."""
        if not call.path.endswith(" (deleted)"):
            try:
                super().after(call, result)
            except KeyError:  # beneath a link, say
                self.note_all()
        if self.process in self.dead:
            raise Killed

    def _do_what_comes_between(self) -> None:
        if not self._between:
            return
        calls, work = self._between
        self._between = (calls - 1, work) if calls else None
        if not calls:
            work()
            if self.process in self.dead:
                raise Killed

    def _kill_whose_turn_it_is(self, call: Call) -> None:
        if not self._kill:
            return
        calls, share = self._kill
        self._kill = (calls - 1, share) if calls else None
        if calls:
            return
        self.dead.add(self.process)
        if call.what != "write" or not share:
            raise Killed
        self._share = share

    def _refuse(self, call: Call) -> None:
        number = 0
        if call.what in ("open", "create", "list") and any(
            call.path == path or call.path.startswith(f"{path}/") for path in self.unreadable
        ):
            number = errno.EACCES
        for one in self.refusals:
            if not number and one.refuses(call):
                number = one.number
        if number:
            self.refused.append(call)
            raise OSError(number, os.strerror(number), *([] if call.descriptor >= 0 else [call.path]))
