"""The load cell, its amplifier and the logger: filter and clock in each step; the rest when a reading is taken.

Formulas of the single effects stand in effects/load_cell.py. The clock's errors need the past: a history of the filtered
force, as long as the reading lags behind. A clock that runs ahead would need the future: the running twin then reads the
present.
"""

import numpy as np
from numpy.random import Generator

from gateway.twin.effects.load_cell import TERMS, convert_reading, lose_sign
from gateway.twin.effects.term import active_formulas
from gateway.twin.elementwise import Real, choose
from gateway.twin.regulator import lag_factor
from gateway.twin.sections import LoadCell
from gateway.twin.surroundings import TwinConditions

_SPARE = 4096  # steps of history that are dropped at once


def shown_time_s(cell: LoadCell, time_s: Real) -> Real:
    """Return the moment that the reading of `time_s` shows: clock-offset and clock-skew."""
    return (time_s - cell.clock_offset_s) * (1.0 - cell.clock_skew)


class History:
    """The force of past steps, as far back as lanes still look."""

    def __init__(self, step_s: float, start: Real) -> None:
        self._values: list[Real] = [start]
        self._step_s, self._first = step_s, 0

    def put(self, value: Real) -> None:
        self._values.append(value)

    def at(self, time_s: Real) -> Real:
        """Return the force at a time, interpolated; before the start that of the start, after the end that of the end."""
        last = self._first + len(self._values) - 1
        steps = np.clip(np.asarray(time_s) / self._step_s, self._first, last)
        whole = np.minimum(np.floor(steps + 1.0e-9).astype(int), max(last - 1, self._first))
        found = self._between(whole - self._first, np.maximum(steps - whole, 0.0))
        self._forget(int(whole.min()))
        return found

    def _between(self, index: np.ndarray, fraction: np.ndarray) -> Real:
        values, end = self._values, len(self._values) - 1
        if not isinstance(values[0], np.ndarray):
            low, high = values[int(index)], values[min(int(index) + 1, end)]
            return low + float(fraction) * (high - low)
        lanes = np.arange(values[0].size)
        index, fraction = np.broadcast_to(index, lanes.shape), np.broadcast_to(fraction, lanes.shape)
        low = np.array([values[i][lane] for i, lane in zip(index, lanes, strict=True)])
        high = np.array([values[min(i + 1, end)][lane] for i, lane in zip(index, lanes, strict=True)])
        return low + fraction * (high - low)

    def _forget(self, oldest: int) -> None:
        if oldest - self._first > _SPARE:
            del self._values[: oldest - self._first]
            self._first = oldest


class LoadCellState:
    """What the amplifier makes of the contact force."""

    def __init__(self, cell: LoadCell, step_s: float, zero: Real) -> None:
        self._cell = cell
        self._lag = lag_factor(cell.filter_s, step_s) if np.any(cell.filter_s) else None
        self._noisy = bool(np.any(cell.noise_n))
        self._spikes, self._repeats = bool(np.any(cell.outlier_share)), bool(np.any(cell.repeated_share))
        self._loses_sign = bool(np.any(cell.sign_lost))
        shifted = bool(np.any(cell.clock_offset_s)) or bool(np.any(cell.clock_skew))
        self._history = History(step_s, zero) if shifted else None
        self._terms = active_formulas(TERMS, cell, TwinConditions())
        self._zero = zero
        self._last_n: Real = None
        self.filtered_n: Real = zero
        self.sign = 1.0

    def select_active_effects(self, conditions: TwinConditions) -> None:
        """Choose the effects that act, from what is known of the surroundings now."""
        self._terms = active_formulas(TERMS, self._cell, conditions)

    def step(self, force_n: Real) -> None:
        """Follow the contact force for one step."""
        self.filtered_n = force_n if self._lag is None else self.filtered_n + self._lag * (force_n - self.filtered_n)
        if self._history is not None:
            self._history.put(self.filtered_n)

    def read(self, rng: Generator, conditions: TwinConditions) -> Real:
        """Return one reading, N, with the sign of the wiring. Chance is the same draw for all lanes, as one rig's is."""
        cell = self._cell
        force = self.filtered_n if self._history is None else self._shown_n(conditions)
        for term in self._terms:
            force = term(cell, force, conditions)
        force = force + cell.zero_n
        if self._noisy:
            force = force + cell.noise_n * float(rng.standard_normal())
        if self._spikes:
            force = force + choose(float(rng.random()) < cell.outlier_share, cell.outlier_n, self._zero)
        force = self.sign * force
        if self._loses_sign:
            force = lose_sign(cell, force)
        return self._kept(convert_reading(cell, force), rng)

    def _shown_n(self, conditions: TwinConditions) -> Real:
        """What a wrong clock shows."""
        assert self._history is not None
        return self._history.at(shown_time_s(self._cell, conditions.time_s))

    def _kept(self, reading_n: Real, rng: Generator) -> Real:
        """repeated-samples: the reading before instead of this one."""
        if not self._repeats:
            return reading_n
        if self._last_n is not None:
            reading_n = choose(float(rng.random()) < self._cell.repeated_share, self._last_n, reading_n)
        self._last_n = reading_n
        return reading_n
