"""Leave out of the readings of a force at rest the one that alone is far off.

A digit that was disturbed on a wire without a checksum, or a spike of an amplifier, is one reading. In a mean of twenty it is
1 N or more, and in the noise at rest so much that every stair seems settled and the rig's largest force near.
"""

from collections.abc import Sequence
from statistics import median
from typing import Final

LONE_N: Final = 3.0  # off the median: more than the usual noise, and than what a force still moves in so short a time
_ALONE: Final = 2.0  # times as far off as any other one: of much noise none is alone
_FEWEST: Final = 3


def find_lone_reading(forces_n: Sequence[float], lone_n: float = LONE_N) -> int | None:
    """Return the place of the reading, N, that alone is more than lone_n off the median; None where there is none."""
    if len(forces_n) < _FEWEST:
        return None
    middle_n = median(forces_n)
    away_n = [abs(force_n - middle_n) for force_n in forces_n]
    next_n, farthest_n = sorted(away_n)[-2:]
    return away_n.index(farthest_n) if farthest_n > lone_n and farthest_n > _ALONE * next_n else None


def without_lone_reading(forces_n: Sequence[float]) -> list[float]:
    """Return the readings, N, in their order, without the one that alone is far off, if there is one."""
    kept, lone = list(forces_n), find_lone_reading(forces_n)
    if lone is not None:
        del kept[lone]
    return kept
