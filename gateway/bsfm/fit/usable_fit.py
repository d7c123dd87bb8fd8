"""The best fit that may drive a plant, where the best fit may not.

A free optimum bends back where the ladder is flat (a dead start) and crosses where the loop is thin. `fit` says so and
leaves it; this is the second question, asked on purpose: the same least squares under slope floor and no crossing. The
constraints are sampled for the search (SLSQP, Kraft 1988) with a margin that grows until the exact tests hold, so what
is returned is proven, not sampled.
"""

from dataclasses import dataclass, replace

import numpy as np

from gateway.bsfm.branches import Branches
from gateway.bsfm.curve import RationalBezier
from gateway.bsfm.fit.branch_fit import (
    FitSettings,
    fit,
    own_weight,
    residual_n,
    result_of,
    split_samples,
    voltage_range,
)
from gateway.bsfm.fit.outliers import huber_weight, inlier_mask
from gateway.bsfm.fit.projected_problem import Floats, ProjectedProblem, Samples
from gateway.bsfm.fit.result import FitResult, ModelName, Ties
from gateway.bsfm.ladder.measured_ladder import Ladder

MARGINS = (0.01, 0.1, 0.5)  # of the slope floor; of GAP_N for the gap
GAP_N = 0.1  # between the branches, of a margin of 1
HANDLES_SHARE = 1.5  # of the largest force: no rig takes coefficients far beyond its cell
PLACES = np.concatenate([[0.0, 1.0e-4], np.arange(1, 64) / 64, [1.0 - 1.0e-4, 1.0]])


@dataclass(frozen=True, slots=True)
class _Task:
    """The least squares to solve under constraints, and the free fit that may not be used. ladder: without outliers."""

    problem: ProjectedProblem
    ladder: Ladder
    free: FitResult
    settings: FitSettings


class _Search:
    """Unknowns u: log weights (d,), then handles (p,). All constraints are linear in the curves' values at PLACES."""

    def __init__(self, problem: ProjectedProblem, floor_n: float, gap_n: float) -> None:
        """floor_n: least rise over the whole range; gap_n: least gap in the middle, closing as t (1-t) towards the ends."""
        self.problem, self.floor_n, self.gap_n = problem, floor_n, gap_n
        curves, m = len(problem.curves), len(PLACES)
        nothing = Samples(PLACES, np.zeros(m), np.ones(m))
        self._probe = ProjectedProblem(
            (nothing,) * curves, problem.order, problem.columns[0][-1] == problem.columns[-1][-1]
        )
        self._unit = float(np.sqrt(curves * m))  # undoes the probe's own weighting
        rise = np.diff(np.eye(m), axis=0) / np.diff(PLACES)[:, None]
        self._rows = np.kron(np.eye(curves), rise)
        self._least = np.full(len(self._rows), floor_n)
        if curves == 2:
            inside = np.eye(m)[1:-1] / (4.0 * PLACES * (1.0 - PLACES))[1:-1, None]
            self._rows = np.concatenate([self._rows, np.concatenate([-inside, inside], axis=1)])
            self._least = np.append(self._least, np.full(m - 2, gap_n))

    def margins(self, u: Floats) -> Floats:
        """Nowhere negative where all is well: rises from place to place, then gaps."""
        return np.asarray(-self._rows @ self._values_at(u)[0] - self._least)

    def margin_slopes(self, u: Floats) -> Floats:
        """Return the derivatives of the margins by the unknowns."""
        return np.asarray(-self._rows @ self._values_at(u)[1])

    def cost(self, u: Floats) -> tuple[float, Floats]:
        """Return the mean square and its gradient."""
        residual, jacobian = self.problem.at_fixed(*np.split(u, [self.problem.unknowns]))
        return float(residual @ residual), 2.0 * jacobian.T @ residual

    def _values_at(self, u: Floats) -> tuple[Floats, Floats]:
        values, slopes = self._probe.at_fixed(*np.split(u, [self.problem.unknowns]))
        return self._unit * values, self._unit * slopes


def fit_usable(
    ladder: Ladder,
    model: ModelName | str,
    order: int,
    ties: Ties | str = Ties.TIED,
    settings: FitSettings | None = None,
) -> FitResult:
    """Fit as `fit` does; if that may not drive a plant, return the best fit found that may.

    Residuals are honest: those of the curves returned. ValueError with the free fit's verdicts if nothing usable is found.
    """
    fit_settings = settings or FitSettings()
    free = fit(ladder, model, order, ties, fit_settings)
    if free.verdicts.usable and is_moderate(free.branches):
        return free
    used = ladder.part(inlier_mask(ladder)) if fit_settings.outliers == "reject" else ladder
    weight = own_weight(used)
    if fit_settings.outliers == "huber":
        weight = weight * huber_weight(residual_n(used, free.branches))
    problem = ProjectedProblem(split_samples(used, weight, free.form, fit_settings), order, free.form.tied)
    task = _Task(problem, used, free, fit_settings)
    for margin in MARGINS:
        results = [_fit_constrained(task, start, margin) for start in _starts(problem, free)]
        usable = [result for result in results if result.verdicts.usable and is_moderate(result.branches)]
        if usable:
            return min(usable, key=lambda result: result.rms_n)
    raise ValueError(f"no usable {free.form.model} of order {order}: " + "; ".join(free.verdicts.sentences))


def is_moderate(branches: Branches, measured_n: float | None = None) -> bool:
    """Return whether no handle is far beyond the largest force: a handle of 1500 N with a weight of 0.002 describes a curve of
    50 N as well as any, but no cell's range allows it. measured_n: that force, None for the largest of the branches' ends,
    which are measured where no slip stops keep a branch from its end."""
    most_n = HANDLES_SHARE * (_most_n(branches) if measured_n is None else measured_n)
    return all(
        abs(handle) <= most_n + 1.0e-9 for curve in (branches.rising, branches.falling) for handle in curve.handles
    )


def _most_n(branches: Branches) -> float:
    return max(
        abs(handle) for curve in (branches.rising, branches.falling) for handle in (curve.handles[0], curve.handles[-1])
    )


def _starts(problem: ProjectedProblem, free: FitResult) -> list[Floats]:
    """The free optimum, and straight lines of equal weights."""
    curves = (free.branches.rising, free.branches.falling)[: len(problem.curves)]
    own, line = np.zeros(problem.handle_count), np.zeros(problem.handle_count)
    for curve, columns in zip(curves, problem.columns, strict=True):
        own[columns] = curve.handles
        line[columns] = np.linspace(curve.handles[0], curve.handles[-1], problem.order + 1)
    return [np.concatenate([free.log_weights.ravel(), own]), np.concatenate([np.zeros(problem.unknowns), line])]


def _fit_constrained(task: _Task, start: Floats, margin: float) -> FitResult:
    from scipy.optimize import minimize  # here: whoever only fits freely does not pay for it

    problem, ladder, free, settings = task.problem, task.ladder, task.free, task.settings
    x0_v, x1_v = voltage_range(ladder, settings)
    floor_n = settings.slope_floor_n_per_v * (1.0 + margin) * (x1_v - x0_v)
    search = _Search(problem, floor_n, GAP_N * margin)
    reach = settings.effort.log_weight_max if free.model.rational else 0.0
    most_n = 0.98 * HANDLES_SHARE * float(np.abs(ladder.force_n).max())
    start = np.concatenate([start[: problem.unknowns], np.clip(start[problem.unknowns :], -most_n, most_n)])
    optimum = minimize(
        search.cost,
        start,
        jac=True,
        method="SLSQP",
        bounds=[(-reach, reach)] * problem.unknowns + [(-most_n, most_n)] * problem.handle_count,
        constraints={"type": "ineq", "fun": search.margins, "jac": search.margin_slopes},
        options={"maxiter": 100, "ftol": 1e-9},
    )
    weights, handles = problem.weights(optimum.x[None, : problem.unknowns])[0], optimum.x[problem.unknowns :]
    numbers = zip(weights, problem.columns, strict=True)
    curves = [RationalBezier(x0_v, x1_v, handles[columns].tolist(), w.tolist()) for w, columns in numbers]
    log_weights = optimum.x[: problem.unknowns].reshape(-1, problem.order)
    result = result_of(ladder, free.form, Branches(curves[0], curves[-1]), log_weights, settings)
    return replace(result, rejected=free.rejected)
