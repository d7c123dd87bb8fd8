"""Limits over time: requests of one client, log lines of one cause. Pure: time is an argument.

The limit on connections per peer is in peers.py.
"""

from collections.abc import Callable
from math import inf
from typing import Final

from gateway.defaults import PILE_S

_BURST_S: Final = 0.25  # what a client saves up while it is quiet: a poll of several blocks in a row is normal
LATE_S: Final = 1.0  # so long more may wait of a client than is taken at once, as behind a burst
TOLD_AGAIN_S: Final = 60.0
_LINES_PER_S: Final = 10
_ROUNDING: Final = 1e-6  # of a request: whoever waited as long as told need not wait again


class RequestRate:
    """A token bucket: requests_per_s on average, a quarter of a second's worth at once."""

    __slots__ = ("_last_s", "_most", "_rate_per_s", "_tokens")

    def __init__(self, requests_per_s: float, now_s: float) -> None:
        self._rate_per_s = requests_per_s
        self._most = max(1.0, requests_per_s * _BURST_S)
        self._tokens = self._most
        self._last_s = now_s

    def wait_s(self, now_s: float) -> float:
        """Return the seconds until the next request may run; 0 when it may now."""
        self._tokens = min(self._most, self._tokens + (now_s - self._last_s) * self._rate_per_s)
        self._last_s = now_s
        missing = 1.0 - self._tokens
        return missing / self._rate_per_s if missing > _ROUNDING else 0.0

    def spend(self) -> None:
        """Take one request out of the bucket; before its time, who asks behind it waits for longer."""
        self._tokens -= 1.0

    def give_back(self) -> None:
        """Put back one that was taken before its time, and was not used."""
        self._tokens += 1.0

    def is_full(self, now_s: float) -> bool:
        """Return whether the bucket is as full as a new one."""
        self.wait_s(now_s)
        return self._tokens >= self._most


class Backlog:
    """Tells whether requests of a client pile up: it may not know how late its stop is, and may be long gone while its
    heartbeats are read. is_late: what is taken now has waited for longer than a burst may. One that has always some requests
    under way, but waits for answers, is not late: at the pace at which they are taken, what waits is soon answered."""

    __slots__ = ("_before", "_since_s", "_told_s", "is_late")

    def __init__(self) -> None:
        self._since_s: float | None = None
        self._told_s, self._before = -inf, 0
        self.is_late = False

    def note(self, now_s: float, taken: int, waiting: float) -> bool:
        """Note how many bytes of the wire have been taken in all, and how many wait behind them; return whether to say now that
        it is late."""
        if not waiting or self._since_s is None:
            self._since_s, self._before, self.is_late = now_s if waiting else None, taken, False
            return False
        lasts_s = now_s - self._since_s
        self.is_late = self.is_late or (lasts_s >= PILE_S and waiting * lasts_s >= (taken - self._before) * PILE_S)
        if not self.is_late or lasts_s < LATE_S or now_s - self._told_s < TOLD_AGAIN_S:
            return False
        self._told_s = now_s
        return True


class LogLimiter:
    """Passes at most ten lines a second of each cause to the sink; the next line that passes tells how many were left out."""

    __slots__ = ("_sink", "_windows")

    def __init__(self, sink: Callable[[str, str], None]) -> None:
        self._sink = sink
        self._windows: dict[str, tuple[float, int]] = {}  # cause: start of its second, lines in it

    def __call__(self, cause: str, sentence: str, now_s: float) -> None:
        start_s, lines = self._windows.get(cause, (now_s, 0))
        if now_s - start_s >= 1.0:
            if (missing := lines - _LINES_PER_S) > 0:
                sentence = f"{sentence} ({missing} more lines like this were left out)"
            start_s, lines = now_s, 0
        self._windows[cause] = (start_s, lines + 1)
        if lines < _LINES_PER_S:
            self._sink(cause, sentence)
