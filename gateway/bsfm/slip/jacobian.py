"""How a slip fit's errors answer to the branches' free numbers, in closed form: finite differences were most of its time.

A branch f(x; b, w) asked for the voltage of a force: dV/dp = -(df/dp) / (df/dx), df/db_k = R_k and df/dlog w_k = R_k (b_k - f)
with R_k = w_k B_k / W. The shares are projected out as Kaufman does it (BIT 15, 1975): what they can take up is taken off.
"""

from typing import Final

import numpy as np

from gateway.bsfm.branches import Branches
from gateway.bsfm.curve import RationalBezier
from gateway.bsfm.fit.projected_problem import Floats, bernstein

NEAR_SHARE: Final = 1.0e-4  # of the range: between two places this far apart a slope is a difference of values


def value_by_numbers(curve: RationalBezier, voltage_v: Floats) -> Floats:
    """Return df / d(b_0 .. b_n, log w_1 .. log w_n) at voltages within the curve: (N, 2 n + 1)."""
    handles = np.array(curve.handles)
    shares = bernstein((voltage_v - curve.x0) / (curve.x1 - curve.x0), curve.order) * np.array(curve.weights)
    shares /= shares.sum(axis=1, keepdims=True)
    by_weights = shares[:, 1:] * (handles[1:] - (shares @ handles)[:, None])
    return np.concatenate([shares, by_weights], axis=1)


def slope_by_numbers(curve: RationalBezier, voltage_v: Floats) -> Floats:
    """Return d(df/dx) / d(handles, log weights), (N, 2 n + 1)."""
    near_v = NEAR_SHARE * (curve.x1 - curve.x0)
    below_v, above_v = np.maximum(voltage_v - near_v, curve.x0), np.minimum(voltage_v + near_v, curve.x1)
    rise = value_by_numbers(curve, above_v) - value_by_numbers(curve, below_v)
    return np.asarray(rise / (above_v - below_v)[:, None])


def voltage_by_numbers(curve: RationalBezier, voltage_v: Floats, gentlest_n_per_v: float) -> Floats:
    """Return dV / d(handles, log weights) of the inverse at these voltages; 0 where it is clamped to an end."""
    inside = (voltage_v > curve.x0) & (voltage_v < curve.x1)
    steepness = np.maximum(curve.slope(voltage_v), gentlest_n_per_v)
    return np.asarray(-value_by_numbers(curve, voltage_v) * (inside / steepness)[:, None])


def in_free_numbers(rising: Floats, falling: Floats) -> Floats:
    """Put two branches' columns (handles, log weights) at their places among gateway.bsfm.slip.problem.free_numbers.

    (N, 2 n + 1) each, of the two added in rows that both move -> (N, 4 n + 1).
    """
    order = (rising.shape[1] - 1) // 2
    inner, logs = order - 1, 2 * order + 1
    columns = np.zeros((len(rising), 4 * order + 1))
    columns[:, 0] = rising[:, 0] + falling[:, 0]
    columns[:, 1], columns[:, 2] = rising[:, order], falling[:, order]
    columns[:, 3 : 3 + inner], columns[:, 3 + inner : logs] = rising[:, 1:order], falling[:, 1:order]
    columns[:, logs : logs + order], columns[:, logs + order :] = rising[:, order + 1 :], falling[:, order + 1 :]
    return columns


def penalties_by_numbers(
    branches: Branches, grid_v: Floats, wanted_n_per_v: float, gap: tuple[Floats, float]
) -> Floats:
    """Return the derivatives of slopes below the wanted one on each branch, then of the gap between them, as shares (N,) of
    what it may be at each place, below the wanted one: (3 grid, 4 n + 1)."""
    rising, falling = branches.rising, branches.falling
    shares, gap_n = gap
    flat = [
        (curve.slope(grid_v) < wanted_n_per_v)[:, None] * slope_by_numbers(curve, grid_v) for curve in (rising, falling)
    ]
    crossed = (((falling.value(grid_v) - rising.value(grid_v)) / shares < gap_n) / shares)[:, None]
    nothing = np.zeros_like(flat[0])
    return np.concatenate(
        [
            -in_free_numbers(flat[0], nothing),
            -in_free_numbers(nothing, flat[1]),
            in_free_numbers(crossed * value_by_numbers(rising, grid_v), crossed * -value_by_numbers(falling, grid_v)),
        ]
    )


def without(taken_up: Floats, heavy: Floats, jacobian: Floats) -> Floats:
    """Return what of the jacobian (N, p) the columns (N, c) cannot take up. heavy: (rows, c), equations beside the data that
    bind them."""
    q, _ = np.linalg.qr(np.concatenate([taken_up, heavy]))
    along = q[: len(jacobian)].T @ jacobian
    return np.asarray(jacobian - q[: len(jacobian)] @ along)
