"""Steps and dead bands of the command that the remainder shows: where a search for them has to begin.

Both change the command itself, in jumps: a saw tooth of n teeth is met only by a step within 1/(20n) of the true one, and
a dead band decides at each command anew. So sizes are tried densely; steps first by the waves that their teeth begin
with, which forgive ten times more, then by the teeth themselves. Friction cannot be left out: it swallows just the
small changes that they make. So many go through a lag and a play of the force only; of dead bands the best few are then
tried in the twin, with rigid friction. The whole twin refines the best.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import numpy as np

from gateway.catalogue.cylinder import AREA, COULOMB
from gateway.catalogue.regulator import DEAD_BAND, LAG
from gateway.diagnosis.bench.bench import Bench, Channel
from gateway.diagnosis.bench.parameters import ChangedValue, ModelParameters
from gateway.diagnosis.measurement import Floats
from gateway.diagnosis.model_fit.levenberg_marquardt import FittedModel
from gateway.diagnosis.model_fit.normal_equations import NormalEquations, model_span
from gateway.diagnosis.noise.whitening import Whitener
from gateway.diagnosis.search.command_loops import (
    ForceChain,
    correlate_dead_bands,
    correlate_roundings,
    fill_first_waves,
    fill_rounding_errors,
)
from gateway.side_by_side import side_by_side
from gateway.twin.elementwise import Real, smaller
from gateway.twin.plant import Plant
from gateway.twin.replay.cache import numbers_at_once

_SMALLEST_STEP_V: Final = 0.0125
_USUAL_STEPS_V: Final = (10.0 / 1023.0, 10.0 / 511.0, 10.0 / 255.0, 5.0 / 1023.0, 5.0 / 255.0)
_LARGEST_SPAN_V: Final = 20.0  # a command beyond it is no voltage
_BANDS_V: Final = np.geomspace(0.004, 0.8, 160)
_FINER_OFFSETS: Final = np.linspace(-1.0, 1.0, 41)  # between the neighbours of a step that was found
_MOST_STEPS_REFINED: Final = 12
_MOST_BANDS_IN_TWIN: Final = 20
_MOST_ANSWERS: Final = 3
_LEAST_WHOLE_STEP: Final = 0.35  # a step that explains best when shrunk below this share of itself is not the step
_FINE_POINTS: Final = ("presliding_m", "stribeck_n", "dwell_stiction_n", "viscous_n_s_per_m", "asymmetry_n_s_per_m")
_BUNCH_SHARE_OF_LAG: Final = 0.25  # of the lag


def likely_steps_v(bench: Bench, fitted: FittedModel, whiten: Whitener) -> tuple[float, ...]:
    """Return steps of the command whose saw tooth is most like the residual, the best first."""
    return _most_likely_steps_v(bench, fitted, whiten, _steps_v(_span_v(bench))) if _span_v(bench) > 0.0 else ()


def likely_dead_bands_pa(bench: Bench, fitted: FittedModel, whiten: Whitener) -> tuple[float, ...]:
    """Return the dead bands of the target with which the twin explains most of the residual, the best first."""
    if _span_v(bench) == 0.0:
        return ()
    regulator, span = fitted.parameters.plant.regulator, model_span(fitted, whiten)
    target = _Target(bench, fitted.parameters, whiten.apply_adjoint(span.left) * bench.usable)
    likely_v = _likely_bands_v(target.correlate(correlate_dead_bands, _BANDS_V))
    bands_pa = likely_v * (regulator.full_scale_pa / regulator.full_scale_v)
    rigid = replace(fitted.parameters, plant=_with_rigid_friction(fitted.parameters.plant))
    dead_band = DEAD_BAND if bench.witnesses is None else ChangedValue(DEAD_BAND, bench.witnesses)
    simulated = bench.simulate([rigid, *(rigid.with_value(dead_band, band_pa) for band_pa in bands_pa)])
    normal = NormalEquations(span, whiten.spectra(bench.reduce(simulated[1:] - simulated[0])))
    return tuple(bands_pa[np.argsort(normal.power - 2.0 * normal.slope)[:_MOST_ANSWERS]].tolist())


def _likely_bands_v(alike: Floats) -> Floats:
    """Return the bands to try in the twin, the likeliest first. Where the command moves in stairs, many bands decide alike at
    each large one, and only the small ones tell them apart, which the likeness may not see: of all that are exactly alike the
    first, the last and some between, not twenty neighbours."""
    kinds, kind = np.unique(alike, return_inverse=True)
    best = np.arange(kinds.size)[::-1][:_MOST_BANDS_IN_TWIN]
    of_each = math.ceil(_MOST_BANDS_IN_TWIN / best.size)
    return np.concatenate([_spread(_BANDS_V[kind == each], of_each) for each in best])


def _spread(values: Floats, most: int) -> Floats:
    """Some of the values, evenly: the first and the last among them; the middle one where only one is wanted."""
    if most >= values.size:
        return values
    return (
        values[values.size // 2 :][:1]
        if most == 1
        else values[np.linspace(0, values.size - 1, most).round().astype(int)]
    )


def _with_rigid_friction(plant: Plant) -> Plant:
    """The same plant with friction that costs little to replay."""
    return replace(plant, friction=replace(plant.friction, **dict.fromkeys(_FINE_POINTS, 0.0)))


def _span_v(bench: Bench) -> float:
    spans = [float(np.ptp(each.command_v)) for each in bench.measurements if each.command_v is not None]
    return min(max(spans, default=0.0), _LARGEST_SPAN_V)


def _steps_v(span_v: float) -> Floats:
    steps, step = [], _SMALLEST_STEP_V
    while step < min(0.5 * span_v, 1.0):
        steps.append(step)
        step *= 1.0 + _spacing(step, span_v)
    return np.array([*steps, *_USUAL_STEPS_V])


def _spacing(step_v: Real, span_v: float) -> Real:
    """Relative distance of steps whose waves differ by a third of a turn at the end of the span."""
    return smaller(step_v / (3.0 * span_v), 0.05)


def _most_likely_steps_v(bench: Bench, fitted: FittedModel, whiten: Whitener, tried: Floats) -> tuple[float, ...]:
    span_v, best = _span_v(bench), list[float]()
    left = whiten.apply_adjoint(model_span(fitted, whiten).left) * bench.usable
    target = _Target(bench, fitted.parameters, left)
    for size in tried[np.argsort(-target.correlate(fill_first_waves, tried, bunched=True))]:
        if all(abs(size / other - 1.0) > 1.5 * _spacing(size, span_v) for other in best):
            best.append(float(size))
        if len(best) == _MOST_STEPS_REFINED:
            break
    finer = np.array([size * (1.0 + _spacing(size, span_v) * _FINER_OFFSETS) for size in best])
    alike = target.correlate(correlate_roundings, finer.ravel()).reshape(finer.shape)
    sharpest = finer[np.arange(len(best)), np.argmax(alike, axis=1)]
    gains = _chi2_gains(bench, fitted, whiten, sharpest)
    return tuple(sharpest[np.argsort(-gains)[:_MOST_ANSWERS]].tolist())


_Fill: TypeAlias = Callable[[Floats, Floats, Floats, ForceChain, tuple[Floats, Floats]], None]


@dataclass(frozen=True, slots=True, eq=False)
class _Target:
    """What sizes of steps and bands are compared with. left: of the residual, weighted as whitening does it twice, (rows,)."""

    bench: Bench
    parameters: ModelParameters
    left: Floats

    def correlate(self, fill: _Fill, tried: Floats, *, bunched: bool = False) -> Floats:
        """Return how much what each size makes of the force goes with the target, in no unit. bunched: a lag is slow."""

        def look(some: Floats) -> Floats:
            slope, power = np.zeros(some.size), np.full(some.size, 1.0e-300)
            for channel, command_v, row_s in _commanded_channels(self.bench):
                bunch = max(round(_BUNCH_SHARE_OF_LAG * self.parameters.value(LAG) / row_s), 1) if bunched else 1
                rows = np.arange(0, command_v.size, bunch)
                sums = np.add.reduceat(self.left[channel.rows], np.maximum(rows - bunch // 2, 0))
                alike, squares = np.empty(some.size), np.empty(some.size)
                fill(command_v[rows], sums, some, _force_chain(self.parameters, bunch * row_s), (alike, squares))
                slope += alike
                power += bunch * squares
            return np.asarray(np.maximum(slope, 0.0) ** 2 / power)

        return np.concatenate(side_by_side(look, np.array_split(tried, 2)))


def _column_parts(columns: int, rows: int) -> Iterator[slice]:
    """Some columns at a time: a long recording has many rows."""
    many = max(numbers_at_once() // rows, 1)
    yield from (slice(first, first + many) for first in range(0, columns, many))


def _commanded_channels(bench: Bench) -> Iterator[tuple[Channel, Floats, float]]:
    """Forces that a command drives: where they stand, the command of each row, V, and the usual distance of rows, s."""
    for channel in bench.channels:
        measurement = bench.measurements[channel.recording]
        is_asked = bench.witnesses is None or channel.recording in bench.witnesses
        if channel.is_force and is_asked and measurement.command_v is not None:
            yield channel, measurement.command_v, float(np.median(np.diff(measurement.time_s)))


def _chi2_gains(bench: Bench, fitted: FittedModel, whiten: Whitener, tried: Floats) -> Floats:
    """Chi-square that each step explains of the whitened residual."""
    found, span = np.zeros(tried.size), model_span(fitted, whiten)
    for part in _column_parts(tried.size, bench.rows):
        vectors = np.zeros((tried[part].size, bench.rows))
        for channel, command_v, row_s in _commanded_channels(bench):
            columns_v = np.empty((tried[part].size, command_v.size))
            fill_rounding_errors(command_v, tried[part], _force_chain(fitted.parameters, row_s), columns_v)
            vectors[:, channel.rows] = columns_v
        normal = NormalEquations(span, whiten.spectra(bench.reduce(vectors)))
        power = np.maximum(normal.power, 1.0e-300)
        found[part] = np.where(normal.slope > _LEAST_WHOLE_STEP * power, normal.slope**2 / power, 0.0)
    return found


def _force_chain(parameters: ModelParameters, row_s: float) -> ForceChain:
    """What lies between command and force."""
    regulator, friction_pa = parameters.plant.regulator, parameters.value(COULOMB) / parameters.value(AREA)
    return ForceChain(
        share=1.0 - math.exp(-row_s / max(parameters.value(LAG), 1.0e-6)),
        play_v=2.0 * friction_pa * regulator.full_scale_v / regulator.full_scale_pa,
    )
