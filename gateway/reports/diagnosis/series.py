"""What the charts of a diagnosis show, from the rows of a recording: envelopes, means over bins, directions, spectra.

Nothing is thinned by leaving rows out: a million rows become the least and the greatest of each column of the picture, or
the cells of the picture that hold a row. So a spike of one row is seen, and the files stay small.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from gateway.diagnosis.measurement import Floats, Measurement
from gateway.diagnosis.result import Trace

RISING, FALLING = 1, -1
_WALK_ROWS: Final = 20_000  # of the play operator, which is a loop in Python
_PLAY_SHARE: Final = 0.01  # of the drive's range: smaller wobble is no change of direction
_LEAST_ALIKE: Final = 0.5  # of the mean product of two directions: 1 for the same, 0 for unrelated ones
_GAP_STEPS: Final = 3.0
_WELCH_ROWS: Final = 2048
_CONSTANT: Final = 1e-9
_MEAN_BINS: Final = 30
_LEAST_ROWS: Final = 5  # of a bin whose mean is drawn
_DEPENDENCE_BINS: Final = 20
_SPECTRUM_BANDS: Final = 140
_WINDOW_SHARE: Final = 0.08  # of a recording's length


@dataclass(frozen=True, slots=True)
class Envelope:
    """Least and greatest value in each column of a picture; broken where nothing was measured: `pieces` of columns."""

    x: Floats
    low: Floats
    high: Floats
    pieces: tuple[slice, ...]


def envelope(x: Floats, y: Floats, columns: int) -> Envelope:
    """Return the band of y over x. x: rising, shape (rows,); y may hold NaN, which is left out."""
    finite = np.isfinite(x) & np.isfinite(y)
    x, y = x[finite], y[finite]
    if x.size <= columns:
        return Envelope(x, y, y, _split_at_gaps(x, _usual_step(x) * _GAP_STEPS))
    width = max((x[-1] - x[0]) / columns, 1e-300)
    column = np.minimum(((x - x[0]) / width).astype(np.int64), columns - 1)
    starts = np.flatnonzero(np.diff(column, prepend=-1))
    middle = x[0] + (column[starts] + 0.5) * width
    low, high = np.minimum.reduceat(y, starts), np.maximum.reduceat(y, starts)
    return Envelope(middle, low, high, _split_at_gaps(middle, max(_GAP_STEPS * _usual_step(x), 1.5 * width)))


def _usual_step(x: Floats) -> float:
    return float(np.median(np.diff(x))) if x.size > 1 else 1.0


def _split_at_gaps(x: Floats, gap: float) -> tuple[slice, ...]:
    ends = [0, *(np.flatnonzero(np.diff(x) > gap * (1.0 + 1e-9)) + 1).tolist(), x.size]
    return tuple(slice(start, end) for start, end in pairwise(ends) if end > start)


@dataclass(frozen=True, slots=True)
class TraceResiduals:
    """What one recording's judged rows leave: residuals are measured minus simulated. All arrays (judged rows,)."""

    time_s: Floats
    measured_n: Floats
    before_n: Floats
    after_n: Floats

    @classmethod
    def of(cls, trace: Trace) -> "TraceResiduals":
        """Return the residuals of one recording, before and after."""
        measurement = trace.measurement
        usable = measurement.usable
        measured_n = measurement.force_n[usable]
        return cls(
            measurement.time_s[usable],
            measured_n,
            measured_n - trace.before_n[usable],
            measured_n - trace.after_n[usable],
        )


@dataclass(frozen=True, slots=True)
class ResidualRows:
    """The judged rows of all recordings on end: residuals (measured minus simulated) and what they may depend on."""

    before_n: Floats
    after_n: Floats
    quantities: dict[str, Floats]
    direction: Floats


def join_traces(traces: Sequence[Trace]) -> ResidualRows:
    """Join the judged rows of all recordings. quantities: the drive, the time and every covariate, by name; NaN where a
    recording does not have it.
    """
    parts = [_quantities(trace.measurement) for trace in traces]
    names = dict.fromkeys(name for part in parts for name in part)
    usable = [trace.measurement.usable for trace in traces]

    def column(name: str) -> Floats:
        absent = [np.full(int(mask.sum()), np.nan) for mask in usable]
        return np.concatenate(
            [part[name][mask] if name in part else gap for part, mask, gap in zip(parts, usable, absent, strict=True)]
        )

    return ResidualRows(
        np.concatenate([TraceResiduals.of(trace).before_n for trace in traces]),
        np.concatenate([TraceResiduals.of(trace).after_n for trace in traces]),
        {name: column(name) for name in names},
        np.concatenate([direction(trace.measurement)[trace.measurement.usable] for trace in traces]),
    )


def drive(measurement: Measurement) -> tuple[str, Floats]:
    """Return the axis that a loop is drawn over: command, else pressure; time where there is neither."""
    if measurement.command_v is not None:
        return "command (V)", measurement.command_v
    if measurement.pressure_pa is not None:
        return "pressure (kPa)", measurement.pressure_pa / 1e3
    return "time (s)", measurement.time_s


def _quantities(measurement: Measurement) -> dict[str, Floats]:
    label, values = drive(measurement)
    quantities = {label: values}
    if measurement.pressure_pa is not None and measurement.command_v is not None:
        quantities["pressure (kPa)"] = measurement.pressure_pa / 1e3
    if measurement.position_m is not None:
        quantities["position_mm"] = measurement.position_m * 1e3
    return quantities | dict(measurement.covariates)


def direction(measurement: Measurement) -> Floats:
    """Return +1 where rising, -1 where falling, 0 before the first move, shape (rows,): of the slide's position where that
    was measured, else of the drive. Play of a hundredth of the range keeps noise from being a reversal.
    """
    driven = _direction_signs(drive(measurement)[1])
    if measurement.position_m is None or not driven.size:
        return driven
    position_signs = _direction_signs(measurement.position_m)
    if measurement.command_v is None:
        return position_signs
    alike = float(
        np.mean(driven * position_signs)
    )  # a position that ignores the command is the tool's, along the workpiece
    return driven if abs(alike) < _LEAST_ALIKE else position_signs


def _direction_signs(values: Floats) -> Floats:
    every = max(-(-values.size // _WALK_ROWS), 1)
    return np.repeat(_play_operator(values[::every]), every)[: values.size]


def _play_operator(values: Floats) -> Floats:
    ways, way = np.zeros(values.size), 0.0
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        return ways
    output, play = float(finite[0]), _PLAY_SHARE * float(np.ptp(finite))
    for row, value in enumerate(values.tolist()):
        if value > output + play:
            output, way = value - play, float(RISING)
        elif value < output - play:
            output, way = value + play, float(FALLING)
        ways[row] = way
    return ways


@dataclass(frozen=True, slots=True)
class BinMeans:
    """Means over equal bins of what they are drawn against."""

    x: Floats
    mean: Floats


def bin_means(x: Floats, y: Floats) -> BinMeans:
    """Return the means of y over equal bins of x that hold enough rows; NaN is left out."""
    finite = np.isfinite(x) & np.isfinite(y)
    x, y = x[finite], y[finite]
    if x.size == 0 or is_constant(x):
        return BinMeans(np.zeros(0), np.zeros(0))
    place, count = _place_in_bins(x, _MEAN_BINS)
    full = count >= _LEAST_ROWS
    x_sum, y_sum = np.bincount(place, x, _MEAN_BINS), np.bincount(place, y, _MEAN_BINS)
    return BinMeans(x_sum[full] / count[full], y_sum[full] / count[full])


def _place_in_bins(x: Floats, bins: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the number of the bin of each x, of equal bins from the least to the greatest, and how many each of them holds."""
    place = np.minimum(((x - x.min()) / (x.max() - x.min()) * bins).astype(np.int64), bins - 1)
    return place, np.bincount(place, minlength=bins)


def is_constant(values: Floats) -> bool:
    """Return whether there are no two different numbers in it, or none at all."""
    finite = values[np.isfinite(values)]
    return finite.size == 0 or float(np.ptp(finite)) <= _CONSTANT * max(1.0, float(np.abs(finite).max()))


def dependence(x: Floats, y: Floats) -> float:
    """Return the share of the variance of y that its mean over bins of x carries, 0..1; 0 for a few rows."""
    finite = np.isfinite(x) & np.isfinite(y)
    x, y = x[finite], y[finite]
    if x.size < 2 * _DEPENDENCE_BINS or is_constant(x) or is_constant(y):
        return 0.0
    place, count = _place_in_bins(x, _DEPENDENCE_BINS)
    mean = np.bincount(place, y, _DEPENDENCE_BINS) / np.maximum(count, 1)
    between = float(np.sum(count * (mean - y.mean()) ** 2))
    return between / (float(y.var()) * y.size)


def occupied_cells(
    x: Floats, y: Floats, cells: tuple[int, int], limits: tuple[float, float, float, float]
) -> NDArray[np.int64]:
    """Return the cells (column, row) of a picture that hold at least one point, shape (n, 2). limits: x
    low, high, y low, high."""
    x_low, x_high, y_low, y_high = limits
    finite = np.isfinite(x) & np.isfinite(y)
    across = np.clip((x[finite] - x_low) / (x_high - x_low) * cells[0], 0, cells[0] - 1).astype(np.int64)
    up = np.clip((y[finite] - y_low) / (y_high - y_low) * cells[1], 0, cells[1] - 1).astype(np.int64)
    place = np.unique(across * cells[1] + up)
    return np.stack([place // cells[1], place % cells[1]], axis=1)


def spectrum(time_s: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return (frequency Hz, amplitude density N/sqrt(Hz)) by Welch's method over the stretches without gaps.

    The greatest of each of some bands that are equally wide on a logarithmic axis: no line is lost. Empty where no
    stretch is long enough. Rows are brought to equal steps by linear interpolation, which dampens the top of the band.
    """
    if time_s.size < 32:
        return np.zeros(0), np.zeros(0)
    step_s = _usual_step(time_s)
    stretches = [
        np.interp(np.arange(time_s[piece][0], time_s[piece][-1], step_s), time_s[piece], values[piece])
        for piece in _split_at_gaps(time_s, _GAP_STEPS * step_s)
    ]
    longest = max(stretch.size for stretch in stretches)
    rows = min(_WELCH_ROWS, 2 ** int(np.log2(max(longest / 4, 2))))
    long_enough = [stretch for stretch in stretches if stretch.size >= rows]
    if rows < 16:
        return np.zeros(0), np.zeros(0)
    spectra = [signal.welch(stretch, 1.0 / step_s, nperseg=rows, detrend="constant") for stretch in long_enough]
    power = np.average([density for _, density in spectra], axis=0, weights=[stretch.size for stretch in long_enough])
    return _peak_per_band(np.asarray(spectra[0][0])[1:], np.sqrt(power)[1:])


def _peak_per_band(frequency_hz: Floats, density: Floats) -> tuple[Floats, Floats]:
    edges = np.geomspace(frequency_hz[0], frequency_hz[-1] * (1.0 + 1e-9), _SPECTRUM_BANDS + 1)
    band = np.searchsorted(edges, frequency_hz, side="right")
    starts = np.flatnonzero(np.diff(band, prepend=-1))
    peaks = np.maximum.reduceat(density, starts)
    at = [int(start + np.argmax(density[start:end])) for start, end in zip(starts, [*starts[1:], None], strict=True)]
    return frequency_hz[at], peaks


def most_improved_window(residuals: TraceResiduals) -> tuple[float, float]:
    """Return (start, end), s, of the stretch in which the extended model gains most, or where the error is greatest."""
    time_s, before_n, after_n = residuals.time_s, residuals.before_n, residuals.after_n
    span_s = _WINDOW_SHARE * float(time_s[-1] - time_s[0])
    gain = np.nan_to_num(before_n**2 - after_n**2)
    if not np.any(gain > 0.0):
        gain = np.nan_to_num(before_n**2)
    total = np.concatenate([[0.0], np.cumsum(gain)])
    starts = np.searchsorted(time_s, np.linspace(time_s[0], time_s[-1] - span_s, 200))
    ends = np.searchsorted(time_s, time_s[starts] + span_s)
    best = int(np.argmax(total[ends] - total[starts]))
    return float(time_s[starts[best]]), float(time_s[starts[best]]) + span_s
