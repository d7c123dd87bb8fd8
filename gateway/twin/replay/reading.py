"""Replay, stage 4: what load cell, amplifier and logger make of the contact force, one plant at a time.

The amplifier's filter runs on the grid; a wrong clock looks at other times of it; the formulas of effects/load_cell.py
follow at the rows. The spindle passes the filter by its response at the spindle's frequency.
"""

import math

import numpy as np
from numpy.typing import NDArray

from gateway.defaults import UNLIMITED
from gateway.twin.effects.contact import SPINDLE, spindle_amplitude_n
from gateway.twin.effects.load_cell import TERMS, convert_reading, lose_sign
from gateway.twin.effects.term import active_formulas, is_switched_on
from gateway.twin.elementwise import quantise
from gateway.twin.load_cell import shown_time_s
from gateway.twin.plant import Plant
from gateway.twin.replay.drive import Drive, Flags, Floats
from gateway.twin.replay.grid import Grid
from gateway.twin.replay.loops import march_lag
from gateway.twin.sections import Contact, LoadCell
from gateway.twin.surroundings import TwinConditions

_RADIAN_PER_TURN = 2.0 * math.pi


class Readings:
    """Readings of a plant at the rows."""

    def __init__(self, drive: Drive, grid: Grid) -> None:
        self._drive, self._grid = drive, grid
        self._shown = None if drive.repeated is None else _last_fresh(drive.repeated)

    def fill(self, plant: Plant, contact_n: Floats, force_n: Floats, found: Floats) -> None:
        """Fill in readings in N. contact_n: on the grid, without the spindle; force_n: at the rows, with it."""
        cell, conditions = plant.cell, self._grid.row_conditions
        reading = self._read_amplifier(plant, contact_n, force_n)
        for term in active_formulas(TERMS, cell, conditions):
            reading = term(cell, reading, conditions)
        if cell.zero_n != 0.0:
            reading = reading + cell.zero_n
        if cell.outlier_n != 0.0 and self._drive.outliers is not None:
            reading = reading + cell.outlier_n * self._drive.outliers
        if cell.sign_lost != 0.0:
            reading = lose_sign(cell, reading)
        if cell.quantum_n != 0.0 or cell.range_n < UNLIMITED:
            reading = _convert_reading(cell, reading)
        found[:] = reading if cell.repeated_share == 0.0 or self._shown is None else reading[self._shown]

    def _read_amplifier(self, plant: Plant, contact_n: Floats, force_n: Floats) -> Floats:
        """Behind the filter and by the logger's clock."""
        cell, grid = plant.cell, self._grid
        shifted = is_switched_on(cell, ("clock_offset_s", "clock_skew"))
        if cell.filter_s == 0.0 and not shifted:
            return force_n
        filtered = contact_n
        if cell.filter_s != 0.0:
            filtered = np.empty_like(contact_n)
            march_lag(cell.filter_s, contact_n[0], contact_n, grid.steps_s, filtered)
        if not shifted:
            return self._vibrating(plant, grid.at_rows(filtered), grid.row_conditions)
        shown_s = shown_time_s(cell, grid.row_s)
        return self._vibrating(plant, grid.at(filtered, shown_s), self._spindle_at(plant.contact, shown_s))

    def _spindle_at(self, contact: Contact, time_s: Floats) -> TwinConditions:
        """The spindle at other times; nothing else is looked at there."""
        known = self._grid.row_conditions
        if known.spindle_rpm is None or not active_formulas((SPINDLE,), contact, known):
            return TwinConditions()
        rpm, angle = (np.interp(time_s, self._grid.row_s, column) for column in (known.spindle_rpm, known.spindle_rad))
        return TwinConditions(spindle_rpm=rpm, spindle_rad=angle)

    def _vibrating(self, plant: Plant, filtered_n: Floats, conditions: TwinConditions) -> Floats:
        """Add the spindle's vibration as the filter lets it through."""
        contact, cell = plant.contact, plant.cell
        if not active_formulas((SPINDLE,), contact, conditions):
            return filtered_n
        frequency = conditions.spindle_rpm * (_RADIAN_PER_TURN / 60.0) * contact.spindle_order
        passed = 1.0 / np.sqrt(1.0 + (frequency * cell.filter_s) ** 2)
        late = np.arctan(frequency * cell.filter_s)
        angle = contact.spindle_order * conditions.spindle_rad + contact.spindle_phase_rad - late
        vibration: Floats = spindle_amplitude_n(contact, conditions.spindle_rpm) * passed * np.sin(angle)
        return filtered_n + vibration


def _convert_reading(cell: LoadCell, reading_n: Floats) -> Floats:
    """effects.load_cell.convert_reading, without looking for the range where it is out of reach."""
    reach_n = cell.range_n - cell.quantum_n
    if reading_n.max() > reach_n or reading_n.min() < -reach_n:
        return np.asarray(convert_reading(cell, reading_n))
    return np.asarray(quantise(reading_n, cell.quantum_n))


def _last_fresh(repeated: Flags) -> NDArray[np.intp]:
    """Index of the row whose reading each row shows."""
    own = np.arange(repeated.size)
    fresh = np.where(repeated, 0, own)
    return np.maximum.accumulate(fresh)
