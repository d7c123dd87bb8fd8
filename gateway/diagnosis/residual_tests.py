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

from gateway.diagnosis.light_statistics import chi2_tail, log_chi2_tail
from gateway.diagnosis.measurement import Floats, Measurement
from gateway.diagnosis.noise import Whitener
from gateway.diagnosis.residual_regressors import Regressors, list_regressors
from gateway.diagnosis.result import Leftover
from gateway.diagnosis.search.bench import BLOCKS, Bench
from gateway.diagnosis.search.levenberg_marquardt import FittedModel
from gateway.diagnosis.search.normal_equations import NormalEquations, model_span

_RESOLUTION_N: Final = 1.0e-4
"""What the simulation itself resolves: its rigid friction gives by a nanometre, 4e-5 N on the usual pad."""
_SIGNIFICANCE: Final = 1.0e-3  # of a false answer over all questions
_LEAST_SHARE: Final = 0.01  # of the whitened squared residual
_OWN_POWER: Final = 1.0e-6  # of a column's power that the model must leave: rounding ...
_OWN_POWER_IN_DOUBT: Final = (
    0.01  # ... and where times are in doubt: of the rate, a fitted delay leaves the corners only
)
_REGRESSORS_AT_ONCE: Final = 60  # questions
_MOST_DEPENDENCES: Final = 6
_SURROUNDING_LINES: Final = 14  # lines to either side that a wandering line stands out of
_LEAST_PEAK_RATIO: Final = 16.0  # times their mean


@dataclass(frozen=True, slots=True)
class Dependence:
    """A question that the residual answers. gain: chi-square beside the model; share: of the whitened squared residual."""

    regressors: Regressors
    gain: float
    share: float
    log_chance: float

    @property
    def leftover(self) -> Leftover:
        return Leftover(self.regressors.depends_on, self.regressors.shape, min(self.share, 1.0))


def strongest_dependence(
    bench: Bench, fitted: FittedModel, whiten: Whitener, given: Collection[Leftover], *, outside: bool
) -> Dependence | None:
    """Return the most telling answer beyond chance that was not given yet; `outside`: only what no named effect covers."""
    if bench.rms_n(fitted.residual_n) < _RESOLUTION_N:
        return None
    white = whiten(fitted.residual_n)
    known = {(each.depends_on, each.shape) for each in given}
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
        columns = whiten.spectra(bench.reduced(np.vstack([each.columns for each in some])))
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
        gain = normal.add(usable).gain if usable else 0.0
        chance = log_chi2_tail(gain, len(indices)) + float(np.log(regressors.among))
        yield Dependence(regressors, gain, gain / total, chance)


def find_dependences(
    bench: Bench, fitted: FittedModel, whiten: Whitener, given: Sequence[Leftover]
) -> tuple[Leftover, ...]:
    """Return what the search gave already, then everything that the residual still depends on, the most telling first.

    Each answer is taken out before the next question.
    """
    leftovers = list(given)
    while len(leftovers) < _MOST_DEPENDENCES:
        dependence = strongest_dependence(bench, fitted, whiten, leftovers, outside=False)
        if dependence is None:
            break
        leftovers.append(dependence.leftover)
        taken = np.vstack([fitted.jacobian, bench.reduced(dependence.regressors.columns)])
        fitted = FittedModel(fitted.parameters, fitted.free, fitted.residual_n, fitted.chi2, taken)
    return (*leftovers, *_find_unsteadiness(bench, fitted, whiten))


def _find_unsteadiness(bench: Bench, fitted: FittedModel, whiten: Whitener) -> Iterator[Leftover]:
    """What has no shape but a time: noise that is louder in some stretches, lines that wander."""
    if bench.rms_n(fitted.residual_n) < _RESOLUTION_N:
        return
    white = whiten(fitted.residual_n)
    times_are_sure = whiten.knows_times and all(map(_evenly_sampled, bench.measurements))
    for channel in bench.channels:
        if channel.is_force:
            part = white[channel.rows]
            counted = part[bench.usable[channel.rows]]
            if counted.size < BLOCKS or not counted.any():
                continue
            levels = np.array([np.mean(block**2) for block in np.array_split(counted, BLOCKS)])
            usual = float(np.median(levels))
            apart = np.sum((levels / levels.mean() - 1.0) ** 2) * counted.size / BLOCKS / 2.0
            if chi2_tail(apart, BLOCKS - 1) < _SIGNIFICANCE and times_are_sure:
                share = float(np.sum(np.maximum(levels - usual, 0.0)) / np.sum(levels))
                yield Leftover("time", "louder at some times than at others", share)
            if (share := _wandering_share(part)) > _LEAST_SHARE:
                yield Leftover("time", "a line that wanders, or comes and goes", share)


def _evenly_sampled(measurement: Measurement) -> bool:
    """Are rows hardly missing? Whitening takes rows for evenly spaced; where they are not, noise seems to come and go."""
    rows_s = np.diff(measurement.time_s)
    return float(np.mean(rows_s > 1.9 * np.median(rows_s))) < 0.02


def _wandering_share(part: Floats) -> float:
    """Share of the power in lines that stand out of their surroundings in single blocks."""
    standing, total = 0.0, 0.0
    for block in np.array_split(part, BLOCKS):
        power = np.abs(np.fft.rfft(block * np.hanning(block.size))) ** 2
        total += float(power.sum())
        if power.size < 7:
            continue
        best = int(np.argmax(power[3:-3])) + 3
        around = np.r_[power[max(best - _SURROUNDING_LINES, 1) : best - 2], power[best + 3 : best + _SURROUNDING_LINES]]
        if around.size and power[best] > _LEAST_PEAK_RATIO * float(around.mean()):
            standing += float(power[best - 2 : best + 3].sum())
    return standing / max(total, 1.0e-300)
