"""From samples to the best solution of one form: many starts (explored) or one known neighbour (refined)."""

from dataclasses import dataclass

import numpy as np

from gateway.bsfm.curve import RationalBezier
from gateway.bsfm.fit.levenberg_marquardt import Effort, minima, pairs_of, polish
from gateway.bsfm.fit.projected_problem import FitLanes, Floats, ProjectedProblem, Samples, merge_samples, raise_order
from gateway.bsfm.fit.result import ModelForm

EXPLORING_PLACES = 128  # distinct voltages per curve that the search for starts looks at


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """The best of one form: its problems (one per set of curves that share handles), each with one lane."""

    form: ModelForm
    problems: tuple[ProjectedProblem, ...]
    lanes: tuple[FitLanes, ...]

    @property
    def log_weights(self) -> Floats:
        """(curves, order)."""
        return np.concatenate([at.theta.reshape(-1, self.form.order) for at in self.lanes])

    def curves(self, x0_v: float, x1_v: float) -> list[RationalBezier]:
        """Return one curve per direction, or the only one, over x0_v .. x1_v."""
        curves = []
        for problem, at in zip(self.problems, self.lanes, strict=True):
            for columns, weights in zip(problem.columns, problem.weights(at.theta)[0], strict=True):
                curves.append(RationalBezier(x0_v, x1_v, at.handles[0][columns].tolist(), weights.tolist()))
        return curves


def explore_starts(samples: tuple[Samples, ...], form: ModelForm, lower: Floats | None, effort: Effort) -> Solution:
    """Return the best solution from many starts. lower: log weights (curves, n) of a lower order."""
    if not form.model.rational:
        return refine_solution(samples, form, np.zeros((len(samples), form.order)), effort)
    coarse = tuple(_coarse(part, form.order) for part in samples)
    raised_lower = (
        None if lower is None else np.stack([raise_order(part, form.order - lower.shape[1]) for part in lower])
    )
    single = [
        minima(ProjectedProblem((part,), form.order, False), _known_start(raised_lower, c, form.order), effort)
        for c, part in enumerate(coarse)
    ]
    if not form.tied:
        return _solution(samples, form, single, effort)
    starts = pairs_of(*single)
    if raised_lower is not None:
        starts = np.concatenate([starts, raised_lower.reshape(1, -1)])
    return _solution(samples, form, [minima(ProjectedProblem(coarse, form.order, True), starts, effort)], effort)


def refine_solution(samples: tuple[Samples, ...], form: ModelForm, log_weights: Floats, effort: Effort) -> Solution:
    """Return the solution nearest to known log weights (curves, order)."""
    starts = [log_weights.reshape(1, -1)] if form.tied else [part[None] for part in log_weights]
    return _solution(samples, form, starts, effort)


def _solution(samples: tuple[Samples, ...], form: ModelForm, starts: list[Floats], effort: Effort) -> Solution:
    shared = [samples] if form.tied else [(part,) for part in samples]
    problems = tuple(ProjectedProblem(part, form.order, form.tied) for part in shared)
    if not form.model.rational:
        return Solution(
            form, problems, tuple(problem.evaluate(start) for problem, start in zip(problems, starts, strict=True))
        )
    lanes = [polish(problem, start, effort) for problem, start in zip(problems, starts, strict=True)]
    return Solution(form, problems, tuple(lanes))


def _known_start(log_weights: Floats | None, curve: int, order: int) -> Floats:
    return np.zeros((0, order)) if log_weights is None else log_weights[curve][None]


def _coarse(samples: Samples, order: int) -> Samples:
    """At most 128 places for the search of starts: voltages that were measured, not commanded, all differ."""
    if len(samples.t) <= max(EXPLORING_PLACES, 4 * order):
        return samples
    return merge_samples(np.round(samples.t * EXPLORING_PLACES) / EXPLORING_PLACES, samples.force_n, samples.weight)
