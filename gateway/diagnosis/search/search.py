"""The search: add the best effect while it pays, then compare every accepted effect with all others again.

What pays is in acceptance.py. Besides:
    - Two causes together may look like a third one: where resampling does not decide, the winner's rivals are judged
      with the best companion that each finds.
    - A dependence that no effect has a name for takes its place where it explains clearly more than any effect.
    - An effect of a size that every machine has goes into the base model: it is no finding, and without it its work
      would be done, and its name taken, by another one.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway import progress
from gateway.catalogue.effect import Effect, EffectForm, Parameter, SearchHints
from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.bench.parameters import reset_parameters
from gateway.diagnosis.model_fit.base_fit import refit
from gateway.diagnosis.model_fit.initial_state import with_start_of
from gateway.diagnosis.model_fit.levenberg_marquardt import FitProblem, FittedModel, refine
from gateway.diagnosis.model_fit.normal_equations import orthonormal
from gateway.diagnosis.noise.whitening import Whitener, coloured_whitener
from gateway.diagnosis.residuals.dependence_tests import RESOLUTION_N, Dependence, strongest_dependence
from gateway.diagnosis.search.acceptance import (
    CHI2_MARGIN,
    AcceptedEffect,
    explained_chi2,
    is_clearly_stronger,
    is_more_than_a_wrong_form,
    is_noticeable,
    saved_share,
    saves_enough,
    stands_in_its_own_noise,
)
from gateway.diagnosis.search.candidates import simulate_candidates, unexplained_residual
from gateway.diagnosis.search.hints import search_hints
from gateway.diagnosis.search.model_comparison import (
    Competitors,
    ModelComparison,
    RefinedEffect,
    compare_effects,
    is_significant,
    joined_parameters,
    refined_effect,
)

MOST_EFFECTS: Final = 5  # found, usual or without a name; each costs a comparison of all others
_DISCREPANT_CHI2_PER_ROW: Final = 3.0  # chi-square per row of the winner
_MOST_RIVALS: Final = 2  # looked at beside the winner
_COMPANIONS: Final = 2  # looked at closely for each
_LEAST_RIVAL_SHARE: Final = 0.05  # share from which a rival is looked at
_UNDISPUTED_SHARE: Final = 0.8  # of a winner that stands where such a rival falls
_OF_THE_MODEL: Final = 0.5  # of what an effect gains, that the model gains without it from the same place
_NEXT_TO: Final = 0.01  # of the force's standard deviation
_WAVES_AGAIN: Final = 2  # of a model that other rows or another noise have hardly moved ...
_WAVES_WIDENED: Final = 3  # ... that gains a parameter ...
_WAVES_WITHOUT: Final = 4  # ... that loses one ...
_WAVES_DISCREPANT: Final = 5  # ... and under a noise that is several times as large


@dataclass(frozen=True, slots=True)
class SearchResult:
    """What the search ends with. bench: that of the search without what the dependences without a name explain; first: the
    comparison beside the base model alone."""

    bench: Bench
    base: FittedModel
    fitted: FittedModel
    accepted: tuple[AcceptedEffect, ...]
    unnamed: tuple[Dependence, ...]
    whiten: Whitener
    first: ModelComparison
    last: ModelComparison


def search_effects(bench: Bench, base: FittedModel, effects: Sequence[Effect], whiten: Whitener) -> SearchResult:
    """Return all effects that the recording shows, one after the other. `base` is the refitted base model."""
    base, whiten, comparison = compare_at_optimum(bench, base, effects, whiten)
    first, fitted, accepted, usual = comparison, base, list[AcceptedEffect](), list[Effect]()
    unnamed, is_newest_settled = list[Dependence](), False
    while len(accepted) + len(usual) + len(unnamed) < MOST_EFFECTS:
        explained = explained_chi2(base, fitted, accepted)
        winner, saved = None, 0.0
        is_seen = bench.rms_n(fitted.residual_n) >= RESOLUTION_N
        if is_seen and comparison.ranked and is_significant(comparison.winner, comparison.starts):
            for winner in _worth_a_look(
                bench, comparison, not_accepted(effects, accepted), (fitted, explained), whiten
            ):
                saved = _saved_if_sound(bench, comparison, winner, (fitted, explained), whiten)
                if saved > 0.0:
                    break
        counted = len(accepted)
        progress.report("looking for what no effect explains")
        dependence = strongest_dependence(bench, fitted, whiten, unnamed, outside=True)
        strongest = comparison.winner if saved > 0.0 else None
        if dependence is not None and is_clearly_stronger(dependence, strongest, explained):
            unnamed.append(dependence)
            bench = bench.without_columns(dependence.regressors.columns)
            fitted = refit(bench, fitted, whiten)
        elif winner is None or saved == 0.0:
            break
        elif saves_enough(winner, saved) and _is_finding(winner, fitted, comparison):
            accepted.append(AcceptedEffect(winner.effect, winner.form, comparison))
            fitted = winner.fitted
        else:
            usual.append(winner.effect)
            base, fitted = _widen_base(bench, base, winner, whiten), winner.fitted
        is_newest_settled = len(accepted) > counted
        effects = [effect for effect in effects if effect not in usual]
        fitted, whiten, comparison = compare_at_optimum(bench, fitted, not_accepted(effects, accepted), whiten)
        base = _refit_base(bench, base, whiten)
    found = SearchResult(bench, base, fitted, tuple(accepted), tuple(unnamed), whiten, first, comparison)
    if len(accepted) > 1:
        return _exchange_effects(found, effects, len(accepted) - is_newest_settled)
    return found


def _worth_a_look(
    bench: Bench,
    comparison: ModelComparison,
    effects: Sequence[Effect],
    model: tuple[FittedModel, float],
    whiten: Whitener,
) -> Iterator[RefinedEffect]:
    """Yield a rival that, with a companion, explains clearly more than the winner, then a winner by far: a rival that turns
    out to be no finding does not take its place. model: the present one, and what its causes explain."""
    winner = comparison.winner
    if saves_enough(
        winner, saved_share(bench, model[0], winner, whiten, model[1])
    ):  # a trifle's name needs no foresight
        best = _pick_with_companions(bench, comparison, effects, whiten)
        if best is not winner:
            yield best
            if comparison.shares.get(winner.effect.name, 0.0) < _UNDISPUTED_SHARE:
                return
    yield winner


def _saved_if_sound(
    bench: Bench, comparison: ModelComparison, winner: RefinedEffect, model: tuple[FittedModel, float], whiten: Whitener
) -> float:
    """Share of the held-out squared error that an effect saves; 0 where it may be the work of a wrong form, or of noise."""
    fitted, explained = model
    saved = saved_share(bench, fitted, winner, whiten, explained)
    if not (saved > 0.0 and is_more_than_a_wrong_form(winner, saved, explained)):
        return 0.0
    return saved if stands_in_its_own_noise(bench, fitted, winner, comparison.starts, whiten) else 0.0


def _is_finding(winner: RefinedEffect, before: FittedModel, comparison: ModelComparison) -> bool:
    """Return whether the winner's size is more than every machine has."""
    return is_noticeable((winner.effect, winner.form), winner.fitted, before, comparison.hints)


def compare_at_optimum(
    bench: Bench, fitted: FittedModel, effects: Sequence[Effect], whiten: Whitener
) -> tuple[FittedModel, Whitener, ModelComparison]:
    """Return what `compare_under_noise` does, of a model whose optimum no effect has shown to be a local one.

    An effect that moves the model to a better optimum gains by that, whatever it is: a drift of 0.02 N in half a minute had
    93 % for itself where the base model had found half of the friction.
    """
    found = compare_under_noise(bench, fitted, effects, whiten)
    fitted, whiten, comparison = found
    if not comparison.ranked or not is_significant(comparison.winner, comparison.starts):
        return found
    winner = comparison.winner
    lone = _refit_from(bench, winner.fitted, fitted, winner.form, whiten)
    if fitted.chi2 - lone.chi2 < _OF_THE_MODEL * winner.gain:
        return found
    return compare_under_noise(bench, lone, effects, whiten)


def _refit_from(
    bench: Bench, beside: FittedModel, fitted: FittedModel, form: EffectForm, whiten: Whitener
) -> FittedModel:
    """The model `fitted` again, from where it stands beside an effect of this form, without that."""
    paths = {each.path for each in fitted.free}
    own = with_start_of(form, form.parameters, [True] * len(bench.measurements))
    gone = tuple(each for each in own if each.path not in paths)
    parameters = reset_parameters(beside.parameters, fitted.parameters, gone)
    return refine(bench, [FitProblem(parameters, fitted.free)], whiten, waves=_WAVES_WITHOUT)[0]


def compare_under_noise(
    bench: Bench, fitted: FittedModel, effects: Sequence[Effect], whiten: Whitener
) -> tuple[FittedModel, Whitener, ModelComparison]:
    """Return the model at its optimum under the noise that its remainder shows, that noise, and the effects compared so.

    Where even the winner leaves several times that noise, no model is near the truth yet, and a whitening that believes
    in one would look at the fastest details only: the noise is then what the best model leaves.
    """
    progress.report("looking for lines, steps and jumps in the residual")
    hints = search_hints(bench, fitted, whiten)
    found = simulate_candidates(bench, fitted, effects, hints)
    whiten = coloured_whitener(bench, *unexplained_residual(found, fitted), whiten.weights)
    before, fitted = fitted, refit(bench, fitted, whiten)
    columns = found if _is_next_to(bench, before, fitted) else None
    comparison = compare_effects(bench, fitted, Competitors(effects, hints, columns=columns), whiten)
    if comparison.ranked and comparison.winner.fitted.chi2 > _DISCREPANT_CHI2_PER_ROW * int(bench.usable.sum()):
        best = min((each.fitted for each in comparison.ranked), key=lambda each: bench.rms_n(each.residual_n))
        whiten = coloured_whitener(bench, best.residual_n, orthonormal(best.jacobian), whiten.weights)
        fitted = refit(bench, fitted, whiten, waves=_WAVES_DISCREPANT)
        comparison = compare_effects(bench, fitted, Competitors(effects, hints), whiten)
    return fitted, whiten, comparison


def _is_next_to(bench: Bench, before: FittedModel, after: FittedModel) -> bool:
    """Are two fits so much alike that an effect changes the same in both? What is refined begins there only."""
    simulated_n, moved_n = (bench.measured_n - before.residual_n)[bench.judged], after.residual_n - before.residual_n
    return bench.rms_n(moved_n) < _NEXT_TO * float(np.std(simulated_n))


def _refit_base(bench: Bench, fitted: FittedModel, whiten: Whitener) -> FittedModel:
    """The same model at its optimum under another noise."""
    return refit(bench, fitted, whiten, waves=_WAVES_AGAIN)


def not_accepted(effects: Sequence[Effect], accepted: Sequence[AcceptedEffect]) -> list[Effect]:
    """Return the effects that are not in the model yet."""
    taken = {each.effect.name for each in accepted}
    return [effect for effect in effects if effect.name not in taken]


def _pick_with_companions(
    bench: Bench, comparison: ModelComparison, effects: Sequence[Effect], whiten: Whitener
) -> RefinedEffect:
    """The winner; or a rival of another kind that, together with its best companion, explains clearly more.

    Two causes together may look like a third one. Looked at only where resampling does not decide.
    """
    winner = comparison.winner
    rivals = [each for each in comparison.ranked[1:] if _is_rival(each, winner, comparison)][:_MOST_RIVALS]
    if not rivals:
        return winner
    costs = [_cost_with_companion(bench, each, effects, comparison.hints, whiten) for each in (winner, *rivals)]
    best = int(np.argmin(costs))
    return (winner, *rivals)[best] if costs[best] < costs[0] - CHI2_MARGIN else winner


def _is_rival(other: RefinedEffect, winner: RefinedEffect, comparison: ModelComparison) -> bool:
    """Does resampling let this one win now and then, and is it neither the same effect nor a relative?"""
    name = other.effect.name
    is_other = name != winner.effect.name and name not in winner.effect.group
    return (
        is_other and comparison.shares.get(name, 0.0) >= _LEAST_RIVAL_SHARE and is_significant(other, comparison.starts)
    )


def _cost_with_companion(
    bench: Bench, first: RefinedEffect, effects: Sequence[Effect], hints: SearchHints, whiten: Whitener
) -> float:
    """Return chi-square and penalty of an effect and of the best one beside it; starts by the same hints as without it."""
    others = [effect for effect in effects if effect.name != first.effect.name]
    comparison = compare_effects(bench, first.fitted, Competitors(others, hints, most=_COMPANIONS), whiten)
    found = [each.fitted.chi2 + each.penalty for each in comparison.ranked if is_significant(each, comparison.starts)]
    return first.penalty + min([first.fitted.chi2, *found])


def _widen_base(bench: Bench, base: FittedModel, usual: RefinedEffect, whiten: Whitener) -> FittedModel:
    """The base model with an effect of a size that every machine has: no finding, and no work for another name."""
    parameters = reset_parameters(base.parameters, usual.fitted.parameters, usual.form.parameters)
    return refine(
        bench, [FitProblem(parameters, joined_parameters(bench, base, usual.form))], whiten, waves=_WAVES_WIDENED
    )[0]


def _exchange_effects(found: SearchResult, effects: Sequence[Effect], doubtful: int) -> SearchResult:
    """Return the search's result after each of the first `doubtful` accepted effects was taken out and all that are not in
    the model competed for its place.

    It competes itself with the optimum that it has already reached. One that nothing joined since has just won beside the
    same others.
    """
    bench, whiten = found.bench, found.whiten
    for index in range(doubtful - 1, -1, -1):
        if len(found.accepted) < 2:
            break
        incumbent, before, after = found.accepted[index], found.accepted[:index], found.accepted[index + 1 :]
        progress.report(f"comparing {incumbent.effect.name} with all others once more")
        lone = refit_without(bench, found, incumbent, (*before, *after))
        hints = search_hints(bench, lone, whiten)
        held = refined_effect(bench, (incumbent.effect, incumbent.form), found.fitted, lone, whiten)
        competitors = Competitors(not_accepted(effects, (*before, *after)), hints, incumbent=held)
        comparison = compare_effects(bench, lone, competitors, whiten)
        winner = comparison.winner
        if is_significant(winner, comparison.starts):
            kept = AcceptedEffect(winner.effect, winner.form, comparison)
            found = replace(found, fitted=winner.fitted, accepted=(*before, kept, *after))
        else:
            found = replace(found, fitted=lone, accepted=(*before, *after))
    return found


def refit_without(
    bench: Bench, found: SearchResult, taken: AcceptedEffect, beside: Sequence[AcceptedEffect]
) -> FittedModel:
    """Return the model without one effect, its parameters back where the base model has them, refitted."""
    fitted, base = found.fitted, found.base
    kept = {parameter.path for each in beside for parameter in each.form.parameters}
    own = with_start_of(taken.form, taken.form.parameters, [True] * len(bench.measurements))
    gone: tuple[Parameter, ...] = tuple(each for each in own if each.path not in kept)
    paths = {each.path for each in gone}
    free = tuple(each for each in fitted.free if each.path not in paths)
    return refine(
        bench,
        [FitProblem(reset_parameters(fitted.parameters, base.parameters, gone), free)],
        found.whiten,
        waves=_WAVES_WITHOUT,
    )[0]
