"""The load cell and its amplifier: filter in each step; noise, zero, saturation and steps when a reading is taken."""

import numpy as np
from numpy.random import Generator

from gateway.twin.elementwise import Real, clip, quantised
from gateway.twin.plant import LoadCell
from gateway.twin.regulator import lag_factor


class LoadCellState:
    """What the amplifier makes of the contact force."""

    def __init__(self, cell: LoadCell, step_s: float, zero: Real) -> None:
        self._cell = cell
        self._lag = lag_factor(cell.filter_s, step_s) if np.any(cell.filter_s) else None
        self._noisy = bool(np.any(cell.noise_n))
        self._zero = zero
        self.filtered_n: Real = zero
        self.sign = 1.0

    def step(self, force_n: Real) -> None:
        """Follow the contact force for one step."""
        self.filtered_n = force_n if self._lag is None else self.filtered_n + self._lag * (force_n - self.filtered_n)

    def read(self, rng: Generator) -> Real:
        """One reading, N, with the sign of the wiring. The noise is the same draw for all lanes, as one rig's is."""
        cell = self._cell
        force = self.filtered_n + cell.zero_n
        if self._noisy:
            force = force + cell.noise_n * float(rng.standard_normal())
        force = clip(self.sign * force, -cell.range_n, cell.range_n)
        return clip(quantised(force, cell.quantum_n), -cell.range_n, cell.range_n)
