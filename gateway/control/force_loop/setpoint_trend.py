"""Where a setpoint that a master writes again and again will be when the force can have followed it.

A robot that tells a path as setpoints, 20 times a second and more, knows where it goes; the gateway hears only where it is, and
the force comes a dead time and the lags' rest later. So a setpoint that moves steadily is continued by a parabola through the
last WINDOW_S of its values. One that jumps, stands, or comes too seldom is not: what a single write asks for is taken as it is.
Nor is what moves for less than LEAST_S: the rate of a burst, or of a setpoint that flickers by a count, is its counts over next
to no time, and continuing that throws the aim to and fro, which friction keeps a part of.
What is added is bounded (MOST_N), and ends when the next value is overdue. A path that stops at once is overrun by what was
added meanwhile: whoever ramps towards a known end lets the gateway ramp (register force_ramp), which overruns nothing.
"""

from collections import deque
from typing import Final

WINDOW_S: Final = 0.16
LONGEST_S: Final = 0.06  # between two values: fewer than 17 a second are steps
FEWEST: Final = 4  # values that moved, one after the other
SHORTEST_S: Final = 0.004  # after a value: what comes sooner waits; a stalled network hands over many at once
LEAST_S: Final = 0.1  # of a path
JUMP_N: Final = 2.0  # between two values: a step
OVERDUE: Final = 2.2  # times the mean interval: at a turn two values may be equal, which looks like one that lasts
AT_A_TURN_S: Final = 0.04  # a fine path stands still for longer there, by its counts
MOST_N: Final = 4.0


class SetpointTrend:
    """Times are virtual: seconds that `advance` was told to have passed."""

    def __init__(self) -> None:
        self._now_s = 0.0
        self._values: deque[tuple[float, float]] = deque()
        self._rate_n_per_s = self._change_n_per_s2 = 0.0

    def restart(self) -> None:
        """Forget the path."""
        self._values.clear()
        self._rate_n_per_s = self._change_n_per_s2 = 0.0

    def advance(self, setpoint_n: float, dt_s: float) -> None:
        """Follow the setpoint: dt_s has passed, and this is the setpoint from now on, N."""
        self._now_s += dt_s
        values = self._values
        if values and self._now_s - values[-1][0] > self._patience_s:
            self.restart()
        if values and abs(setpoint_n - values[-1][1]) > JUMP_N:
            self.restart()
        if values and (setpoint_n == values[-1][1] or self._now_s - values[-1][0] < SHORTEST_S):
            return
        values.append((self._now_s, setpoint_n))
        while len(values) > FEWEST and values[-1][0] - values[0][0] > WINDOW_S:
            values.popleft()
        if self._is_path:
            self._fit()

    def ahead_n(self, ahead_s: float) -> float:
        """Return by how much the setpoint will have moved ahead_s from now, N; 0 where it does not move steadily."""
        if not self._is_path:
            return 0.0
        since_s = ahead_s + self._now_s - self._values[-1][0]
        moved_n = self._rate_n_per_s * since_s + 0.5 * self._change_n_per_s2 * since_s * since_s
        return max(-MOST_N, min(MOST_N, moved_n))

    @property
    def _is_path(self) -> bool:
        """Decide whether the values have moved for long enough."""
        values = self._values
        return len(values) >= FEWEST and values[-1][0] - values[0][0] >= LEAST_S

    @property
    def _patience_s(self) -> float:
        """How long the last value may stand."""
        values = self._values
        if len(values) < FEWEST:
            return LONGEST_S
        return max(AT_A_TURN_S, OVERDUE * (values[-1][0] - values[0][0]) / (len(values) - 1))

    def _fit(self) -> None:
        """Rates of both halves of the window, and from them rate and change at its end."""
        first, middle, last = self._values[0], self._values[len(self._values) // 2], self._values[-1]
        early_s, late_s = middle[0] - first[0], last[0] - middle[0]
        early, late = (middle[1] - first[1]) / early_s, (last[1] - middle[1]) / late_s
        self._change_n_per_s2 = 2.0 * (late - early) / (early_s + late_s)
        self._rate_n_per_s = late + 0.5 * self._change_n_per_s2 * late_s
