"""Replay, stage 3: from the slide's force to the contact force, one plant at a time (a minute is 96 kB: it stays in cache).

Backlash and creep run from point to point of the grid; the other terms of contact and tool are slow and go with them. The
spindle is faster than the rows, so it is added at their own times instead.
"""

import numpy as np

from gateway.twin.effects.contact import SLOW, SPINDLE
from gateway.twin.effects.term import active_formulas
from gateway.twin.replay.drive import Floats
from gateway.twin.replay.grid import Grid
from gateway.twin.replay.lags import follow_lag
from gateway.twin.sections import Contact


class Forces:
    """Contact force of a plant on the grid and at the rows."""

    def __init__(self, grid: Grid) -> None:
        self._grid = grid

    def on_grid(self, contact: Contact, slide_n: Floats) -> Floats:
        """Contact force on the grid without the spindle, N; the slide's own array when there is nothing to add."""
        force = slide_n
        if contact.backlash_n != 0.0:
            force = _backlash(force, contact.backlash_n)
        if contact.creep_share != 0.0:
            force = force + contact.creep_share * follow_lag(force, contact.creep_s, self._grid.steps_s)
        for term in active_formulas(SLOW, contact, self._grid.conditions):
            force = term(contact, force, self._grid.conditions)
        return force

    def at_rows(self, contact: Contact, contact_n: Floats, found: Floats) -> None:
        """Contact force at the rows, spindle included, N."""
        found[:] = self._grid.at_rows(contact_n)
        conditions = self._grid.row_conditions
        for term in active_formulas((SPINDLE,), contact, conditions):
            found[:] = term(contact, found, conditions)


def _backlash(force_n: Floats, width_n: float) -> Floats:
    """regulator.play over a series, from 0."""
    state, found = 0.0, []
    half = 0.5 * width_n
    for low, high in zip((force_n - half).tolist(), (force_n + half).tolist(), strict=True):
        state = low if state < low else high if state > high else state
        found.append(state)
    return np.array(found)
