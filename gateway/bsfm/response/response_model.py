"""What force a step of the command leads to, by dead time and lags.

A regulator whose poles are complex passes the end and comes back, and friction keeps a part of that: the force is the model's
way on to the peak, and its way back from there, and what is settled is what has stayed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.bsfm.ladder.settled_points import SAME_V
from gateway.bsfm.response.second_order import SecondOrder

Floats = NDArray[np.float64]

PATH_POINTS: Final = 25
SHORTEST_LAG_S: Final = 1.0e-3


@dataclass(frozen=True, slots=True)
class Lags:
    """Dead time and one or two lags in series, s; with a damping they are a pair of complex poles (SecondOrder)."""

    dead_time_s: float
    lag_s: float
    second_lag_s: float = 0.0
    damping: float = 0.0


@dataclass(frozen=True, eq=False)
class StepResponse:
    """One step of the command, and what came back.

    changes: (seconds, volts by which the command went) of this step and of those before it whose effect may last; path_v,
    path_n: what the model makes of each voltage on the way; back_v, back_n: by how much the force goes back, N, where the
    voltage goes back from the step's end, V.
    """

    time_s: Floats
    force_n: Floats
    changes: tuple[tuple[float, float], ...]
    end_v: float
    path_v: Floats
    path_n: Floats
    back_v: Floats
    back_n: Floats

    @property
    def way(self) -> float:
        """1 up, -1 down."""
        return 1.0 if self.changes[-1][1] > 0.0 else -1.0

    def expected_n(self, lags: Lags) -> Floats:
        """Return the force by the model, N, at the times of the readings."""
        return JoinedSteps((self,)).expected_n(lags)

    def with_overshoot(self, arrived_v: Floats, on_way_n: Floats) -> Floats:
        """Return on_way_n with the way beyond the end and back. arrived_v: what has come of the command. What friction keeps of
        it is in the settled force, so the way itself is shorter."""
        beyond_v = self.way * (arrived_v - self.end_v)
        peak_v = np.maximum.accumulate(np.maximum(beyond_v, 0.0))
        start_n, end_n = (self.path_n[0], self.path_n[-1]) if self.way > 0.0 else (self.path_n[-1], self.path_n[0])
        slope = self._slope_at_end
        lost_n = np.interp(np.where(peak_v > 0.0, peak_v - beyond_v, 0.0), self.back_v, self.back_n)
        kept_n = slope * peak_v[-1] - float(np.interp(peak_v[-1], self.back_v, self.back_n))
        share = (np.where(peak_v > 0.0, end_n, on_way_n) - start_n) / (end_n - start_n)
        expected_n = start_n + share * (end_n - self.way * kept_n - start_n) + self.way * (slope * peak_v - lost_n)
        return np.asarray(expected_n, dtype=np.float64)

    @cached_property
    def _slope_at_end(self) -> float:
        """N/V over the last third of the way; where the model's range ends there, not more than twice that of the whole."""
        third = slice(-(PATH_POINTS // 3), None) if self.way > 0.0 else slice(0, PATH_POINTS // 3)
        whole = float(np.ptp(self.path_n) / np.ptp(self.path_v))
        return min(2.0 * whole, float(np.ptp(self.path_n[third]) / max(np.ptp(self.path_v[third]), SAME_V)))


class JoinedSteps:
    """Several steps as one: a fit asks a thousand times for the force of all of them. force_n: measured, one step behind the
    other, N."""

    def __init__(self, steps: Sequence[StepResponse]) -> None:
        self._steps = steps
        self.force_n = np.concatenate([step.force_n for step in steps])
        self._rows = np.array([len(step.time_s) for step in steps])
        changes = [np.array(step.changes) for step in steps]
        self._since_s = np.concatenate(
            [(step.time_s[:, None] - change[:, 0]).ravel() for step, change in zip(steps, changes, strict=True)]
        )
        self._by_v = np.concatenate(
            [np.tile(change[:, 1], rows) for change, rows in zip(changes, self._rows.tolist(), strict=True)]
        )
        in_row = np.repeat([len(change) for change in changes], self._rows)
        self._row_starts = np.concatenate([[0], np.cumsum(in_row)[:-1]])
        self._end_v = np.repeat([step.end_v for step in steps], self._rows)
        self._join_paths()

    def _join_paths(self) -> None:
        """Each step's path over an interval of its own, so that one interpolation serves all: the k-th over 2 k to 2 k + 1."""
        first_v, last_v = (np.array([step.path_v[end] for step in self._steps]) for end in (0, -1))
        places = 2.0 * np.arange(len(self._steps))
        self._path_n = np.concatenate([step.path_n for step in self._steps])
        shares = [(step.path_v - step.path_v[0]) / np.ptp(step.path_v) for step in self._steps]
        self._path = np.concatenate([place + share for place, share in zip(places.tolist(), shares, strict=True)])
        self._first_v, self._way_v, self._place = (
            np.repeat(of_step, self._rows) for of_step in (first_v, last_v - first_v, places)
        )

    def expected_n(self, lags: Lags) -> Floats:
        """Return the force by the model, N, at the times of all readings."""
        share = missing_share(self._since_s - lags.dead_time_s, lags.lag_s, lags.second_lag_s, lags.damping)
        arrived_v = self._end_v - np.add.reduceat(share * self._by_v, self._row_starts)
        along = np.clip((arrived_v - self._first_v) / self._way_v, 0.0, 1.0)
        on_way_n = np.interp(self._place + along, self._path, self._path_n)
        if not lags.damping:
            return np.asarray(on_way_n, dtype=np.float64)
        ends = np.cumsum(self._rows)[:-1]
        parts = zip(self._steps, np.split(arrived_v, ends), np.split(on_way_n, ends), strict=True)
        return np.concatenate([step.with_overshoot(volts, on_way) for step, volts, on_way in parts])


def missing_share(since_s: Floats, lag_s: float, second_lag_s: float, damping: float = 0.0) -> Floats:
    """Return the share of a step that has not arrived yet behind two lags in series, or behind a pair of complex poles; 1
    before it begins."""
    since_s = np.maximum(since_s, 0.0)
    if damping:
        pair = SecondOrder(lag_s, second_lag_s, damping)
        decay_per_s = 0.5 * pair.delay_s / pair.bend_s2
        swing_per_s = np.sqrt(1.0 - damping**2) / pair.natural_s
        turn = swing_per_s * since_s
        swing = np.cos(turn) + decay_per_s / swing_per_s * np.sin(turn)
        return np.asarray(np.exp(-decay_per_s * since_s) * swing)
    if second_lag_s < SHORTEST_LAG_S:
        return np.exp(-since_s / lag_s)
    if abs(lag_s - second_lag_s) < 1.0e-4 * lag_s:
        return (1.0 + since_s / lag_s) * np.exp(-since_s / lag_s)
    slow, fast = lag_s * np.exp(-since_s / lag_s), second_lag_s * np.exp(-since_s / second_lag_s)
    return (slow - fast) / (lag_s - second_lag_s)
