"""Straighten the load cell's reading: back to the force that made it.

The cell reads  (F + q F^2 + c F^3) (1 + span (T - T0)) + zero (T - T0) + crosstalk x command voltage + its constant zero:
the terms of the twin's load cell, in their order. The constant zero stays in the result, for the tare takes it.
"""

from dataclasses import dataclass
from functools import cache
from math import inf, isfinite, sqrt
from typing import Final

COMPENSATED_CELL_TERMS: Final = ("quadratic_per_n", "cubic_per_n2", "span_per_k", "zero_n_per_k", "crosstalk_n_per_v")
"""Numbers of a plant's cell that a map takes back; each is 0 where it leaves one."""
_ROUNDS: Final = 20
_CLOSE_N: Final = 1.0e-9
_FLATTEST: Final = 0.2  # slope of the bent reading below which it tells no force any more


@dataclass(frozen=True, slots=True, kw_only=True)
class CellMap:
    """Coefficients as in a plant's `cell`; zero_n: the constant one, known only so that the bend has its origin."""

    quadratic_per_n: float = 0.0
    cubic_per_n2: float = 0.0
    span_per_k: float = 0.0
    zero_n_per_k: float = 0.0
    reference_c: float = 20.0
    crosstalk_n_per_v: float = 0.0
    zero_n: float = 0.0

    def force_n(self, reading_n: float, temperature_c: float, voltage_v: float) -> float:
        """Return the force that made a reading, N. temperature_c nan: taken as the reference; voltage_v: on the output when
        the reading was taken."""
        away_k = self._away_k(temperature_c)
        bent_n = reading_n - self.zero_n - self.zero_n_per_k * away_k - self.crosstalk_n_per_v * voltage_v
        bent_n /= max(_FLATTEST, 1.0 + self.span_per_k * away_k)
        return self._straight_n(bent_n) + self.zero_n

    def reading_n(self, force_n: float, temperature_c: float, voltage_v: float) -> float:
        """Return the reading of which `force_n` makes this force, N: the other way, its constant zero in the force as well."""
        away_k = self._away_k(temperature_c)
        disturbed_n = self.zero_n + self.zero_n_per_k * away_k + self.crosstalk_n_per_v * voltage_v
        return self._bent_n(force_n - self.zero_n) * (1.0 + self.span_per_k * away_k) + disturbed_n

    def _away_k(self, temperature_c: float) -> float:
        return temperature_c - self.reference_c if isfinite(temperature_c) else 0.0

    def _straight_n(self, bent_n: float) -> float:
        """Newton between the places where the curve turns flat; beyond them on along its last slope, for an overload must
        stay one."""
        if (self.quadratic_per_n == 0.0 and self.cubic_per_n2 == 0.0) or not isfinite(bent_n):
            return bent_n
        low_n, high_n = _steep_range_n(self.quadratic_per_n, self.cubic_per_n2)
        end_n = high_n if bent_n > 0.0 else low_n
        if isfinite(end_n) and abs(bent_n) > abs(self._bent_n(end_n)):
            return end_n + (bent_n - self._bent_n(end_n)) / _FLATTEST
        force_n = max(low_n, min(high_n, bent_n))
        for _ in range(_ROUNDS):
            off_n = self._bent_n(force_n) - bent_n
            if abs(off_n) < _CLOSE_N:
                break
            force_n = max(low_n, min(high_n, force_n - off_n / self._slope(force_n)))
        return force_n

    def _bent_n(self, force_n: float) -> float:
        return force_n + (self.quadratic_per_n + self.cubic_per_n2 * force_n) * force_n * force_n

    def _slope(self, force_n: float) -> float:
        return max(_FLATTEST, 1.0 + (2.0 * self.quadratic_per_n + 3.0 * self.cubic_per_n2 * force_n) * force_n)


@cache
def _steep_range_n(quadratic: float, cubic: float) -> tuple[float, float]:
    """Around 0 where the slope is above _FLATTEST: up to the nearest roots of 3 c F^2 + 2 q F + 1 - _FLATTEST."""
    above = 1.0 - _FLATTEST
    inside = quadratic * quadratic - 3.0 * cubic * above
    if inside < 0.0:
        return -inf, inf
    larger = -quadratic - sqrt(inside) if quadratic > 0.0 else -quadratic + sqrt(inside)
    roots_n = [above / larger] if larger else []
    roots_n += [larger / (3.0 * cubic)] if cubic else []
    low_n = max((root_n for root_n in roots_n if root_n < 0.0), default=-inf)
    return low_n, min((root_n for root_n in roots_n if root_n > 0.0), default=inf)
