"""What was measured, as the diagnosis takes it: one recording, checked, in SI units where the model needs them.

The columns of the contract that drive the model or are judged stand by themselves; everything else is a covariate under
the name and in the unit that its column has (temperature_c, supply_kpa, ...). `command_v` of a row holds from its time
until the next row; `force_n` of a row was read before its command acted.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Flags: TypeAlias = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Settings:
    """What was sent to the regulator, (settings,) each: from when it stood on the line, s, and which voltage."""

    times_s: Floats
    volts: Floats

    def interval_means(self, edges_s: Floats) -> Floats:
        """Return the mean between each edge and the next of what stood; before the first time the first voltage."""
        first_s, last_s = min(edges_s[0], self.times_s[0]), max(edges_s[-1], self.times_s[-1])
        knots_s = np.concatenate([[first_s - 1.0], self.times_s, [last_s + 1.0]])
        held = np.concatenate([self.volts[:1], self.volts])
        integral = np.concatenate([[0.0], np.cumsum(held * np.diff(knots_s))])
        return np.asarray(np.diff(np.interp(edges_s, knots_s, integral)) / np.diff(edges_s))


@dataclass(frozen=True, slots=True, kw_only=True)
class Measurement:
    """One recording. All arrays have the shape (rows,); rows are in order of time, which strictly rises from 0.

    usable: rows whose force may be judged (a finite, valid reading, and a drive that is known at that time).
    repeated: rows whose reading is exactly the one before, where that is no chance (see the reader).
    even_s: distance of rows that the reader has made even, s, 0 where they are as recorded; jitter_s: how far the readings'
    own times were scattered about such rows (standard deviation). sent: the settings that such rows' commands are the means
    of, at times as in time_s; None where they are not known one by one.
    """

    name: str
    time_s: Floats
    force_n: Floats
    usable: Flags
    repeated: Flags
    command_v: Floats | None = None
    pressure_pa: Floats | None = None
    position_m: Floats | None = None
    covariates: Mapping[str, Floats] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    even_s: float = 0.0
    jitter_s: float = 0.0
    sent: Settings | None = None

    @property
    def rows(self) -> int:
        """Number of rows."""
        return int(self.time_s.size)

    @property
    def duration_s(self) -> float:
        """Time from the first row to the last."""
        return float(self.time_s[-1]) if self.rows else 0.0
