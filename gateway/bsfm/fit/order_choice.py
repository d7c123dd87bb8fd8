"""Choose the order: leave one group out, then take the fewest coefficients that are not certainly worse than the best.

Certain: by two standard errors (Breiman et al. 1984 take one) of the difference to the best, group by group. What a group has
of its own (it was warmer, the tool had moved) is in all fits' errors alike; with two or three groups it would make the error of
one fit so uncertain that a straight line passed for as good as the best.

A group is one way up and down, so what is left out is a whole loop: samples of one loop are correlated, single ones
would flatter high orders. The order by residual alone always grows, the order by held-out error stops where the loop
does.

The orders that are tried by default stand in evaluation.py.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.bsfm.fit.branch_fit import FitSettings, branches_of, fit_orders, own_weight, residual_n, split_samples
from gateway.bsfm.fit.outliers import inlier_mask
from gateway.bsfm.fit.result import FitResult, ModelName, Ties
from gateway.bsfm.fit.solution import refine_solution
from gateway.bsfm.ladder.measured_ladder import Ladder
from gateway.progress import reported

CERTAIN: Final = 2.0  # standard errors of the difference: nobody prefers more coefficients for less


@dataclass(frozen=True, slots=True, eq=False)
class Score:
    """One fit, and how it predicts what it has not seen.

    heldout_rms_n: root of the mean over groups of the held-out mean square; mean square and its standard error in N^2;
    groups_n2: mean square of each group, empty where none was held out.
    """

    result: FitResult
    heldout_n2: float
    error_n2: float
    groups_n2: tuple[float, ...] = ()

    @property
    def heldout_rms_n(self) -> float:
        """Root of the held-out mean square, N."""
        return float(np.sqrt(self.heldout_n2))

    @property
    def coefficients(self) -> int:
        """Number of free coefficients of the fit."""
        return self.result.form.coefficients


def score_orders(
    ladder: Ladder,
    models: Iterable[ModelName | str],
    orders: Iterable[int],
    ties: Ties | str = Ties.TIED,
    settings: FitSettings | None = None,
) -> list[Score]:
    """Fit every model and order to all groups and to all but each. ValueError with less than two groups."""
    if len(ladder.groups) < 2:
        raise ValueError("leaving a group out needs at least two groups: repeat the ladder")
    fit_settings, ascending = settings or FitSettings(), sorted(orders)
    used = ladder.part(inlier_mask(ladder)) if fit_settings.outliers == "reject" else ladder
    results = [result for model in models for result in fit_orders(ladder, model, ascending, ties, fit_settings)]
    return [_score(used, result, fit_settings) for result in reported("holding groups out", results)]


def choose_fit(scores: Sequence[Score]) -> Score:
    """Return the fewest coefficients that are not certainly worse than the best, of fits that may drive a plant.

    If none is usable the choice is among all: its verdicts say why it must not be activated.
    """
    candidates = [score for score in scores if score.result.verdicts.usable] or list(scores)
    best = min(candidates, key=lambda score: score.heldout_n2)
    near = [
        score
        for score in candidates
        if score.heldout_n2 - best.heldout_n2 <= CERTAIN * _difference_error_n2(score, best)
    ]
    return min(near, key=lambda score: (score.coefficients, score.heldout_n2))


def _difference_error_n2(score: Score, best: Score) -> float:
    """Return the standard error of the mean difference of two fits' mean squares on the same groups."""
    gaps = np.array(score.groups_n2) - np.array(best.groups_n2)
    return float(gaps.std(ddof=1) / np.sqrt(len(gaps))) if len(gaps) > 1 else 0.0


def _score(ladder: Ladder, result: FitResult, settings: FitSettings) -> Score:
    squares = np.array([_heldout_n2(ladder, group, result, settings) for group in ladder.groups])
    return Score(
        result, float(squares.mean()), float(squares.std(ddof=1) / np.sqrt(len(squares))), tuple(squares.tolist())
    )


def _heldout_n2(ladder: Ladder, group: int, result: FitResult, settings: FitSettings) -> float:
    """Return the mean square on one group of the fit to the others, found from the full fit's weights."""
    inside = ladder.group == group
    rest, form = ladder.part(~inside), result.form
    solution = refine_solution(
        split_samples(rest, own_weight(rest), form, settings), form, result.log_weights, settings.effort
    )
    curves = branches_of(solution, result.branches.rising.x0, result.branches.rising.x1)
    away = residual_n(ladder.part(inside), curves)
    return float(np.mean(away * away))
