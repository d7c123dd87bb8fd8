"""What is read behind a standstill has waited for it in the kernel, and nobody knows since when: a reading of before looked as
if it had been made just then, and a cell that had fallen silent meanwhile as if it spoke.
"""

from dataclasses import dataclass


@dataclass(slots=True)
class WaitingBytes:
    """Told of each turn of the loop. longest_s: a pause that is longer is a standstill. Times are monotonic seconds."""

    longest_s: float
    _turn_s: float | None = None
    _since_s: float | None = None
    _is_rest_left: bool = False

    def note_tick(self, now_s: float) -> None:
        """Take note of a tick. What is read before the next one may have waited, where this one came late."""
        stood_s = self._stood_since(now_s)
        self._since_s = self._since_s if self._is_rest_left and self._since_s is not None else stood_s

    def came_s(self, now_s: float, *, is_rest_left: bool = False) -> float:
        """Return when the bytes that are read now came at the earliest. is_rest_left: it was as much as is read at once, and
        what comes next may have waited as long."""
        stood_s, since_s = self._stood_since(now_s), self._since_s
        earliest_s = stood_s if since_s is None else since_s
        self._since_s, self._is_rest_left = earliest_s if is_rest_left else None, is_rest_left
        return now_s if earliest_s is None else earliest_s

    def _stood_since(self, now_s: float) -> float | None:
        before_s, self._turn_s = self._turn_s, now_s
        return before_s if before_s is not None and now_s - before_s > self.longest_s else None
