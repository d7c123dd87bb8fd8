"""All starts of all effects as columns: what each would change in the readings, from the twin itself. One wave."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.catalogue.effect import ANY, Effect, Form, Scene, Start
from gateway.diagnosis.measurement import Floats
from gateway.diagnosis.search.bench import Bench
from gateway.diagnosis.search.levenberg_marquardt import Fitted, Whiten
from gateway.diagnosis.search.normal_equations import Normal, Screened
from gateway.diagnosis.search.parameters import Point, started

_LARGEST_STRETCH: Final = 3.0  # how far beyond its start a response that is not proportional is believed
_HOPELESS: Final = 8.0  # chi-square: half of what 1 % over a hundred starts asks for
_FAR_BEHIND: Final = 0.25
_QUARTER: Final = {"rad": 0.5 * math.pi, "deg": 90.0}


@dataclass(frozen=True, slots=True)
class Candidate:
    """One start of one form; columns: where its one or two columns stand."""

    effect: Effect
    form: Form
    start: Start
    columns: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Wave:
    """Candidates and their raw columns (columns, rows), at the point where they were computed."""

    candidates: tuple[Candidate, ...]
    columns: Floats


def wave(bench: Bench, fitted: Fitted, effects: Iterable[Effect], scene: Scene) -> Wave:
    """Every start of these effects that the recording's columns allow."""
    points: list[Point] = []
    candidates: list[Candidate] = []
    taken = {parameter.path for parameter in fitted.free}
    for effect in effects:
        for form in effect.forms:
            if set(form.needs) <= scene.columns and not taken & {parameter.path for parameter in form.parameters}:
                for start in _starts(form, fitted.point, scene):
                    starts = [start, _quarter_turn(form, start)] if form.quadrature else [start]
                    indices = tuple(range(len(points), len(points) + len(starts)))
                    points += [started(fitted.point, form, each) for each in starts]
                    candidates.append(Candidate(effect, form, start, indices))
    if not points:
        return Wave((), np.empty((0, bench.rows)))
    centre = bench.measured_n - fitted.residual_n
    return Wave(tuple(candidates), bench.reduced(bench.simulate(points) - centre * bench.usable))


def _starts(form: Form, point: Point, scene: Scene) -> tuple[Start, ...]:
    """The form's own, and the way back to nothing where the plant already has the effect."""
    starts, size = form.probes(scene), form.parameters[0]
    there = point.value(size) - size.null
    if not starts or there == 0.0 or size.null >= ANY or form.quadrature:
        return starts
    return (*starts, (-there, *starts[0][1:]))


def _quarter_turn(form: Form, start: Start) -> Start:
    return (*start[:-1], start[-1] + _QUARTER[form.parameters[-1].unit])


@dataclass(frozen=True, slots=True)
class Score:
    """What a candidate promises: gain in chi-square to first order, and where to begin its refinement.

    power: chi-square that its start would leave if it were not in the model; alone: share of it that the model cannot absorb.
    """

    candidate: Candidate
    gain: float
    point: Point
    power: float = 0.0
    alone: float = 0.0


def scores(found: Wave, fitted: Fitted, whiten: Whiten) -> list[Score]:
    """Every candidate's promise beside the present model."""
    normal = Normal(whiten(fitted.jacobian), whiten(found.columns), whiten(fitted.residual_n))
    return [_with_power(_score(candidate, normal, fitted.point), normal) for candidate in found.candidates]


def _with_power(score: Score, normal: Normal) -> Score:
    columns = list(score.candidate.columns)
    power, raw_power = normal.power[columns], np.maximum(normal.raw_power[columns], 1.0e-300)
    return replace(score, power=float(np.max(power)), alone=float(np.max(power / raw_power)))


def _score(candidate: Candidate, normal: Normal, point: Point) -> Score:
    screened = normal.add(list(candidate.columns))
    if candidate.form.quadrature:
        start = _turned(candidate, screened)
        return Score(candidate, screened.gain, started(point, candidate.form, start))
    size = float(screened.sizes[0])
    if candidate.form.proportional:
        return Score(candidate, screened.gain, _sized(candidate, point, size))
    return _bounded(candidate, normal, point, size)


def _turned(candidate: Candidate, screened: Screened) -> Start:
    along, across = (float(size) for size in screened.sizes)
    unit = candidate.form.parameters[-1].unit
    angle = math.atan2(across, along)
    turn = math.degrees(angle) if unit == "deg" else angle
    start = candidate.start
    return (start[0] * math.hypot(along, across), *start[1:-1], start[-1] + turn)


def _bounded(candidate: Candidate, normal: Normal, point: Point, size: float) -> Score:
    """A response that is no straight line: the size counts as far as it is believed."""
    column = candidate.columns[0]
    limit = candidate.form.exact or candidate.form.parameters[0].null >= ANY  # a fall from UNLIMITED has one size
    kept = min(max(size, 0.0 if _at_low(candidate, point) else -1.0), 1.0 if limit else _LARGEST_STRETCH)
    kept = 1.0 if candidate.form.exact else kept
    gain = float(2.0 * kept * normal.slope[column] - kept**2 * normal.power[column])
    begin = (
        started(point, candidate.form, candidate.start)
        if limit
        else _sized(candidate, point, kept if kept < 0.0 else max(kept, 0.2))
    )
    return Score(candidate, max(gain, 0.0) if kept != 0.0 else 0.0, begin)


def _at_low(candidate: Candidate, point: Point) -> bool:
    """Would a smaller size than now leave the bounds? Asked in the direction of the start."""
    parameter, way = candidate.form.parameters[0], candidate.start[0]
    value = point.value(parameter)
    return value <= parameter.low if way > 0.0 else value >= parameter.high


def _sized(candidate: Candidate, point: Point, size: float) -> Point:
    sizes = tuple(
        number if parameter.shape else number * size
        for parameter, number in zip(candidate.form.parameters, candidate.start, strict=True)
    )
    return started(point, candidate.form, sizes)


def best_of_each(found: Sequence[Score], most: int) -> list[Score]:
    """The best starts, at most one per form, the strongest `most` effects (each with up to two forms).

    None at all where the best could not be significant even if its refinement doubled its gain, and none that is far
    behind the best.
    """
    best = max((each.gain for each in found), default=0.0)
    if best < _HOPELESS:
        return []
    found = [each for each in found if each.gain > _FAR_BEHIND * best]
    chosen: dict[tuple[str, int], Score] = {}
    for score in sorted(found, key=lambda each: -each.gain):
        chosen.setdefault((score.candidate.effect.name, id(score.candidate.form)), score)
    names: list[str] = []
    result: list[Score] = []
    for score in chosen.values():
        name = score.candidate.effect.name
        if score.gain <= 0.0 or (name not in names and len(names) == most):
            continue
        names += [name] if name not in names else []
        if sum(each.candidate.effect.name == name for each in result) < 2:
            result.append(score)
    return result


def remainder(found: Wave, fitted: Fitted) -> tuple[Floats, Floats]:
    """What is left of the residual when every column may take its share, and the orthonormal columns (k, rows)."""
    rows = np.vstack([fitted.jacobian, found.columns])
    norms = np.sqrt(np.sum(rows**2, axis=1))
    rows = rows[norms > 0.0] / norms[norms > 0.0, None]
    gram = rows @ rows.T
    sizes, vectors = np.linalg.eigh(gram)
    kept = sizes > 1.0e-5
    basis = (vectors[:, kept].T @ rows) / np.sqrt(sizes[kept])[:, None]
    residual = fitted.residual_n
    return residual - (residual @ basis.T) @ basis, basis
