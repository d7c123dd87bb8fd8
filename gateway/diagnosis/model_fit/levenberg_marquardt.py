"""Levenberg-Marquardt for several problems at once: every wave of simulations serves all of them.

A wave costs about the same for one plant and for sixty, so candidates are refined side by side, and each damping is
tried for each of them in one wave.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Final

import numpy as np

from gateway import progress
from gateway.catalogue.effect import Parameter
from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.bench.parameters import ModelParameters
from gateway.diagnosis.measurement import Floats
from gateway.diagnosis.noise.whitening import Whitener
from gateway.twin.replay.cache import numbers_at_once

_DAMPINGS: Final = (0.0, 1.0, 30.0)  # tried side by side: Gauss-Newton, and two steps as careful as that goes wrong
_SECANT_SHARE: Final = 0.02  # of a size that is there: large against the twin's steps, small against its bends
_LEAST_PROGRESS: Final = 0.02  # a gain in chi-square below this share of one row's is no progress ...
_LEAST_GAIN: Final = 1.0e-5  # ... nor one below this share of chi-square itself
_CATCHES_UP: Final = 5.0  # times its last gain, that a problem may be behind the best: gains shrink from wave to wave


@dataclass(frozen=True, slots=True)
class FittedModel:
    """A problem at its present point.

    free: parameters that move, beside one offset per recording. residual_n: raw (rows,). jacobian: raw derivatives of
    the simulation (columns, rows), offsets first, then `free`. chi2: of the whitened residual.
    """

    parameters: ModelParameters
    free: tuple[Parameter, ...]
    residual_n: Floats
    chi2: float
    jacobian: Floats

    @property
    def size(self) -> int:
        """Number of what is fitted: offsets and free parameters."""
        return len(self.parameters.offsets_n) + len(self.free)


@dataclass(frozen=True, slots=True)
class FitProblem:
    """Where a fit begins, and which parameters it moves beside the offsets."""

    parameters: ModelParameters
    free: tuple[Parameter, ...]


@dataclass(frozen=True, slots=True)
class Contest:
    """Problems of which the best is wanted: one that is too far behind to catch up is refined no further.

    best_chi2: of a rival that has been refined before. least_gain: share of chi-square that a step must gain to be progress.
    """

    best_chi2: float = inf
    least_gain: float = _LEAST_GAIN


def refine(
    bench: Bench, problems: Sequence[FitProblem], whiten: Whitener, waves: int, contest: Contest | None = None
) -> list[FittedModel]:
    """Move each problem's free parameters and offsets to the least whitened squares, in at most `waves` waves.

    contest: None where every problem is wanted for itself.
    """
    fitted = linearise(bench, problems, whiten)
    active = list(range(len(fitted)))
    for wave in range(waves):
        if not active:
            break
        progress.advance(wave + 1, waves)
        gains = _step_all(bench, fitted, active, whiten)
        least_gain = contest.least_gain if contest else _LEAST_GAIN
        active = [k for k in active if gains[k] > max(_LEAST_PROGRESS, least_gain * fitted[k].chi2)]
        if contest:
            best = min(contest.best_chi2, *(each.chi2 for each in fitted))
            active = [k for k in active if fitted[k].chi2 - best <= _CATCHES_UP * gains[k]]
        problems = [FitProblem(fitted[k].parameters, fitted[k].free) for k in active]
        for k, found in zip(active, linearise(bench, problems, whiten), strict=True):
            fitted[k] = found
    return fitted


def _step_all(bench: Bench, fitted: list[FittedModel], active: Sequence[int], whiten: Whitener) -> dict[int, float]:
    """Move each active problem by its best step; return what each gained in chi-square."""
    gains = dict.fromkeys(active, 0.0)
    for k, found in zip(active, _try_steps(bench, [fitted[k] for k in active], whiten), strict=True):
        if found is not None:
            gains[k] = fitted[k].chi2 - found.chi2
            fitted[k] = found
    return gains


def linearise(bench: Bench, problems: Sequence[FitProblem], whiten: Whitener) -> list[FittedModel]:
    """Return the residual and derivatives of each problem where it stands; one wave."""
    most = max(1, numbers_at_once() // bench.rows)
    result: list[FittedModel] = []
    some: list[FitProblem] = []
    for problem in problems:
        if some and sum(1 + len(each.free) for each in (*some, problem)) > most:
            result += _linearise_at_once(bench, some, whiten)
            some = []
        some.append(problem)
    return result + (_linearise_at_once(bench, some, whiten) if some else [])


def _linearise_at_once(bench: Bench, problems: Sequence[FitProblem], whiten: Whitener) -> list[FittedModel]:
    parameter_sets: list[ModelParameters] = []
    for problem in problems:
        parameter_sets.append(problem.parameters)
        parameter_sets += [_secant(problem.parameters, parameter)[0] for parameter in problem.free]
    simulated = bench.simulate(parameter_sets)
    result, at = [], 0
    for problem in problems:
        centre = simulated[at]
        rows = [_offset_column(bench, recording) for recording in range(len(problem.parameters.offsets_n))]
        for k, parameter in enumerate(problem.free):
            step = _secant(problem.parameters, parameter)[1]
            rows.append((simulated[at + 1 + k] - centre) / step if step else np.zeros_like(centre))
        at += 1 + len(problem.free)
        residual = bench.residuals(centre)
        jacobian = bench.reduce(np.array(rows)) if rows else np.empty((0, bench.rows))
        result.append(FittedModel(problem.parameters, problem.free, residual, float(_chi2(residual, whiten)), jacobian))
    return result


def _secant(parameters: ModelParameters, parameter: Parameter) -> tuple[ModelParameters, float]:
    """A neighbour in one parameter, and how far it is: 0 where the limit is so far that no step changes it."""
    value = parameters.value(parameter)
    own = parameter.shape or abs(value) >= 1.0e11  # 2 % of a frequency or a pitch is many turns over a minute
    step = parameter.step if own else max(parameter.step, _SECANT_SHARE * abs(value))
    with_value = parameters.with_value(parameter, value + step if value + step <= parameter.high else value - step)
    return with_value, with_value.value(parameter) - value


def _offset_column(bench: Bench, recording: int) -> Floats:
    column = np.zeros(bench.rows)
    for channel in bench.channels:
        if channel.recording == recording and channel.is_force:
            column[channel.rows] = 1.0
    return column


def _try_steps(bench: Bench, fitted: Sequence[FittedModel], whiten: Whitener) -> list[FittedModel | None]:
    """The best of a few damped steps of each problem; None where no step is better."""
    trials = [_damped_steps(each, whiten) for each in fitted]
    simulated = bench.simulate([parameters for parameter_sets in trials for parameters in parameter_sets])
    residuals = bench.residuals(simulated).reshape(len(fitted), len(_DAMPINGS), -1)
    chi2 = _chi2(residuals, whiten)
    result: list[FittedModel | None] = []
    for k, each in enumerate(fitted):
        best = int(np.argmin(chi2[k]))
        if chi2[k, best] < each.chi2:
            result.append(
                replace(each, parameters=trials[k][best], residual_n=residuals[k, best], chi2=float(chi2[k, best]))
            )
        else:
            result.append(None)
    return result


def _chi2(residuals: Floats, whiten: Whitener) -> Floats:
    """Whitened sum of squares of each residual (..., rows)."""
    spectra = whiten.spectra(residuals)
    return np.asarray(np.einsum("...i,...i->...", spectra, spectra))


def _damped_steps(fitted: FittedModel, whiten: Whitener) -> list[ModelParameters]:
    """Where Gauss-Newton steps of each damping lead."""
    columns = whiten.spectra(fitted.jacobian)
    normal_matrix, slope = columns @ columns.T, columns @ whiten.spectra(fitted.residual_n)
    return [_damped_step(fitted, normal_matrix, slope, damping) for damping in _DAMPINGS]


def _damped_step(fitted: FittedModel, normal_matrix: Floats, slope: Floats, damping: float) -> ModelParameters:
    """Where a damped step leads; a parameter that would leave its bounds stays, the others step again."""
    scale = np.sqrt(np.maximum(np.diag(normal_matrix), 1.0e-300))
    scaled = normal_matrix / np.outer(scale, scale) + np.diag(np.full(scale.size, 1.0e-9 + 0.1 * damping))
    held = np.zeros(scale.size, dtype=bool)
    values = np.array([*fitted.parameters.offsets_n, *(fitted.parameters.value(each) for each in fitted.free)])
    low = np.array([*(-np.inf for _ in fitted.parameters.offsets_n), *(each.low for each in fitted.free)])
    high = np.array([*(np.inf for _ in fitted.parameters.offsets_n), *(each.high for each in fitted.free)])
    step = np.zeros(scale.size)
    for _ in range(3):
        free = ~held
        if not free.any():
            break
        step[:] = 0.0
        step[free] = np.linalg.solve(scaled[np.ix_(free, free)], (slope / scale)[free]) / scale[free]
        beyond = free & (((values + step) < low) | ((values + step) > high)) & ((values <= low) | (values >= high))
        if not beyond.any():
            break
        held |= beyond
    return _apply_values(fitted, np.clip(values + step, low, high))


def _apply_values(fitted: FittedModel, values: Floats) -> ModelParameters:
    count = len(fitted.parameters.offsets_n)
    parameters = fitted.parameters.with_offsets(values[:count].tolist())
    for parameter, value in zip(fitted.free, values[count:], strict=True):
        parameters = parameters.with_value(parameter, float(value))
    return parameters
