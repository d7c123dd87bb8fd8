"""Map volts to volts that are linear in the thrust, so that lags which follow the command map are linear ones.

A regulator whose command map bends makes its thrust of the bent command, and its lags carry the thrust: what is 63 % of the
way in volts is not 63 % of the way in newtons. The middle between a model's branches is the thrust but for the friction, away
from the ends, where the branches meet. A parabola through three points of it tells the bow, and no more of it is believed: a
push that is reckoned with too flat a map ends beyond its wish, and friction keeps the force there. It is scaled to volts by
the mean slope, and goes on with that beyond the model's range, so that a wish that the range does not hold stays one. A map
that is flatter at its upper end goes on as flat: pushes go there, and one reckoned with the mean slope falls short of its wish.
"""

from bisect import bisect_right
from itertools import pairwise
from typing import Final

from gateway.bsfm.model import Bsfm

POINTS: Final = 32
WITHIN: Final = (0.2, 0.5, 0.8)  # of the range: where the middle between the branches is the thrust
FLATTEST: Final = 0.8  # of the mean slope, as far as a bow is believed: rather too steep a map than too flat a one
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
        range_v = high_v - low_v
        first_n, middle_n, last_n = (model.force_n(low_v + share * range_v, 0.0) for share in WITHIN)
        half_v = 0.5 * (WITHIN[2] - WITHIN[0]) * range_v
        mean = (last_n - first_n) / (2.0 * half_v)
        bend = (last_n - 2.0 * middle_n + first_n) / (half_v * half_v)
        self.n_per_v = max(1.0e-6, mean)
        self._volts = [low_v + range_v * k / POINTS for k in range(POINTS + 1)]
        self._linear = [low_v]
        for below_v, above_v in pairwise(self._volts):
            away_v = 0.5 * (below_v + above_v) - (low_v + WITHIN[1] * range_v)
            slope = min(STEEPEST, max(FLATTEST, 1.0 + bend * away_v / self.n_per_v))
            self._linear.append(self._linear[-1] + slope * (above_v - below_v))
        top_slope = (self._linear[-1] - self._linear[-2]) * POINTS / range_v
        beyond = min(
            1.0, top_slope
        )  # a map that flattens goes on as flat, one that steepens no steeper than on average
        self._volts = [low_v - BEYOND_V, *self._volts, high_v + BEYOND_V]
        self._linear = [self._linear[0] - BEYOND_V, *self._linear, self._linear[-1] + beyond * BEYOND_V]

    def linear_v(self, volts: float) -> float:
        """Return the linearized volts of these, V."""
        return _along(self._volts, self._linear, volts)

    def volts(self, linear_v: float) -> float:
        """Return the volts as sent that make these linearized ones, V."""
        return _along(self._linear, self._volts, linear_v)


def _along(places: list[float], values: list[float], at: float) -> float:
    k = bisect_right(places, at, 1, len(places) - 1) - 1
    return values[k] + (at - places[k]) * (values[k + 1] - values[k]) / (places[k + 1] - places[k])
