"""The twin run over a recording: the readings that a plant would have given for the commands that were really sent.

Made for a search that tries hundreds of plants on one recording, so it differs from `Twin` in how, not in what:
    - quasi-static: mass and pad damping are left out (they are faster than a recording's rows; the weight stays);
    - from row to row, in steps of about 5 ms at most, instead of 1 ms. Lags and delays are exact and smooth for commands
      and rows at any times (the twin's second lag leads by half of its own step);
    - no noise; the null value of a random effect (repeats, outliers) is told apart by rows that the caller names.
Work is shared: plants with equal regulators share a pressure, those with equal friction besides share a slide, within a
call and between calls. The stages stand beside this file, each on the points of grid.py: regulator.py, slide.py, force.py,
reading.py.
The state before the first row is rest under the command `before_v`; what lags, friction and pad remember there may be given.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from gateway.twin.plant import Plant, plain
from gateway.twin.replay.drive import AT_REST, Drive, Floats, StartState
from gateway.twin.replay.force import Forces
from gateway.twin.replay.grid import MOST_STEPS, Grid
from gateway.twin.replay.reading import Readings
from gateway.twin.replay.regulator import Pressures
from gateway.twin.replay.slide import Slides

__all__ = ["Drive", "Replay", "ReplayResult"]


@dataclass(frozen=True, slots=True, eq=False)
class ReplayResult:
    """What each plant gives at the rows' times, shape (plants, rows). force_n: true contact force; reading_n: recorded.

    pressure_pa: one series (rows,) for each plant; plants with equal regulators share theirs.
    """

    reading_n: Floats
    force_n: Floats
    pressure_pa: Sequence[Floats]


@dataclass(slots=True, eq=False)
class Replay:
    """One recording, ready to be run with any plants. step_s: about that of the grid; None: as fine as the rows, at most 5 ms,
    but no more than most_steps in all.

    notes: what was done to the recording, in sentences.
    """

    drive: Drive
    step_s: float | None = None
    most_steps: int = MOST_STEPS
    grid: Grid = field(init=False)
    _pressures: Pressures = field(init=False)
    _slides: Slides = field(init=False)
    _forces: Forces = field(init=False)
    _readings: Readings = field(init=False)

    def __post_init__(self) -> None:
        self.grid = Grid(self.drive, self.step_s, self.most_steps)
        self._pressures = Pressures(self.drive, self.grid)
        self._slides = Slides(self.drive, self.grid)
        self._forces = Forces(self.grid)
        self._readings = Readings(self.drive, self.grid)

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on what was done to the recording."""
        return self.grid.notes

    def run(self, plants: Sequence[Plant], starts: Sequence[StartState] | None = None) -> ReplayResult:
        """Replay the recording with each plant. ValueError when there is none.

        starts: what each plant remembers at the first row; None: rest without pressure.
        """
        if not plants:
            raise ValueError("a replay needs at least one plant")
        plants, starts = [plain(plant) for plant in plants], starts or [AT_REST] * len(plants)
        pressures, which = self._pressures.of([plant.regulator for plant in plants], starts)
        slides = self._slides.of(plants, pressures, which, starts)
        force = np.empty((len(plants), self.grid.rows))
        reading = np.empty_like(force)
        for lane, (plant, slide_n) in enumerate(zip(plants, slides, strict=True)):
            contact_n = self._forces.on_grid(plant.contact, slide_n, starts[lane].creep_n)
            self._forces.at_rows(plant.contact, contact_n, force[lane])
            self._readings.fill(plant, contact_n, force[lane], reading[lane])
        return ReplayResult(reading, force, [self.grid.at_rows(pressures[place]) for place in which])
