"""A command that expires: only a changing heartbeat value renews it; reads and repeated frames do not.

A closed connection of the owner counts as loss only where a lease is set; without a lease a command lasts until the
next one.
"""

from math import inf


class Lease:
    """length_s: None for no lease. Times are monotonic seconds."""

    def __init__(self, length_s: float | None) -> None:
        self._length_s = length_s
        self._heartbeat = 0
        self._changed_s = -inf
        self._started_s = -inf

    def adopt(self, heartbeat: int) -> None:
        """Take over a value without counting it as a beat: the bank itself zeroed the command block."""
        self._heartbeat = heartbeat

    def observe(self, now_s: float, heartbeat: int) -> None:
        """Note the time of a heartbeat that has changed."""
        if heartbeat != self._heartbeat:
            self._heartbeat = heartbeat
            self._changed_s = now_s

    def start(self, now_s: float) -> None:
        """Start the lease at an enable: the master has one length to beat."""
        self._started_s = now_s

    def age_s(self, now_s: float) -> float:
        """Return the time since the lease was renewed, s."""
        return now_s - max(self._changed_s, self._started_s)

    def is_lost(self, now_s: float, owner_connected: bool) -> bool:
        """Return whether the owner is disconnected, or its heartbeat older than the lease; never without a lease."""
        if self._length_s is None:
            return False
        return not owner_connected or self.age_s(now_s) > self._length_s

    def is_fresh_since(self, since_s: float, now_s: float) -> bool:
        """Return whether the heartbeat has changed after since_s, and within one length; always true without a lease."""
        if self._length_s is None:
            return True
        return self._changed_s > since_s and now_s - self._changed_s <= self._length_s

    def would_have_beaten_since(self, since_s: float, heartbeat: int) -> bool:
        """Return whether the heartbeat has changed since then, were this value observed now; true without a lease."""
        return self._length_s is None or heartbeat != self._heartbeat or self._changed_s >= since_s

    def would_be_fresh_since(self, since_s: float, now_s: float, heartbeat: int) -> bool:
        """Return the same, were this value observed now."""
        return heartbeat != self._heartbeat or self.is_fresh_since(since_s, now_s)
