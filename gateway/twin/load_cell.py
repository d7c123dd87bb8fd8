"""The load cell, its amplifier and the logger: filter and clock in each step; the rest when a reading is taken.

Formulas of the single effects stand in effects/load_cell.py. The clock's errors need the past: a history of the filtered
force, as long as the reading lags behind. A clock that runs ahead would need the future: the running twin then reads the
present.
"""

import math

from numpy.random import Generator

from gateway.twin.effects.load_cell import TERMS, convert_reading, lose_sign
from gateway.twin.effects.term import active_formulas, is_switched_on
from gateway.twin.elementwise import Real
from gateway.twin.play_and_lags import follow_ramp, ramp_shares
from gateway.twin.sections import LoadCell
from gateway.twin.surroundings import TwinConditions

_SPARE = 4096  # steps of history that are dropped at once


def shown_time_s(cell: LoadCell, time_s: Real) -> Real:
    """Return the moment that the reading of `time_s` shows: clock-offset and clock-skew."""
    return (time_s - cell.clock_offset_s) * (1.0 - cell.clock_skew)


class History:
    """The force of past steps, as far back as the reading looks. first: number of the step that it begins with."""

    def __init__(self, step_s: float, force_n: float = 0.0, first: int = 0) -> None:
        self._values = [force_n]
        self._step_s, self._first = step_s, first

    def put(self, value: float) -> None:
        """Append the force of one more step, N."""
        self._values.append(value)

    def at(self, time_s: float) -> float:
        """Return the force at a time, interpolated; before the start that of the start, after the end that of the end."""
        last = self._first + len(self._values) - 1
        steps = min(max(time_s / self._step_s, self._first), last)
        whole = min(math.floor(steps + 1.0e-9), max(last - 1, self._first))
        low, high = self._values[whole - self._first], self._values[min(whole + 1, last) - self._first]
        if whole - self._first > _SPARE:
            del self._values[: whole - self._first]
            self._first = whole
        return low + max(steps - whole, 0.0) * (high - low)


class LoadCellState:
    """What the amplifier makes of the contact force."""

    def __init__(self, cell: LoadCell, step_s: float) -> None:
        self._step_s = step_s
        self._force_n = 0.0
        self._last_n: float | None = None
        self.filtered_n = 0.0
        self.sign = 1.0
        self._take(cell, begins=True)

    def _take(self, cell: LoadCell, *, begins: bool) -> None:
        self._cell = cell
        self._shares = ramp_shares(cell.filter_s, self._step_s) if cell.filter_s != 0.0 else None
        self._terms = active_formulas(TERMS, cell, TwinConditions())
        if begins:
            shifted = is_switched_on(cell, ("clock_offset_s", "clock_skew"))
            self._history = History(self._step_s, self.filtered_n) if shifted else None

    def change_cell(self, cell: LoadCell, *, begins: bool) -> None:
        """Go on as another load cell. begins: its time begins now."""
        if self._shares is None:
            self._force_n = self.filtered_n
        self._take(cell, begins=begins)

    def begin_at(self, step: int) -> None:
        """Begin with this step of its time, before the first one."""
        if self._history is not None:
            self._history = History(self._step_s, self.filtered_n, step)

    def select_active_effects(self, conditions: TwinConditions) -> None:
        """Choose the effects that act, from what is known of the surroundings now."""
        self._terms = active_formulas(TERMS, self._cell, conditions)

    def step(self, force_n: float) -> None:
        """Follow the contact force for one step."""
        if self._shares is None:
            self.filtered_n = force_n
        else:
            self.filtered_n = follow_ramp(self.filtered_n, self._shares, self._force_n, force_n)
            self._force_n = force_n
        if self._history is not None:
            self._history.put(self.filtered_n)

    def read(self, rng: Generator, conditions: TwinConditions) -> float:
        """Return one reading, N, with the sign of the wiring."""
        cell, force = self._cell, self.filtered_n
        if self._history is not None:
            force = self._history.at(shown_time_s(cell, conditions.time_s))
        for term in self._terms:
            force = term(cell, force, conditions)
        force += cell.zero_n
        if cell.noise_n != 0.0:
            force += cell.noise_n * float(rng.standard_normal())
        if cell.outlier_share != 0.0 and float(rng.random()) < cell.outlier_share:
            force += cell.outlier_n
        force *= self.sign
        if cell.sign_lost != 0.0:
            force = lose_sign(cell, force)
        return self._repeat(convert_reading(cell, force), rng)

    def _repeat(self, reading_n: float, rng: Generator) -> float:
        """repeated-samples: the reading before instead of this one."""
        if self._cell.repeated_share == 0.0:
            return reading_n
        if self._last_n is not None and float(rng.random()) < self._cell.repeated_share:
            reading_n = self._last_n
        self._last_n = reading_n
        return reading_n
