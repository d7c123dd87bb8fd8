"""One round of the search: every effect competes to explain what the present model leaves.

All starts in one wave, the best few refined jointly with the model, then compared by resampling blocks of time: the
winner's name stands only if it wins nearly always; otherwise the group of those that win sometimes is the answer.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.random import default_rng

from gateway.catalogue.catalogue import BY_NAME
from gateway.catalogue.effect import Effect, Form, Parameter, Scene
from gateway.diagnosis.measurement import Floats
from gateway.diagnosis.search.bench import Bench
from gateway.diagnosis.search.candidates import Score, Wave, best_of_each, scores, wave
from gateway.diagnosis.search.levenberg_marquardt import Fitted, Problem, Whiten, refine
from gateway.diagnosis.search.normal_equations import block_sums

FINALISTS: Final = 6
_RESAMPLES: Final = 500
_SHARE: Final = 0.95  # a name that wins this often stands alone
_SMALL_SHARE: Final = 0.03  # rarer winners do not belong to a group
_ALIKE: Final = 0.75  # share of the gain that a relative must explain to stay in the group
_WAVES: Final = 6
_DEFENDED: Final = 0.04
_SEED: Final = 20


@dataclass(frozen=True, slots=True)
class Finalist:
    """An effect refined jointly with the model. dof: parameters that it added.

    defence: chi-square by which a rival must beat it, because it stood in the model before.
    """

    effect: Effect
    form: Form
    fitted: Fitted
    gain: float  # in chi-square
    dof: int
    block_chi2: Floats
    defence: float = 0.0

    @property
    def penalised(self) -> float:
        return self.gain - self.price

    @property
    def price(self) -> float:
        """What its parameters and its rarity cost, less its defence, in chi-square."""
        return 2.0 * self.dof + self.effect.rarity - self.defence


@dataclass(frozen=True, slots=True)
class Contest:
    """Finalists beside the model `beside`, the strongest first.

    shares: how often each name wins under resampling; starts: how many were tried in all.
    """

    beside: Fitted
    finalists: tuple[Finalist, ...]
    shares: dict[str, float]
    scene: Scene
    starts: int
    scores: tuple[Score, ...]

    @property
    def winner(self) -> Finalist:
        return self.finalists[0]

    def group(self, name: str) -> tuple[str, ...]:
        """Names that this recording cannot tell from `name`, itself first.

        Those that win when blocks are resampled; and those that the catalogue calls hard to tell from it and that explain
        nearly as much: no form of an effect is exact, so a small lead of one form proves nothing among relatives.
        """
        own = max((each.gain for each in self.finalists if each.effect.name == name), default=0.0)
        relatives = BY_NAME[name].group
        alike = {
            each.effect.name for each in self.finalists if each.effect.name in relatives and each.gain > _ALIKE * own
        }
        if self.shares.get(name, 0.0) < _SHARE:
            alike |= {each for each, share in self.shares.items() if share >= _SMALL_SHARE}
        ranked = sorted(alike - {name}, key=lambda each: -self.shares.get(each, 0.0))
        return (name, *ranked)


def significant(finalist: Finalist, starts: int) -> bool:
    """Chi-square at 1 % over the number of starts."""
    from scipy.stats import chi2 as chi2_law  # here, so that the catalogue costs no scipy

    return bool(chi2_law.sf(finalist.gain, max(finalist.dof, 1)) < 0.01 / max(starts, 1))


def hold(
    bench: Bench,
    fitted: Fitted,
    effects: Iterable[Effect],
    scene: Scene,
    whiten: Whiten,
    *,
    holder: Finalist | None = None,
    most: int = FINALISTS,
) -> Contest:
    """Let these effects compete beside the model `fitted`, which stands at its own optimum.

    holder: an effect that has been refined before and defends its place; most: effects that become finalists.
    """
    found = wave(bench, fitted, effects, scene)
    promised = scores(found, fitted, whiten)
    best = best_of_each(promised, most)
    problems = [Problem(each.point, joined(fitted, each.candidate.form)) for each in best]
    refined = refine(bench, problems, whiten, _WAVES)
    finalists = [
        finalist(bench, score.candidate.effect, score.candidate.form, each, fitted, whiten)
        for score, each in zip(best, refined, strict=True)
    ]
    finalists += [replace(holder, defence=_defence(bench, holder))] if holder else []
    finalists.sort(key=lambda each: -each.penalised)
    return Contest(fitted, tuple(finalists), _shares(finalists), scene, _starts(found, scene), tuple(promised))


def _defence(bench: Bench, holder: Finalist) -> float:
    """Where the whole model is still far from the noise, a few percent of gain are no reason to change a cause."""
    per_row = holder.fitted.chi2 / max(int(bench.usable.sum()), 1)
    return _DEFENDED * holder.gain * min(max((per_row - 1.1) / 0.4, 0.0), 1.0)


def joined(fitted: Fitted, form: Form) -> tuple[Parameter, ...]:
    """What moves when a form joins a model; what is settled stands as the start has it."""
    return (*fitted.free, *(each for each in form.parameters if each not in fitted.free and not each.settled))


def finalist(bench: Bench, effect: Effect, form: Form, refined: Fitted, beside: Fitted, whiten: Whiten) -> Finalist:
    """An effect at its optimum, against the model without it."""
    block_chi2 = block_sums(bench, whiten(refined.residual_n) ** 2)
    dof = len(refined.free) - len(beside.free)
    return Finalist(effect, form, refined, beside.chi2 - refined.chi2, dof, block_chi2)


def _shares(finalists: Sequence[Finalist]) -> dict[str, float]:
    """How often each name has the least chi-square, two per parameter added, over resampled blocks."""
    if not finalists:
        return {}
    blocks = finalists[0].block_chi2.size
    weights = default_rng(_SEED).multinomial(blocks, np.full(blocks, 1.0 / blocks), size=_RESAMPLES)
    costs = np.array([each.block_chi2 @ weights.T + each.price for each in finalists])
    wins = np.bincount(np.argmin(costs, axis=0), minlength=len(finalists)) / _RESAMPLES
    shares: dict[str, float] = {}
    for finalist, won in zip(finalists, wins, strict=True):
        shares[finalist.effect.name] = shares.get(finalist.effect.name, 0.0) + float(won)
    return shares


def _starts(found: Wave, scene: Scene) -> int:
    """Starts tried; a line or a pitch was chosen among as many as the rows can tell apart."""
    rows = scene.duration_s / max(scene.row_s, 1.0e-6)
    searched = sum(each.form.quadrature and len(each.start) == 3 for each in found.candidates)
    return len(found.candidates) + (int(rows / 4.0) if searched else 0)
