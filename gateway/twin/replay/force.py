"""Replay, stage 3: from the slide's force to the contact force, one plant at a time (a minute is 96 kB: it stays in cache).

Backlash and creep run from point to point of the grid; the other terms of contact and tool are slow and go with them. The
spindle is faster than the rows, so it is added at their own times instead.
"""

import numpy as np

from gateway.twin.effects.contact import SLOW, SPINDLE
from gateway.twin.effects.term import active_formulas
from gateway.twin.replay.drive import Floats
from gateway.twin.replay.grid import Grid
from gateway.twin.replay.loops import march_lag, march_play
from gateway.twin.sections import Contact


class Forces:
    """Contact force of a plant on the grid and at the rows."""

    def __init__(self, grid: Grid) -> None:
        self._grid = grid

    def on_grid(self, contact: Contact, slide_n: Floats, creep_n: float = 0.0) -> Floats:
        """Return the contact force on the grid without the spindle, N; the slide's own array when there is nothing to add.

        creep_n: see StartState.
        """
        force = slide_n
        if contact.backlash_n != 0.0:
            force = np.empty_like(slide_n)
            march_play(contact.backlash_n, 0.0, slide_n, force)
        if contact.creep_share != 0.0:
            late = np.empty_like(force)
            march_lag(contact.creep_s, force[0] + creep_n, force, self._grid.steps_s, late)
            force = force + contact.creep_share * late
        for term in active_formulas(SLOW, contact, self._grid.conditions):
            force = term(contact, force, self._grid.conditions)
        return force

    def at_rows(self, contact: Contact, contact_n: Floats, found: Floats) -> None:
        """Fill in the contact force at the rows, (rows,), spindle included, N."""
        found[:] = self._grid.at_rows(contact_n)
        conditions = self._grid.row_conditions
        for term in active_formulas((SPINDLE,), contact, conditions):
            found[:] = term(contact, found, conditions)
