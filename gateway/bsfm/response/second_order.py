"""Two lags in series, or a pair of complex poles, as one second-order low-pass: what is left of a distance from rest.

Its states are the output (`second`) and `first = second + b * speed`, with b the shorter lag (half the sum of both, where the
poles are complex): for real lags that is what stands behind the first. The general form has 0/0 for equal lags; whoever asks
for those takes them a little apart.
"""

from dataclasses import dataclass
from math import cos, exp, sin, sqrt
from typing import NamedTuple

RINGS_BELOW = 1.0  # damping of two equal lags


class Transition(NamedTuple):
    """What both states' distances from a held input are after a time: first = ff * first + fs * second, second = sf * first +
    ss * second."""

    ff: float
    fs: float
    sf: float
    ss: float


@dataclass(frozen=True, slots=True)
class SecondOrder:
    """Two lags, s, and the damping where it is below 1; 0: the lags are real. With a damping the mean delay is still the sum
    of both lags, and the natural time half of it over the damping."""

    lag_s: float
    second_lag_s: float
    damping: float = 0.0

    @property
    def is_ringing(self) -> bool:
        """Decide whether the poles are complex."""
        return 0.0 < self.damping < RINGS_BELOW

    @property
    def delay_s(self) -> float:
        """Mean delay, s: twice damping times natural time."""
        return self.lag_s + self.second_lag_s

    @property
    def bend_s2(self) -> float:
        """Square of the natural time, s^2: the product of both lags."""
        return (0.5 * self.delay_s / self.damping) ** 2 if self.is_ringing else self.lag_s * self.second_lag_s

    @property
    def decay_s(self) -> float:
        """Time in which the slowest part of a distance from rest falls by a factor e, s."""
        return 2.0 * self.bend_s2 / self.delay_s if self.is_ringing else max(self.lag_s, self.second_lag_s)

    @property
    def natural_s(self) -> float:
        """Natural time, s."""
        return sqrt(self.bend_s2)

    def after(self, dt_s: float) -> Transition:
        """Return the transition over a time in which the input is held."""
        if not self.is_ringing:
            first_decay, second_decay = exp(-dt_s / self.lag_s), exp(-dt_s / self.second_lag_s)
            passed = self.lag_s * (first_decay - second_decay) / (self.lag_s - self.second_lag_s)
            return Transition(first_decay, 0.0, passed, second_decay)
        part_s = self.second_lag_s
        decay_per_s = 0.5 * self.delay_s / self.bend_s2
        swing_per_s = sqrt(1.0 - self.damping**2) / self.natural_s
        left = exp(-decay_per_s * dt_s)
        swing_s = left * sin(swing_per_s * dt_s) / swing_per_s
        stays = left * cos(swing_per_s * dt_s) + decay_per_s * swing_s
        share = swing_s / part_s
        fs = swing_s * (2.0 * decay_per_s - 1.0 / part_s - part_s / self.bend_s2)
        return Transition(share + stays - 2.0 * decay_per_s * swing_s, fs, share, stays - share)
