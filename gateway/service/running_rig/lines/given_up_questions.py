"""Questions to an output device that were given up and may still be answered: what comes late is the answer to one of them.

An answer may come after its time has run out, when the next question is already out, and a bare number does not say what
it answers. Taken for the next question's, each following answer would be one behind for as long as the setpoint moves, and
an honest device would look like one that alters its settings. So after a time-out an answer that repeats a setting which was
given up answers that one, and what was asked last is still out. One that repeats neither is believed by nobody: the line is
left alone for one reply time, then asked anew. A falling voltage never waits, and what comes in that time is doubted, too.

One that was garbled is asked for again behind a round trip already. Where another one was due before, what seems garbled may be
that one, or the rest of it, and each try waits for a round trip more: with always the same patience a device whose answers take
a moment longer is given up at each of them, for ever. What a round trip takes is told only by an answer that is surely the
question's own.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import Final

from gateway.devices.messages import OutputRequest

_MOST: Final = 4  # each may be answered so many reply times later at most


@dataclass(slots=True)
class GivenUpQuestions:
    """The last ones, in a row, with their send times. is_overdue: nothing has come since one was given up but what repeats a
    setting, as a late answer may."""

    reply_timeout_s: float
    questions: list[tuple[OutputRequest, float]] = field(default_factory=list)
    is_overdue: bool = False
    _heard_s: float = -inf

    def forget(self) -> None:
        """Forget all of them, and what was heard: the port has been opened again."""
        self.questions, self.is_overdue, self._heard_s = [], False, -inf

    @property
    def is_awaited(self) -> bool:
        """Decide whether what comes may be the answer to one of them."""
        return bool(self.questions) or self.is_overdue

    def patience_s(self, round_trip_s: float) -> float:
        """Return how long an answer is waited for of which something garbled has come. round_trip_s: what one takes."""
        return min(self.reply_timeout_s, (1 + max(len(self.questions), self.is_overdue)) * round_trip_s)

    def note(self, question: OutputRequest, sent_s: float) -> None:
        """Note one that is given up now."""
        self.questions = [*self.questions[1 - _MOST :], (question, sent_s)]

    def note_strange(self, now_s: float) -> None:
        """Note an answer of which nobody knows whose it is: none that was asked before counts as silent any more."""
        self._heard_s = now_s

    def take_answer(self, is_its: Callable[[OutputRequest], bool], now_s: float) -> float | None:
        """Return when the first one was sent whose answer this may be, None where there is none. Those before it will never be
        answered."""
        for index, (question, sent_s) in enumerate(self.questions):
            if is_its(question) and now_s - sent_s <= _MOST * self.reply_timeout_s:
                del self.questions[: index + 1]
                return sent_s
        return None

    @property
    def silent_since_s(self) -> float | None:
        """Return when the oldest was sent that is still to be answered."""
        return next((sent_s for _, sent_s in self.questions if sent_s > self._heard_s), None)
