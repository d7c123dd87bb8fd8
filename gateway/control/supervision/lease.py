"""A command that expires: only a changing heartbeat value renews it; reads and repeated frames do not. Of a master whose last
frame is sent on and on it does not change, whatever another one has written meanwhile, or another frame of its own, by another
connection or at another address: two that stand still would renew it in turn. Who takes over has one whole length to
beat, not what the one before has left of its own. Behind a stop of another one nothing begins by the heartbeat that was there
before it: the next frame of a program that had just hung, and is no lost one yet, would undo it.

A closed connection of the owner counts as loss only where a lease is set; without a lease a command lasts until the
next one.
"""

from math import inf, nan

from gateway.registers.command import NO_BEAT, NO_CHANNEL, Channel
from gateway.registers.writes.frame_beats import LONGEST_CYCLE_S, FrameBeats
from gateway.registers.writes.ownership import keep_latest


class Lease:
    """length_s: None for no lease. Times are monotonic seconds."""

    def __init__(self, length_s: float | None) -> None:
        self._length_s = length_s
        self._heartbeat = 0
        self._changed_s = self._moved_s = self._heard_s = -inf  # heard: in what was refused
        self._beats: dict[str, tuple[int, float]] = {}  # of each master its last, and when it came; nan: counts no more
        self._started_s = -inf
        self._frames = FrameBeats()
        self._master = ""  # who has the lease
        self._stopped_s: dict[str, float] = {}  # when each master has switched the output off last
        self._unbeaten: dict[str, None] = {}  # who has taken over, and not beaten since

    def observe(self, now_s: float, heartbeat: int, who: str = "", channel: Channel = NO_CHANNEL) -> None:
        """Note the time of a heartbeat that this master has changed, in its frame of this channel."""
        if self._is_beat(heartbeat, who, channel):
            self._changed_s, self._master = now_s, who
            if self._frames.knows(channel):
                self._moved_s = now_s
            self._unbeaten.pop(who, None)
            keep_latest(self._beats, who, (heartbeat, now_s))
        self.pass_over(heartbeat, channel)

    def pass_over(self, heartbeat: int, channel: Channel) -> None:
        """Take over a value of this channel's frame without counting it as a beat."""
        self._heartbeat = heartbeat
        if channel != NO_BEAT:
            self._frames.put(channel, heartbeat)

    def _is_beat(self, heartbeat: int, who: str, channel: Channel) -> bool:
        """Whether a frame brings another heartbeat than before, or as its first none that stands, or is its master's last."""
        if channel == NO_BEAT or self._frames.has_brought(channel, heartbeat):
            return False
        is_known = heartbeat == self._heartbeat or (who in self._beats and heartbeat == self._beats[who][0])
        return not is_known or self._frames.has_changed(channel, heartbeat)

    def hear_refused(self, now_s: float, heartbeat: int, who: str, channel: Channel) -> None:
        """Note the heartbeat of a write that was refused: it renews nothing, but where it changes its program goes on."""
        if self._frames.moves(channel, heartbeat):
            keep_latest(self._beats, who, (heartbeat, now_s))
            self._unbeaten.pop(who, None)
            self._heard_s = now_s
        self._frames.put(channel, heartbeat)

    def beats_of(self, who: str | None) -> list[int]:
        """Return the heartbeats that stand in the latest frames of this master."""
        return self._frames.of(who)

    def start(self, now_s: float, who: str = "") -> None:
        """Start the lease at an enable: the master has one length to beat."""
        self._started_s, self._master = now_s, who

    def take_over(self, now_s: float, who: str) -> None:
        """Start another master's lease, once until it beats: two that hang, and take over in turn, would keep it up."""
        if self.would_start_for(who):
            self.start(now_s, who)
        self._master = who
        keep_latest(self._unbeaten, who, None)

    def stop(self, now_s: float, who: str) -> None:
        """Let no beat of before count of the master that has the lease, nor of any other that has beaten within one length:
        this one has switched the output off. Its own count for one length, as long as a cycle may bring the next frame: of two
        programs on one host that hung one may write 0, and the other 1."""
        if self._master not in (who, *self._beats):  # it has never beaten, and would begin again by what stands
            keep_latest(self._beats, self._master, (self._heartbeat, nan))
        for other, (heartbeat, beaten_s) in self._beats.items():
            if other != who and (other == self._master or self.is_within(beaten_s, now_s)):
                self._beats[other] = heartbeat, nan
        keep_latest(self._stopped_s, who, now_s)

    def stand_still(self, now_s: float) -> None:
        """Let each stop be one of now, behind a stall of the loop: the frame that follows it has not been heard yet."""
        self._stopped_s = dict.fromkeys(self._stopped_s, now_s)

    def let_no_beat_count(self) -> None:
        """Let no beat of before count, whose ever: the output goes off, and nobody has asked for that just now."""
        self._beats = {who: (heartbeat, nan) for who, (heartbeat, _) in self._beats.items()}

    def would_start_for(self, who: str) -> bool:
        """Return whether a takeover by this master would start its lease."""
        return who not in (self._master, *self._unbeaten)

    def is_taken_again(self, heartbeat: int, who: str = "", channel: Channel = NO_CHANNEL) -> bool:
        """Return whether this master, from whom another one has the lease, has taken over before and not beaten since, were
        this value observed now; never without a lease."""
        is_again = who != self._master and who in self._unbeaten
        return self._length_s is not None and is_again and not self._is_beat(heartbeat, who, channel)

    def age_s(self, now_s: float) -> float:
        """Return the time since the lease was renewed, s."""
        return now_s - max(self._changed_s, self._started_s)

    @property
    def has_moved(self) -> bool:
        """Decide whether a frame has brought another heartbeat than before since the lease was started: its program does not
        stand still. A frame's first one proves nothing."""
        return self._moved_s > self._started_s

    def is_lost(self, now_s: float, owner_connected: bool) -> bool:
        """Return whether the owner is disconnected, or its heartbeat older than the lease; never without a lease."""
        if self._length_s is None:
            return False
        return not owner_connected or self.age_s(now_s) > self._length_s

    def is_within(self, since_s: float, now_s: float) -> bool:
        """Return whether no more than one length has passed since then; always true without a lease."""
        return self._length_s is None or now_s - since_s <= self._length_s

    def is_fresh_since(self, since_s: float, now_s: float) -> bool:
        """Return whether the heartbeat has changed after since_s, and within one length; always true without a lease."""
        if self._length_s is None:
            return True
        return self._changed_s > since_s and now_s - self._changed_s <= self._length_s

    def would_have_beaten_since(
        self, since_s: float, now_s: float, heartbeat: int, who: str = "", channel: Channel = NO_CHANNEL
    ) -> bool:
        """Return whether this master has beaten since then, and right behind its own stop within one length, were this value
        observed now; always true without a lease."""
        if self._length_s is None or self._is_beat(heartbeat, who, channel):
            return True
        is_stopped = now_s - self._stopped_s.get(who, -inf) < LONGEST_CYCLE_S
        if who not in self._beats:  # a person, or a program whose heartbeat stands since the start
            return self._changed_s >= since_s and not (is_stopped and self._frames.of(who))
        beaten_s = self._beats[who][1]
        return beaten_s >= since_s and (self.is_within(beaten_s, now_s) or not is_stopped)

    def would_be_fresh_since(self, since_s: float, now_s: float, heartbeat: int) -> bool:
        """Return what `is_fresh_since` would, were this value observed now: any master's, for a reset presses nothing."""
        is_heard = self._heard_s > since_s and self.is_within(self._heard_s, now_s)
        return heartbeat != self._heartbeat or is_heard or self.is_fresh_since(since_s, now_s)
