"""By which frames of which hosts a heartbeat has moved: of a program that stands still none does, whatever its other frames
bring, by whichever connection. A frame is told by its host, its connection and its words; where the connection is new, by host
and words, for a program that hung may connect anew for each of its frames."""

from typing import Final, TypeVar

from gateway import defaults
from gateway.registers.command import NO_CHANNEL, Channel
from gateway.registers.writes.ownership import keep_latest

LONGEST_CYCLE_S: Final = 0.8
"""In which a program that writes in cycles comes again; a person needs longer to want the same once more."""

_Known = TypeVar("_Known")


def of_frame(known: dict[Channel, _Known], channel: Channel) -> _Known | None:
    """Return what is known of a frame: of this connection, else of the last one with the same words of its host."""
    here = known.get(channel)
    return _latest_alike(known, channel) if here is None else here


def _latest_alike(known: dict[Channel, _Known], channel: Channel) -> _Known | None:
    host, _, _, address, size = channel
    for other in reversed(known):
        if other[3] == address and other[4] == size and other[0] == host:
            return known[other]
    return None


class FrameBeats:
    """The last heartbeat of each frame, and a count of how often any has moved."""

    def __init__(self) -> None:
        self._last: dict[Channel, int] = {}
        self._newest: Channel = NO_CHANNEL  # the latest of them: of most masters the only one
        self.moves_so_far = 0
        """How often any frame has moved."""
        self._moved: dict[str, int] = {}  # what that was when a frame of each host moved last

    def has_brought(self, channel: Channel, heartbeat: int) -> bool:
        """Decide whether this is what the frame has brought last, by this connection or by whichever."""
        if self._last.get(channel) == heartbeat:
            return True
        return channel != self._newest and _latest_alike(self._last, channel) == heartbeat

    def has_changed(self, channel: Channel, heartbeat: int) -> bool:
        """Decide whether the frame has brought another one last. Its first proves nothing."""
        return self.knows_alike(channel) and not self.has_brought(channel, heartbeat)

    def moves(self, channel: Channel, heartbeat: int) -> bool:
        """Decide whether a program goes on that brings this: of a connection's first frame a heartbeat counts that none of its
        host's frames has brought."""
        if channel in self._last:
            return not self.has_brought(channel, heartbeat)
        return self.has_changed(channel, heartbeat) and heartbeat not in self.of(channel[0])

    def knows_alike(self, channel: Channel) -> bool:
        """Decide whether the frame has come before, by whichever connection."""
        return channel in self._last or _latest_alike(self._last, channel) is not None

    def knows(self, channel: Channel) -> bool:
        """Decide whether the frame has come before."""
        return channel in self._last

    def put(self, channel: Channel, heartbeat: int) -> None:
        """Keep what a frame brings."""
        keep_latest(self._last, channel, heartbeat)
        self._newest = channel

    def note(self, channel: Channel, heartbeat: int) -> bool:
        """Keep what a frame brings, and count whether that moves; return it."""
        is_moving = self.moves(channel, heartbeat)
        if is_moving:
            self.count_move(channel[0])
        self.put(channel, heartbeat)
        return is_moving

    def count_move(self, host: str) -> None:
        """Note that a frame of this host has moved."""
        self.moves_so_far += 1
        if host in self._moved:
            self._moved[host] = self.moves_so_far
        else:
            keep_latest(self._moved, host, self.moves_so_far)

    def has_moved_since(self, moves: int, host: str) -> bool:
        """Decide whether a frame of this host has moved since so many had."""
        return self._moved.get(host, 0) > moves

    def of(self, host: str | None) -> list[int]:
        """Return what the latest frames of a host have brought last."""
        return [beat for channel, beat in self._last.items() if channel[0] == host][-defaults.MOST_FRAMES :]
