"""One round of the search: every effect competes to explain what the present model leaves.

All starts in one wave, the best few refined jointly with the model, then compared by resampling blocks of time: the
winner's name stands only if it wins nearly always; otherwise the group of those that win sometimes is the answer.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.random import default_rng

from gateway import progress
from gateway.catalogue.effect import Effect, EffectForm, Parameter, SearchHints
from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.bench.recording_drive import begins_at_rest
from gateway.diagnosis.light_statistics import chi2_tail
from gateway.diagnosis.measurement import Floats
from gateway.diagnosis.model_fit.initial_state import with_known_rests, with_start_of
from gateway.diagnosis.model_fit.levenberg_marquardt import Contest, FitProblem, FittedModel, refine
from gateway.diagnosis.model_fit.normal_equations import block_sums
from gateway.diagnosis.noise.whitening import Whitener
from gateway.diagnosis.search.candidates import (
    CandidateColumns,
    CandidateScore,
    best_scores,
    score_candidates,
    simulate_candidates,
)

MOST_REFINED: Final = 6  # effects; a wave of simulations serves all of them
_MORE_BESIDE_A_HELD_START: Final = 4  # effects: beside a force that friction holds at first, promises mislead
_LEAST_AHEAD: Final = 0.1  # of what it promises beside a rest, that an effect may be behind such a force
_RESAMPLES: Final = 500  # draws of blocks: a share of 95 % is then uncertain by 1 %
_SURE_SHARE: Final = 0.95  # a name that wins this often stands alone
_SMALL_SHARE: Final = 0.03  # rarer winners do not belong to a group
_SIMILAR_GAIN_SHARE: Final = 0.75  # share of the gain that a relative must explain to stay in the group
_WAVES: Final = 6  # most waves of a refinement; it ends before where nothing is gained
_FALSE_ALARMS: Final = 0.01  # over all starts that were tried (Bonferroni)
_MAY_GAIN: Final = 2.0  # times what its start promises, by a refinement ...
_LINE_MAY_GAIN: Final = 1.5  # ... of a line, whose frequency is known already
_PENALTY_PER_PARAMETER: Final = 2.0  # chi-square (Akaike's criterion)
_INCUMBENT_SHARE: Final = 0.04  # of its own gain, at most: what leaves as many rows unexplained proves no better form
_NOISE_CHI2: Final = 1.1  # chi-square per row of a model at the noise: no bonus ...
_BONUS_GROWS_OVER: Final = 0.4  # ... and whole so far above it
_SEED: Final = 20


@dataclass(frozen=True, slots=True)
class RefinedEffect:
    """An effect refined jointly with the model. dof: parameters that it added.

    incumbent_bonus: chi-square by which a rival must beat it, because it stood in the model before.
    """

    effect: Effect
    form: EffectForm
    fitted: FittedModel
    gain: float  # in chi-square
    dof: int
    block_chi2: Floats
    incumbent_bonus: float = 0.0

    @property
    def penalised_gain(self) -> float:
        """Gain less the penalty, by which effects are ranked."""
        return self.gain - self.penalty

    @property
    def penalty(self) -> float:
        """Cost of its parameters and its rarity, less its bonus, in chi-square."""
        return _PENALTY_PER_PARAMETER * self.dof + self.effect.rarity - self.incumbent_bonus


@dataclass(frozen=True, slots=True)
class ModelComparison:
    """Refined effects beside the model `beside`, the strongest first.

    shares: how often each name wins under resampling; starts: how many were tried in all.
    """

    beside: FittedModel
    ranked: tuple[RefinedEffect, ...]
    shares: dict[str, float]
    hints: SearchHints
    starts: int
    scores: tuple[CandidateScore, ...]

    @property
    def winner(self) -> RefinedEffect:
        """The strongest effect. IndexError where none was refined."""
        return self.ranked[0]

    def group(self, name: str) -> tuple[str, ...]:
        """Return the names that this recording cannot tell from `name`, itself first, then those that win more often.

        Those that win when blocks are resampled; and those that the catalogue calls hard to tell from it and that explain
        nearly as much: no form of an effect is exact, so a small lead of one form proves nothing among relatives.
        """
        own = max((each.gain for each in self.ranked if each.effect.name == name), default=0.0)
        relatives = {each for other in self.ranked if other.effect.name == name for each in other.effect.group}
        alike = {
            each.effect.name
            for each in self.ranked
            if each.effect.name in relatives and each.gain > _SIMILAR_GAIN_SHARE * own
        }
        if self.shares.get(name, 0.0) < _SURE_SHARE:
            alike |= {each for each, share in self.shares.items() if share >= _SMALL_SHARE}
        names = dict.fromkeys(each.effect.name for each in self.ranked if each.effect.name in alike - {name})
        return (name, *sorted(names, key=lambda each: -self.shares.get(each, 0.0)))


def is_significant(refined: RefinedEffect, starts: int) -> bool:
    """Return whether an effect gains more than chance: chi-square at 1 % over the number of starts."""
    return chi2_tail(refined.gain, max(refined.dof, 1)) < _FALSE_ALARMS / max(starts, 1)


def _is_hopeful(score: CandidateScore, starts: int) -> bool:
    """Could a start be significant if its refinement gained as much as it may? Where none could, none is refined."""
    form = score.candidate.form
    gain = score.gain * (_LINE_MAY_GAIN if form.quadrature else _MAY_GAIN)
    return chi2_tail(gain, len(form.parameters)) < _FALSE_ALARMS / max(starts, 1)


@dataclass(frozen=True, slots=True)
class Competitors:
    """Effects to compare, and hints where their search begins.

    incumbent: an effect of the model before, refined already; most: effects that are refined. columns: what all starts change,
    where it is known for a model that is next to this one.
    """

    effects: Sequence[Effect]
    hints: SearchHints
    incumbent: RefinedEffect | None = None
    most: int = MOST_REFINED
    columns: CandidateColumns | None = None


def compare_effects(bench: Bench, fitted: FittedModel, competitors: Competitors, whiten: Whitener) -> ModelComparison:
    """Return how well each of these effects explains what the model `fitted` leaves, which stands at its own optimum."""
    hints, incumbent = competitors.hints, competitors.incumbent
    found = competitors.columns or simulate_candidates(bench, fitted, competitors.effects, hints)
    promised = score_candidates(found, fitted, whiten)
    starts = _count_starts(found, hints)
    at_rest = with_known_rests(bench, FitProblem(fitted.parameters, fitted.free))
    most = competitors.most + (_MORE_BESIDE_A_HELD_START if at_rest else 0)
    best = best_scores(promised, most) if any(_is_hopeful(each, starts) for each in promised) else []
    problems = [FitProblem(each.parameters, joined_parameters(bench, fitted, each.candidate.form)) for each in best]
    for score, problem in _beside_known_rests(bench, fitted, at_rest, competitors, whiten):
        best, problems = [*best, score], [*problems, problem]
    if best:
        progress.report(f"refining {progress.few([each.candidate.effect.name for each in best])}")
    contest = Contest(incumbent.fitted.chi2) if incumbent else Contest()
    refined = _refine_from_rests_too(bench, problems, whiten, contest)
    ranked = [
        refined_effect(bench, (score.candidate.effect, score.candidate.form), each, fitted, whiten)
        for score, each in zip(best, refined, strict=True)
    ]
    ranked += [replace(incumbent, incumbent_bonus=_incumbent_bonus(bench, incumbent))] if incumbent else []
    ranked.sort(key=lambda each: -each.penalised_gain)
    return ModelComparison(fitted, tuple(ranked), _winning_shares(ranked), hints, starts, tuple(promised))


def _beside_known_rests(
    bench: Bench, held: FittedModel, at_rest: FitProblem | None, competitors: Competitors, whiten: Whitener
) -> Iterator[tuple[CandidateScore, FitProblem]]:
    """Yield the effects that look like a force that friction holds at first, where such a force is in the model: begun beside
    the same model at rest, for beside the force they promise nothing."""
    effects = [each for each in competitors.effects if any(form.like_a_held_start for form in each.forms)]
    if at_rest is None or not effects:
        return
    (known,) = refine(bench, [at_rest], whiten, _WAVES)
    scores = score_candidates(simulate_candidates(bench, known, effects, competitors.hints), known, whiten)
    for score in best_scores(scores, len(effects)):
        if known.chi2 - score.gain < held.chi2 + _LEAST_AHEAD * score.gain:
            yield score, FitProblem(score.parameters, joined_parameters(bench, known, score.candidate.form))


def _refine_from_rests_too(
    bench: Bench, problems: Sequence[FitProblem], whiten: Whitener, contest: Contest
) -> list[FittedModel]:
    """Each problem at its optimum; where friction was found to hold a force in a rest at the beginning, the better one of that
    and of a rest without.

    Lost motion and a lost sign show nothing in a rest, as if a force were held there: the base model has taken that for the
    start, and beside it they gain nothing.
    """
    rests = [with_known_rests(bench, each) for each in problems]
    found = refine(bench, [*problems, *(each for each in rests if each)], whiten, _WAVES, contest)
    others = iter(found[len(problems) :])
    pairs = [
        (each, *([next(others)] if rest else [])) for each, rest in zip(found[: len(problems)], rests, strict=True)
    ]
    return [min(pair, key=lambda each: each.chi2 + _PENALTY_PER_PARAMETER * len(each.free)) for pair in pairs]


def _incumbent_bonus(bench: Bench, incumbent: RefinedEffect) -> float:
    """Where the whole model is still far from the noise, a few percent of gain are no reason to change a cause."""
    per_row = incumbent.fitted.chi2 / max(int(bench.usable.sum()), 1)
    return _INCUMBENT_SHARE * incumbent.gain * min(max((per_row - _NOISE_CHI2) / _BONUS_GROWS_OVER, 0.0), 1.0)


def joined_parameters(bench: Bench, fitted: FittedModel, form: EffectForm) -> tuple[Parameter, ...]:
    """Return what moves when a form joins a model; what is settled stands as the start has it."""
    free = (*fitted.free, *(each for each in form.parameters if each not in fitted.free and not each.settled))
    return with_start_of(form, free, [not begins_at_rest(each) for each in bench.measurements])


def refined_effect(
    bench: Bench, named: tuple[Effect, EffectForm], refined: FittedModel, beside: FittedModel, whiten: Whitener
) -> RefinedEffect:
    """Return an effect, in one of its forms, at its optimum against the model without it."""
    block_chi2 = block_sums(bench, whiten(refined.residual_n) ** 2)
    dof = len(refined.free) - len(beside.free)
    return RefinedEffect(*named, refined, beside.chi2 - refined.chi2, dof, block_chi2)


def _winning_shares(ranked: Sequence[RefinedEffect]) -> dict[str, float]:
    """How often each name has the least chi-square, two per parameter added, over resampled blocks."""
    if not ranked:
        return {}
    blocks = ranked[0].block_chi2.size
    weights = default_rng(_SEED).multinomial(blocks, np.full(blocks, 1.0 / blocks), size=_RESAMPLES)
    costs = np.array([each.block_chi2 @ weights.T + each.penalty for each in ranked])
    wins = np.bincount(np.argmin(costs, axis=0), minlength=len(ranked)) / _RESAMPLES
    shares: dict[str, float] = {}
    for refined, won in zip(ranked, wins, strict=True):
        shares[refined.effect.name] = shares.get(refined.effect.name, 0.0) + float(won)
    return shares


def _count_starts(found: CandidateColumns, hints: SearchHints) -> int:
    """Starts tried; a line or a pitch was chosen among as many as the rows can tell apart."""
    rows = hints.duration_s / max(hints.row_s, 1.0e-6)
    searched = sum(each.form.quadrature and len(each.start) == 3 for each in found.candidates)
    return len(found.candidates) + (int(rows / 4.0) if searched else 0)
