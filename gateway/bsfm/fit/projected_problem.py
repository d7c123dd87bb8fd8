"""Variable projection: given the weights, the handles are linear least squares; a small problem in log w remains.

Unknowns are theta_i = log(w_i / w_0), i = 1..n, per curve: positive by construction, so no fit has a pole. Linearised
fits (Levy, Sanathanan-Koerner) were rejected: they give negative weights at every n >= 3 tried. The Jacobian is
analytic, both terms of Golub and Pereyra (SIAM J. Numer. Anal. 10, 1973). With R_i = w_i B_i / W:  dR_i/dtheta_k = R_i
(delta_ik - R_k), so df/dtheta_k = R_k (b_k - f).

Everything works on lanes, many theta at once: the problem has many local minima from n = 4 on, and numpy's cost is per
call. Shapes: k lanes, m rows, p handles, d = curves * n unknowns.
"""

from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Samples:
    """One curve's data, equal voltages merged: share of the range t, mean force, and summed weight, each (m,)."""

    t: Floats
    force_n: Floats
    weight: Floats


def merge_samples(t: Floats, force_n: Floats, weight: Floats) -> Samples:
    """Merge samples into one row per distinct t: least squares sees the same minimum, and ten groups cost as little as one."""
    places, index = np.unique(t, return_inverse=True)
    total = np.bincount(index, weight).astype(np.float64)
    return Samples(places, np.bincount(index, weight * force_n) / total, total)


def bernstein(t: Floats, order: int) -> Floats:
    """Return the Bernstein polynomials B_i(t), shape (m, order + 1), by the recurrence of degrees: sums of positive terms
    only.
    """
    basis = np.ones((len(t), 1))
    for _ in range(order):
        higher = np.zeros((len(t), basis.shape[1] + 1))
        higher[:, :-1] = basis * (1.0 - t)[:, None]
        higher[:, 1:] += basis * t[:, None]
        basis = higher
    return basis


@dataclass(frozen=True, slots=True)
class FitLanes:
    """What is known at k thetas. design = q r; cost: weighted mean of squared residuals in N^2."""

    theta: Floats  # (k, d)
    handles: Floats  # (k, p)
    residual: Floats  # (k, m)
    shares: Floats  # R_i of the row's own curve, (k, m, n + 1)
    q: Floats  # (k, m, p)
    r: Floats  # (k, p, p)
    cost: Floats  # (k,)

    def pick(self, lanes: Floats | NDArray[np.intp] | NDArray[np.bool_]) -> "FitLanes":
        """Return the chosen lanes."""
        return FitLanes(*(getattr(self, field.name)[lanes] for field in fields(self)))

    def where(self, mask: NDArray[np.bool_], other: "FitLanes") -> "FitLanes":
        """Pick lane by lane: this one where the mask is true, else the other's."""
        names = [field.name for field in fields(self)]
        pairs = ((getattr(self, name), getattr(other, name)) for name in names)
        return FitLanes(*(np.where(mask.reshape(-1, *(1,) * (a.ndim - 1)), a, b) for a, b in pairs))


class ProjectedProblem:
    """One or two curves of one order. tied: the two share their end handles."""

    def __init__(self, curves: tuple[Samples, ...], order: int, tied: bool) -> None:
        self.curves, self.order = curves, order
        self.columns = _columns(len(curves), order, tied)
        self.handle_count = int(self.columns[-1].max()) + 1
        ends = np.cumsum([0, *(len(samples.t) for samples in curves)])
        self.rows = [slice(int(a), int(b)) for a, b in pairwise(ends)]
        weight = np.concatenate([samples.weight for samples in curves])
        self.root_weight = np.sqrt(weight / weight.sum())  # squares of weighted residuals add up to a mean
        self._force = np.concatenate([samples.force_n for samples in curves]) * self.root_weight
        self._bases = [bernstein(samples.t, order) for samples in curves]

    @property
    def unknowns(self) -> int:
        """Number d of log weights, over all curves."""
        return len(self.curves) * self.order

    def weights(self, theta: Floats) -> Floats:
        """Return w_0 = 1, w_i = exp(theta_i): (k, d) -> (k, curves, n + 1)."""
        logs = theta.reshape(len(theta), len(self.curves), self.order)
        return np.asarray(np.concatenate([np.ones((*logs.shape[:2], 1)), np.exp(logs)], axis=2))

    def designs(self, theta: Floats) -> tuple[Floats, Floats]:
        """Return the shares R_i of each row's own curve, (k, m, n + 1), and the weighted design, (k, m, p)."""
        weights = self.weights(theta)
        shares = np.concatenate([basis * weights[:, c, None, :] for c, basis in enumerate(self._bases)], axis=1)
        shares /= shares.sum(axis=2, keepdims=True)
        design = np.zeros((len(theta), len(self._force), self.handle_count))
        for rows, columns in zip(self.rows, self.columns, strict=True):
            design[:, rows, columns] = shares[:, rows] * self.root_weight[rows, None]
        return shares, design

    def evaluate(self, theta: Floats) -> FitLanes:
        """Solve for the best handles of each lane's weights, by QR of the weighted design with columns of equal length."""
        shares, design = self.designs(theta)
        lengths = np.sqrt((design * design).sum(axis=1))
        q, r = np.linalg.qr(design / lengths[:, None, :])
        along = q.transpose(0, 2, 1) @ self._force
        residual = self._force - (q @ along[:, :, None])[:, :, 0]
        handles = np.linalg.solve(r, along[:, :, None])[:, :, 0] / lengths
        return FitLanes(theta, handles, residual, shares, q, r * lengths[:, None, :], (residual * residual).sum(axis=1))

    def jacobian(self, at: FitLanes) -> Floats:
        """Return d residual / d theta, (k, m, d)."""
        direct = self.sensitivity(at.shares, at.handles)
        inner = at.q.transpose(0, 2, 1) @ direct - np.linalg.solve(at.r.transpose(0, 2, 1), self._moved_normals(at))
        return np.asarray(at.q @ inner - direct)

    def at_fixed(self, theta: Floats, handles: Floats) -> tuple[Floats, Floats]:
        """Return the residual (m,) and its Jacobian (m, d + p) with respect to log weights (d,) and handles (p,), both
        free.
        """
        shares, design = self.designs(theta[None])
        slopes = self.sensitivity(shares, handles[None])[0]
        return self._force - design[0] @ handles, -np.concatenate([slopes, design[0]], axis=1)

    def sensitivity(self, shares: Floats, handles: Floats) -> Floats:
        """Return weighted df / d theta at fixed handles (k, p), R_k (b_k - f): (k, m, d)."""
        result = np.zeros((len(shares), len(self._force), self.unknowns))
        for c, (rows, columns) in enumerate(zip(self.rows, self.columns, strict=True)):
            share, own = shares[:, rows], handles[:, columns]
            inner = share[:, :, 1:] * (own[:, None, 1:] - share @ own[:, :, None])
            result[:, rows, c * self.order : (c + 1) * self.order] = inner * self.root_weight[rows, None]
        return result

    def _moved_normals(self, at: FitLanes) -> Floats:
        """(d design / d theta_j)^T residual, one column per j: (k, p, d)."""
        result = np.zeros((len(at.theta), self.handle_count, self.unknowns))
        for c, (rows, columns) in enumerate(zip(self.rows, self.columns, strict=True)):
            share = at.shares[:, rows]
            weighted = share * (self.root_weight[rows] * at.residual[:, rows])[:, :, None]
            block = -share.transpose(0, 2, 1) @ weighted
            block[:, range(self.order + 1), range(self.order + 1)] += weighted.sum(axis=1)
            result[:, columns, c * self.order : (c + 1) * self.order] = block[:, :, 1:]
        return result


def _columns(curves: int, order: int, tied: bool) -> list[NDArray[np.intp]]:
    """Which linear unknown each handle of each curve is."""
    first = np.arange(order + 1)
    if curves == 1:
        return [first]
    second = first + order + 1
    if tied:
        second = np.concatenate([[0], np.arange(order + 1, 2 * order), [order]])
    return [first, second]


def raise_order(theta: Floats, by: int) -> Floats:
    """Return theta (n,) of the same curve written `by` orders higher: a start that loses nothing."""
    weights = np.exp(np.concatenate([[0.0], theta]))
    for _ in range(by):
        share = np.arange(len(weights) + 1) / len(weights)
        weights = np.append(weights, 0.0) * (1.0 - share) + np.append(0.0, weights) * share
    return np.asarray(np.log(weights[1:] / weights[0]))
