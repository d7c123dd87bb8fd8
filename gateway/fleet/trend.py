"""The trend of a few values over days: a slope that single bad days do not move, and the chance of one as steep.

Slope: the median of the slopes between any two days (Theil, Sen 1968). Chance: twice the smaller of two, which together are no
more often small than they say. Student's t of least squares sees a small trend in few clean days; Kendall's rank test is exact
and sees one through bad days. A tie counts for neither direction, so that many equal values prove nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import sqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray

LEAST_DAYS: Final = 4  # a line through three has one degree of freedom: nothing is small enough
_INTERVAL: Final = 0.95

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Trend:
    """Slope in N per day with its 95 % interval (of 4 days: 92 %, no ranks tell more), and the chance of one as steep without
    a trend."""

    slope_n_per_day: float
    low: float
    high: float
    chance: float


def fit_trend(days: Sequence[float], values: Sequence[float]) -> Trend | None:
    """Return the trend; None where too few days are known."""
    x, y = np.asarray(days, float), np.asarray(values, float)
    if len(x) < LEAST_DAYS or len(set(days)) < len(x):
        return None
    first, second = np.triu_indices(len(x), 1)
    slopes = np.sort((y[second] - y[first]) / (x[second] - x[first]))
    outside = _pairs_outside(len(x))
    chance = min(1.0, 2.0 * min(_chance_by_line(x, y), _chance_by_ranks(slopes, len(x))))
    return Trend(float(np.median(slopes)), float(slopes[outside]), float(slopes[-1 - outside]), chance)


def level_of(trend: Trend, days: Sequence[float], values: Sequence[float]) -> float:
    """Return the line's value at day 0: half of the days lie above it."""
    return float(np.median(np.asarray(values) - trend.slope_n_per_day * np.asarray(days)))


def _chance_by_line(x: Floats, y: Floats) -> float:
    from scipy.special import stdtr

    freedom, centred = len(x) - 2, x - x.mean()
    slope = float(centred @ y / (centred @ centred))
    left = y - y.mean() - slope * centred
    error = sqrt(float(left @ left) / freedom / float(centred @ centred))
    return float(2.0 * stdtr(freedom, -abs(slope) / error)) if error > 0.0 else float(slope == 0.0)


def _chance_by_ranks(slopes: Floats, days: int) -> float:
    """Kendall's test, exact: of all orders of the days, the share with as many more rises than falls, or falls than rises."""
    excess = abs(int(np.sum(np.sign(slopes))))
    falls_at_most = (len(slopes) - excess) // 2
    return min(1.0, 2.0 * float(np.sum(_shares_by_falls(days)[: falls_at_most + 1])))


def _pairs_outside(days: int) -> int:
    """Return how many slopes at either end lie outside the interval."""
    allowed = np.searchsorted(np.cumsum(_shares_by_falls(days)), 0.5 * (1.0 - _INTERVAL), side="right")
    return max(0, int(allowed) - 1)


@cache
def _shares_by_falls(days: int) -> Floats:
    """Return which share of the orders of so many days has 0, 1, 2 ... pairs that fall."""
    shares = np.ones(1)
    for size in range(2, days + 1):
        # a further day falls below 0 .. size - 1 of those before: a mean over so many places
        sums = np.cumsum(np.pad(shares, (0, size - 1)))
        shares = np.maximum(sums - np.pad(sums, (size, 0))[: len(sums)], 0.0) / size
    return shares
