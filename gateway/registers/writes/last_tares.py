"""Whose tare came last, and whether its program has gone on since."""

from typing import NamedTuple

from gateway import defaults
from gateway.registers.command import Channel
from gateway.registers.writes.frame_beats import LONGEST_CYCLE_S, FrameBeats, of_frame
from gateway.registers.writes.held_starts import StartFrame
from gateway.registers.writes.ownership import keep_latest


class _Tared(NamedTuple):
    """When a frame has tared last, s, and how often any heartbeat had moved by then; is_let_go: somebody on its host has
    written the bit as 0 since."""

    tared_s: float
    moves: int
    is_let_go: bool = False


class LastTares:
    """The last tare of each host, taken or refused: a program that stands still asks for it on and on, and whatever lies on the
    tool by then would become the zero. Who has written another heartbeat since goes on, and who has written the bit as 0,
    behind a cycle: a program beside it may hang. has_lease: a heartbeat has to change; else none is noted."""

    def __init__(self, frames: FrameBeats, *, has_lease: bool = True) -> None:
        self._has_lease, self._frames = has_lease, frames
        self.by_host: dict[str, dict[Channel, _Tared]] = {}  # and frame, the latest last

    def note(self, host: str, channel: Channel, now_s: float) -> None:
        """Note a tare, behind the heartbeat that came with it."""
        if self._has_lease:
            known = {**self.by_host.get(host, {})}
            known.pop(channel, None)
            known[channel] = _Tared(now_s, self._frames.moves_so_far)
            keep_latest(self.by_host, host, dict(list(known.items())[-defaults.MOST_FRAMES :]))

    def repeats(self, host: str, frame: StartFrame, now_s: float) -> bool:
        """Decide whether no heartbeat of this host has moved since this frame of its has tared last; one that brings none comes
        as often as only a cycle does."""
        if host not in self.by_host:
            return False
        tared = of_frame(self.by_host[host], frame.channel) or self._latest(host)
        if self._frames.has_moved_since(tared.moves, host):
            return False
        is_soon = now_s - tared.tared_s < LONGEST_CYCLE_S
        if frame.heartbeat is None:
            return is_soon
        return (is_soon or not tared.is_let_go) and not self._frames.moves(frame.channel, frame.heartbeat)

    def knows(self, host: str) -> bool:
        """Decide whether this host has tared, and has not gone on since."""
        return host in self.by_host and not self._frames.has_moved_since(self._latest(host).moves, host)

    def let_go(self, host: str) -> None:
        """Note that a host of by_host has written the bit as 0."""
        self.by_host[host] = {channel: tared._replace(is_let_go=True) for channel, tared in self.by_host[host].items()}

    def _latest(self, host: str) -> _Tared:
        return next(reversed(self.by_host[host].values()))
