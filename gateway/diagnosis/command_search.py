"""Steps and dead bands of the command that the remainder shows: where a search for them has to begin.

Both change the command itself, in jumps: a saw tooth of n teeth is met only by a step within 1/(2n) of the true one, and
a dead band decides at each command anew. So sizes are tried densely, with the gain and lag of the base model and no
friction, which costs one filter each; the twin then refines the best few.
"""

import math
from collections.abc import Callable
from typing import Final, TypeAlias

import numpy as np

from gateway.diagnosis.bench import Bench
from gateway.diagnosis.catalogue_regulator import LAG
from gateway.diagnosis.measurement import Floats
from gateway.diagnosis.noise import Whitener
from gateway.diagnosis.refine import Fitted

Change: TypeAlias = Callable[[Floats, Floats], Floats]
"""(command of the rows, sizes tried) -> what each size does to the command, (sizes, rows)."""

_SMALLEST_STEP_V: Final = 0.02
_USUAL_STEPS_V: Final = (10.0 / 1023.0, 10.0 / 511.0, 10.0 / 255.0, 5.0 / 1023.0, 5.0 / 255.0)
_LARGEST_SPAN_V: Final = 20.0  # a command beyond it is no voltage
_BANDS_V: Final = np.geomspace(0.004, 0.8, 360)
_FINER: Final = 0.012  # about a size that was found
_APART: Final = 0.04  # sizes closer than this are one
_BEST: Final = 3
_AT_ONCE: Final = 64


def likely_steps_v(bench: Bench, fitted: Fitted, whiten: Whitener) -> tuple[float, ...]:
    """Steps of the command whose saw tooth is most like the residual, the best first."""
    return _likely(bench, fitted, whiten, _steps_v(_span_v(bench)), _rounded) if _span_v(bench) > 0.0 else ()


def likely_dead_bands_pa(bench: Bench, fitted: Fitted, whiten: Whitener) -> tuple[float, ...]:
    """Dead bands of the target whose jumps are most like the residual, the best first."""
    if _span_v(bench) == 0.0:
        return ()
    regulator = fitted.point.plant.regulator
    scale = regulator.full_scale_pa / regulator.full_scale_v
    return tuple(band_v * scale for band_v in _likely(bench, fitted, whiten, _BANDS_V, _unnoticed))


def _span_v(bench: Bench) -> float:
    spans = [float(np.ptp(each.command_v)) for each in bench.measurements if each.command_v is not None]
    return min(max(spans, default=0.0), _LARGEST_SPAN_V)


def _steps_v(span_v: float) -> Floats:
    steps, step = [], _SMALLEST_STEP_V
    while step < min(0.5 * span_v, 1.0):
        steps.append(step)
        step *= 1.0 + min(0.5 * step / max(span_v, step), 0.05)
    return np.array([*steps, *_USUAL_STEPS_V])


def _rounded(command_v: Floats, steps_v: Floats) -> Floats:
    return np.asarray(np.round(command_v / steps_v[:, None]) * steps_v[:, None] - command_v)


def _unnoticed(command_v: Floats, bands_v: Floats) -> Floats:
    """What a regulator that ignores small changes holds, less what it is told."""
    held = np.zeros(bands_v.size)
    found = np.empty((bands_v.size, command_v.size))
    for row, told in enumerate(command_v):
        held = np.where(np.abs(told - held) > bands_v, told, held)
        found[:, row] = held - told
    return found


def _likely(bench: Bench, fitted: Fitted, whiten: Whitener, tried: Floats, change: Change) -> tuple[float, ...]:
    lag_s, residual = fitted.point.value(LAG), whiten(fitted.residual_n)
    gains = _gains(bench, tried, change, lag_s, residual, whiten)
    best: list[float] = []
    for size in tried[np.argsort(-gains)]:
        if all(abs(size / other - 1.0) > _APART for other in best):
            best.append(float(size))
        if len(best) == _BEST:
            break
    finer = [size * np.linspace(1.0 - _FINER, 1.0 + _FINER, 41) for size in best]
    return tuple(float(near[int(np.argmax(_gains(bench, near, change, lag_s, residual, whiten)))]) for near in finer)


def _gains(bench: Bench, tried: Floats, change: Change, lag_s: float, residual: Floats, whiten: Whitener) -> Floats:
    """Chi-square that each size explains of the whitened residual; some at a time, a long recording has many rows."""
    found = []
    for sizes in np.array_split(tried, -(-tried.size // _AT_ONCE)):
        vectors = np.zeros((sizes.size, bench.rows))
        for segment in bench.segments:
            measurement = bench.measurements[segment.recording]
            if segment.is_force and measurement.command_v is not None:
                row_s = float(np.median(np.diff(measurement.time_s)))
                vectors[:, segment.rows] = _lagged(change(measurement.command_v, sizes), lag_s, row_s)
        vectors = whiten(bench.reduced(vectors))
        power = np.maximum(np.sum(vectors**2, axis=1), 1.0e-300)
        found.append(np.maximum(vectors @ residual, 0.0) ** 2 / power)
    return np.concatenate(found)


def _lagged(command_v: Floats, lag_s: float, row_s: float) -> Floats:
    """Behind the regulator's lag; a row sees the command of the row before."""
    from scipy.signal import lfilter

    share = 1.0 - math.exp(-row_s / max(lag_s, 1.0e-6))
    return np.asarray(lfilter([0.0, share], [1.0, share - 1.0], command_v, axis=1))
