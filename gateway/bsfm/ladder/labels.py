"""What the recording of our own run says about its rows: which stair each command belongs to, of which group and part.

A table from elsewhere has to be taken apart by its shape (sweeps.py), which is a guess: a run that was cut in its first
group leaves nothing but the coarse cycle of the check as a whole loop. Our recorder writes the columns LABELS, so that nothing
is guessed. A stair is finished where a later row has a later stair; a group is whole where all of its stairs are.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.bsfm.fit.projected_problem import Floats
from gateway.bsfm.ladder.measured_ladder import FALLING, RISING, Ladder
from gateway.bsfm.ladder.plan import LABELS, RESPONSE_GROUP
from gateway.bsfm.ladder.settled_points import Points

CHECK, WALK, DONE = 2, 4, 5  # of CalibrationPhase, which this room cannot import; a test compares
NO_GROUP: Final = -1

Integers = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Labels:
    """phase, group and stair of each row (N,)."""

    phase: Integers
    group: Integers
    stair: Integers

    @classmethod
    def of(cls, columns: Mapping[str, Floats]) -> "Labels | None":
        """Return the labels of a table; None where it has none, or not on every row."""
        if not set(LABELS) <= set(columns):
            return None
        label_columns = [columns[name] for name in LABELS]
        if not all(len(column) and np.isfinite(column).all() for column in label_columns):
            return None
        return cls(*(column.astype(np.int64) for column in label_columns))

    def part(self, keep: NDArray[np.bool_] | Integers) -> "Labels":
        """Return the labels of the rows to keep."""
        return Labels(self.phase[keep], self.group[keep], self.stair[keep])

    @property
    def last_stair(self) -> int:
        """Number of the newest stair."""
        return int(self.stair.max())

    def stairs_of(self, mask: NDArray[np.bool_]) -> Integers:
        """Return the stairs in these rows if they are whole: none missing between, and the last one was left. Empty
        otherwise."""
        stairs = np.unique(self.stair[mask])
        whole = len(stairs) > 0 and stairs[-1] - stairs[0] == len(stairs) - 1 and stairs[-1] < self.last_stair
        return stairs if whole else stairs[:0]

    @property
    def whole_groups(self) -> list[int]:
        """Numbers of the groups of which no stair is missing."""
        groups = np.unique(self.group[self.group > NO_GROUP])
        return [int(group) for group in groups if len(self.stairs_of(self.group == group))]

    @property
    def cut_groups(self) -> list[int]:
        """Numbers of the groups that were begun and not finished."""
        whole = self.whole_groups
        return [int(group) for group in np.unique(self.group[self.group > NO_GROUP]) if group not in whole]

    @property
    def is_finished(self) -> bool:
        """The run has come to its own end: its last stair was left, too."""
        return bool((self.phase == DONE).any())

    @property
    def walk_stairs(self) -> Integers:
        """Stairs of the reversal part that are points of the fit, if it is whole; empty otherwise."""
        whole = self.stairs_of(self.phase == WALK)
        return whole[~np.isin(whole, self.stair[self.group == RESPONSE_GROUP])]

    @property
    def has_walk(self) -> bool:
        """The reversal part is whole."""
        return len(self.walk_stairs) > 0


@dataclass(frozen=True, slots=True, eq=False)
class LabelSplit:
    """What the labels show. ladder: whole groups, or the check's cycle where it is asked for; None where there are none."""

    ladder: Ladder | None
    minor_v: Floats
    minor_n: Floats
    left_out: tuple[str, ...]


def split_by_labels(points: Points, labels: Labels, *, by_check: bool) -> LabelSplit:
    """Return the points of a labelled recording. labels: of its rows; by_check: of a run that had only the reversal part
    left."""
    at = {int(labels.stair[row]): k for k, row in enumerate(points.row.tolist())}  # the last point of a stair counts
    masks = [labels.phase == CHECK] if by_check else [labels.group == group for group in labels.whole_groups]
    groups = [[at[stair] for stair in labels.stairs_of(mask).tolist() if stair in at] for mask in masks]
    walk = [at[stair] for stair in labels.walk_stairs.tolist() if stair in at]
    walk = (
        [*range(walk[0] - 1, walk[0]), *walk] if walk and walk[0] > 0 else walk
    )  # its first point says where it began
    return LabelSplit(_ladder(points, groups), points.voltage_v[walk], points.force_n[walk], _describe_left_out(labels))


def _ladder(points: Points, groups: list[list[int]]) -> Ladder | None:
    groups = [group for group in groups if group]
    if not groups:
        return None
    index = [k for group in groups for k in group]
    ways = [_directions(points.voltage_v[group]) for group in groups]
    number = [k for k, group in enumerate(groups) for _ in group]
    return Ladder(points.voltage_v[index], points.force_n[index], np.concatenate(ways), np.array(number))


def _directions(voltage_v: Floats) -> Integers:
    """Up to the top, which counts as rising, and down again."""
    rising = np.arange(len(voltage_v)) <= int(np.argmax(voltage_v))
    return np.where(rising, RISING, FALLING)


def _describe_left_out(labels: Labels) -> tuple[str, ...]:
    notes = [
        f"group {group + 1} was cut after {len(np.unique(labels.stair[labels.group == group]))} stairs: left out"
        for group in labels.cut_groups
    ]
    begun = (labels.phase == WALK).any()
    return (*notes, *(["the reversal part was cut: left out"] if begun and not labels.has_walk else []))
