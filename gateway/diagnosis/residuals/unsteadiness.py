"""What is left without a form but a time: noise that is louder in some stretch, a line that wanders or comes and goes."""

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.diagnosis.bench.bench import BLOCKS, Bench, Channel
from gateway.diagnosis.light_statistics import chi2_tail
from gateway.diagnosis.measurement import Floats, Measurement
from gateway.diagnosis.model_fit.levenberg_marquardt import FittedModel
from gateway.diagnosis.model_fit.normal_equations import orthonormal
from gateway.diagnosis.noise.whitening import Whitener
from gateway.diagnosis.residuals.leftovers import propose_experiment
from gateway.diagnosis.result import Leftover

_SIGNIFICANCE: Final = 1.0e-3  # of noise that seems louder somewhere by chance
_LOUD_RATIO: Final = 1.5  # of the usual power, that belongs to the loudest stretch
_SURROUNDING_LINES: Final = 14  # lines to either side that a wandering line stands out of
_LEAST_PEAK_RATIO: Final = 16.0  # times their mean: noise has such a line in one of thirty recordings ...
_SURE_PEAK_RATIO: Final = 40.0  # ... so one block alone must show this much, or ...
_LEAST_BLOCKS: Final = 2  # ... so many blocks a line
_LEAST_SHARE: Final = 0.01  # of the power
_MOST_GAPS: Final = 0.02  # of the rows


def find_unsteadiness(bench: Bench, fitted: FittedModel, whiten: Whitener) -> Iterator[Leftover]:
    """Yield at most one stretch that is louder, and one line that wanders.

    Noise can be called louder only where the times of all rows are sure: whitening takes rows for evenly spaced.
    """
    white = whiten(fitted.residual_n)
    model = whiten(fitted.jacobian)
    scale = np.sqrt(np.maximum(np.sum(model**2, axis=1), 1.0e-300))
    basis = orthonormal(model / scale[:, None])
    left = white - (white @ basis.T) @ basis
    channels = [each for each in bench.channels if each.is_force]
    loud: list[Leftover | None] = []
    if whiten.knows_times and all(map(_evenly_sampled, bench.measurements)):
        loud = [_loud_stretch(bench, fitted.residual_n, left, each) for each in channels]
    for found in (loud, [_wandering_line(bench, fitted.residual_n, left, each) for each in channels]):
        leftovers = [each for each in found if each is not None]
        if leftovers:
            yield max(leftovers, key=lambda each: each.share)


def _evenly_sampled(measurement: Measurement) -> bool:
    """Are rows hardly missing? Where they are, noise seems to come and go."""
    rows_s = np.diff(measurement.time_s)
    return float(np.mean(rows_s > 1.9 * np.median(rows_s))) < _MOST_GAPS


def _loud_stretch(bench: Bench, residual_n: Floats, white: Floats, channel: Channel) -> Leftover | None:
    """The stretch in which the residual is louder than chance allows."""
    rows = channel.rows.start + np.flatnonzero(bench.usable[channel.rows])
    if rows.size < BLOCKS or not white[rows].any():
        return None
    blocks = np.array_split(rows, BLOCKS)
    levels = np.array([np.mean(white[block] ** 2) for block in blocks])
    apart = np.sum((levels / levels.mean() - 1.0) ** 2) * rows.size / BLOCKS / 2.0
    if not chi2_tail(float(apart), BLOCKS - 1) < _SIGNIFICANCE:
        return None
    usual = float(np.median(levels))
    loud = _about(int(np.argmax(levels)), levels > _LOUD_RATIO * usual)
    inside, outside = (
        np.concatenate([block for block, here in zip(blocks, kept, strict=True) if here] or [rows])
        for kept in (loud, ~loud)
    )
    inside_n, outside_n = (float(np.sqrt(np.mean(residual_n[each] ** 2))) for each in (inside, outside))
    time_s = bench.time_s()
    shape = when = f"from {time_s[inside[0]]:.0f} to {time_s[inside[-1]]:.0f} s"
    shape = f"louder {when}: {inside_n:.2g} N against {outside_n:.2g} N elsewhere"
    share = float(np.sum(np.maximum(levels - usual, 0.0)) / np.sum(levels))
    return Leftover(
        "time", shape, share, amplitude_n=inside_n, file=_file(bench, channel), experiment=propose_experiment("loud")
    )


def _about(peak: int, is_high: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The blocks about the peak without a gap between them, the peak's own included."""
    found = np.zeros_like(is_high)
    found[peak] = True
    for way in (-1, 1):
        block = peak + way
        while 0 <= block < is_high.size and is_high[block]:
            found[block] = True
            block += way
    return found


def _wandering_line(bench: Bench, residual_n: Floats, white: Floats, channel: Channel) -> Leftover | None:
    """A line that stands out of its surroundings in single blocks."""
    measurement = bench.measurements[channel.recording]
    row_s = float(np.median(np.diff(measurement.time_s)))
    total, lines = 0.0, list[tuple[float, float, float]]()
    for block in np.array_split(white[channel.rows], BLOCKS):
        power = np.abs(np.fft.rfft(block * np.hanning(block.size))) ** 2
        total += float(power.sum())
        if power.size < 7:
            continue
        best = int(np.argmax(power[3:-3])) + 3
        around = np.r_[power[max(best - _SURROUNDING_LINES, 1) : best - 2], power[best + 3 : best + _SURROUNDING_LINES]]
        if around.size and power[best] > _LEAST_PEAK_RATIO * float(around.mean()):
            hertz = best / (block.size * row_s)
            lines.append((hertz, float(power[best - 2 : best + 3].sum()), float(power[best] / around.mean())))
    share = sum(power for _, power, _ in lines) / max(total, 1.0e-300)
    is_chance = len(lines) < _LEAST_BLOCKS and not any(ratio > _SURE_PEAK_RATIO for *_, ratio in lines)
    if share <= _LEAST_SHARE or is_chance:
        return None
    hertz = float(np.average([line[0] for line in lines], weights=[line[1] for line in lines]))
    amplitude_n = float(np.sqrt(2.0 * share * BLOCKS / len(lines))) * float(np.std(residual_n[channel.rows]))
    shape = f"a line about {hertz:.3g} Hz that wanders, or comes and goes, {amplitude_n:.2g} N while it is there"
    return Leftover(
        "time",
        shape,
        share,
        frequency_hz=hertz,
        amplitude_n=amplitude_n,
        file=_file(bench, channel),
        experiment=propose_experiment("line", hertz=hertz),
    )


def _file(bench: Bench, channel: Channel) -> str:
    return bench.measurements[channel.recording].name if len(bench.measurements) > 1 else ""
