"""Samples that must not steer a fit: found without a model, or played down by their residual.

Rejection compares repeated readings of one stair (same voltage, same direction) with their median. It asks no model, so
that a low order's misfit is not called an outlier and all orders are judged on the same samples. Stairs read fewer than
three times keep everything.
"""

import numpy as np
from numpy.typing import NDArray

from gateway.bsfm.fit.projected_problem import Floats
from gateway.bsfm.ladder.measured_ladder import Ladder
from gateway.robust import HUBER_AT, SIGMA_PER_MAD

REJECT_AT = 6.0  # robust standard deviations


def stair_index(ladder: Ladder) -> tuple[NDArray[np.intp], int]:
    """Return the stair (voltage and direction) that each sample stands on, (N,), and the number of stairs."""
    _, index = np.unique(np.stack([ladder.voltage_v, ladder.direction]), axis=1, return_inverse=True)
    flat = np.asarray(index).reshape(-1)
    return flat, int(flat.max()) + 1


def inlier_mask(ladder: Ladder) -> NDArray[np.bool_]:
    """Return which readings to keep, (N,): False for those far from the median of their stair."""
    index, count = stair_index(ladder)
    order = np.argsort(index, kind="stable")
    groups = np.split(order, np.cumsum(np.bincount(index, minlength=count))[:-1])
    away, repeated = np.zeros(len(ladder)), np.zeros(len(ladder), dtype=bool)
    for members in groups:
        away[members] = ladder.force_n[members] - np.median(ladder.force_n[members])
        repeated[members] = len(members) >= 3
    if not repeated.any():
        return np.ones(len(ladder), dtype=bool)
    return np.asarray(~repeated | (np.abs(away) <= REJECT_AT * _robust_sigma(away[repeated])))


def huber_weight(residual_n: Floats) -> Floats:
    """Return Huber's weights, (N,): 1 for small residuals, falling as 1/|r| beyond HUBER_AT robust standard deviations."""
    scale = max(_robust_sigma(residual_n), 1.0e-12)
    return np.asarray(np.minimum(1.0, HUBER_AT * scale / np.maximum(np.abs(residual_n), 1.0e-300)))


def _robust_sigma(away_n: Floats) -> float:
    """Robust standard deviation; coarse counts make the median 0, then the middle 95 % decide."""
    size = np.abs(away_n)
    middle = size[size <= np.quantile(size, 0.95)]
    return float(max(SIGMA_PER_MAD * np.median(size), np.sqrt(np.mean(middle * middle))))
