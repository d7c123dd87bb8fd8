"""The points of time of a replay: every row, and as many between two rows as their distance needs.

The step is the median row distance, halved until it is at most 5 ms; rows further apart have points between them, at
about this step. So nothing is interpolated at a row: behind a command the pressure has a corner, and a line drawn across
it, between points of a uniform grid, was wrong by up to 1 N. Steps may all be different. A value at a point is that before the
command of a row at this time acts. Only where there would be too many points they lie evenly, apart from the rows.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.twin.replay.drive import Drive, Floats
from gateway.twin.surroundings import COLUMNS, TwinConditions

COARSEST_S: Final = 5.0e-3
MOST_STEPS: Final = 80_000  # where many plants share the memory
_ALIKE: Final = 1.0e-6  # of a step


class Grid:
    """Points of time, rows among them, and the surroundings at both. steps_s: between them, (points - 1,)."""

    def __init__(self, drive: Drive, step_s: float | None, most_steps: int = MOST_STEPS) -> None:
        time_s = drive.time_s
        self.row_s = time_s
        self.rows = time_s.size
        self.notes: tuple[str, ...] = ()
        self.step_s: float = self._step_s(time_s, most_steps) if step_s is None else step_s
        self._parts = np.maximum(np.round(np.diff(time_s) / self.step_s), 1.0).astype(np.intp)
        self._has_rows = not self.notes  # else there would be too many points
        self.time_s = _divide_rows(time_s, self._parts) if self._has_rows else _even_times_s(time_s[-1], self.step_s)
        self.points = self.time_s.size
        self.steps_s: Floats = np.diff(self.time_s)
        self.is_rows = self._has_rows and self.points == self.rows
        self._row_index = np.concatenate([[0], np.cumsum(self._parts)])
        self.row_conditions = _conditions(drive, self.row_s, self)
        self.conditions = self.row_conditions if self.is_rows else _conditions(drive, self.time_s, self)

    def _step_s(self, time_s: Floats, most_steps: int) -> float:
        step_s = float(np.median(np.diff(time_s)))
        while step_s > COARSEST_S * (1.0 + _ALIKE):
            step_s *= 0.5
        shortest_s = float(time_s[-1]) / most_steps
        if step_s < shortest_s:
            self.notes = (f"simulated in steps of {shortest_s * 1.0e3:.3g} ms, coarser than the rows",)
        return max(step_s, shortest_s)

    def at_rows(self, values: Floats) -> Floats:
        """Return a series on the grid, (points,), at the rows. It may be the same array: not to be written to."""
        if self.is_rows:
            return values
        return values[self._row_index] if self._has_rows else self.at(values, self.row_s)

    def at(self, values: Floats, time_s: Floats) -> Floats:
        """Return a series on the grid at any times; before the first point and behind the last it stays as it is there."""
        found: Floats = np.interp(time_s, self.time_s, values)
        return found

    def from_rows(self, column: Floats) -> Floats:
        """Return a column of the recording on the grid, interpolated."""
        found: Floats = column if self.is_rows else np.interp(self.time_s, self.row_s, column)
        return found


def _divide_rows(time_s: Floats, parts: NDArray[np.intp]) -> Floats:
    """The rows' times, with each distance between them cut into so many equal parts."""
    if parts.max() == 1:
        return time_s
    row = np.repeat(np.arange(parts.size), parts)
    part = np.arange(row.size) - np.repeat(np.cumsum(parts) - parts, parts)
    between = time_s[row] + part * (np.diff(time_s) / parts)[row]
    return np.concatenate([between, time_s[-1:]])


def _even_times_s(last_s: float, step_s: float) -> Floats:
    """Times from 0 to the last row, or a little beyond."""
    found: Floats = np.arange(math.ceil(last_s / step_s - _ALIKE) + 1, dtype=np.float64) * step_s
    return found


def _conditions(drive: Drive, time_s: Floats, grid: Grid) -> TwinConditions:
    """The recording's surroundings at the rows or on the grid."""
    conditions, around = TwinConditions(time_s=time_s), drive.surroundings
    for name in COLUMNS:
        column = getattr(around, name)
        if column is not None:
            column = np.broadcast_to(np.asarray(column, dtype=np.float64), grid.row_s.shape)
            setattr(conditions, name, np.interp(time_s, grid.row_s, column))
    if around.position_mm is not None:
        conditions.aside_mm = conditions.position_mm - np.mean(around.position_mm)
    if around.spindle_rpm is not None:
        conditions.spindle_rad = _spindle_angle_rad(time_s, conditions.spindle_rpm)
    if drive.command_v is not None:
        first_v = drive.command_v[0] if drive.before_v is None else drive.before_v
        before_v = np.concatenate([[first_v], drive.command_v[:-1]])
        conditions.command_v = before_v if time_s is grid.row_s else None  # only readings look at it
    return conditions


def _spindle_angle_rad(time_s: Floats, spindle_rpm: Floats) -> Floats:
    """The spindle's angle since time 0: the integral of its speed."""
    mean_rpm = 0.5 * (spindle_rpm[1:] + spindle_rpm[:-1])
    turned = np.cumsum(mean_rpm * np.diff(time_s)) * (2.0 * math.pi / 60.0)
    return np.concatenate([[0.0], turned])
