"""The search: add the winner of a contest while it pays, then let every accepted effect compete for its place again.

Rules of acceptance: chi-square at 1 % over the number of starts; a held-out gain over blocks of time that the fit did
not see, in nearly all ways to resample them, and without the blocks that still feel how the recording began; at least
4 % of the held-out squared error, or 2 % where chi-square overwhelms; and, for every effect after the first, a few
percent of what the others explain, or much of the error that is left: no form is exact, and what a cause's wrong form
leaves must not be named. What oscillates does not count there: the rest of a sine is no bent line.
    - Two causes together may look like a third one: where resampling does not decide, the winner's rivals are judged
      with the best companion that each finds.
    - A dependence that no effect has a name for takes its place where it explains clearly more than any effect.
    - An effect of a size that every machine has goes into the base model: it is no finding, and without it its work
      would be done, and its name taken, by another one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.random import default_rng
from numpy.typing import NDArray

from gateway.catalogue.effect import Effect, Form, Parameter, Scene
from gateway.diagnosis.noise import Whitener, coloured
from gateway.diagnosis.residual_tests import Answer, best_answer
from gateway.diagnosis.search.base_fit import refit
from gateway.diagnosis.search.bench import Bench
from gateway.diagnosis.search.candidates import remainder, wave
from gateway.diagnosis.search.hints import scene_of
from gateway.diagnosis.search.levenberg_marquardt import Fitted, Problem, Whiten, refine
from gateway.diagnosis.search.model_comparison import Contest, Finalist, finalist, hold, joined, significant
from gateway.diagnosis.search.normal_equations import block_sums, held_out, orthonormal
from gateway.diagnosis.search.parameters import back_at

MOST_EFFECTS: Final = 5
_DISCREPANT: Final = 3.0  # chi-square per row of the winner
_CLEARLY: Final = 1.15  # a nameless dependence must explain this much more than the best effect ...
_CLEARLY_ALIKE: Final = 1.3  # ... or this much more, where both look at one column ...
_MARGIN: Final = 10.0  # ... and this much more in chi-square
_DOUBT: Final = 0.15  # of resampled blocks may see no gain: an effect may show in two blocks of twenty only
_MOMENTS: Final = 2  # best and worst blocks without which an effect that acts everywhere ...
_ELSEWHERE: Final = 0.3  # ... must save this much of what it saves with them
_OVERWHELMING: Final = 80.0
_RIVALS: Final = 2
_COMPANIONS: Final = 2  # looked at closely for each
_WINS: Final = 0.05  # share from which a rival is looked at
_SEED: Final = 21
_LEAST_GAIN: Final = 0.04  # of the held-out squared error; less is a trifle ...
_LEAST_SURE_GAIN: Final = 0.02  # ... unless chi-square overwhelms
_LEAST_BESIDE: Final = 0.05  # of the chi-square that the effects before it explain ...
_MUCH: Final = 0.15  # ... unless it saves this much of the held-out squared error


@dataclass(frozen=True, slots=True)
class Accepted:
    """An effect of the extended model, and the contest in which it holds its place."""

    effect: Effect
    form: Form
    contest: Contest


@dataclass(frozen=True, slots=True)
class Found:
    """What the search ends with. bench: that of the search without what the nameless dependences explain; first: the contest
    beside the base model alone."""

    bench: Bench
    base: Fitted
    fitted: Fitted
    accepted: tuple[Accepted, ...]
    nameless: tuple[Answer, ...]
    whiten: Whitener
    first: Contest
    last: Contest


Clock = Callable[[str], None]


def search(bench: Bench, base: Fitted, effects: Sequence[Effect], whiten: Whitener, clock: Clock) -> Found:
    """All effects that the recording shows, one after the other. `base` is the refitted base model."""
    base, whiten, contest = _opened(bench, base, effects, whiten)
    clock("first contest")
    first, fitted, accepted, usual = contest, base, list[Accepted](), list[Effect]()
    nameless: list[Answer] = []
    while len(accepted) + len(usual) + len(nameless) < MOST_EFFECTS:
        explained = _explained(base, fitted, accepted)
        winner, saved = None, 0.0
        if contest.finalists and significant(contest.winner, contest.starts):
            winner, saved = contest.winner, _saved(bench, fitted, contest.winner, whiten, explained)
            if _matters(winner, saved):  # the name of a trifle is not worth foresight
                winner = _foreseen(bench, contest, _others(effects, accepted), whiten)
                saved = saved if winner is contest.winner else _saved(bench, fitted, winner, whiten, explained)
            saved *= winner.gain > _LEAST_BESIDE * explained or saved > _MUCH
        answer = best_answer(bench, fitted, whiten, [each.leftover for each in nameless], outside=True)
        strongest = contest.winner if saved > 0.0 else None
        if answer is not None and _stands_beside(answer, strongest, explained):
            nameless.append(answer)
            bench = bench.without_columns(answer.question.columns)
            fitted = refit(bench, fitted, whiten)
        elif winner is None or saved == 0.0:
            break
        elif _matters(winner, saved) and _noticeable(winner, fitted):
            accepted.append(Accepted(winner.effect, winner.form, contest))
            fitted = winner.fitted
        else:
            usual.append(winner.effect)
            base, fitted = _widened(bench, base, winner, whiten), winner.fitted
        effects = [effect for effect in effects if effect not in usual]
        fitted, whiten, contest = _opened(bench, fitted, _others(effects, accepted), whiten)
        base = _revalued(bench, base, whiten)
        clock(f"contest {len(accepted) + len(nameless) + 1}")
    if len(accepted) > 1:
        fitted, accepted = _exchanged(bench, fitted, base, accepted, effects, whiten)
        clock("exchange")
    return Found(bench, base, fitted, tuple(accepted), tuple(nameless), whiten, first, contest)


def _opened(
    bench: Bench, fitted: Fitted, effects: Sequence[Effect], whiten: Whitener
) -> tuple[Fitted, Whitener, Contest]:
    """Noise as the remainder shows it, the model at its optimum under that noise, and the contest beside it.

    Where even the winner leaves several times that noise, no model is near the truth yet, and a whitening that believes
    in one would look at the fastest details only: the noise is then what the best model leaves.
    """
    scene = scene_of(bench, fitted, whiten)
    found = wave(bench, fitted, effects, scene)
    whiten = coloured(bench, *remainder(found, fitted), whiten.weights)
    fitted = refit(bench, fitted, whiten)
    contest = hold(bench, fitted, effects, scene, whiten)
    if contest.finalists and contest.winner.fitted.chi2 > _DISCREPANT * int(bench.usable.sum()):
        best = min((each.fitted for each in contest.finalists), key=lambda each: bench.rms_n(each.residual_n))
        whiten = coloured(bench, best.residual_n, orthonormal(best.jacobian), whiten.weights)
        fitted = refit(bench, fitted, whiten, waves=5)
        contest = hold(bench, fitted, effects, scene, whiten)
    return fitted, whiten, contest


def _revalued(bench: Bench, fitted: Fitted, whiten: Whitener) -> Fitted:
    """The same model at its optimum under another noise."""
    return refit(bench, fitted, whiten, waves=2)


def _others(effects: Sequence[Effect], accepted: Sequence[Accepted]) -> list[Effect]:
    taken = {each.effect.name for each in accepted}
    return [effect for effect in effects if effect.name not in taken]


def _stands_beside(answer: Answer, strongest: Finalist | None, explained: float) -> bool:
    """Is a nameless dependence more than what the effects before it have left, and clearly more than the strongest effect?

    One on the effect's own column may be no more than the effect's form, which is never exact.
    """
    if strongest is None:
        return answer.gain > _LEAST_BESIDE * explained
    times = _CLEARLY_ALIKE if answer.question.depends_on in strongest.form.needs else _CLEARLY
    return answer.gain > times * strongest.gain + _MARGIN


def _explained(base: Fitted, fitted: Fitted, accepted: Sequence[Accepted]) -> float:
    """Chi-square that the model explains by causes whose wrong form could look like another one: not by oscillations."""
    gains = [(each.contest.winner.gain, each.form.quadrature) for each in accepted]
    total = sum(gain for gain, _oscillates in gains)
    shapes = sum(gain for gain, oscillates in gains if not oscillates)
    return max(base.chi2 - fitted.chi2, 0.0) * (shapes / total if total > 0.0 else 1.0)


def _foreseen(bench: Bench, contest: Contest, effects: Sequence[Effect], whiten: Whitener) -> Finalist:
    """The winner; or a rival of another kind that, together with its best companion, explains clearly more.

    Two causes together may look like a third one. Looked at only where resampling does not decide.
    """
    winner = contest.winner
    rivals = [each for each in contest.finalists[1:] if _rivals(each, winner, contest)][:_RIVALS]
    if not rivals:
        return winner
    costs = [_with_companion(bench, each, effects, contest.scene, whiten) for each in (winner, *rivals)]
    best = int(np.argmin(costs))
    return (winner, *rivals)[best] if costs[best] < costs[0] - _MARGIN else winner


def _rivals(other: Finalist, winner: Finalist, contest: Contest) -> bool:
    """Does resampling let this one win now and then, and is it neither the same effect nor a relative?"""
    name = other.effect.name
    is_other = name != winner.effect.name and name not in winner.effect.group
    return is_other and contest.shares.get(name, 0.0) >= _WINS and significant(other, contest.starts)


def _with_companion(bench: Bench, first: Finalist, effects: Sequence[Effect], scene: Scene, whiten: Whitener) -> float:
    """Chi-square and price of an effect and of the best one beside it; starts as in the scene without it."""
    others = [effect for effect in effects if effect.name != first.effect.name]
    contest = hold(bench, first.fitted, others, scene, whiten, most=_COMPANIONS)
    found = [each.fitted.chi2 + each.price for each in contest.finalists if significant(each, contest.starts)]
    return first.price + min([first.fitted.chi2, *found])


def _matters(finalist: Finalist, saved: float) -> bool:
    """Is what it saves of the held-out squared error no trifle?"""
    return saved > (_LEAST_SURE_GAIN if finalist.gain > _OVERWHELMING else _LEAST_GAIN)


def _noticeable(finalist: Finalist, before: Fitted) -> bool:
    """Is its size, or the change of a size that the plant had already, more than every machine has?"""
    size = finalist.form.parameters[0]
    return abs(finalist.fitted.point.value(size) - before.point.value(size)) >= max(
        finalist.effect.least, finalist.form.least
    )


def _widened(bench: Bench, base: Fitted, usual: Finalist, whiten: Whiten) -> Fitted:
    """The base model with an effect of a size that every machine has: no finding, and no work for another name."""
    point = back_at(base.point, usual.fitted.point, usual.form.parameters)
    return refine(bench, [Problem(point, joined(base, usual.form))], whiten, waves=3)[0]


def _saved(bench: Bench, before: Fitted, winner: Finalist, whiten: Whitener, explained: float) -> float:
    """Share of the held-out squared error that it saves; 0 unless it saves in nearly all ways to resample the blocks.

    An effect that shows in one block only (a slide that rests once, a force that is negative once) cannot be resampled;
    an overwhelming chi-square stands for it, also beside what the effects before it have `explained`. Not so for a saw
    tooth: it is there all the time, and among so many teeth some meet the few moments that another form got wrong.
    """
    old = _old_blocks(bench)
    error_before = held_out(bench, before, whiten).errors[old]
    saved = error_before - held_out(bench, winner.fitted, whiten).errors[old]
    weights = default_rng(_SEED).multinomial(saved.size, np.full(saved.size, 1.0 / saved.size), size=400)
    if winner.form.everywhere:
        sure = float(np.sum(np.sort(saved)[_MOMENTS:-_MOMENTS])) > _ELSEWHERE * float(np.sum(saved))
    else:
        overwhelming = winner.gain > max(_OVERWHELMING, 0.5 * explained)
        sure = overwhelming or float(np.quantile(weights @ saved, _DOUBT)) > 0.0
    return max(float(np.sum(saved)), 0.0) / float(np.sum(error_before)) if sure else 0.0


def _old_blocks(bench: Bench) -> NDArray[np.intp]:
    """Blocks that do not feel any more how their recording began: a cause must show without the first seconds, too."""
    counted = block_sums(bench, bench.judged.astype(np.float64))
    young = block_sums(bench, (bench.judged & bench.young).astype(np.float64))
    return np.flatnonzero(young <= 0.5 * counted)


def _exchanged(
    bench: Bench,
    fitted: Fitted,
    base: Fitted,
    accepted: list[Accepted],
    effects: Sequence[Effect],
    whiten: Whitener,
) -> tuple[Fitted, list[Accepted]]:
    """Take each accepted effect out and let all that are not in the model compete for its place.

    It competes itself with the optimum that it has already reached.
    """
    for index in range(len(accepted) - 1, -1, -1):
        if len(accepted) < 2:
            break
        holder, beside = accepted[index], accepted[:index] + accepted[index + 1 :]
        lone = without(bench, fitted, base, holder, beside, whiten)
        scene = scene_of(bench, lone, whiten)
        held = finalist(bench, holder.effect, holder.form, fitted, lone, whiten)
        contest = hold(bench, lone, _others(effects, beside), scene, whiten, holder=held)
        winner = contest.winner
        if not significant(winner, contest.starts):
            fitted, accepted = lone, beside
        else:
            fitted = winner.fitted
            accepted = [*accepted[:index], Accepted(winner.effect, winner.form, contest), *accepted[index + 1 :]]
    return fitted, accepted


def without(
    bench: Bench, fitted: Fitted, base: Fitted, taken: Accepted, beside: Sequence[Accepted], whiten: Whiten
) -> Fitted:
    """The model without one effect, its parameters back where the base model has them, refitted."""
    kept = {parameter.path for each in beside for parameter in each.form.parameters}
    gone: tuple[Parameter, ...] = tuple(each for each in taken.form.parameters if each.path not in kept)
    paths = {each.path for each in gone}
    free = tuple(each for each in fitted.free if each.path not in paths)
    return refine(bench, [Problem(back_at(fitted.point, base.point, gone), free)], whiten, waves=4)[0]
