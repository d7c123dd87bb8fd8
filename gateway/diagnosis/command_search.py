"""Steps and dead bands of the command that the remainder shows: where a search for them has to begin.

Both change the command itself, in jumps: a saw tooth of n teeth is met only by a step within 1/(2n) of the true one, and
a dead band decides at each command anew. So sizes are tried densely. Friction cannot be left out: it swallows just the
small changes that they make. Dead bands are tried in the twin; steps need so many that they go through a lag and a play
of the force only, and the twin refines the best few.
"""

import math
from typing import Final

import numpy as np

from gateway.diagnosis.bench import Bench
from gateway.diagnosis.catalogue_cylinder import AREA, COULOMB
from gateway.diagnosis.catalogue_regulator import DEAD_BAND, LAG
from gateway.diagnosis.gram import Normal
from gateway.diagnosis.measurement import Floats
from gateway.diagnosis.noise import Whitener
from gateway.diagnosis.point import Point
from gateway.diagnosis.refine import Fitted

_SMALLEST_STEP_V: Final = 0.02
_USUAL_STEPS_V: Final = (10.0 / 1023.0, 10.0 / 511.0, 10.0 / 255.0, 5.0 / 1023.0, 5.0 / 255.0)
_LARGEST_SPAN_V: Final = 20.0  # a command beyond it is no voltage
_BANDS_V: Final = np.geomspace(0.004, 0.8, 160)
_FINER: Final = 0.012  # about a size that was found
_APART: Final = 0.04  # sizes closer than this are one
_LOOKED_AT: Final = 8
_BEST: Final = 3
_WHOLE: Final = 0.35  # a step that explains best when shrunk below this share of itself is not the step
_AT_ONCE: Final = 64


def likely_steps_v(bench: Bench, fitted: Fitted, whiten: Whitener) -> tuple[float, ...]:
    """Steps of the command whose saw tooth is most like the residual, the best first."""
    return _likely(bench, fitted, whiten, _steps_v(_span_v(bench))) if _span_v(bench) > 0.0 else ()


def likely_dead_bands_pa(bench: Bench, fitted: Fitted, whiten: Whitener) -> tuple[float, ...]:
    """Dead bands of the target with which the twin explains most of the residual, the best first."""
    if _span_v(bench) == 0.0:
        return ()
    regulator = fitted.point.plant.regulator
    bands_pa = _BANDS_V * regulator.full_scale_pa / regulator.full_scale_v
    simulated = bench.simulate([fitted.point.moved(DEAD_BAND, band_pa) for band_pa in bands_pa])
    present = (bench.measured_n - fitted.residual_n) * bench.usable
    normal = Normal(whiten(fitted.jacobian), whiten(bench.reduced(simulated - present)), whiten(fitted.residual_n))
    return tuple(bands_pa[np.argsort(normal.power - 2.0 * normal.slope)[:_BEST]].tolist())


def _span_v(bench: Bench) -> float:
    spans = [float(np.ptp(each.command_v)) for each in bench.measurements if each.command_v is not None]
    return min(max(spans, default=0.0), _LARGEST_SPAN_V)


def _steps_v(span_v: float) -> Floats:
    steps, step = [], _SMALLEST_STEP_V
    while step < min(0.5 * span_v, 1.0):
        steps.append(step)
        step *= 1.0 + min(0.5 * step / max(span_v, step), 0.05)
    return np.array([*steps, *_USUAL_STEPS_V])


def _likely(bench: Bench, fitted: Fitted, whiten: Whitener, tried: Floats) -> tuple[float, ...]:
    gains = _gains(bench, fitted, tried, whiten)
    best: list[float] = []
    for size in tried[np.argsort(-gains)]:
        if all(abs(size / other - 1.0) > _APART for other in best):
            best.append(float(size))
        if len(best) == _LOOKED_AT:
            break
    finer = np.array([size * np.linspace(1.0 - _FINER, 1.0 + _FINER, 41) for size in best])
    gains = _gains(bench, fitted, finer.ravel(), whiten).reshape(finer.shape)
    sharpest = finer[np.arange(len(best)), np.argmax(gains, axis=1)]
    return tuple(sharpest[np.argsort(-np.max(gains, axis=1))[:_BEST]].tolist())


def _gains(bench: Bench, fitted: Fitted, tried: Floats, whiten: Whitener) -> Floats:
    """Chi-square that each size explains of the whitened residual; some at a time, a long recording has many rows."""
    found = []
    for sizes in np.array_split(tried, -(-tried.size // _AT_ONCE)):
        vectors = np.zeros((sizes.size, bench.rows))
        for segment in bench.segments:
            measurement = bench.measurements[segment.recording]
            if segment.is_force and measurement.command_v is not None:
                row_s = float(np.median(np.diff(measurement.time_s)))
                vectors[:, segment.rows] = _rounding_error(measurement.command_v, sizes, row_s, fitted.point).T
        normal = Normal(whiten(fitted.jacobian), whiten(bench.reduced(vectors)), whiten(fitted.residual_n))
        power = np.maximum(normal.power, 1.0e-300)
        found.append(np.where(normal.slope > _WHOLE * power, normal.slope**2 / power, 0.0))
    return np.concatenate(found)


def _rounding_error(command_v: Floats, steps_v: Floats, row_s: float, point: Point) -> Floats:
    """What each step makes of the force, in volts, (rows, steps)."""
    rounded = np.round(command_v[:, None] / steps_v) * steps_v
    both = _lagged(np.concatenate([rounded, command_v[:, None]], axis=1), point.value(LAG), row_s)
    regulator, friction_pa = point.plant.regulator, point.value(COULOMB) / point.value(AREA)
    played = _dragged(both, friction_pa * regulator.full_scale_v / regulator.full_scale_pa)
    return np.asarray(played[:, :-1] - played[:, -1:])


def _lagged(command_v: Floats, lag_s: float, row_s: float) -> Floats:
    """Behind the regulator's lag; a row sees the command of the row before."""
    from scipy.signal import lfilter

    share = 1.0 - math.exp(-row_s / max(lag_s, 1.0e-6))
    return np.asarray(lfilter([0.0, share], [1.0, share - 1.0], command_v, axis=0))


def _dragged(values: Floats, half_width: float) -> Floats:
    """Play operator along the rows: what rigid friction lets through."""
    low, high, found = values - half_width, values + half_width, np.empty_like(values)
    state = np.maximum(low[0], 0.0)
    for least, most, out in zip(low, high, found, strict=True):
        np.maximum(state, least, out=out)
        np.minimum(out, most, out=out)
        state = out
    return found
