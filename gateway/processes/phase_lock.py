"""Where a tick of the same period would come right behind what arrives again and again, as a phase-locked loop finds it.

A process that wakes up pays for the kernel's switch and, far more, for code and data that left the caches while it slept. A
load cell that streams as fast as the loop wakes it anyway: a tick that is due while its sample is still worked on costs no
wake-up of its own, and finds everything at hand. Only the phase moves, by little at a time; the period never does.
"""

from math import inf, nan, remainder
from typing import Final

BEHIND_S: Final = 1e-4
"""From the arrival until the tick is due: less than a sample takes to be worked on."""
ARRIVALS: Final = 20
STEADY_SHARE: Final = 0.1  # of the period, between the earliest and the latest of these arrivals
TOLERANCE_S: Final = 5e-5
_MOST_SHARE: Final = 0.1  # of the period, by which one tick comes later or sooner than the one before wants


class PhaseLock:
    """period_s: of the tick. What arrives at another rate, or as it likes, is not followed."""

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._last_s = nan
        self._begin()

    def _begin(self) -> None:
        self._arrivals, self._first_s, self._sum_s = 0, 0.0, 0.0
        self._earliest_s, self._latest_s = inf, -inf

    def shift_s(self, arrival_s: float, due_s: float) -> float:
        """Return by how much the tick is to come later from now on, negative for sooner; 0 nearly always.
        arrival_s: of the newest, which may be told again; due_s: of the tick now. Monotonic seconds."""
        if arrival_s == self._last_s:
            return 0.0
        self._last_s = arrival_s
        late_s = arrival_s + BEHIND_S - due_s
        if not self._arrivals:
            self._first_s = late_s
        beside_s = remainder(late_s - self._first_s, self._period_s)
        self._arrivals += 1
        self._sum_s += beside_s
        self._earliest_s, self._latest_s = min(self._earliest_s, beside_s), max(self._latest_s, beside_s)
        return self._judge_s() if self._arrivals >= ARRIVALS else 0.0

    def _judge_s(self) -> float:
        shift_s = remainder(self._first_s + self._sum_s / self._arrivals, self._period_s)
        is_steady = self._latest_s - self._earliest_s <= STEADY_SHARE * self._period_s
        self._begin()
        most_s = _MOST_SHARE * self._period_s
        return max(-most_s, min(most_s, shift_s)) if is_steady and abs(shift_s) > TOLERANCE_S else 0.0
