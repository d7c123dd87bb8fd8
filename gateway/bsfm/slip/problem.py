"""The numbers of a slip fit: walks as one system, linear in the shares, and the branches' free numbers around it.

On a walk every stop is known from the voltages alone. So V = m(f) + s h(f) is linear in the shares, and for any branches the
best shares are a small non-negative problem: its sum of 1, and the largest stiffness, are heavy rows beside the data. All
rows are told in newtons through the branches' mean slope.

What may move: the branches meet at the lowest voltage, where both have been measured, and part at the highest. With slip
they are the curves that are reached when every stop has given way; a staircase never sees the falling one at its top, where
it turns round, so tying it there would bend it.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import nnls

from gateway.bsfm.branches import Branches
from gateway.bsfm.curve import RationalBezier
from gateway.bsfm.fit.projected_problem import Floats
from gateway.bsfm.slip.slip_stops import BOUND_RESOLUTION, BOUND_SHARE, STIFFEST

HEAVY: Final = 1.0e4  # of the two heavy rows, beside rows of a few newtons
MARGIN: Final = 0.98  # of the stiffness that a model may have
GRID: Final = 257
GENTLEST_N_PER_V: Final = 0.3  # for Newton's step in the inverse only


@dataclass(frozen=True, slots=True, eq=False)
class Walk:
    """Settled points in the order of their visit, after a full fall to the lowest voltage. Arrays (N,).

    trust: of each point, 0 leaves it out of the fit though the stops still pass it; None for 1 each. ValueError on lengths
    that differ or anything not finite.
    """

    voltage_v: Floats
    force_n: Floats
    trust: Floats | None = None

    def __post_init__(self) -> None:
        columns = [self.voltage_v, self.force_n, *([] if self.trust is None else [self.trust])]
        if len({len(column) for column in columns}) != 1 or not all(np.all(np.isfinite(column)) for column in columns):
            raise ValueError("walk: columns of one length, finite, are needed")

    @property
    def trusts(self) -> Floats:
        """Weight of each point, (N,); 1 where none was given."""
        return np.ones(len(self.voltage_v)) if self.trust is None else self.trust


def places(voltage_v: Floats, radii_v: Floats) -> Floats:
    """Return stop / r along a walk that starts fallen: shape (N, radii)."""
    place, rows = np.full(len(radii_v), -1.0), []
    for step_v in np.diff(voltage_v, prepend=voltage_v[:1]):
        place = np.clip(place + step_v / radii_v, -1.0, 1.0)
        rows.append(place)
    return np.array(rows)


def inverses(curve: RationalBezier, force_n: Floats) -> Floats:
    """Return voltages of many forces, clamped to the curve: a table, then Newton. Within 1e-9 V where the curve is not flat."""
    grid_v = np.linspace(curve.x0, curve.x1, GRID)
    inside_n = np.clip(force_n, curve.handles[0], curve.handles[-1])
    voltage_v: Floats = np.interp(inside_n, curve.value(grid_v), grid_v)
    for _ in range(3):
        step_v = (curve.value(voltage_v) - inside_n) / np.maximum(curve.slope(voltage_v), GENTLEST_N_PER_V)
        voltage_v = np.clip(voltage_v - step_v, curve.x0, curve.x1)
    return voltage_v


@dataclass(frozen=True, slots=True, eq=False)
class System:
    """matrix @ c = target where the model is exact, in newtons: (rows, shares) and (rows,). Volts of each row on both branches,
    slope: what tells volts in newtons; widest_v: half the loop at its widest."""

    rising_v: Floats
    falling_v: Floats
    slope: Floats
    matrix: Floats
    target: Floats
    widest_v: float


class SlipProblem:
    """Walks over a set of radii. `weight`, (rows,), is the square root of the trust in each row."""

    def __init__(self, walks: list[Walk], radii_v: Floats) -> None:
        self.radii_v = radii_v
        self.voltage_v = np.concatenate([walk.voltage_v for walk in walks])
        self.force_n = np.concatenate([walk.force_n for walk in walks])
        self.places = np.vstack([places(walk.voltage_v, radii_v) for walk in walks])
        self.weight = np.sqrt(np.concatenate([walk.trusts for walk in walks]))

    def shares(self, branches: Branches) -> Floats:
        """Return the best c for these branches: non-negative, sum 1, no stiffer than a model may be."""
        return self.best_shares(self.system(branches))

    def best_shares(self, system: System) -> Floats:
        """Return the best c of a system, (shares,): non-negative least squares."""
        rows = np.column_stack([self.weight[:, None] * system.matrix, np.zeros(len(system.matrix))])
        bound = np.concatenate([rows, self.heavy_rows(system)])
        solution, _ = nnls(bound, np.append(self.weight * system.target, [HEAVY, HEAVY]))
        shares: Floats = solution[:-1] / solution[:-1].sum()
        return shares

    def heavy_rows(self, system: System) -> Floats:
        """Sum of the shares is 1; their stiffness and a slack, the last column, are 1: (2, shares + 1)."""
        stiffness = system.widest_v / (self.radii_v * MARGIN * STIFFEST)
        return HEAVY * np.array([np.append(np.ones(len(stiffness)), 0.0), np.append(stiffness, 1.0)])

    def errors_n(self, branches: Branches, shares: Floats | None = None) -> Floats:
        """Return model minus walk: V(f) - V, in newtons. shares: None for the best."""
        system = self.system(branches)
        errors: Floats = system.matrix @ (self.best_shares(system) if shares is None else shares) - system.target
        return errors

    def system(self, branches: Branches, slope: Floats | None = None) -> System:
        """Return the linear system of the shares for these branches. slope: N/V that turn each row's volts into newtons,
        None for these branches' own.
        """
        rows = len(self.force_n)
        forces = np.append(self.force_n, _forces_of(branches))
        rising_v, falling_v = inverses(branches.rising, forces), inverses(branches.falling, forces)
        half_v = 0.5 * (rising_v - falling_v)
        least_v = BOUND_RESOLUTION * (branches.rising.x1 - branches.rising.x0)
        widest_v = max(float(half_v[rows:].max()), least_v) * (1.0 + BOUND_SHARE)
        rising_v, falling_v, half_v = rising_v[:rows], falling_v[:rows], half_v[:rows]
        if slope is None:
            slope = np.asarray(0.5 * (branches.rising.slope(rising_v) + branches.falling.slope(falling_v)))
        target = slope * (self.voltage_v - 0.5 * (rising_v + falling_v))
        return System(rising_v, falling_v, slope, (slope * half_v)[:, None] * self.places, target, widest_v)


def free_numbers(branches: Branches) -> Floats:
    """Return the numbers that a joint fit may move: common low end, both tops, inner handles, log weights with w_0 = 1."""
    rising, falling = branches.rising, branches.falling
    return np.array(
        [
            0.5 * (rising.handles[0] + falling.handles[0]),
            rising.handles[-1],
            falling.handles[-1],
            *rising.handles[1:-1],
            *falling.handles[1:-1],
            *np.log(np.array(rising.weights[1:]) / rising.weights[0]),
            *np.log(np.array(falling.weights[1:]) / falling.weights[0]),
        ]
    )


def branches_of(numbers: Floats, frame: Branches) -> Branches:
    """Return the branches of such numbers, the inverse of `free_numbers`; frame gives voltages and order (of both
    branches). ValueError for weights beyond a double.
    """
    order = frame.rising.order
    low_n, rising_n, falling_n, *inner = numbers[: 2 * order + 1].tolist()
    with np.errstate(over="ignore"):  # an infinite weight is refused below
        weights = np.exp(numbers[2 * order + 1 :]).tolist()
    x0, x1, middle = frame.rising.x0, frame.rising.x1, order - 1
    return Branches(
        RationalBezier(x0, x1, (low_n, *inner[:middle], rising_n), (1.0, *weights[:order])),
        RationalBezier(x0, x1, (low_n, *inner[middle:], falling_n), (1.0, *weights[order:])),
    )


def _forces_of(branches: Branches) -> Floats:
    """All that the loop reaches, evenly: where its width is looked at."""
    low_n = min(branches.rising.handles[0], branches.falling.handles[0])
    high_n = max(branches.rising.handles[-1], branches.falling.handles[-1])
    return np.linspace(low_n, high_n, GRID)
