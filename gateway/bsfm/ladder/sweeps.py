"""Split settled points by their sweeps, into whole groups and the minor-loop walk.

A sweep is a stretch in which the voltage goes one way. A group is a full sweep one way and a full one back; what follows
the last group with three sweeps or more is the minor-loop walk. A cycle with far fewer stairs than the others only settled
the friction. A loop's turning points belong to the sweep that reached them; a 0 V that ends one group begins the next, too.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.bsfm.fit.projected_problem import Floats
from gateway.bsfm.ladder.measured_ladder import FALLING, RISING, Ladder
from gateway.bsfm.ladder.settled_points import SAME_V, Points

FULL_SHARE: Final = 0.95  # of the span: a sweep from below 5 % to above it is full
COARSE_SHARE: Final = 0.7  # of the usual number of stairs: below it a cycle is no group
FEWEST_STAIRS: Final = 3  # each way, the turning point included
FEWEST_MINOR_SWEEPS: Final = 3


@dataclass(frozen=True, slots=True)
class Sweep:
    """Points first .. last (inclusive) in one direction; first is the turning point where it begins."""

    first: int
    last: int
    direction: int
    full: bool

    @property
    def stairs(self) -> int:
        """Number of stairs from the turning point on."""
        return self.last - self.first


@dataclass(frozen=True, slots=True, eq=False)
class SweepSplit:
    """What the sweeps show. ladder: whole groups; minor_v, minor_n: the walk of partial reversals, may be empty; rising,
    falling: stairs of all sweeps long enough; left_out: sentences about what is not in it."""

    ladder: Ladder | None
    minor_v: Floats
    minor_n: Floats
    rising: int
    falling: int
    left_out: tuple[str, ...]


def split_by_sweeps(points: Points) -> SweepSplit:
    """Split points into groups and minor loops. ladder is None where no whole group is found: `left_out`, `rising` and
    `falling` say why."""
    sweeps = _find_sweeps(points.voltage_v)
    fine, coarse = _without_coarse(sweeps)
    pairs, others = _pair_sweeps(fine)
    minor = _minor_sweeps(others, pairs)
    notes = [
        *_describe_coarse(coarse, points),
        *_describe_cut([sweep for sweep in others if sweep not in minor], points),
    ]
    walk = slice(minor[0].first, minor[-1].last + 1) if minor else slice(0, 0)
    return SweepSplit(
        _ladder(points, pairs) if pairs else None,
        points.voltage_v[walk],
        points.force_n[walk],
        _count(sweeps, RISING),
        _count(sweeps, FALLING),
        tuple(notes),
    )


def _find_sweeps(voltage_v: Floats) -> list[Sweep]:
    """Stretches of one direction. Where the turning point was read twice each run gets its own reading."""
    low, high = float(voltage_v.min()), float(voltage_v.max())
    margin_v = (1.0 - FULL_SHARE) * (high - low)
    ends_v = (low + margin_v, high - margin_v)
    sweeps: list[Sweep] = []
    first = direction = 0
    was_still = False
    for k, step_v in enumerate(np.diff(voltage_v).tolist(), start=1):
        way = 0 if abs(step_v) <= SAME_V else RISING if step_v > 0.0 else FALLING
        if way and way != direction:
            sweeps += [_sweep(voltage_v, first, k - 2 if was_still else k - 1, direction, ends_v)] if direction else []
            first, direction = k - 1, way
        was_still = way == 0
    return [*sweeps, _sweep(voltage_v, first, len(voltage_v) - 1, direction, ends_v)] if direction else []


def _sweep(voltage_v: Floats, first: int, last: int, direction: int, ends_v: tuple[float, float]) -> Sweep:
    bottom, top = (first, last) if direction == RISING else (last, first)
    full = bool(voltage_v[bottom] <= ends_v[0] and voltage_v[top] >= ends_v[1])
    return Sweep(first, last, direction, full and last - first >= FEWEST_STAIRS)


def _pair_sweeps(sweeps: list[Sweep]) -> tuple[list[tuple[Sweep, Sweep]], list[Sweep]]:
    """Full runs there and back, and the runs that are in no such pair."""
    pairs: list[tuple[Sweep, Sweep]] = []
    others: list[Sweep] = []
    k = 0
    while k < len(sweeps):
        if (
            k + 1 < len(sweeps)
            and sweeps[k].full
            and sweeps[k + 1].full
            and sweeps[k].direction != sweeps[k + 1].direction
        ):
            pairs.append((sweeps[k], sweeps[k + 1]))
            k += 2
        else:
            others.append(sweeps[k])
            k += 1
    return pairs, others


def _without_coarse(sweeps: list[Sweep]) -> tuple[list[Sweep], list[Sweep]]:
    """Sweeps without the full ones that have far fewer stairs than others of their direction, and those."""
    usual = {
        way: max((sweep.stairs for sweep in sweeps if sweep.full and sweep.direction == way), default=0)
        for way in (1, -1)
    }
    coarse = [sweep for sweep in sweeps if sweep.full and sweep.stairs < COARSE_SHARE * usual[sweep.direction]]
    return [sweep for sweep in sweeps if sweep not in coarse], coarse


def _describe_coarse(coarse: list[Sweep], points: Points) -> list[str]:
    if not coarse:
        return []
    stairs = sum(sweep.stairs for sweep in coarse)
    return [f"a coarse cycle of {stairs} stairs from row {points.row[coarse[0].first]} settled the friction: left out"]


def _minor_sweeps(others: list[Sweep], pairs: list[tuple[Sweep, Sweep]]) -> list[Sweep]:
    after = pairs[-1][1].last if pairs else -1
    walk = [sweep for sweep in others if sweep.first >= after]
    return walk if pairs and len(walk) >= FEWEST_MINOR_SWEEPS else []


def _describe_cut(sweeps: list[Sweep], points: Points) -> list[str]:
    return [
        f"from row {points.row[sweep.first]} the voltage goes {'up' if sweep.direction == RISING else 'down'} from "
        f"{points.voltage_v[sweep.first]:.3g} to {points.voltage_v[sweep.last]:.3g} V only: a group cut short, left out"
        for sweep in sweeps
    ]


def _ladder(points: Points, pairs: list[tuple[Sweep, Sweep]]) -> Ladder:
    index: list[int] = []
    direction: list[int] = []
    group: list[int] = []
    for number, (there, back) in enumerate(pairs):
        index += [*range(there.first, there.last + 1), *range(back.first + 1, back.last + 1)]
        direction += [there.direction] * (there.stairs + 1) + [back.direction] * back.stairs
        group += [number] * (there.stairs + back.stairs + 1)
    return Ladder(points.voltage_v[index], points.force_n[index], np.array(direction), np.array(group))


def _count(sweeps: list[Sweep], direction: int) -> int:
    return sum(sweep.stairs for sweep in sweeps if sweep.direction == direction and sweep.stairs >= FEWEST_STAIRS)
