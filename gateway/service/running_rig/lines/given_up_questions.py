"""Questions to an output device that were given up and may still be answered: what comes late is the answer to one of them.

An answer may come after its time has run out, when the next question is already out, and a bare number does not say what
it answers. Taken for the next question's, each following answer would be one behind for as long as the setpoint moves, and
an honest device would look like one that alters its settings. So after a time-out an answer that repeats a setting which was
given up answers that one, and what was asked last is still out. One that repeats neither is believed by nobody: the line is
left alone for one reply time, then asked anew. A falling voltage never waits, and what comes in that time is doubted, too.
Where an echo repeats the setting before, it came twice, perhaps: the line is left alone as well.

One that was garbled is asked for again behind a round trip already. Where another one was due before, what seems garbled may be
that one, or the rest of it, and each try waits for twice as long: with always the same patience a device whose answers take a
moment longer is given up at each of them, for ever. What a round trip takes is told only by an answer that is surely the
question's own.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf, nan
from typing import Final

from gateway.devices.messages import OutputRequest

_MOST_DOUBLED: Final = 10
_MOST: Final = 4  # each may be answered so many reply times later at most


@dataclass(slots=True)
class GivenUpQuestions:
    """The last ones, in a row, with their send times. is_overdue: nothing has come since one was given up but what repeats a
    setting, as a late answer may; round_trip_s: of the last answer that is surely its question's own, nan before the first."""

    reply_timeout_s: float
    questions: list[tuple[OutputRequest, float]] = field(default_factory=list)
    is_overdue: bool = False
    round_trip_s: float = nan
    _heard_s: float = -inf
    _tries: int = 0  # since an answer was surely its question's own

    def forget(self) -> None:
        """Forget all of them, and what was heard: the port has been opened again."""
        self.questions, self.is_overdue, self.round_trip_s = [], False, nan
        self._heard_s, self._tries = -inf, 0

    @property
    def patience_s(self) -> float:
        """Return how long an answer is waited for of which something garbled has come, s."""
        return min(self.reply_timeout_s, self.round_trip_s * 2.0 ** min(self._tries, _MOST_DOUBLED))

    def give_up(self, question: OutputRequest, sent_s: float) -> None:
        """Give up one that was sent then."""
        self.note(question, sent_s)
        self.is_overdue, self._tries = True, self._tries + 1

    def note_answer(self, took_s: float) -> None:
        """Note that a question was answered, so long behind it: those before it never will be."""
        if not (self.questions or self.is_overdue):
            self.round_trip_s, self._tries = took_s, 0
        self.questions.clear()

    def note(self, question: OutputRequest, sent_s: float) -> None:
        """Note one whose answer may still come."""
        self.questions = [*self.questions[1 - _MOST :], (question, sent_s)]

    def note_strange(self, now_s: float) -> None:
        """Note an answer of which nobody knows whose it is: none that was asked before counts as silent any more."""
        self._heard_s, self.is_overdue = now_s, False

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
