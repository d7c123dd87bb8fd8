"""The joint fit's search: the branches' free numbers that leave the smallest error, with the best shares at each trial.

Errors are told in newtons by the slopes of the branches it starts from, so that they are a function of the numbers alone.
Penalties on a grid hold the branches to what may drive a plant; a ridge holds the log weights, which the data leave open.
"""

from typing import Final

import numpy as np
from scipy.optimize import least_squares

from gateway.bsfm.branches import Branches
from gateway.bsfm.fit.projected_problem import Floats
from gateway.bsfm.fit.usable_fit import GAP_N
from gateway.bsfm.slip.jacobian import in_free_numbers, penalties_by_numbers, voltage_by_numbers, without
from gateway.bsfm.slip.problem import GENTLEST_N_PER_V, SlipProblem, branches_of, free_numbers

RIDGE: Final = 0.1
SLOPE_WANTED_N_PER_V: Final = 0.7
PENALTY: Final = 10.0
PENALTY_GRID: Final = 33
END_PLACES: Final = np.geomspace(1.0e-4, 0.02, 8)  # of the range: beside the end at which the branches meet
OPEN_AT: Final = 0.25  # of the range: the gap between the branches may be closing up to there
MOST_SHARE: Final = 1.45  # of the largest force: handles beyond 1.5 are refused (gateway.bsfm.fit.usable_fit)
STEPS_MAX: Final = 200
CLOSE: Final = 1.0e-5  # relative gain of a step that is the last
REFUSED_N: Final = 1.0e3  # residual of branches that are no model


class SlipSearch:
    """Residuals of trial numbers, and their Jacobian."""

    def __init__(self, problem: SlipProblem, start: Branches, margin: float = 0.0) -> None:
        """margin: by which the branches are kept off what may not drive a plant: a share of the slope, and of GAP_N."""
        self._problem = problem
        self._start = start
        places = np.concatenate([END_PLACES, np.linspace(0.0, 1.0, PENALTY_GRID)[1:]])
        self._grid_v = start.rising.x0 + places * (start.rising.x1 - start.rising.x0)
        self._wanted_n_per_v = SLOPE_WANTED_N_PER_V * (1.0 + margin)
        self._open, self._gap_n = np.minimum(1.0, places / OPEN_AT), GAP_N * margin
        self._slope = problem.system(start).slope
        self._log_weights = 2 * start.rising.order
        self._most_n = MOST_SHARE * float(np.abs(problem.force_n).max())

    def best(self) -> Branches:
        """Return the branches at the minimum."""
        first = free_numbers(self._start)
        minimum = least_squares(self.residuals, first, self.jacobian, x_scale="jac", ftol=CLOSE, max_nfev=STEPS_MAX)
        return branches_of(minimum.x, self._start)

    def residuals(self, numbers: Floats) -> Floats:
        """Return weighted errors, penalties, handles too large, ridge: (rows + 3 grid + numbers,)."""
        refused = np.full(len(self._slope) + 3 * len(self._grid_v) + len(numbers), REFUSED_N)
        try:
            trial = branches_of(numbers, self._start)
        except ValueError:  # weights beyond a double
            return refused
        if not (trial.rising.is_increasing() and trial.falling.is_increasing()):
            return refused
        problem, system = self._problem, self._problem.system(trial, self._slope)
        error_n = problem.weight * (system.matrix @ problem.best_shares(system) - system.target)
        handles_n, log_weights = np.split(numbers, [-self._log_weights])
        too_large_n = PENALTY * np.maximum(0.0, np.abs(handles_n) - self._most_n)
        return np.concatenate([error_n, self._penalties(trial), too_large_n, RIDGE * log_weights])

    def jacobian(self, numbers: Floats) -> Floats:
        """Return the derivatives of residuals where they are no refusal: (rows + 3 grid + numbers, numbers)."""
        trial = branches_of(numbers, self._start)
        penalties = PENALTY * penalties_by_numbers(trial, self._grid_v, self._wanted_n_per_v, (self._open, self._gap_n))
        own = np.full(len(numbers), RIDGE)
        handles_n = numbers[: -self._log_weights]
        own[: len(handles_n)] = PENALTY * np.sign(handles_n) * (np.abs(handles_n) > self._most_n)
        return np.concatenate([self._errors_by_numbers(trial), penalties, np.diag(own)])

    def _penalties(self, branches: Branches) -> Floats:
        """What a plant would not bear: slopes below the wanted one in N/V, the falling branch below the rising one in N."""
        grid_v, rising, falling = self._grid_v, branches.rising, branches.falling
        flat = [np.maximum(0.0, self._wanted_n_per_v - curve.slope(grid_v)) for curve in (rising, falling)]
        crossed = np.maximum(0.0, self._gap_n - (falling.value(grid_v) - rising.value(grid_v)) / self._open)
        return PENALTY * np.concatenate([*flat, crossed])

    def _errors_by_numbers(self, trial: Branches) -> Floats:
        problem, system = self._problem, self._problem.system(trial, self._slope)
        shares = problem.best_shares(system)
        place = problem.places @ shares
        scale = problem.weight * self._slope
        rising = voltage_by_numbers(trial.rising, system.rising_v, GENTLEST_N_PER_V)
        falling = voltage_by_numbers(trial.falling, system.falling_v, GENTLEST_N_PER_V)
        direct = in_free_numbers(
            (scale * 0.5 * (1.0 + place))[:, None] * rising, (scale * 0.5 * (1.0 - place))[:, None] * falling
        )
        used = shares > 0.0
        return without(
            (problem.weight[:, None] * system.matrix)[:, used], problem.heavy_rows(system)[:1, :-1][:, used], direct
        )
