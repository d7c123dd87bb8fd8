"""All starts of all effects as columns: what each would change in the readings, from the twin itself. One wave."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway import progress
from gateway.catalogue.effect import Effect, EffectForm, SearchHints, Start
from gateway.defaults import UNLIMITED
from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.bench.parameters import ModelParameters, apply_start
from gateway.diagnosis.measurement import Floats
from gateway.diagnosis.model_fit.levenberg_marquardt import FittedModel
from gateway.diagnosis.model_fit.normal_equations import ColumnGain, NormalEquations, model_span
from gateway.diagnosis.noise.whitening import Whitener

_LARGEST_STRETCH: Final = 3.0  # how far beyond its start a response that is not proportional is believed
_FAR_BEHIND: Final = 0.25  # of the best gain: what is further behind is not refined
_LEAST_FIRST_STEP: Final = 0.2  # of a start: a refinement that begins at nothing stays there
_INDEPENDENT: Final = 1.0e-5  # eigenvalue of normalised columns below which they are the same column
_AT_ONCE: Final = 32  # columns: there are hundreds, as long as the recordings
_QUARTER: Final = {"rad": 0.5 * math.pi, "deg": 90.0}


@dataclass(frozen=True, slots=True)
class Candidate:
    """One start of one form; columns: where its one or two columns stand."""

    effect: Effect
    form: EffectForm
    start: Start
    columns: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class CandidateColumns:
    """Candidates and their raw columns (columns, rows), at the point where they were computed."""

    candidates: tuple[Candidate, ...]
    columns: Floats


def simulate_candidates(
    bench: Bench, fitted: FittedModel, effects: Iterable[Effect], hints: SearchHints
) -> CandidateColumns:
    """Return every start of these effects that the recording's columns allow."""
    parameter_sets: list[ModelParameters] = []
    candidates: list[Candidate] = []
    taken = {parameter.path for parameter in fitted.free}
    for effect in effects:
        for form in effect.forms:
            if set(form.needs) <= hints.columns and not taken & {parameter.path for parameter in form.parameters}:
                for start in _starts(form, fitted.parameters, hints):
                    starts = [start, _quarter_turn(form, start)] if form.quadrature else [start]
                    indices = tuple(range(len(parameter_sets), len(parameter_sets) + len(starts)))
                    parameter_sets += [apply_start(fitted.parameters, form, each) for each in starts]
                    candidates.append(Candidate(effect, form, start, indices))
    if not parameter_sets:
        return CandidateColumns((), np.empty((0, bench.rows)))
    names = [each.effect.name for each in candidates]
    progress.report(f"trying {len(candidates)} forms and sizes of {len(set(names))} effects")
    return CandidateColumns(tuple(candidates), _changes_n(bench, fitted, parameter_sets))


def _changes_n(bench: Bench, fitted: FittedModel, parameter_sets: Sequence[ModelParameters]) -> Floats:
    """What each of these models has in other readings than the fitted one, (models, rows); a few at a time."""
    found = bench.simulate(parameter_sets)
    centre = (bench.measured_n - fitted.residual_n) * bench.usable
    for first in range(0, found.shape[0], _AT_ONCE):
        some = slice(first, first + _AT_ONCE)
        found[some] = bench.reduce(found[some] - centre)
    return found


def _starts(form: EffectForm, parameters: ModelParameters, hints: SearchHints) -> tuple[Start, ...]:
    """The form's own, and the way back to nothing where the plant already has the effect."""
    starts, size = form.probes(hints), form.parameters[0]
    there = parameters.value(size) - size.null
    if not starts or there == 0.0 or size.null >= UNLIMITED or form.quadrature:
        return starts
    return (*starts, (-there, *starts[0][1:]))


def _quarter_turn(form: EffectForm, start: Start) -> Start:
    return (*start[:-1], start[-1] + _QUARTER[form.parameters[-1].unit])


@dataclass(frozen=True, slots=True)
class CandidateScore:
    """What a candidate promises: gain in chi-square to first order, and where to begin its refinement.

    power: chi-square that its start would leave if it were not in the model; alone: share of it that the model cannot absorb.
    """

    candidate: Candidate
    gain: float
    parameters: ModelParameters
    power: float = 0.0
    alone: float = 0.0


def score_candidates(found: CandidateColumns, fitted: FittedModel, whiten: Whitener) -> list[CandidateScore]:
    """Return every candidate's promise beside the present model."""
    normal = NormalEquations(model_span(fitted, whiten), whiten.spectra(found.columns))
    return [
        _with_power(_score_candidate(candidate, normal, fitted.parameters), normal) for candidate in found.candidates
    ]


def _with_power(score: CandidateScore, normal: NormalEquations) -> CandidateScore:
    columns = list(score.candidate.columns)
    power, raw_power = normal.power[columns], np.maximum(normal.raw_power[columns], 1.0e-300)
    return replace(score, power=float(np.max(power)), alone=float(np.max(power / raw_power)))


def _score_candidate(candidate: Candidate, normal: NormalEquations, parameters: ModelParameters) -> CandidateScore:
    screened = normal.add(list(candidate.columns))
    if candidate.form.quadrature:
        start = _turn_phase(candidate, screened)
        return CandidateScore(candidate, screened.gain, apply_start(parameters, candidate.form, start))
    size = float(screened.sizes[0])
    if candidate.form.proportional:
        return CandidateScore(candidate, screened.gain, _apply_sizes(candidate, parameters, size))
    return _score_bounded(candidate, normal, parameters, size)


def _turn_phase(candidate: Candidate, screened: ColumnGain) -> Start:
    along, across = (float(size) for size in screened.sizes)
    unit = candidate.form.parameters[-1].unit
    angle = math.atan2(across, along)
    turn = math.degrees(angle) if unit == "deg" else angle
    start = candidate.start
    return (start[0] * math.hypot(along, across), *start[1:-1], start[-1] + turn)


def _score_bounded(
    candidate: Candidate, normal: NormalEquations, parameters: ModelParameters, size: float
) -> CandidateScore:
    """A response that is no straight line: the size counts as far as it is believed."""
    column = candidate.columns[0]
    limit = candidate.form.exact or candidate.form.parameters[0].null >= UNLIMITED  # a fall from UNLIMITED has one size
    kept = min(max(size, 0.0 if _is_at_limit(candidate, parameters) else -1.0), 1.0 if limit else _LARGEST_STRETCH)
    kept = 1.0 if candidate.form.exact else kept
    gain = float(2.0 * kept * normal.slope[column] - kept**2 * normal.power[column])
    begin = (
        apply_start(parameters, candidate.form, candidate.start)
        if limit
        else _apply_sizes(candidate, parameters, kept if kept < 0.0 else max(kept, _LEAST_FIRST_STEP))
    )
    return CandidateScore(candidate, max(gain, 0.0) if kept != 0.0 else 0.0, begin)


def _is_at_limit(candidate: Candidate, parameters: ModelParameters) -> bool:
    """Would a smaller size than now leave the bounds? Asked in the direction of the start."""
    parameter, way = candidate.form.parameters[0], candidate.start[0]
    value = parameters.value(parameter)
    return value <= parameter.low if way > 0.0 else value >= parameter.high


def _apply_sizes(candidate: Candidate, parameters: ModelParameters, size: float) -> ModelParameters:
    sizes = tuple(
        number if parameter.shape else number * size
        for parameter, number in zip(candidate.form.parameters, candidate.start, strict=True)
    )
    return apply_start(parameters, candidate.form, sizes)


def best_scores(found: Sequence[CandidateScore], most: int) -> list[CandidateScore]:
    """Return the best starts, at most one per form, the strongest `most` effects (each with up to two forms).

    None that is far behind the best.
    """
    best = max((each.gain for each in found), default=0.0)
    found = [each for each in found if each.gain > _FAR_BEHIND * best]
    chosen: dict[tuple[str, int], CandidateScore] = {}
    for score in sorted(found, key=lambda each: -each.gain):
        chosen.setdefault((score.candidate.effect.name, id(score.candidate.form)), score)
    names: list[str] = []
    result: list[CandidateScore] = []
    for score in chosen.values():
        name = score.candidate.effect.name
        if score.gain <= 0.0 or (name not in names and len(names) == most):
            continue
        names += [name] if name not in names else []
        if sum(each.candidate.effect.name == name for each in result) < 2:
            result.append(score)
    return result


def unexplained_residual(found: CandidateColumns, fitted: FittedModel) -> tuple[Floats, Floats]:
    """Return what is left of the residual when every column may take its share, and the orthonormal columns (k, rows)."""
    rows = np.vstack([fitted.jacobian, found.columns])
    norms = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    rows /= np.where(norms > 0.0, norms, 1.0)[:, None]
    normal_matrix = rows @ rows.T
    sizes, vectors = np.linalg.eigh(normal_matrix)
    kept = sizes > _INDEPENDENT
    basis = vectors[:, kept].T @ rows
    basis /= np.sqrt(sizes[kept])[:, None]
    residual = fitted.residual_n
    return residual - (residual @ basis.T) @ basis, basis
