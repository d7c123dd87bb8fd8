"""Our own answers, come back: adapters for two wires may hear what they send.

Most answers are no requests, so that they are known when they come. Those of FC05, FC06 and FC22 are requests, letter by
letter, and to answer one's own echo would never end. Decisions:

- Such a frame is an echo where no master can have been as fast: before the answer, the silence and a request of the same
  length can have passed the wire.
- Once an answer of the other kind has come back, or has not, the line is known.
- Until then, a slow adapter could bring the echo later. Equal writes at once after each answer are a master's at first; behind
  a row of them one is left out, which ends what an echo had begun and costs a master one request. The row grows each time.
"""

from typing import Final

_QUICK_REPEATS: Final = 3  # equal writes at once after each answer: more on a line that may have an echo are in doubt
_DOUBT_GROWTH: Final = 10  # how many more are answered after each that was left out
_ECHO_LATENCY_S: Final = 0.02  # from the last character of an answer to its echo, through the slowest adapter


class RtuEcho:
    """The answer that may come back, and whether this line gives answers back. may_echo: false where it cannot."""

    __slots__ = (
        "_character_s", "_has_echo", "_is_like_request", "_master_s", "_may_echo", "_most_repeats", "_repeats", "_silence_s",
        "_until_s", "frame",
    )  # fmt: skip

    def __init__(self, character_s: float, silence_s: float, *, may_echo: bool) -> None:
        self._character_s, self._silence_s = character_s, silence_s
        self._may_echo = may_echo
        self._has_echo: bool | None = None if may_echo else False  # None: not known yet
        self._is_like_request = False
        self._master_s = self._until_s = 0.0  # the earliest a master's next request can have come; the latest an echo
        self._repeats, self._most_repeats = 0, _QUICK_REPEATS
        self.frame = b""

    def expect(self, answer: bytes, now_s: float, *, is_like_request: bool) -> None:
        """Expect this answer back, where the line may have an echo. is_like_request: it is its request once more."""
        self._is_like_request = is_like_request
        self.frame = answer if not is_like_request or self._has_echo is not False else b""
        wire_s = len(answer) * self._character_s
        self._master_s, self._until_s = now_s + 2.0 * wire_s + self._silence_s, now_s + wire_s + _ECHO_LATENCY_S

    def is_this(self, frame: bytes, heard_s: float) -> bool:
        """Decide whether a frame is our last answer come back."""
        if not self.frame or frame != self.frame:
            return False
        if not self._is_like_request:
            self._has_echo = True
        elif self._has_echo is None and not self._is_doubtful(heard_s):
            return False
        self.frame = b""
        return True

    def _is_doubtful(self, heard_s: float) -> bool:
        """Decide whether a write that is equal to our answer is rather taken for it."""
        if heard_s < self._master_s:
            return True
        self._repeats = self._repeats + 1 if heard_s <= self._until_s else 0
        if self._repeats <= self._most_repeats:
            return False
        self._repeats, self._most_repeats = 0, self._most_repeats * _DOUBT_GROWTH
        return True

    def note_master(self) -> None:
        """Note that a master speaks: an answer that has not come back by now does not."""
        if self.frame and not self._is_like_request:
            self._has_echo = False
        self.frame = b""

    def forget(self) -> None:
        """Forget the answer; and what was learned, where there may be another adapter now."""
        self.frame = b""
        self._has_echo = None if self._may_echo else False
