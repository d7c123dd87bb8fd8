"""Where a setpoint that a master writes again and again will be when the force can have followed it.

A robot that tells a path as setpoints, 20 times a second and more, knows where it goes; the gateway hears only where it is, and
the force comes a dead time and the lags' rest later. So a setpoint that moves steadily is continued by a parabola through the
last WINDOW_S of its values. One that jumps, stands, or comes too seldom is not: what a single write asks for is taken as it is.
Nor is what moves for less than LEAST_S, for the rate of a burst is its counts over next to no time, nor what goes to and fro,
as an analog setpoint does: continuing either throws the aim about, and friction keeps a part of that. Of what else scatters
about its parabola only what the scatter could not have made is added.
What is added is bounded (MOST_N), and ends when the next value is overdue. A path that stops at once is overrun by what was
added meanwhile: whoever ramps towards a known end lets the gateway ramp (register force_ramp), which overruns nothing.
"""

from collections import deque
from itertools import pairwise
from math import copysign, sqrt
from typing import Final

WINDOW_S: Final = 0.16
LONGEST_S: Final = 0.06  # between two values: fewer than 17 a second are steps
FEWEST: Final = 4  # values that moved, one after the other
SHORTEST_S: Final = 0.004  # after a value: what comes sooner waits; a stalled network hands over many at once
LEAST_S: Final = 0.1  # of a path
MOST_TURNS: Final = 1  # of a path, within its window ...
MOST_TURNING: Final = (
    0.5  # ... or this share of its values, where they are many: noise turns a path round where it is flat
)
JUMP_N: Final = 2.0  # between two values: a step
OVERDUE: Final = 2.2  # times the mean interval: at a turn two values may be equal, which looks like one that lasts
SCATTER_GAIN: Final = 5.0  # what the parabola, 0.15 s later, makes of a scatter of its three values, about
AT_A_TURN_S: Final = 0.04  # a fine path stands still for longer there, by its counts
MOST_N: Final = 4.0


class SetpointTrend:
    """Times are virtual: seconds that `advance` was told to have passed."""

    def __init__(self) -> None:
        self._now_s = 0.0
        self._values: deque[tuple[float, float]] = deque()
        self._rate_n_per_s = self._change_n_per_s2 = self._unsure_n = 0.0
        self._is_path = False

    def restart(self) -> None:
        """Forget the path."""
        self._values.clear()
        self._is_path = False
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
        self._is_path = self._moves_steadily()
        if self._is_path:
            self._fit()

    def ahead_n(self, ahead_s: float) -> float:
        """Return by how much the setpoint will have moved ahead_s from now, N; 0 where it does not move steadily."""
        if not self._is_path:
            return 0.0
        since_s = ahead_s + self._now_s - self._values[-1][0]
        moved_n = self._rate_n_per_s * since_s + 0.5 * self._change_n_per_s2 * since_s * since_s
        sure_n = max(0.0, abs(moved_n) - self._unsure_n)
        return copysign(min(MOST_N, sure_n), moved_n)

    def _moves_steadily(self) -> bool:
        values = self._values
        if len(values) < FEWEST or values[-1][0] - values[0][0] < LEAST_S:
            return False
        steps = [later[1] > earlier[1] for earlier, later in pairwise(values)]
        turns = sum(before is not after for before, after in pairwise(steps))
        return turns <= max(MOST_TURNS, MOST_TURNING * len(steps))

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
        self._unsure_n = SCATTER_GAIN * self._scatter_n(last)

    def _scatter_n(self, last: tuple[float, float]) -> float:
        """RMS distance of the other values from the parabola through three of them."""
        half = 0.5 * self._change_n_per_s2
        squares = 0.0
        for at_s, value_n in self._values:
            since_s = at_s - last[0]
            squares += (value_n - last[1] - (self._rate_n_per_s + half * since_s) * since_s) ** 2
        return sqrt(squares / (len(self._values) - 3))
