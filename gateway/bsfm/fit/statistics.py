"""Numbers about a finished fit: residuals, covariance where the data identify the parameters, the paper's own norm.

Covariance is the estimate of linearised least squares,  s^2 (J' W J)^-1  with  s^2 = sum(w r^2) / (sum(w) (n - p))  (Seber and
Wild, Nonlinear Regression, 1989, chapter 2), J the Jacobian by handles and log weights; its columns are scaled to length 1
before the inverse, for their units differ.
"""

import numpy as np
from numpy.typing import NDArray

from gateway.bsfm.fit.outliers import stair_index
from gateway.bsfm.fit.projected_problem import FitLanes, Floats, ProjectedProblem
from gateway.bsfm.fit.result import NOT_IDENTIFIABLE, Covariance, Residuals
from gateway.bsfm.fit.solution import Solution
from gateway.bsfm.ladder.measured_ladder import Ladder

LOG_WEIGHT_ERROR_MAX = 0.5  # a standard error beyond it: the data leave the weight open
CONDITION_MAX = 1.0e10  # of the scaled normal matrix, whose inverse is wanted


def summarize_residuals(residual_n: Floats) -> Residuals:
    """Return RMS, largest, mean and count of errors in N, (N,)."""
    if not len(residual_n):
        return Residuals(0.0, 0.0, 0.0, 0)
    rms_n = float(np.sqrt(np.mean(residual_n * residual_n)))
    return Residuals(rms_n, float(np.max(np.abs(residual_n))), float(np.mean(residual_n)), len(residual_n))


def estimate_covariance(
    solution: Solution, rows: list[NDArray[np.bool_]], residual_n: Floats, weight: Floats, box: float
) -> Covariance | str:
    """Return the covariance at the optimum, or NOT_IDENTIFIABLE.

    rows: the samples of each curve, masks (N,); residual_n, weight: (N,); box: bound of the log weights.
    """
    blocks: list[Floats] = []
    names: list[str] = []
    first = 0
    for problem, at in zip(solution.problems, solution.lanes, strict=True):
        curves = range(first, first + len(problem.curves))
        mask = np.any([rows[c] for c in curves], axis=0)
        block = _block(problem, at, _variance(problem, residual_n[mask], weight[mask], solution), solution, box)
        if block is None:
            return NOT_IDENTIFIABLE
        blocks.append(block)
        names += parameter_names(problem, list(curves), solution)
        first += len(problem.curves)
    return Covariance(tuple(names), block_diagonal(blocks))


def _variance(problem: ProjectedProblem, residual_n: Floats, weight: Floats, solution: Solution) -> float:
    """Return the variance of one sample over the sum of weights, in the problem's normalisation."""
    free = problem.handle_count + (problem.unknowns if solution.form.model.rational else 0)
    spare = max(len(residual_n) - free, 1)
    return float(np.sum(weight * residual_n * residual_n) / weight.sum() / spare)


def _block(problem: ProjectedProblem, at: FitLanes, variance: float, solution: Solution, box: float) -> Floats | None:
    """Return the covariance of the parameters of one problem, (p, p), or None where the data leave one open."""
    jacobian = at.q[0] @ at.r[0]
    if solution.form.model.rational:
        jacobian = np.concatenate([jacobian, problem.sensitivity(at.shares, at.handles)[0]], axis=1)
    lengths = np.sqrt((jacobian * jacobian).sum(axis=0))
    if not np.all(lengths > 0.0) or np.any(np.abs(at.theta) >= box):
        return None
    normal = (jacobian / lengths).T @ (jacobian / lengths)
    if np.linalg.cond(normal) > CONDITION_MAX:
        return None
    block = np.asarray(variance * np.linalg.inv(normal) / np.outer(lengths, lengths))
    errors = np.sqrt(np.diag(block))[problem.handle_count :]
    return None if np.any(errors > LOG_WEIGHT_ERROR_MAX) else block


def parameter_names(problem: ProjectedProblem, curves: list[int], solution: Solution) -> list[str]:
    """Return a name for each row of the covariance: handles (`rising b1`, `both b0` where shared), then log weights."""
    branch = ["rising", "falling"] if solution.form.model.per_direction else ["pooled"]
    handles = {}
    for c, columns in zip(curves, problem.columns, strict=True):
        for i, column in enumerate(columns.tolist()):
            shared = len(curves) == 2 and i in (0, solution.form.order)
            handles[column] = f"{'both' if shared else branch[c]} b{i}"
    weights = [f"{branch[c]} log w{i}" for c in curves for i in range(1, solution.form.order + 1)]
    return [handles[column] for column in sorted(handles)] + (weights if solution.form.model.rational else [])


def block_diagonal(blocks: list[Floats]) -> Floats:
    """Return square matrices along the diagonal of one, zeros elsewhere."""
    size = sum(len(block) for block in blocks)
    matrix, at = np.zeros((size, size)), 0
    for block in blocks:
        matrix[at : at + len(block), at : at + len(block)] = block
        at += len(block)
    return matrix


def paper_norm(ladder: Ladder, residual_n: Floats, split: bool) -> float:
    """Return the paper's figure: 2-norm of the stair means' residuals / number of stairs, the sets of a split model added."""
    index, count = stair_index(ladder)
    readings = np.bincount(index, minlength=count)
    means = np.bincount(index, residual_n, minlength=count) / readings
    rising = np.bincount(index, ladder.direction > 0, minlength=count) > 0
    sets = [means[rising], means[~rising]] if split else [means]
    return float(sum(np.linalg.norm(part) / len(part) for part in sets if len(part)))
