"""Fit PFM, PSFM, BFM and BSFM of order 1..15 to a ladder, through one interface (the paper's Eqs. 1, 3 and 4).

A polynomial is the rational curve with equal weights, so one linear step serves all four; the rational ones search log
weights around it (levenberg_marquardt). No constraint keeps an optimum increasing or uncrossed: that would hide what the data
say. The verdicts tell. Never imported by control.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gateway.bsfm.branches import Branches
from gateway.bsfm.coefficients import SLOPE_FLOOR_N_PER_V
from gateway.bsfm.curve import ORDER_MAX
from gateway.bsfm.fit.levenberg_marquardt import Effort
from gateway.bsfm.fit.outliers import huber_weight, inlier_mask
from gateway.bsfm.fit.projected_problem import Floats, Samples, merge_samples
from gateway.bsfm.fit.result import NOT_IDENTIFIABLE, FitResult, ModelForm, ModelName, Ties, verdicts_of
from gateway.bsfm.fit.solution import Solution, explore_starts, refine_solution
from gateway.bsfm.fit.statistics import estimate_covariance, paper_norm, summarize_residuals
from gateway.bsfm.ladder.measured_ladder import FALLING, RISING, Ladder
from gateway.progress import reported

HUBER_ROUNDS = 8  # of reweighting, each from the solution before


@dataclass(frozen=True, slots=True)
class FitSettings:
    """How branches are fitted. outliers: keep all, reject by stair, or Huber's loss; voltage_range_v: of the curves, None
    for the ladder's own.
    """

    outliers: Literal["keep", "reject", "huber"] = "keep"
    voltage_range_v: tuple[float, float] | None = None
    slope_floor_n_per_v: float = SLOPE_FLOOR_N_PER_V
    effort: Effort = field(default_factory=Effort)


def fit(
    ladder: Ladder,
    model: ModelName | str,
    order: int,
    ties: Ties | str = Ties.TIED,
    settings: FitSettings | None = None,
) -> FitResult:
    """Fit one form. ValueError with a sentence if the ladder cannot carry it (one direction only, too few voltages)."""
    return fit_orders(ladder, model, (order,), ties, settings)[0]


def fit_orders(
    ladder: Ladder,
    model: ModelName | str,
    orders: Iterable[int],
    ties: Ties | str = Ties.TIED,
    settings: FitSettings | None = None,
) -> list[FitResult]:
    """Fit several orders, ascending; each order starts from the one below it, too."""
    fit_settings = settings or FitSettings()
    used = ladder.part(inlier_mask(ladder)) if fit_settings.outliers == "reject" else ladder
    results: list[FitResult] = []
    lower: Floats | None = None
    for order in reported(f"fitting {ModelName(model).value}", sorted(orders)):
        form = ModelForm(ModelName(model), order, Ties(ties))
        solution, weight = solve_robustly(used, form, fit_settings, lower)
        lower = solution.log_weights
        result = result_of(used, form, branches_of(solution, *voltage_range(used, fit_settings)), lower, fit_settings)
        rows, residual = curve_rows(used, form), residual_n(used, result.branches)
        covariance = estimate_covariance(solution, rows, residual, weight, fit_settings.effort.log_weight_max)
        results.append(replace(result, covariance=covariance, rejected=len(ladder) - len(used)))
    return results


def solve_robustly(
    ladder: Ladder, form: ModelForm, settings: FitSettings, lower: Floats | None
) -> tuple[Solution, Floats]:
    """Return the solution and the weights it was found with: the ladder's own, times Huber's if asked for."""
    own = own_weight(ladder)
    samples = split_samples(ladder, own, form, settings)
    solution, weight = explore_starts(samples, form, lower, settings.effort), own
    if settings.outliers != "huber":
        return solution, weight
    x0_v, x1_v = voltage_range(ladder, settings)
    for _ in range(HUBER_ROUNDS):
        weight = own * huber_weight(residual_n(ladder, branches_of(solution, x0_v, x1_v)))
        solution = refine_solution(
            split_samples(ladder, weight, form, settings), form, solution.log_weights, settings.effort
        )
    return solution, weight


def own_weight(ladder: Ladder) -> Floats:
    """Return the weights of the ladder itself, 1 each where it has none: (N,)."""
    return np.ones(len(ladder)) if ladder.weight is None else ladder.weight


def voltage_range(ladder: Ladder, settings: FitSettings) -> tuple[float, float]:
    """Return the voltages of the curves, V. ValueError where they do not cover the ladder."""
    low, high = float(ladder.voltage_v.min()), float(ladder.voltage_v.max())
    x0_v, x1_v = settings.voltage_range_v or (low, high)
    if not (x0_v <= low and high <= x1_v and x0_v < x1_v):
        raise ValueError(f"ladder spans {low:g} .. {high:g} V, the curves {x0_v:g} .. {x1_v:g} V: they must cover it")
    return x0_v, x1_v


def split_samples(ladder: Ladder, weight: Floats, form: ModelForm, settings: FitSettings) -> tuple[Samples, ...]:
    """Return one Samples per curve of the form."""
    if not 1 <= form.order <= ORDER_MAX:
        raise ValueError(f"order {form.order}: 1 .. {ORDER_MAX} is allowed")
    x0_v, x1_v = voltage_range(ladder, settings)
    t = (ladder.voltage_v - x0_v) / (x1_v - x0_v)
    return tuple(_samples(t, ladder, weight, mask, form) for mask in curve_rows(ladder, form))


def curve_rows(ladder: Ladder, form: ModelForm) -> list[NDArray[np.bool_]]:
    """Return which samples belong to each curve of the form."""
    if form.model.per_direction:
        return [ladder.direction == RISING, ladder.direction == FALLING]
    return [ladder.direction != 0]


def _samples(t: Floats, ladder: Ladder, weight: Floats, mask: NDArray[np.bool_], form: ModelForm) -> Samples:
    name = "/".join(sorted({"rising" if d > 0 else "falling" for d in ladder.direction[mask].tolist()}, reverse=True))
    if not mask.any():
        raise ValueError(f"{form.model} needs both directions: the ladder goes one way only")
    samples = merge_samples(t[mask], ladder.force_n[mask], weight[mask])
    if len(samples.t) < form.order + 1:
        raise ValueError(f"order {form.order} needs {form.order + 1} different voltages: {name} has {len(samples.t)}")
    return samples


def branches_of(solution: Solution, x0_v: float, x1_v: float) -> Branches:
    """Return the solution as two branches; a pooled model has the same curve twice."""
    curves = solution.curves(x0_v, x1_v)
    return Branches(curves[0], curves[-1])


def residual_n(ladder: Ladder, branches: Branches) -> Floats:
    """Return measured minus model, N, each sample against its own branch."""
    rising, falling = branches.rising.value(ladder.voltage_v), branches.falling.value(ladder.voltage_v)
    return np.asarray(ladder.force_n - np.where(ladder.direction == RISING, rising, falling))


def result_of(
    ladder: Ladder, form: ModelForm, branches: Branches, log_weights: Floats, settings: FitSettings
) -> FitResult:
    """Return residuals and verdicts of given branches; nothing is claimed about their parameters."""
    residual = residual_n(ladder, branches)
    return FitResult(
        form=form,
        branches=branches,
        overall=summarize_residuals(residual),
        rising=summarize_residuals(residual[ladder.direction == RISING]),
        falling=summarize_residuals(residual[ladder.direction == FALLING]),
        rejected=0,
        covariance=NOT_IDENTIFIABLE,
        verdicts=verdicts_of(branches, settings.slope_floor_n_per_v),
        paper_norm=paper_norm(ladder, residual, form.model.per_direction),
        log_weights=log_weights,
    )
