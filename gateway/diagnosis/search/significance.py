"""What is reported, and what is a finding: the models at their best, the gain of each cause on unseen blocks, and doubts.

The search whitens, for a test needs to know what noise can do. The reported model is the one of the two fits, whitened or
plain, that predicts the held-out blocks better: where a cause is missing from the catalogue, a whitened fit would
sacrifice the slow part of the force to details. A cause is no finding when its gain may be nothing, when it leaves the error as
large, or when it and its like win by chance only; it is told with the reason, and the model is made without it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.random import default_rng
from numpy.typing import NDArray

from gateway.catalogue.cylinder import AREA
from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.model_fit.levenberg_marquardt import FitProblem, FittedModel, refine
from gateway.diagnosis.model_fit.normal_equations import HeldOutErrors, held_out_errors
from gateway.diagnosis.noise.whitening import Whitener, white_whitener
from gateway.diagnosis.result import Gain
from gateway.diagnosis.search.acceptance import AcceptedEffect, is_noticeable
from gateway.diagnosis.search.search import SearchResult, refit_without

_BETTER: Final = 0.995  # plain over whitened held-out RMS from which the plain fit is reported
_SAME_AREA: Final = 0.2  # relative; plain optima further apart are looked for from both sides
_LEAST_SAVED: Final = 0.02  # of the held-out squared error
_LEFT_AS_LARGE: Final = 0.995  # of the base model's error: what is left of it is all of it
_LEAST_SURE: Final = 0.5  # share of resampled recordings that an effect and its like must win
_PARTS: Final = 100  # of a recording, drawn anew for an interval
_RESAMPLES: Final = 400  # draws: ten in each tail of a 95 % interval
_TAILS: Final = (0.025, 0.975)
_WAVES: Final = 3  # of a model that is at its optimum but for another weighting ...
_WAVES_FROM_AFAR: Final = 12  # ... and of one that begins at another area
_SEED: Final = 43


@dataclass(frozen=True, slots=True)
class ReportedModels:
    """The models that are reported: base, extended, and the extended one without each accepted effect."""

    base: FittedModel
    fitted: FittedModel
    without: tuple[FittedModel, ...]
    whiten: Whitener
    held_out: HeldOutErrors


@dataclass(frozen=True, slots=True)
class DoubtfulEffect:
    """What the search had accepted and is no finding; gain_n: of the held-out RMS; why: as a sentence."""

    name: str
    gain_n: float
    why: str

    @property
    def note(self) -> str:
        """Sentence for the notes of an answer."""
        return f"{self.name} is no finding: {self.why}"


def drop_doubtful_effects(
    bench: Bench, found: SearchResult
) -> tuple[SearchResult, ReportedModels, tuple[DoubtfulEffect, ...]]:
    """Return what is reported once everything counts again, without effects that are no finding then, the worst of them
    first."""
    reported, dropped = _refit_for_report(bench, found), list[DoubtfulEffect]()
    while found.accepted:
        gains = [
            gain_of(held_out_errors(bench, without_it, reported.whiten), reported.held_out, 0.0)
            for without_it in reported.without
        ]
        doubts = [
            reason_for_doubt(each, gain) or _reason_in_size(each, reported.fitted)
            for each, gain in zip(found.accepted, gains, strict=True)
        ]
        rms_n = bench.rms_n(reported.base.residual_n)
        if not any(doubts) and reported.held_out.rms_n > _LEFT_AS_LARGE * rms_n:
            doubts = [f"with it the error is as large on unseen blocks as without: {rms_n:.3g} N"] * len(gains)
        if not any(doubts):
            break
        worst = min((k for k, why in enumerate(doubts) if why), key=lambda k: gains[k].ci95[0])
        taken, kept = found.accepted[worst], found.accepted[:worst] + found.accepted[worst + 1 :]
        won_n = gains[worst].held_out_rms_before_n - gains[worst].held_out_rms_after_n
        dropped.append(DoubtfulEffect(taken.effect.name, won_n, doubts[worst]))
        fitted = refit_without(bench, found, taken, kept) if kept else found.base
        found = replace(found, fitted=fitted, accepted=kept)
        reported = _refit_for_report(bench, found)
    return found, reported, tuple(dropped)


def reason_for_doubt(accepted: AcceptedEffect, gain: Gain) -> str:
    """Return why this is no finding, as a sentence; empty where it is one."""
    name, comparison = accepted.effect.name, accepted.comparison
    before_n, after_n = gain.held_out_rms_before_n, gain.held_out_rms_after_n
    if gain.ci95[0] <= 0.0:
        return f"what it gains on unseen blocks may be nothing: {gain.ci95[0]:.2g} .. {gain.ci95[1]:.2g} N"
    if after_n**2 > (1.0 - _LEAST_SAVED) * before_n**2:
        return f"it leaves the error as large: {before_n:.3g} N before, {after_n:.3g} N after"
    wins = sum(comparison.shares.get(each, 0.0) for each in {name, *accepted.effect.group})
    return f"it wins in {100.0 * wins:.0f} % of the ways to resample the recording only" if wins < _LEAST_SURE else ""


def _reason_in_size(accepted: AcceptedEffect, reported: FittedModel) -> str:
    """Why an effect of this size is no finding; empty where it is one. An exchange may have let a small one in."""
    named, comparison = (accepted.effect, accepted.form), accepted.comparison
    return (
        "" if is_noticeable(named, reported, comparison.beside, comparison.hints) else "every machine has as much of it"
    )


def _refit_for_report(bench: Bench, found: SearchResult) -> ReportedModels:
    """Every model twice, whitened and plain; the kind whose extended model predicts better.

    Dependences without a name count here: the reported errors are those of the simulation, and of nothing beside it.
    """
    plain = white_whitener(bench, found.fitted.residual_n, found.whiten.weights)
    models = [found.base, found.fitted, *(_model_without(each, found) for each in found.accepted)]
    problems = [FitProblem(each.parameters, each.free) for each in models]
    kinds = [
        (found.whiten, refine(bench, problems, found.whiten, waves=_WAVES)),
        (plain, _refit_plainly(bench, problems, plain)),
    ]
    errors = [held_out_errors(bench, fits[1], whiten) for whiten, fits in kinds]
    best = 1 if errors[1].rms_n < _BETTER * errors[0].rms_n else 0
    whiten, fits = kinds[best]
    return ReportedModels(fits[0], fits[1], tuple(fits[2:]), whiten, errors[best])


def _refit_plainly(bench: Bench, problems: Sequence[FitProblem], plain: Whitener) -> list[FittedModel]:
    """Each model at its plain optimum. The whitened one may be far from it in the area, which slow changes tell best:
    then it is looked for from the base model's plain area, too."""
    fits = refine(bench, problems, plain, waves=_WAVES)
    area_m2 = fits[0].parameters.value(AREA)
    if all(abs(each.parameters.value(AREA) / area_m2 - 1.0) < _SAME_AREA for each in fits):
        return fits
    again = [FitProblem(each.parameters.with_value(AREA, area_m2), each.free) for each in fits]
    others = refine(bench, again, plain, waves=_WAVES_FROM_AFAR)
    return [min(pair, key=lambda each: each.chi2) for pair in zip(fits, others, strict=True)]


def _model_without(accepted: AcceptedEffect, found: SearchResult) -> FittedModel:
    return found.base if len(found.accepted) == 1 else accepted.comparison.beside


def gain_of(before: HeldOutErrors, after: HeldOutErrors, floor_n: float) -> Gain:
    """Return by how much a model's held-out error falls, with its interval from resampled blocks."""
    errors_before, errors_after, counts = (
        np.add.reduceat(values, _part_edges(before)) for values in (before.squares, after.squares, before.squares > 0.0)
    )
    blocks = counts.size
    weights = default_rng(_SEED).multinomial(blocks, np.full(blocks, 1.0 / blocks), size=_RESAMPLES)
    rms_before = np.sqrt((weights @ errors_before) / (weights @ counts))
    rms_after = np.sqrt((weights @ errors_after) / (weights @ counts))
    low, high = np.quantile(rms_before - rms_after, _TAILS)
    return Gain(
        before.rms_n, after.rms_n, (float(low), float(high)), share_of_excess(before.rms_n, after.rms_n, floor_n)
    )


def _part_edges(held: HeldOutErrors) -> NDArray[np.intp]:
    """Where parts begin that are drawn anew for an interval: finer than the blocks that are left out, for an effect may show
    in one of these only, and then a fifth of all ways to draw blocks would not have it."""
    counted = np.cumsum(held.squares > 0.0)
    parts = min(_PARTS, int(counted[-1]) // 2)
    return np.asarray(np.searchsorted(counted, np.arange(parts) * counted[-1] // parts, side="right"))


def share_of_excess(before_n: float, after_n: float, floor_n: float) -> float:
    """Return the share of the error above the floor that a model takes away, 0 .. 1."""
    excess = before_n**2 - min(floor_n, after_n) ** 2
    return float(min(max((before_n**2 - after_n**2) / excess, 0.0), 1.0)) if excess > 0.0 else 0.0
