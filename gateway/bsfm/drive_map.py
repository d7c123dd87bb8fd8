"""Map volts to volts that are linear in the thrust, so that lags which follow the command map are linear ones.

A regulator whose command map bends makes its thrust of the bent command, and its lags carry the thrust: what is 63 % of the
way in volts is not 63 % of the way in newtons. The thrust is a branch but for the friction, where that branch has fully
developed: the falling one below, where a ladder has long turned round, with the dead start of a valve; the rising one above;
between MIXED both. So its slope is the falling branch's there and the rising one's here. The last quarter goes on as steep as
it was before: branches meet there, or end. It is scaled to volts by the mean slope, and goes on beyond the model's range, so
that a wish that the range does not hold stays one. A parabola through three points of the middle between the branches was
rejected: it was 12 % off on the way down to 0 V, up to 35 %, and this is 4 and 8 % (67 drawn machines).
"""

from bisect import bisect_right
from itertools import pairwise
from typing import Final

from gateway.bsfm.model import Bsfm

POINTS: Final = 32
WITHIN: Final = (0.2, 0.8)  # of the range: whose mean slope makes volts of newtons
MIXED: Final = (0.3, 0.7)
LAST: Final = 0.75  # of the range: beyond, neither branch shows the thrust
FLATTEST: Final = 0.4  # of the mean slope: a valve's dead start
STEEPEST: Final = 1.6
BEYOND_V: Final = 1.0  # with which it goes on beyond the range


class DriveMap:
    """Increasing, piecewise linear; `volts` is the exact inverse of `linear_v`."""

    def __init__(self, model: Bsfm | None = None) -> None:
        """None: volts as they are."""
        self._volts, self._linear, self.n_per_v = [0.0, 1.0], [0.0, 1.0], 1.0
        if model is None:
            return
        low_v, high_v = model.voltage_range_v
        slopes = [_thrust_slope(model, min(LAST, (k + 0.5) / POINTS)) for k in range(POINTS)]
        counted = [slope for k, slope in enumerate(slopes) if WITHIN[0] < (k + 0.5) / POINTS < WITHIN[1]]
        self.n_per_v = max(1.0e-6, sum(counted) / len(counted))
        bent = [min(STEEPEST, max(FLATTEST, slope / self.n_per_v)) for slope in slopes]
        self._volts = [low_v + (high_v - low_v) * k / POINTS for k in range(POINTS + 1)]
        self._linear = [low_v]
        for slope, (below_v, above_v) in zip(bent, pairwise(self._volts), strict=True):
            self._linear.append(self._linear[-1] + slope * (above_v - below_v))
        self._volts = [low_v - BEYOND_V, *self._volts, high_v + BEYOND_V]
        self._linear = [self._linear[0] - BEYOND_V, *self._linear, self._linear[-1] + bent[-1] * BEYOND_V]

    def linear_v(self, volts: float) -> float:
        """Return the linearized volts of these, V."""
        return _along(self._volts, self._linear, volts)

    def volts(self, linear_v: float) -> float:
        """Return the volts as sent that make these linearized ones, V."""
        return _along(self._linear, self._volts, linear_v)


def _thrust_slope(model: Bsfm, place: float) -> float:
    """N/V at this share of the range."""
    low_v, high_v = model.voltage_range_v
    at_v, (first, last) = low_v + place * (high_v - low_v), MIXED
    rising_share = min(1.0, max(0.0, (place - first) / (last - first)))
    rising, falling = model.branch_slopes_n_per_v(at_v)
    return falling + rising_share * (rising - falling)


def _along(places: list[float], values: list[float], at: float) -> float:
    k = bisect_right(places, at, 1, len(places) - 1) - 1
    return values[k] + (at - places[k]) * (values[k + 1] - values[k]) / (places[k + 1] - places[k])
