"""Who may connect, who must go, and who never: the rules of a face's places, said once more; and a crowd that wants them all.

Shares no code with the gateway. What it does not see to the moment (when a face last looked around) it leaves open.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from typing import Any, NamedTuple

LINGERS_S, CROWD = 1.5, "10.0.1."
READ = bytes.fromhex("000700000006010300640003")


class Rules(NamedTuple):
    """gives_way_s: silent for so long, somebody who has more than one place gives one away; slack_s: between two looks."""

    connections: int
    per_address: int
    idle_s: float
    partial_s: float
    gives_way_s: float
    slack_s: float


@dataclass(eq=False)
class Place:
    """One connection. asked_s: when it connected or last sent a whole request; begun_s: when it began one that is not whole."""

    host: str
    asked_s: float
    begun_s: float | None = None


class Places:
    """The connections of one face that its clients know of."""

    def __init__(self, rules: Rules, now: Callable[[], float]) -> None:
        self.rules, self._now = rules, now
        self.broken: list[str] = []
        self.onlookers: list[Callable[[], object]] = []
        """Those who have places here, each to see which of its own were closed."""
        self._open: list[Place] = []
        self._left: deque[tuple[float, Place]] = deque(maxlen=64)
        self._came: list[tuple[str, float]] = []  # who has come where there was no room, and nobody has gone for yet

    def look(self) -> None:
        """Before somebody connects: where one was closed since anybody looked, there is room."""
        for see in self.onlookers:
            see()

    def take(self, host: str, is_admitted: bool) -> Place | None:
        """Somebody has connected, and is still there, or not."""
        now_s, rules = self._now(), self.rules
        has_share, is_full = self._lacks_room(host, self._open)
        may_have_share, may_be_full = self._lacks_room(host, [*self._open, *self._lingering])
        rivals = [one for one in self._open if (one.host == host if has_share else self._count(one.host) > 1)]
        silent = [now_s - one.asked_s for one in rivals if one.begun_s is None]
        may, must = (any(each >= rules.gives_way_s + more for each in silent) for more in (-1e-6, rules.slack_s))
        if is_admitted and (has_share or is_full) and not may:
            self.broken.append(f"{host} is let in, and there is no room: {self._show()}")
        if not is_admitted and (not (may_have_share or may_be_full) or (must and (has_share or is_full))):
            self.broken.append(f"{host} is kept out, and there is room: {self._show()}")
        if not is_admitted:
            return None
        if may_have_share or may_be_full:
            self._came.append((host if may_have_share else "", now_s))
        self._open.append(place := Place(host, now_s))
        return place

    def _lacks_room(self, host: str, here: list[Place]) -> tuple[bool, bool]:
        """Whether its address has its share, and whether all places are taken."""
        has_share = not host.startswith("127.") and sum(one.host == host for one in here) >= self.rules.per_address
        return has_share, len(here) >= self.rules.connections

    @property
    def _lingering(self) -> list[Place]:
        return [one for at_s, one in self._left if self._now() - at_s < LINGERS_S]

    def lose(self, place: Place) -> None:
        """It was closed by the other end."""
        now_s, rules = self._now(), self.rules
        silent_s = now_s - place.asked_s
        is_idle = silent_s >= rules.idle_s - 1e-6
        is_half = place.begun_s is not None and now_s - place.begun_s >= rules.partial_s - 1e-6
        for_whom = self._for_whom(place)
        if for_whom:
            self._came.remove(for_whom)
            self._judge_longest(place, is_own=bool(for_whom[0]))
        if not (is_idle or is_half or for_whom):
            self.broken.append(f"{place} is closed at {now_s:.3f}, and did nothing: {self._show()}")
        self._open.remove(place)

    def _for_whom(self, place: Place) -> tuple[str, float] | None:
        """Who has come that this one may have made room for: of its own address, or of any where it has more than one place."""
        hosts = (place.host, "") if self._count(place.host) > 1 else (place.host,)
        before_s = self.rules.gives_way_s - 1e-6 + place.asked_s
        fits = (one for one in self._came if one[0] in hosts and one[1] >= before_s and place.begun_s is None)
        return next(fits, None)

    def _judge_longest(self, place: Place, *, is_own: bool) -> None:
        """Who has been silent for longest gives way: of the crowd, which is looked at in that order."""
        rivals = [one for one in self._open if (one.host == place.host if is_own else self._count(one.host) > 1)]
        longer = [one for one in rivals if one.host.startswith(CROWD) and one.begun_s is None]
        if any(one.asked_s < place.asked_s - self.rules.slack_s for one in longer):
            self.broken.append(f"{place} gives way, and others are silent for longer: {self._show()}")

    def leave(self, place: Place) -> None:
        """Its client has gone; the other end may see that later, where it waits with what was asked before."""
        if place in self._open:
            self._open.remove(place)
            self._left.append((self._now(), place))

    def judge_kept(self, place: Place) -> None:
        """It is still there."""
        now_s, rules = self._now(), self.rules
        is_idle = now_s - place.asked_s > rules.idle_s + 2.0 * rules.slack_s
        is_half = place.begun_s is not None and now_s - place.begun_s > rules.partial_s + rules.slack_s + 0.02
        if (is_idle and place.begun_s is None) or is_half:
            self.broken.append(f"{place} is still there at {now_s:.3f}")

    def _count(self, host: str) -> int:
        return sum(one.host == host for one in self._open)

    def _show(self) -> str:
        return ", ".join(f"{one.host} {self._now() - one.asked_s:.2f} {one.begun_s}" for one in self._open)


@dataclass(eq=False)
class Member:
    """One connection of the crowd. said: bytes of its next request that it has sent."""

    wire: Any
    place: Place
    said: int = 0


class Crowd:
    """connect: returns a client's end of a new connection of this host."""

    def __init__(self, places: Places, connect: Callable[[str, int], Any], now: Callable[[], float]) -> None:
        self._places, self._connect, self._now = places, connect, now
        self._ports = iter(range(20000, 40000))
        self.members: list[Member] = []
        places.onlookers.append(self.look)

    def act(self, draw: Random, run: Callable[[float], None]) -> str:
        """Some come, from a few addresses; each says nothing, or a bit, or a whole request; some go, some send byte by byte."""
        self.look()
        how = draw.choice(("come", "come", "say", "say", "go", "wait", "drip"))
        if how == "come":
            for _ in range(draw.randrange(1, 7)):
                self._come(draw)
        elif how == "wait":
            for _ in range(draw.choice((2, 5, 8))):
                run(0.1)
                self.look()
        elif how == "drip":
            self._drip([one for one in self.members if draw.random() < 0.5], run)
        for member in tuple(self.members):
            if how == "say" and draw.random() < 0.7:
                self._say(member, draw.choice((1, 1, 3, 11, 12)))
            elif how == "go" and draw.random() < 0.5:
                self._leave(member)
        return f"{how}, {len(self.members)} are there"

    def _drip(self, members: list[Member], run: Callable[[float], None]) -> None:
        """A byte at a time, and never the last one."""
        for _ in range(10):
            for member in members:
                if member in self.members and member.said < len(READ) - 1:
                    self._say(member, 1)
            run(0.05)
            self.look()

    def fill(self, draw: Random, run: Callable[[float], None]) -> None:
        """Take all places there are, and be silent; then more come, and half of them send byte by byte."""
        for count in (9, 3):
            for _ in range(count):
                self._come(draw)
            run(self._places.rules.gives_way_s + 0.3)
            self.look()
        self._drip([one for one in self.members if draw.random() < 0.5], run)

    def look(self) -> None:
        """See who was closed."""
        for member in sorted(self.members, key=lambda one: one.place.asked_s):
            if self._is_closed(member):
                self._places.lose(member.place)
                self.members.remove(member)
                member.wire.close()
            else:
                self._places.judge_kept(member.place)

    def _come(self, draw: Random) -> None:
        host = f"{CROWD}{draw.randrange(1, 6)}"
        self._places.look()
        wire = self._connect(host, next(self._ports))
        if _is_open(wire):
            self._take(wire, host)
        else:
            self._places.take(host, False)
            wire.close()
        self.look()

    def _take(self, wire: Any, host: str) -> None:
        place = self._places.take(host, True)
        assert place
        self.members.append(Member(wire, place))

    def _say(self, member: Member, size: int) -> None:
        whole, now_s = READ * 2, self._now()
        try:
            member.wire.send(whole[member.said : member.said + size])
        except OSError:
            return
        said = member.said + size
        if said >= len(READ):
            member.place.asked_s, member.place.begun_s = now_s, None
        member.said = said % len(READ)
        if member.said and member.place.begun_s is None:
            member.place.begun_s = now_s

    def _leave(self, member: Member) -> None:
        member.wire.close()
        self._places.leave(member.place)
        self.members.remove(member)

    @staticmethod
    def _is_closed(member: Member) -> bool:
        return not _is_open(member.wire)


def _is_open(wire: Any) -> bool:
    """Whether the other end has not closed; what it has answered is read and forgotten."""
    try:
        while wire.recv(4096):
            pass
    except BlockingIOError:
        return True
    except OSError:
        pass
    return False
