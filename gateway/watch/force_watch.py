"""Whether the plant in use makes the force worse: its error now against the reference that was kept when it came into use.

Only what was asked of both runs is compared (gateway.diagnosis.force_error), in rows that are younger than the change. Two
looks in a row must show it, and by more than a share of the rig's band: less disturbs nobody. A look that has enough to
compare and does not show it takes the warning back. What a plant says of the load cell cannot be judged here: the readings
that would show it are the ones that it has changed.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from gateway.diagnosis.force_error import (
    FEWEST_BLOCKS,
    ForceChange,
    GainVerdict,
    commanded_force,
    compare_runs,
    error_blocks,
)
from gateway.plants.force_reference import ForceReference, read_reference
from gateway.watch.pushed_rows import pushed_rows

_LONGEST_S: Final = 300.0
"""Newest rows that are looked at: a machine that gets worse later is soon seen."""
_LOOKS_TO_BE_SURE: Final = 2
TOLERANCE_SHARE: Final = 0.25
"""Share of the rig's band: a smaller change of the force does not matter to whoever holds it."""


@dataclass(frozen=True, slots=True)
class PlantSince:
    """number: of the plant in use, 0 the rig's own; since_s: when it came into use, by the machine's monotonic clock."""

    number: int = 0
    since_s: float = 0.0


class ForceWatch:
    """Compares, look by look. tolerance_n: the rig's band, of which a quarter matters."""

    def __init__(self, state: Path, tolerance_n: float) -> None:
        self._state = state
        self._least_n = TOLERANCE_SHARE * tolerance_n
        self._plant = PlantSince()
        self._reference: ForceReference | None = None
        self._worse_in_a_row = 0
        self.sentence = ""

    def follow(self, plant: PlantSince) -> None:
        """Take note of the plant in use; another one than before has its own reference."""
        if plant == self._plant:
            return
        self._plant = plant
        self._reference = read_reference(self._state, plant.number) if plant.number else None
        self._worse_in_a_row, self.sentence = 0, ""

    def look(self, data: bytes, columns: tuple[str, ...]) -> None:
        """Look at the newest rows of the ring; `sentence` says what is worse, empty where nothing is."""
        if self._reference is None or not data:
            return
        rows = pushed_rows(data, columns)
        time_s = rows["time_s"]
        fresh = time_s >= max(self._plant.since_s, float(time_s[-1]) - _LONGEST_S) if time_s.size else np.zeros(0, bool)
        if fresh.sum() < 2:
            return
        rows = {name: values[fresh] for name, values in rows.items()}
        self._judge(self._reference, compare_runs(self._reference.blocks, error_blocks(commanded_force(rows))))

    def _judge(self, reference: ForceReference, change: ForceChange) -> None:
        if min(change.blocks) < FEWEST_BLOCKS:
            return
        is_worse = change.verdict is GainVerdict.WORSE and -change.gain_n >= self._least_n
        self._worse_in_a_row = self._worse_in_a_row + 1 if is_worse else 0
        if not is_worse:
            self.sentence = ""
        elif self._worse_in_a_row >= _LOOKS_TO_BE_SURE:
            self.sentence = _sentence(self._plant.number, reference, change)


def _sentence(number: int, reference: ForceReference, change: ForceChange) -> str:
    before = f"plant {reference.plant_before}" if reference.plant_before else "the rig's own plant"
    low, high = change.ratio_ci95
    return (
        f"since plant {number} is in use the force is {change.after_rms_n:.2f} N (rms) off what is commanded, with {before} "
        f"it was {change.before_rms_n:.2f} N ({reference.recording}): {change.ratio:.1f} times, "
        f"95 % interval {low:.1f} .. {high:.1f}; force-gateway plant rollback goes back"
    )
