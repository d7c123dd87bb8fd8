"""Is the load cell still alive behind its readings? A cell that repeats one value while the plant must have moved is
frozen.

"Must have moved" is judged friction-proof: since the value last changed, the rising branch (the least force a voltage
can leave) has somewhere been above the falling branch (the most it can leave) of another time, by more than five
quanta. A single number would trip on every small reversal, where friction really holds the force. Only in contact: in
free air a quiet cell rightly repeats itself. A cell whose noise shows in every reading can be judged sooner, by n equal
samples (frozen_equal_samples).
"""

from math import inf
from typing import Final

from gateway.control.reading import Reading
from gateway.control.response import ModelResponse
from gateway.control.settings import Supervision

_QUANTA: Final = 5.0
_WIDER_LOOP: Final = 0.5  # friction may have grown by this share of the loop since the calibration


class FrozenWatch:
    """Fed with every reading; `is_frozen` after each."""

    def __init__(self, supervision: Supervision) -> None:
        self._frozen_s = supervision.frozen_s
        self._least_change_n = _QUANTA * supervision.sample_quantum_n
        self._equal_limit = supervision.frozen_equal_samples or inf
        self._value_n = inf
        self._slack_n = 0.0
        self.start()

    def start(self) -> None:
        """At enable: what happened before does not count."""
        self._equal = 1
        self._watch_model()

    def _watch_model(self) -> None:
        self._same_s = 0.0
        self._least_n, self._most_n = -inf, inf

    def observe(self, reading: Reading, response: ModelResponse, touching: bool) -> None:
        """One more new reading."""
        if reading.cell_n != self._value_n:
            self._value_n = reading.cell_n
            self.start()
        else:
            self._equal += 1
            self._same_s += reading.interval_s
        if not touching:
            self._watch_model()
        self._slack_n = _WIDER_LOOP * response.width_n
        self._least_n = max(self._least_n, response.rising_n)
        self._most_n = min(self._most_n, response.falling_n)

    @property
    def is_frozen(self) -> bool:
        must_have_moved = self._least_n - self._most_n > self._least_change_n + self._slack_n
        return (self._same_s >= self._frozen_s and must_have_moved) or self._equal > self._equal_limit

    @property
    def same_s(self) -> float:
        return self._same_s
