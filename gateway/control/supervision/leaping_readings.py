"""Believe a reading that leaps only as far as the one before lets it be believed.

A digit that was disturbed on a wire without a checksum, or a spike of an amplifier, is one reading; a force that has really
moved so far shows in the next one as well. So the trim learns from a leap a reading later, and nothing from one that is alone:
at 100 Hz one that was 50 N off moved a held force by 2 N, for a second. It passes such a reading over: a part of a true leap
is a wrong force, too: of a cell of 10 Hz each step is one. The self-test, and the force at rest that the first rise is judged
from, take the part: there one false reading was a wrong sign, span or gain. Over-force and contact count readings themselves.

Two false readings in a row seldom say the same. So behind one that was passed over the trim passes one more that agrees neither
with it nor with those before; not where readings leapt shortly before, for of a force that shakes none agree.

Readings that leap between the same two values, bit for bit, are of no force, but for two neighbouring counts of a coarse cell:
noise and friction show others between. They are a defective amplifier's, and nothing is learned from them; which of the two is
the force, if any, nobody knows.
"""

from collections import deque
from itertools import pairwise
from math import inf
from typing import Final

LEAP_N: Final = 3.0  # more than usual noise, and than a force that is held moves from one reading to the next
CALM_READINGS: Final = 5  # that did not leap, behind which two leaps in a row are doubted
_TWO_READINGS: Final = 8  # of two values, which change ...
_TWO_LEAPS: Final = 4  # ... so often: a force that has fallen once, without noise, is of two values, too


class LeapLimit:
    """Told of each usable reading in its order."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Forget what was read before: the next one is believed whole."""
        self._low_n, self._high_n = -inf, inf

    def take(self, force_n: float) -> float:
        """Return as much of this reading as is believed, N."""
        if self._low_n <= force_n <= self._high_n:  # most are no leap
            self._low_n, self._high_n = force_n - LEAP_N, force_n + LEAP_N
            return force_n
        believed_n = max(self._low_n, min(self._high_n, force_n))
        self._low_n, self._high_n = min(force_n, believed_n) - LEAP_N, max(force_n, believed_n) + LEAP_N
        return believed_n


class LeapCheck:
    """Told of each usable reading in its order. quantum_n: as of `supervision.sample_quantum_n` of the rig."""

    def __init__(self, quantum_n: float) -> None:
        self._two_values_n = max(LEAP_N, 3.0 * quantum_n)  # a rig may write half a count
        self._limit, self._believed_n = LeapLimit(), 0.0
        self._said_n: deque[float] = deque(maxlen=_TWO_READINGS)
        self.forget()

    def forget(self) -> None:
        """Forget what was read before: the next one is believed whole."""
        self._limit.forget()
        self._said_n.clear()
        self._calm = CALM_READINGS
        self._leapt_n: float | None = None  # by the reading before, behind calm ones

    @property
    def two_values(self) -> str:
        """Observation of readings that leap between the same two values; empty where they do not."""
        low_n, high_n = min(self._said_n, default=0.0), max(self._said_n, default=0.0)
        if not high_n - low_n > self._two_values_n or not {low_n, high_n}.issuperset(self._said_n):
            return ""
        if sum(before_n != after_n for before_n, after_n in pairwise(self._said_n)) < _TWO_LEAPS:
            return ""
        return f"the cell says nothing but {low_n:.2f} N and {high_n:.2f} N by turns"

    def passes_over(self, force_n: float, said_n: float) -> bool:
        """Decide whether nothing may be learned from this reading, N. said_n: the same as the cell said it."""
        self._said_n.append(said_n)
        return self._is_alone(force_n) or bool(self.two_values)

    def _is_alone(self, force_n: float) -> bool:
        leapt_n, self._leapt_n = self._leapt_n, None
        if self._limit.take(force_n) != force_n:
            self._leapt_n, self._calm = (force_n if self._calm >= CALM_READINGS else None), 0
            return True
        if leapt_n is not None and min(abs(force_n - leapt_n), abs(force_n - self._believed_n)) > LEAP_N:
            return True
        self._calm, self._believed_n = self._calm + 1, force_n
        return False
