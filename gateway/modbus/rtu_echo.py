"""Our own answers, come back: adapters for two wires may hear what they send.

Most answers are no requests, so that they are known when they come. Those of FC05, FC06 and FC22 are requests, letter by
letter, and to answer one's own echo would never end. Decisions:

- Such a frame is an echo where no master can have been as fast: before the answer, the silence and a request of the same
  length can have passed the wire.
- Once an answer of the other kind has come back, or has not, the line is known. What is heard before a master can have listened
  to an answer tells nothing of its echo.
- Until then, a slow adapter could bring the echo later. Equal writes at once after each answer are a master's at first; behind
  some of them one is in doubt. It is not executed but refused (06, busy), and that answer is no request: it comes back, or does
  not, and the line is known from then on. So a master that only writes is refused once; to leave writes out without a word cost
  it one of each row, and what it heard next told nothing.
- On a line that has an echo, or may have one, what is asked before it comes back was asked by a master that had given up. It is
  executed and not answered, and the echo behind it is one: an enable that came back behind a stop would undo that.
"""

from typing import Final

_QUICK_REPEATS: Final = 3  # equal writes at once after an answer: the next on a line that may have an echo is in doubt
_ECHO_LATENCY_S: Final = 0.02  # from the last character of an answer to its echo, through the slowest adapter
_LATEST_ECHO_S: Final = 0.1
"""The same where this machine reads late, too. An equal write up to then may be one: counted to 20 ms only, echoes that came
behind 21 ms were answered, heard and answered again without an end."""


class RtuEcho:
    """The answer that may come back, and whether this line gives answers back. may_echo: false where it cannot."""

    __slots__ = (
        "_character_s", "_has_echo", "_is_like_request", "_may_echo", "_repeats", "_sent_s", "_silence_s", "_until_s", "frame",
    )  # fmt: skip

    def __init__(self, character_s: float, silence_s: float, *, may_echo: bool) -> None:
        self._character_s, self._silence_s = character_s, silence_s
        self._may_echo = may_echo
        self._has_echo: bool | None = None if may_echo else False  # None: not known yet
        self._is_like_request = False
        self._sent_s = self._until_s = 0.0  # the answer; the latest that its echo comes
        self._repeats = 0
        self.frame = b""

    def expect(self, answer: bytes, now_s: float, *, is_like_request: bool) -> None:
        """Expect this answer back, where the line may have an echo. is_like_request: it is its request once more."""
        self._is_like_request = is_like_request
        self.frame = answer if not is_like_request or self._has_echo is not False else b""
        self._sent_s, self._until_s = now_s, now_s + len(answer) * self._character_s + _ECHO_LATENCY_S

    def is_this(self, frame: bytes, heard_s: float) -> bool:
        """Decide whether a frame is our last answer come back."""
        if not self.frame or frame != self.frame:
            return False
        if not self._is_like_request:
            self._has_echo = True
        elif self._has_echo is None and heard_s >= self._heard_out_s(len(self.frame)) + self._silence_s:
            return False
        self.frame = b""
        return True

    def _heard_out_s(self, size: int) -> float:
        """The earliest that a request of so many bytes can be there, of a master that has listened to the answer."""
        return self._sent_s + (len(self.frame) + size) * self._character_s

    def is_in_doubt(self, frame: bytes, heard_s: float) -> bool:
        """Decide whether a frame that is_this has let through may be our answer all the same, and none that a slow adapter
        brings back has shown yet what the line does."""
        if not self.frame or frame != self.frame or self._has_echo is not None:
            return False
        is_quick = heard_s <= self._until_s - _ECHO_LATENCY_S + _LATEST_ECHO_S
        self._repeats = self._repeats + 1 if is_quick else 0
        if self._repeats <= _QUICK_REPEATS:
            return False
        self._repeats = 0
        return True

    def is_coming(self, size: int, heard_s: float) -> bool:
        """Decide whether our last answer may still come back behind a request of so many bytes."""
        if not self.frame or self._has_echo is False:
            return False
        if self._has_echo:
            return heard_s <= self._until_s
        return not self._is_like_request and heard_s < self._heard_out_s(size)

    def note_master(self, size: int, heard_s: float) -> None:
        """Note that a master speaks, in so many bytes: an answer that had to come back by now, and has not, does not."""
        if self.is_coming(size, heard_s):
            return
        if self.frame and not self._is_like_request:
            self._has_echo = False
        self.frame = b""

    def forget(self) -> None:
        """Forget the answer; and what was learned, where there may be another adapter now."""
        self.frame = b""
        self._has_echo = None if self._may_echo else False
