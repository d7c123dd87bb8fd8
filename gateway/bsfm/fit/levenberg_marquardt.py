"""Levenberg-Marquardt in a box with a ridge, on the projected problem, in lanes: many starts at the price of few.

The ridge keeps directions that the data do not see (from n = 3 on) from running to the box. It is 1e-6 on the mean
square in N^2, where 1e-4 already biases n = 2; on quiet data even 1e-6 shows, so the last run takes at most 1e-5 of the
mean square reached. Own loop rather than scipy.optimize: a fit takes milliseconds, and the frame of a general solver
would be most of it.

Starts: from n = 4 on one start in ten finds the lowest minimum. So weights are drawn in a fixed spread sequence, the
cheap cost alone screens them, the best go down together. Tied branches depend on each other weakly: pairs of the
branches' own minima start them.
"""

from dataclasses import dataclass

import numpy as np

from gateway.bsfm.fit.projected_problem import FitLanes, Floats, ProjectedProblem

STEPS_MAX = 100
RELATIVE_GAIN = 1.0e-9
RIDGE_SHARE = 1.0e-5  # of the mean square, in the last run
EXPLORING_STEPS = 30
PRIMES = np.array(
    [
        2,
        3,
        5,
        7,
        11,
        13,
        17,
        19,
        23,
        29,
        31,
        37,
        41,
        43,
        47,
        53,
        59,
        61,
        67,
        71,
        73,
        79,
        83,
        89,
        97,
        101,
        103,
        107,
        109,
        113,
    ]
)
QUIET_N2 = 1.0e-20  # below it nothing but rounding is left


@dataclass(frozen=True, slots=True)
class Effort:
    """ridge_n2 on |log w|^2; log_weight_max: the box; screened, descending: how many starts, per curve."""

    ridge_n2: float = 1.0e-6
    log_weight_max: float = 6.0
    screened: int = 192
    descending: int = 16


def polish(problem: ProjectedProblem, starts: Floats, effort: Effort) -> FitLanes:
    """Return the lowest minimum reached from starts (k, d), as one lane."""
    best = lowest(descend(problem, starts, effort.ridge_n2, effort), 1)
    for _ in range(3):
        cost = float(best.cost[0])
        if RIDGE_SHARE * cost >= effort.ridge_n2 or cost < QUIET_N2:
            break
        better = descend(problem, best.theta, RIDGE_SHARE * cost, effort)
        if better.cost[0] < cost:
            best = better
        if better.cost[0] > 0.9 * cost:
            break
    return best


def minima(problem: ProjectedProblem, given: Floats, effort: Effort, count: int = 3) -> Floats:
    """Return different minima, (count or fewer, d), lowest first, from given starts (k, d) and from the spread ones."""
    curves = len(problem.curves)
    seeds = _spread_starts(problem.unknowns, curves * effort.screened, effort.log_weight_max)
    best_seeds = lowest(problem.evaluate(seeds), curves * effort.descending).theta
    flat = np.zeros((1, problem.unknowns))
    lanes = descend(problem, np.concatenate([flat, given, best_seeds]), effort.ridge_n2, effort, EXPLORING_STEPS)
    lanes = lowest(lanes, len(lanes.cost))
    new = np.ones(len(lanes.cost), dtype=bool)
    new[1:] = np.diff(lanes.cost) > 1.0e-3 * lanes.cost[1:]
    return lanes.theta[new][:count]


def _spread_starts(unknowns: int, count: int, bound: float) -> Floats:
    """Log weights that fill the box evenly, always the same: multiples of irrational numbers (Weyl), denser near 0."""
    even = 2.0 * np.modf(np.arange(1, count + 1)[:, None] * np.sqrt(PRIMES[:unknowns]))[0] - 1.0
    return np.asarray(bound * even * np.abs(even))


def pairs_of(rising: Floats, falling: Floats) -> Floats:
    """Return each minimum of one branch beside each of the other: (a, n), (b, n) -> (a b, 2 n)."""
    return np.concatenate([np.repeat(rising, len(falling), axis=0), np.tile(falling, (len(rising), 1))], axis=1)


def lowest(lanes: FitLanes, count: int) -> FitLanes:
    """Return the lanes with the smallest costs, the best first."""
    return lanes.pick(np.argsort(lanes.cost, kind="stable")[:count])


def descend(
    problem: ProjectedProblem, starts: Floats, ridge: float, effort: Effort, steps: int = STEPS_MAX
) -> FitLanes:
    """Descend from each start to a local minimum of cost + ridge |theta|^2 within the box."""
    bound = effort.log_weight_max
    at = problem.evaluate(np.clip(starts, -bound, bound))
    damping = np.full(len(starts), 1.0e-3)
    finished: list[FitLanes] = []
    for _ in range(steps):
        trial = problem.evaluate(np.clip(at.theta + _step(problem, at, ridge, damping, bound), -bound, bound))
        before, after = _total(at, ridge), _total(trial, ridge)
        better = after < before
        at = trial.where(better, at)
        damping = np.where(better, np.maximum(damping / 5.0, 1.0e-12), damping * 4.0)
        is_done = (better & (before - after <= RELATIVE_GAIN * before)) | (damping > 1.0e8)
        finished.append(at.pick(is_done))
        at, damping = at.pick(~is_done), damping[~is_done]
        if not len(damping):
            break
    return _join_lanes([*finished, at])


def _total(at: FitLanes, ridge: float) -> Floats:
    return np.asarray(at.cost + ridge * (at.theta * at.theta).sum(axis=1))


def _step(problem: ProjectedProblem, at: FitLanes, ridge: float, damping: Floats, bound: float) -> Floats:
    """The damped Gauss-Newton step; unknowns that push against the box stand still."""
    jacobian = problem.jacobian(at)
    transposed = jacobian.transpose(0, 2, 1)
    gradient = (transposed @ at.residual[:, :, None])[:, :, 0] + ridge * at.theta
    free = (np.abs(at.theta) < bound) | (at.theta * gradient > 0.0)
    curvature = transposed @ jacobian * (free[:, :, None] & free[:, None, :])
    scale = np.trace(curvature, axis1=1, axis2=2) / curvature.shape[1] + ridge
    curvature[:, range(curvature.shape[1]), range(curvature.shape[1])] += ridge + (damping * scale)[:, None] + ~free
    return np.asarray(-np.linalg.solve(curvature, (gradient * free)[:, :, None])[:, :, 0])


def _join_lanes(lanes: list[FitLanes]) -> FitLanes:
    names = FitLanes.__slots__
    return FitLanes(*(np.concatenate([getattr(part, name) for part in lanes]) for name in names))
