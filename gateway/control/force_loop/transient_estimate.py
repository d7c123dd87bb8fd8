"""What of a force error behind a movement goes away by itself: told from what stays by how it falls.

The model of the lags is driven along the limits and back, and a command map that is some percent off leaves it elsewhere than
the plant. The inverse brings the model to rest, not the plant: its own error falls with the plant's longest lag, whatever
the output does. A trim that takes it for an error of the static model corrects what is about to vanish, and is as much off a
second later. So the predicted error is taken for a sum of two, one that stays and one that falls at that pace, and each new
sample divides it between them by what is known before: how far the movement went, and how exact static models are.
Two states, an ordinary Kalman filter.
"""

from math import exp
from typing import Final

from gateway.control.limits import TICK_S

PUSH_SHARE: Final = (
    0.05  # of a movement's thrust: so far, one standard deviation, is the model of the lags off behind it
)
STAYS_N: Final = 0.5  # the same of the static model
WANDERS_N: Final = 0.3  # by which what stays may change in a second
LEAST_NOISE_N: Final = 0.05  # of a sample: counts, ripple, and what of friction nobody models


class TransientEstimate:
    """transient_n: of the predicted error, what goes away by itself; lag_s: by which it falls."""

    def __init__(self) -> None:
        self.lag_s, self._pushed_n = TICK_S, 0.0
        self.restart()

    def restart(self) -> None:
        """Begin at rest."""
        self._stays_n = self.transient_n = 0.0
        self._stays_n2, self._both_n2, self._transient_n2 = STAYS_N**2, 0.0, 0.0

    def push(self, away_n: float) -> None:
        """Note that a movement is on its way: thrust that has not come yet, N."""
        self._pushed_n = max(self._pushed_n, abs(away_n))

    def correct(self, change_n: float) -> None:
        """Take off what the trim has taken of the error that stays."""
        self._stays_n -= change_n

    def observe(self, error_n: float, noise_n: float, interval_s: float) -> None:
        """Split one predicted error between both."""
        if self._pushed_n:
            self.restart()
            self._transient_n2, self._pushed_n = (PUSH_SHARE * self._pushed_n) ** 2, 0.0
        self._elapse(interval_s)
        stays_n2, transient_n2 = self._stays_n2 + self._both_n2, self._transient_n2 + self._both_n2
        whole_n2 = stays_n2 + transient_n2 + max(LEAST_NOISE_N, noise_n) ** 2
        surprise_n = error_n - self._stays_n - self.transient_n
        self._stays_n += stays_n2 / whole_n2 * surprise_n
        self.transient_n += transient_n2 / whole_n2 * surprise_n
        self._stays_n2 -= stays_n2**2 / whole_n2
        self._transient_n2 -= transient_n2**2 / whole_n2
        self._both_n2 -= stays_n2 * transient_n2 / whole_n2

    def _elapse(self, interval_s: float) -> None:
        left = exp(-interval_s / self.lag_s)
        self.transient_n *= left
        self._both_n2 *= left
        self._transient_n2 *= left * left
        self._stays_n2 += WANDERS_N**2 * interval_s
