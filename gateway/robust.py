"""Robust statistics that more than one room uses: the scale of noise from medians, where Huber's weights begin, and what is no
value."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

SIGMA_PER_MAD: Final = 1.4826
"""Standard deviation of normal noise over its median absolute deviation: 1 / 0.6745 (Huber 1981)."""
HUBER_AT: Final = 1.345
"""Standard deviations beyond which Huber's weights fall: 95 % efficiency on normal noise (Huber 1981)."""
LARGEST_VALUE: Final = 1.0e60
"""Beyond, squares and products of columns overflow: what a logger writes for no value."""


def noise_from_second_differences(values: NDArray[np.float64]) -> float:
    """Return the standard deviation of white noise on evenly spaced values (n,), n >= 3, whatever slow trend carries them.

    Second differences of white noise have 6 times its variance (weights 1, -2, 1); the median is robust against steps.
    """
    return float(SIGMA_PER_MAD * np.median(np.abs(np.diff(values, n=2))) / np.sqrt(6.0))
