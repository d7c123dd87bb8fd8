"""A look at what the model leaves: does it depend on anything at all?

Each question is a handful of columns beside the model; the answer counts only beyond chance over all questions asked, on the
whitened residual. The measured force is never a regressor: its own noise would answer (false findings in nearly every
run of a prototype); the simulated force is. What has no shape at all is asked of the power, block by block.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Final

import numpy as np

from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.light_statistics import log_chi2_tail
from gateway.diagnosis.measurement import Floats
from gateway.diagnosis.model_fit.levenberg_marquardt import FittedModel
from gateway.diagnosis.model_fit.normal_equations import NormalEquations, model_span
from gateway.diagnosis.noise.whitening import Whitener
from gateway.diagnosis.residuals.leftovers import describe_leftover, is_one_thing
from gateway.diagnosis.residuals.regressors import Regressors, list_regressors
from gateway.diagnosis.residuals.unsteadiness import find_unsteadiness
from gateway.diagnosis.result import Leftover

RESOLUTION_N: Final = 1.0e-4
"""What the simulation itself resolves: its rigid friction gives by a nanometre, 4e-5 N on the usual pad."""
_SIGNIFICANCE: Final = 1.0e-3  # of a false answer over all questions
_LEAST_SHARE: Final = 0.01  # of the whitened squared residual
_OWN_POWER: Final = 1.0e-6  # of a column's power that the model must leave: rounding ...
_OWN_POWER_IN_DOUBT: Final = (
    0.01  # ... and where times are in doubt: of the rate, a fitted delay leaves the corners only
)
_REGRESSORS_AT_ONCE: Final = 16  # questions
_MOST_DEPENDENCES: Final = 6
MOST_LEFTOVERS: Final = 3  # that are told


@dataclass(frozen=True, slots=True)
class Dependence:
    """A question that the residual answers. gain: chi-square beside the model; share: of the whitened squared residual;
    sizes: of the regressors' columns, N."""

    regressors: Regressors
    gain: float
    share: float
    log_chance: float
    sizes: Floats

    @property
    def contribution_n(self) -> Floats:
        """Force that it explains, (rows,)."""
        return np.asarray(self.sizes @ self.regressors.columns)


def strongest_dependence(
    bench: Bench, fitted: FittedModel, whiten: Whitener, given: Collection[Dependence], *, outside: bool
) -> Dependence | None:
    """Return the most telling answer beyond chance that was not given yet; `outside`: only what no named effect covers."""
    if bench.rms_n(fitted.residual_n) < RESOLUTION_N:
        return None
    white = whiten(fitted.residual_n)
    known = {(each.regressors.depends_on, each.regressors.shape) for each in given}
    asked = (
        each
        for each in list_regressors(bench, fitted.residual_n, white)
        if (each.outside or not outside) and (each.depends_on, each.shape) not in known
    )
    return _strongest(bench, fitted, whiten, asked)


def _strongest(bench: Bench, fitted: FittedModel, whiten: Whitener, asked: Iterator[Regressors]) -> Dependence | None:
    """Some at a time: a thousand columns would be gigabytes at once."""
    span, white = model_span(fitted, whiten), whiten.spectra(fitted.residual_n)
    total = max(float(white @ white), 1.0)
    least_power = _OWN_POWER if whiten.knows_times else _OWN_POWER_IN_DOUBT
    tried, best = 0, None
    while some := list(islice(asked, _REGRESSORS_AT_ONCE)):
        tried += sum(each.among for each in some)
        columns = whiten.spectra(bench.reduce(np.vstack([each.columns for each in some])))
        found = [
            each
            for each in _dependences(NormalEquations(span, columns), some, total, least_power)
            if each.share >= _LEAST_SHARE
        ]
        best = min([*found, *([best] if best else [])], key=lambda each: each.log_chance, default=None)
    return best if best and best.log_chance < np.log(_SIGNIFICANCE / tried) else None


def _dependences(
    normal: NormalEquations, asked: Sequence[Regressors], total: float, least_power: float
) -> Iterator[Dependence]:
    """Each question's gain beside the model; `normal` holds the columns of all of them in order. A column of which the model
    leaves less than the share `least_power` does not ask any more what its name says."""
    at = 0
    for regressors in asked:
        indices = list(range(at, at + regressors.columns.shape[0]))
        at += len(indices)
        usable = [k for k in indices if normal.power[k] > least_power * max(normal.raw_power[k], 1.0e-300)]
        added = normal.add(usable) if usable else None
        gain, sizes = added.gain if added else 0.0, np.zeros(len(indices))
        sizes[[k - indices[0] for k in usable]] = added.sizes if added else 0.0
        chance = log_chi2_tail(gain, len(indices)) + float(np.log(regressors.among))
        yield Dependence(regressors, gain, gain / total, chance, sizes)


def find_dependences(
    bench: Bench, fitted: FittedModel, whiten: Whitener, given: Sequence[Dependence]
) -> tuple[Leftover, ...]:
    """Return what the search gave already, then what the residual still depends on, the most telling first: one leftover for
    each thing, and no more than a reader can follow.

    Each answer is taken out before the next question.
    """
    found, distinct = list(given), list[Dependence]()
    for each in found:
        distinct += [each] if _is_new(bench, each, distinct) else []
    while len(found) < _MOST_DEPENDENCES and len(distinct) < MOST_LEFTOVERS:
        dependence = strongest_dependence(bench, fitted, whiten, found, outside=False)
        if dependence is None:
            break
        distinct += [dependence] if _is_new(bench, dependence, distinct) else []
        found.append(dependence)
        taken = np.vstack([fitted.jacobian, bench.reduce(dependence.regressors.columns)])
        fitted = FittedModel(fitted.parameters, fitted.free, fitted.residual_n, fitted.chi2, taken)
    shares = [_share_of_left(bench, each, fitted, given) for each in distinct]
    leftovers = [
        describe_leftover(bench, each.regressors, each.sizes, share)
        for each, share in zip(distinct, shares, strict=True)
    ]
    kinds = {each.regressors.kind for each in distinct}
    is_uneven = bool(kinds & {"jump", "slow"})  # these are louder somewhere themselves
    if not is_uneven and bench.rms_n(fitted.residual_n) >= RESOLUTION_N:
        leftovers += find_unsteadiness(bench, fitted, whiten)
    return tuple(leftovers[:MOST_LEFTOVERS])


def _share_of_left(bench: Bench, dependence: Dependence, fitted: FittedModel, given: Sequence[Dependence]) -> float:
    """Return its share of what is left. Of a line that is its power: noise with a line in it is what the residual is whitened
    by, and little of a strong one is left there. given: what the search has taken out of the residual."""
    if not dependence.regressors.frequency_hz:
        return dependence.share
    line_n2 = float(np.mean(dependence.contribution_n[bench.judged] ** 2))
    rest_n2 = float(np.mean(fitted.residual_n[bench.judged] ** 2))
    is_out = any(dependence is each for each in given)
    return line_n2 / max(rest_n2 + (line_n2 if is_out else 0.0), line_n2)


def _is_new(bench: Bench, dependence: Dependence, distinct: Sequence[Dependence]) -> bool:
    """Return whether it is of another thing than all of these."""
    return not any(
        is_one_thing(
            dependence.regressors, each.regressors, (dependence.contribution_n, each.contribution_n), bench.judged
        )
        for each in distinct
    )
