"""When a recording that the disk has ended is begun again: half a minute later, then after twice as long each time, up to an
hour. A disk that was full for a while must not leave the rest of the year unrecorded, nor a full one get thousands of files.
"""

from typing import Final

_FIRST_PAUSE_S: Final = 30.0
_LONGEST_PAUSE_S: Final = 3600.0


class RecordingAgain:
    """why: what has ended the recording, empty while none waits to go on."""

    def __init__(self) -> None:
        self.why = ""
        self._pause_s = _FIRST_PAUSE_S
        self._due_s: float | None = None

    def ask(self, why: str) -> None:
        """Have it begun again after the next pause."""
        self.why, self._due_s = why, None

    def forget(self) -> None:
        """Begin none again: somebody has begun or ended one."""
        self.why, self._due_s = "", None

    def note_lasting(self, lasted_s: float) -> None:
        """Begin with the short pause the next time, where one has gone well for longer than the last pause."""
        if lasted_s > self._pause_s:
            self._pause_s = _FIRST_PAUSE_S

    def is_due(self, now_s: float) -> bool:
        """Decide whether to try now; the next time `ask` has been called, the pause is longer."""
        if not self.why:
            return False
        if self._due_s is None:
            self._due_s = now_s + self._pause_s
            self._pause_s = min(2.0 * self._pause_s, _LONGEST_PAUSE_S)
        return now_s >= self._due_s
