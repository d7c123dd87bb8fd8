"""What drives a replay: the columns of a recording, checked."""

from dataclasses import dataclass
from typing import Final, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gateway.twin.surroundings import COLUMNS, UNKNOWN, Surroundings

Floats: TypeAlias = NDArray[np.float64]
Flags: TypeAlias = NDArray[np.bool_]
Strains: TypeAlias = tuple[float, float, float]
"""What friction remembers, -1..1 for each of its three elements, the stiffest first.

The first is the stiffest element's strain; each further one how an element stands beyond the one before it, as a share of
what it may: d z = d' z' + (d - d') u. So any three numbers are a state that some history leaves, all 1 is the rising branch,
and a reversal turns the first number first."""


class StartState(NamedTuple):
    """What a machine remembers when its first row comes.

    strains: of friction; None: it was at rest without pressure before. ahead_pa: what the pressure behind the first lag has
    to fall until it is that of the first command (below 0: to rise); second_ahead_pa: how far that behind a second lag is
    above it; coming_pa: what is under way in the delay, above the first command's. stiction_share: of the full stiction, what
    rest has grown already, 0..1. creep_n: what the pad's creep follows is so far above the first force.
    """

    strains: Strains | None = None
    ahead_pa: float = 0.0
    second_ahead_pa: float = 0.0
    coming_pa: float = 0.0
    stiction_share: float = 0.0
    creep_n: float = 0.0


AT_REST: Final = StartState()
Motion: TypeAlias = Literal["inferred", "measured", "measured-reversed"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drive:
    """One recording's inputs; arrays have the shape (rows,). ValueError when they do not fit or are not finite.

    time_s: rising, first 0. command_v: of a row, holds from its time until the next row; the force of a row is read
    before it acts. pressure_pa: drives the cylinder where there is no command. position_m: the slide's, for the motions
    "measured" (it grows outward) and "measured-reversed": friction follows it, and the pad is left out.
    position_noise_m: standard deviation; friction elements are made so wide that it does not move them.
    repeated: rows known to repeat the reading before. outliers: spike of each row, in units of the cell's outlier_n.
    before_v: command for a long time before the first row; None: that of the first row.
    """

    time_s: Floats
    command_v: Floats | None = None
    pressure_pa: Floats | None = None
    position_m: Floats | None = None
    motion: Motion = "inferred"
    position_noise_m: float = 0.0
    surroundings: Surroundings = UNKNOWN
    repeated: Flags | None = None
    outliers: Floats | None = None
    before_v: float | None = 0.0

    def __post_init__(self) -> None:
        if self.time_s.ndim != 1 or self.time_s.size < 2 or self.time_s[0] != 0.0:
            raise ValueError("time_s must have at least two rows and start at 0")
        if not np.all(np.diff(self.time_s) > 0.0):
            raise ValueError("time_s must rise from row to row")
        if self.command_v is None and self.pressure_pa is None:
            raise ValueError("a replay is driven by command_v or by pressure_pa")
        if self.motion != "inferred" and self.position_m is None:
            raise ValueError("measured motion needs position_m")
        self._check()

    def _check(self) -> None:
        names = ("time_s", "command_v", "pressure_pa", "position_m", "repeated", "outliers")
        columns = {name: getattr(self, name) for name in names}
        columns |= {name: getattr(self.surroundings, name) for name in COLUMNS}
        for name, column in columns.items():
            if column is not None and np.shape(column) not in ((), self.time_s.shape):
                raise ValueError(f"{name} has the shape {np.shape(column)}, time_s has {self.time_s.shape}")
            if column is not None and not np.all(np.isfinite(column)):
                raise ValueError(f"{name} is not finite in row {int(np.argmin(np.isfinite(column)))}")
