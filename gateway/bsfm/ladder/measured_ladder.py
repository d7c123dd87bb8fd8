"""The calibration staircase: what came back from it. Which voltages to visit is gateway.bsfm.ladder.plan's, without numpy.

The paper's ladder is 0 -> 5 -> 0 V in 0.1 V steps, 101 points, ten groups. The top counts as rising, the last 0 V as
falling: with tied ends both branches pass through them anyway.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gateway.bsfm.ladder.plan import FALLING, RISING, LadderPlan, ladder_plan

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
__all__ = ["FALLING", "RISING", "Floats", "Integers", "Ladder", "LadderPlan", "ladder_plan"]


@dataclass(frozen=True, slots=True, eq=False)
class Ladder:
    """Settled readings: arrays of equal length (N,). weight: relative trust in each sample, None for equal trust.

    ValueError on lengths that differ, anything not finite, directions other than +1 and -1, weights that are not
    positive.
    """

    voltage_v: Floats
    force_n: Floats
    direction: Integers
    group: Integers
    weight: Floats | None = None

    def __post_init__(self) -> None:
        for name, kind in (
            ("voltage_v", np.float64),
            ("force_n", np.float64),
            ("direction", np.int64),
            ("group", np.int64),
        ):
            object.__setattr__(self, name, _column(name, getattr(self, name), kind))
        if self.weight is not None:
            object.__setattr__(self, "weight", _column("weight", self.weight, np.float64))
        _check(self)

    @classmethod
    def from_rows(cls, rows: Iterable[Sequence[float]]) -> "Ladder":
        """Build a ladder from rows of voltage, force, direction, group."""
        voltage, force, direction, group = zip(*rows, strict=True)
        return cls(np.array(voltage), np.array(force), np.array(direction), np.array(group))

    def __len__(self) -> int:
        return len(self.voltage_v)

    @property
    def groups(self) -> tuple[int, ...]:
        """Numbers of the groups, ascending."""
        return tuple(int(group) for group in np.unique(self.group))

    def part(self, mask: NDArray[np.bool_]) -> "Ladder":
        """Return the samples where mask is true."""
        weight = None if self.weight is None else self.weight[mask]
        return Ladder(self.voltage_v[mask], self.force_n[mask], self.direction[mask], self.group[mask], weight)


def _column(name: str, values: Any, kind: type[np.generic]) -> NDArray[Any]:
    array = np.asarray(values)
    if array.ndim != 1 or not np.all(np.isfinite(array)):
        raise ValueError(f"ladder {name}: one finite number per sample is needed")
    column = array.astype(kind)
    if not np.array_equal(column, array):
        raise ValueError(f"ladder {name}: whole numbers are needed")
    column.flags.writeable = False
    return column


def _check(ladder: Ladder) -> None:
    columns = [ladder.voltage_v, ladder.force_n, ladder.direction, ladder.group]
    columns += [] if ladder.weight is None else [ladder.weight]
    lengths = {len(column) for column in columns}
    if len(lengths) != 1 or lengths == {0}:
        raise ValueError("ladder: columns of one length, not empty, are needed")
    if not np.all(np.abs(ladder.direction) == 1):
        raise ValueError("ladder direction: +1 (rising) or -1 (falling) is needed")
    if ladder.weight is not None and not np.all(ladder.weight > 0.0):
        raise ValueError("ladder weight: positive numbers are needed")
