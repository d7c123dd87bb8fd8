"""Our own answers, come back: adapters for two wires may hear what they send.

Most answers are no requests, so that they are known when they come. Those of FC05, FC06 and FC22 are requests, letter by
letter, and to answer one's own echo would never end. Decisions:

- Such a frame is an echo where no master can have been as fast: before the answer, the silence and a request of the same
  length can have passed the wire.
- Once an answer of the other kind has come back, or has not, the line is known. What is heard before a master can have listened
  to an answer tells nothing of its echo.
- Until then, a slow adapter could bring the echo later. Equal writes at once after each answer are a master's at first; behind
  some of them one is in doubt. It is not executed but refused (06, busy), and that answer is no request: it comes back, or does
  not, and the line is known from then on. So a master that only writes is refused a few times at most; to leave writes out
  without a word cost it one of each row, and what it heard next told nothing.
- A write that equals an earlier answer than the last is in doubt at once: two echoes that follow each other would go round, and
  an enable come back behind each stop. Nobody waits for a refusal of an echo, so a master may speak before that comes back:
  what is heard while that may still come tells that there is none the third time only.
- Of a master that waits for no answer several are on their way: on a line that has an echo each of them is one when it comes
  back. A stop that equals one is rather that master's own, and those before it may still come.
- On a line that has an echo, or may have one, what is asked before it comes back was asked by a master that had given up. It is
  executed and not answered, and the echo behind it is one: an enable that came back behind a stop would undo that.
"""

from typing import Final

_QUICK_REPEATS: Final = 3  # equal writes at once after an answer: the next on a line that may have an echo is in doubt
_MOST_UNRETURNED: Final = 3  # refusals of what may be echoes: so many do not get lost one after the other
_NOTHING_SET: Final = bytes(2)
"""The value of FC05 and FC06, the bits that FC22 sets: a stop is not refused behind an enable."""
_ECHO_LATENCY_S: Final = 0.02  # from the last character of an answer to its echo, through the slowest adapter
_LATEST_ECHO_S: Final = 0.1
"""The same where this machine reads late, too. An equal write up to then may be one: counted to 20 ms only, echoes that came
behind 21 ms were answered, heard and answered again without an end."""


class RtuEcho:
    """The answer that may come back, and whether this line gives answers back. may_echo: false where it cannot."""

    __slots__ = (
        "_answers", "_character_s", "_has_echo", "_is_like_request", "_latest_s", "_may_echo", "_refusal", "_repeats",
        "_sent_s", "_silence_s", "_unreturned", "_until_s", "frame",
    )  # fmt: skip

    def __init__(self, character_s: float, silence_s: float, *, may_echo: bool) -> None:
        self._character_s, self._silence_s = character_s, silence_s
        self._may_echo = may_echo
        self._has_echo: bool | None = None if may_echo else False  # None: not known yet
        self._is_like_request = False
        self._sent_s = 0.0  # the answer
        self._until_s = self._latest_s = 0.0  # the latest that its echo comes, and that it is read here
        self._repeats = 0
        self._answers: list[tuple[bytes, float]] = []  # like their requests, not heard again; until when they may be
        self._refusal = b""  # of a write in doubt
        self._unreturned = 0  # such refusals
        self.frame = b""

    def expect(self, answer: bytes, now_s: float, *, is_like_request: bool) -> None:
        """Expect this answer back, where the line may have an echo. is_like_request: it is its request once more."""
        self._is_like_request = is_like_request
        self._sent_s, sent_out_s = now_s, now_s + len(answer) * self._character_s
        self._until_s, self._latest_s = sent_out_s + _ECHO_LATENCY_S, sent_out_s + _LATEST_ECHO_S
        if is_like_request:
            self._answers.append((answer, self._latest_s))
        self.frame = answer if not is_like_request or self._has_echo is not False else b""

    def is_this(self, frame: bytes, heard_s: float) -> bool:
        """Decide whether a frame is our last answer come back."""
        if self._refusal and frame == self._refusal != self.frame:
            self._has_echo, self._refusal = True, b""  # behind an answer to a master who has not waited for it
            return True
        if self._has_echo and self._is_owed(frame, heard_s):
            return True
        if not self.frame or frame != self.frame:
            return False
        if not self._is_like_request:
            self._has_echo = True
        elif self._has_echo is None and heard_s >= self._heard_out_s(len(self.frame)) + self._silence_s:
            return False
        self.frame = b""
        return True

    def _is_owed(self, frame: bytes, heard_s: float) -> bool:
        """Decide whether a frame is an earlier answer, too, which a line that has an echo owes: of a master that has not waited
        several are under way."""
        place = self._place_of(frame, heard_s)
        if place is None:
            return False
        del self._answers[place]
        if frame == self.frame:
            self.frame = b""
        return True

    def _place_of(self, frame: bytes, heard_s: float) -> int | None:
        """Where an equal answer that may still come stands among those that may."""
        self._answers = [one for one in self._answers if heard_s <= one[1]]
        return next((k for k, (answer, _) in enumerate(self._answers) if answer == frame), None)

    def _heard_out_s(self, size: int) -> float:
        """The earliest that a request of so many bytes can be there, of a master that has listened to the answer."""
        return self._sent_s + (len(self.frame) + size) * self._character_s

    def is_in_doubt(self, frame: bytes, heard_s: float) -> bool:
        """Decide whether a frame that is_this has let through may be an answer of ours all the same, while no answer of another
        kind has shown yet what the line does. Those before it have come back as well then, or never do."""
        place = self._place_of(frame, heard_s)
        if self._has_echo is not None or place is None:
            self._repeats = 0
            return False
        is_stop, later = frame[-4:-2] == _NOTHING_SET, self._answers[place + 1 :]
        earlier = self._answers[:place] if is_stop else []  # which is never refused: it may be a master's own
        self._answers = [*earlier, *later]
        self._repeats += 1
        if later:  # something else was answered since: an echo on its second round, or a stop
            return not is_stop
        return self._is_refusal_out or self._repeats > _QUICK_REPEATS

    @property
    def _is_refusal_out(self) -> bool:
        """Decide whether the last answer was the refusal of a write in doubt."""
        return bool(self.frame) and self.frame == self._refusal

    def note_refused(self) -> None:
        """Note that the answer expected last refuses a write in doubt: nobody waits for it, if that was an echo."""
        self._refusal = self.frame

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
            self._unreturned += self._is_refusal_out
            is_patient = self._is_refusal_out or self._has_echo  # it may come late, as one has come
            if not is_patient or heard_s > self._latest_s or self._unreturned == _MOST_UNRETURNED:
                self._has_echo = False
        self.frame = b""

    def forget(self) -> None:
        """Forget the answer; and what was learned, where there may be another adapter now."""
        self.frame = b""
        self._answers, self._refusal, self._repeats, self._unreturned = [], b"", 0, 0
        self._has_echo = None if self._may_echo else False
