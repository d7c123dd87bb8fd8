"""Questions to an output device that were given up and may still be answered: what comes late is the answer to one of them."""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import Final

from gateway.devices.messages import OutputRequest

_MOST: Final = 4  # each may be answered so many reply times later at most


@dataclass(slots=True)
class GivenUpQuestions:
    """The last ones, in a row, with their send times."""

    reply_timeout_s: float
    questions: list[tuple[OutputRequest, float]] = field(default_factory=list)
    _heard_s: float = -inf

    def forget(self) -> None:
        """Forget all of them, and what was heard: the port has been opened again."""
        self.questions, self._heard_s = [], -inf

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
