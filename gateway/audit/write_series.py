"""Many writes of one kind, told in few lines: the first ones each, then a summary at the end of each window.

A robot streams setpoints at 100 Hz; each a line would fill a disk in weeks. The first writes of a series are told at once,
each; what follows is counted, with the least, the greatest and the last value, until its window ends. Windows last 10 s, and
twice as long each time while the series goes on, at most 10 minutes: at worst 52 000 lines a year for each peer and register.
A window in which nothing came ends the series; the next write is a first one again.
"""

from dataclasses import dataclass, field
from typing import Any, Final

FIRST_WINDOW_S: Final = 10.0
LONGEST_WINDOW_S: Final = 600.0


@dataclass(slots=True)
class WriteSeries:
    """One kind of write of one peer. told_at_once: how many of a window are. fields: what all its lines say."""

    told_at_once: int
    fields: dict[str, Any] = field(default_factory=dict)
    window_s: float = FIRST_WINDOW_S
    began_s: float = 0.0
    told: int = 0
    count: int = 0
    first: float | None = None
    last: float | None = None
    least: float | None = None
    greatest: float | None = None

    def take(self, old: float | None, new: float | None) -> bool:
        """Count one write; return whether it is to be told by itself."""
        if self.told < self.told_at_once:
            self.told += 1
            return True
        if not self.count:
            self.first, self.least, self.greatest = old, new, new
        elif new is not None and self.least is not None and self.greatest is not None:
            if new < self.least:
                self.least = new
            elif new > self.greatest:
                self.greatest = new
        self.count += 1
        self.last = new
        return False

    def is_over(self, now_s: float) -> bool:
        """Decide whether its window has ended."""
        return now_s - self.began_s >= self.window_s

    def summarize(self, now_s: float) -> dict[str, Any] | None:
        """End the window and begin the next; return what to tell of it, None where nothing was only counted."""
        if not self.count:
            return None
        told = {
            **self.fields, "count": self.count, "seconds": round(now_s - self.began_s, 1),
            "old": self.first, "min": self.least, "max": self.greatest, "new": self.last,
        }  # fmt: skip
        self.count, self.began_s = 0, now_s
        self.window_s = min(2.0 * self.window_s, LONGEST_WINDOW_S)
        return told
