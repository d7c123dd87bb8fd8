"""Bits that masters that write in cycles keep at 1: only a master's own 0 lets its next 1 count.

They outlive the process: by a control that was started anew the holder's next cycle would begin another run, or press over a
fault that was latched, and that nobody has reset. An enable that is written on and on over a latched fault would press by
another master's reset alone, too: a reset begins nothing. And a start that was refused, for whatever reason, and comes on and
on with the same heartbeat would begin when that reason is over, whatever its other frames bring, as long as they stand still;
a tare would take whatever lies on the tool by then for the zero. One rule for both: what a frame asks for counts again once a
heartbeat of its host has moved since that frame has come last, or behind its host's own 0 and a cycle.
"""

from collections.abc import Callable, Mapping, Sequence
from math import inf
from typing import Final, NamedTuple

from gateway import defaults
from gateway.registers.command import NO_BEAT, Channel, Command
from gateway.registers.writes.frame_beats import LONGEST_CYCLE_S, FrameBeats, of_frame
from gateway.registers.writes.ownership import keep_latest

_HELD_S: Final = 3.0  # longer than a cycle; who has waited for so long has looked, and decides anew
_TOLD_S: Final = 1.0  # from one time that the next process is told to another
_DOWN_S: Final = 10.0  # that a start may take, in which nobody can write


class HeldRuns:
    """by_host: the bits of each host that keeps any; on_change: told of all of them whenever they are others."""

    def __init__(self) -> None:
        self.on_change: Callable[[dict[str, int]], None] = lambda held: None
        self.by_host: dict[str, int] = {}

    def of(self, host: str) -> int:
        """Return the bits that a host keeps at 1."""
        return self.by_host.get(host, 0)

    def keep(self, host: str, held: int) -> None:
        """Note which bits a host keeps at 1."""
        before = self.by_host.pop(host, 0)
        if held:
            keep_latest(self.by_host, host, held)
        if held != before:
            self.on_change(dict(self.by_host))

    def restore(self, held: Mapping[str, int]) -> None:
        """Go on with what was held in the process before."""
        self.by_host.update(held)


class StartFrame(NamedTuple):
    """A write, by what tells it from the one before. heartbeat: None where it brings none; takes: it takes over; tares: it
    is looked at as a tare, which counts beside all other starts of its host."""

    channel: Channel
    data: tuple[int, bytes]  # where, and what
    heartbeat: int | None = None
    takes: bool = False
    tares: bool = False


class _Sent(NamedTuple):
    """Where and what a frame has written. moves: how often any heartbeat had moved by then."""

    data: tuple[int, bytes]
    moves: int


class _Refused(NamedTuple):
    """What was refused last of a host. heartbeat: its own, as far as it has brought one (`beats`), else the one that stood;
    at_s: when it came last, s; sent: by each of its frames; moves: how often any heartbeat had moved by then; is_let_go:
    somebody on that host has written enable as 0 since."""

    frame: StartFrame
    heartbeat: int
    beats: bool
    at_s: float
    sent: dict[Channel, _Sent]
    moves: int
    is_let_go: bool = False

    def is_same(self, frame: StartFrame) -> bool:
        """Whether a frame brings nothing new. Of who beats one without a heartbeat does not: the one that stands may be
        another's. Who is refused because another one owns is told to take over: not by the same frame, of which nobody knows
        that it takes over where its setpoint was out of range."""
        if self.is_let_go:
            return any(frame.data == sent.data for sent in self.sent.values())
        if frame.data == self.frame.data:
            return True
        if frame.takes and not self.frame.takes:
            return False
        if frame.heartbeat is None and self.beats:
            return True
        return frame.heartbeat == self.heartbeat


class HeldEnables:
    """by_host: when each host that keeps enable at 1 over a latched fault has written it last, monotonic s; on_change: told of
    all of them, of other times of the same ones once a second. has_lease: a heartbeat has to change; else none is noted. lost:
    the heartbeats with which each master was lost in the process before, one for each of its frames; on_lost: told of all of
    this one's; beats_of: what a host's frames bring, as far as control has taken them; awake_since_s: since when this process
    has come by without a stall, s."""

    def __init__(self, *, has_lease: bool = True) -> None:
        self._has_lease = has_lease
        self.on_change: Callable[[dict[str, float]], None] = lambda held: None
        self.on_lost: Callable[[dict[str, list[int]]], None] = lambda lost: None
        self.beats_of: Callable[[str | None], Sequence[int]] = lambda host: ()
        self.on_refused_beat: Callable[[float, int, str, Channel], None] = lambda now_s, heartbeat, host, channel: None
        self.awake_since_s: Callable[[], float] = lambda: -inf
        self.by_host: dict[str, float] = {}
        self.lost: dict[str, list[int]] = {}
        self._lost_now: dict[str, list[int]] = {}
        self._let_go_s: dict[str, float] = {}  # when somebody on the host of one of the lost has written enable as 0
        self.frames = FrameBeats()
        self._refused: dict[tuple[str, bool], _Refused] = {}  # of each host its last refused start; True: its last tare
        self._told_s = 0.0
        self._ahead: Command | None = None  # whose heartbeat is noted later

    def note(self, host: str, now_s: float) -> None:
        """Note that a host has written enable as 1, and that this was refused because a fault is latched."""
        is_new = host not in self.by_host
        keep_latest(self.by_host, host, now_s)
        if is_new or now_s - self._told_s >= _TOLD_S:
            self._told_s = now_s
            self.on_change(dict(self.by_host))

    def note_lost(self, host: str | None, heartbeat: int) -> None:
        """Note that a master is lost, that another one has stopped it, or that the gateway ends: by its last frame, sent on and
        on, the next process would press."""
        if host is not None and self._has_lease:
            self.follow()
            self._keep_lost(host, (*self.frames.of(host), *self.beats_of(host), heartbeat))

    def _keep_lost(self, host: str, beats: Sequence[int]) -> None:
        """Add to the heartbeats with which a host was lost: of a program with several frames each brings its own. The
        latest stay: who connects anew for each frame has had more of them than are kept."""
        known = self._lost_now.get(host, [])
        latest = list(dict.fromkeys((*reversed(beats), *reversed(known))))[: defaults.MOST_FRAMES]
        if set(latest) != set(known):
            keep_latest(self._lost_now, host, latest[::-1])
            self.on_lost(dict(self._lost_now))

    def note_refused(self, host: str, frame: StartFrame, standing: int, now_s: float) -> None:
        """Note a write that was refused, or has tared: the same one, on and on, is of a program that may stand still.
        standing: the heartbeat that stands."""
        if not self._has_lease:
            return
        before = self._refused.pop((host, frame.tares), None)
        if before and self._stands(host, frame, before.moves):
            frame = frame._replace(takes=frame.takes or before.frame.takes)  # one of its frames does
            if before.beats:
                self.note_lost(host, before.heartbeat)
        self.note_refused_beat(host, frame)
        known = frame.heartbeat if frame.heartbeat is not None else before.heartbeat if before else standing
        moves = self.frames.moves_so_far
        sent = _sent_with(before.sent if before else {}, frame, moves)
        beats = frame.heartbeat is not None or bool(before and before.beats)
        keep_latest(self._refused, (host, frame.tares), _Refused(frame, known, beats, now_s, sent, moves))
        if frame.tares and self.has_beaten(host):
            self.note_lost(host, known)

    def _is_same(self, host: str, refused: _Refused, frame: StartFrame) -> bool:
        """Whether a frame brings nothing new, beside what was refused last or behind itself: no heartbeat of its host has moved
        since it came last."""
        sent = of_frame(refused.sent, frame.channel)
        moves = sent.moves if sent else refused.moves
        if frame.heartbeat is not None or not frame.tares:
            # The same bytes by another connection of a pool are of the same program. Tares of two programs are alike, too, as
            # far as they bring no heartbeat: there a connection stands for its program.
            moves = max([moves, *(other.moves for other in refused.sent.values() if other.data == frame.data)])
        if not self._stands(host, frame, moves):
            return False
        is_as_before = frame.heartbeat is not None and self.frames.has_brought(frame.channel, frame.heartbeat)
        return refused.is_same(frame) or (
            is_as_before and not refused.is_let_go and (refused.frame.takes or not frame.takes)
        )

    def _stands(self, host: str, frame: StartFrame, moves: int) -> bool:
        """Whether no heartbeat of a host has moved since so many had, nor does by this frame."""
        is_moving = frame.heartbeat is not None and self.frames.moves(frame.channel, frame.heartbeat)
        return not is_moving and not self.frames.has_moved_since(moves, host)

    def follow_later(self, command: Command) -> None:
        """Have noted what the frame of a command brings, of a host of which nothing is known, before it is asked for: of one
        that comes again and again only the last heartbeat is. Whatever was refused, that host has moved since."""
        ahead, channel = self._ahead, command.channel
        if channel == NO_BEAT or not self._has_lease:
            return
        if ahead is None or channel != ahead.channel:
            self.follow()
        self._ahead = command

    def follow(self) -> None:
        """Note what was left for later."""
        if ahead := self._ahead:
            self.frames.note(ahead.channel, ahead.heartbeat)
            self._ahead = None

    def has_beaten(self, host: str) -> bool:
        """Decide whether a host has written a heartbeat: a person writes none."""
        return bool(self.frames.of(host))

    def note_refused_beat(self, host: str, frame: StartFrame) -> None:
        """Note the heartbeat of a write that was refused."""
        if frame.heartbeat is None:
            return
        self._look_for(host, frame.heartbeat, frame.channel)
        is_new = not self.frames.has_brought(frame.channel, frame.heartbeat)
        self.frames.note(frame.channel, frame.heartbeat)
        if is_new and (refused := self._refused.get((host, False))):
            self._refused[host, False] = refused._replace(heartbeat=frame.heartbeat, beats=True)

    def repeats(self, host: str, frame: StartFrame, now_s: float) -> bool:
        """Decide whether a write brings no other heartbeat than the one with which its host was lost in the process before, or
        was refused last: by the frame of a program that hung meanwhile, the machine would press when what it was refused for
        is over."""
        if host in self.lost and (frame.heartbeat is None or not self._is_there(host, frame.heartbeat, frame.channel)):
            if self._silent_s(self._let_go_s.get(host, inf), now_s) < LONGEST_CYCLE_S:
                return True
            self._find(host)
        key = host, frame.tares
        if (refused := self._refused.get(key)) is None or not self._is_same(host, refused, frame):
            return False
        is_by_hand = refused.is_let_go or (frame.tares and frame.heartbeat is None)
        if self._silent_s(refused.at_s, now_s) >= (LONGEST_CYCLE_S if is_by_hand else inf if frame.tares else _HELD_S):
            del self._refused[key]
            self._miss_no_more(host)
            return False
        if refused.beats:  # else nobody knows of a program: the next process asks none for a heartbeat
            self.note_lost(host, refused.heartbeat)
        sent = _sent_with(refused.sent, frame, self.frames.moves_so_far)
        self._refused[key] = refused._replace(at_s=now_s, sent=sent)
        return True

    def _silent_s(self, since_s: float, now_s: float) -> float:
        """Return for how long nothing has come since then, s: what nobody was there to hear is no silence."""
        return now_s - max(since_s, self.awake_since_s())

    def knows(self, host: str) -> bool:
        """Decide whether this host keeps up an enable, or was lost or refused and has not been heard since."""
        if host in self.by_host or host in self.lost or host in self._lost_now:
            return True
        if not self._refused:
            return False
        asked = (self._refused.get((host, tares)) for tares in (False, True))
        return any(one is not None and not self.frames.has_moved_since(one.moves, host) for one in asked)

    def holds(self, host: str, now_s: float) -> bool:
        """Decide whether a 1 of this host is one that it has kept up since the fault. If so, it goes on being kept up."""
        if (held_s := self.by_host.get(host)) is None or self._silent_s(held_s, now_s) >= _HELD_S:
            self._forget(host)
            return False
        self.note(host, now_s)
        return True

    def hear(self, host: str, heartbeat: int, channel: Channel) -> None:
        """Note what a host has written as its heartbeat: where it is another one than when it was lost, its program goes on."""
        self._look_for(host, heartbeat, channel)
        stands = not self.frames.note(channel, heartbeat)
        for key in ((host, False), (host, True)) if stands and self._refused else ():
            if refused := self._refused.get(key):
                self._refused[key] = refused._replace(heartbeat=heartbeat, beats=True)
                self.note_lost(host, heartbeat)

    def _is_there(self, host: str, heartbeat: int, channel: Channel) -> bool:
        """Whether the program of a lost master goes on: a heartbeat that only goes to and fro may have been in one of its
        frames each way."""
        if self.frames.knows(channel) and self.frames.has_changed(channel, heartbeat):
            return True
        lost = (*self.lost.get(host, ()), *self._lost_now.get(host, ()))
        return heartbeat not in lost and not self.frames.has_brought(channel, heartbeat)

    def _look_for(self, host: str, heartbeat: int, channel: Channel) -> None:
        if (host in self.lost or host in self._lost_now) and self._is_there(host, heartbeat, channel):
            if host in self.lost:  # beside what each of its frames had brought in the process before
                self.frames.count_move(host)
            self._find(host)

    def let_go(self, host: str, now_s: float, *, asks: bool = False) -> None:
        """Note that a host has written enable as 0; asks: beside the bit of a run or a tare, which goes on asking. Who was
        lost stays so for the next process: this 0 may be of a program beside the one that hung."""
        self._forget(host)
        if asks:
            return
        if host in self.lost:
            self._let_go_s[host] = now_s
        if refused := self._refused.get((host, False)):
            self._refused[host, False] = refused._replace(is_let_go=True)

    def let_go_tare(self, host: str) -> None:
        """Note that a host has written the bit of a tare as 0."""
        if tared := self._refused.get((host, True)):
            self._refused[host, True] = tared._replace(is_let_go=True)

    def _find(self, host: str) -> None:
        """A lost master is there again: the next process must not refuse what a program that goes on writes."""
        self.lost.pop(host, None)
        self._miss_no_more(host)

    def _miss_no_more(self, host: str) -> None:
        if self._lost_now.pop(host, None) is not None:
            self.on_lost(dict(self._lost_now))

    def _forget(self, host: str) -> None:
        if self.by_host.pop(host, None) is not None:
            self.on_change(dict(self.by_host))

    def restore(self, held: Mapping[str, float], lost: Mapping[str, Sequence[int]], now_s: float) -> None:
        """Go on with who was lost, and with what was held in the process before, as long as that can have been a moment ago."""
        for host, beats in lost.items() if self._has_lease else ():
            self._keep_lost(host, beats)
        self.lost = dict(self._lost_now)
        self.by_host.update((host, now_s) for host, held_s in held.items() if 0.0 <= now_s - held_s < _HELD_S + _DOWN_S)


def _sent_with(sent: dict[Channel, _Sent], frame: StartFrame, moves: int) -> dict[Channel, _Sent]:
    """Return what the latest frames of a host have sent, with this one. Of too many the oldest of the same bytes goes first:
    beside a program that connects anew for each frame another one's last frame is not forgotten."""
    known = {channel: other for channel, other in sent.items() if channel != frame.channel}
    known[frame.channel] = _Sent(frame.data, moves)  # the latest is the last
    if len(known) > defaults.MOST_FRAMES:
        each = [other.data for other in known.values()]
        del known[next((channel for channel, other in known.items() if each.count(other.data) > 1), next(iter(known)))]
    return known
