"""What the starts of a search need to know of a recording: its levels, and where its remainder oscillates."""

from typing import Final

import numpy as np

from gateway.catalogue.cylinder import AREA
from gateway.catalogue.effect import SearchHints
from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.measurement import Floats
from gateway.diagnosis.model_fit.levenberg_marquardt import FittedModel
from gateway.diagnosis.noise.whitening import Whitener
from gateway.diagnosis.search.command_search import likely_dead_bands_pa, likely_steps_v

_MAINS_HZ: Final = 0.15  # how far the mains stray
_PEAKS: Final = 3
_FEW: Final = 3  # rows
_PITCH_BINS: Final = 4096


def search_hints(bench: Bench, fitted: FittedModel, whiten: Whitener) -> SearchHints:
    """Return what the starts of a search may know of the recordings."""
    simulated = bench.measured_n - fitted.residual_n
    forces = simulated[bench.judged]
    area_m2 = fitted.parameters.value(AREA)
    offset_n = float(np.mean(fitted.parameters.offsets_n))
    pressures = np.maximum(forces - offset_n, 0.0) / area_m2
    white = whiten(fitted.residual_n)
    positions = _positions(bench)
    return SearchHints(
        duration_s=max(each.duration_s for each in bench.measurements),
        row_s=_row_s(bench),
        pressures_pa=_quantiles(pressures),
        forces_n=_quantiles(forces),
        pressure_rate_pa_per_s=_fastest_n_per_s(bench, simulated) / area_m2,
        positions_mm=_quantiles(positions)[:4] if positions is not None else (),
        lines_hz=lines_hz(bench, white),
        mains_hz=_mains_hz(bench, white),
        pitches_mm=_pitches_mm(white, positions) if positions is not None else (),
        command_steps_v=likely_steps_v(bench, fitted, whiten),
        dead_bands_pa=likely_dead_bands_pa(bench, fitted, whiten),
        columns=bench.columns(),
    )


def lines_hz(bench: Bench, white: Floats) -> tuple[float, ...]:
    """Return frequencies of the strongest lines of the first recording's whitened residual, strongest first."""
    part = white[bench.channels[0].rows]
    power = np.abs(np.fft.rfft(part, 4 * part.size)) ** 2
    return tuple(peak / (4 * part.size * _row_s(bench)) for peak in _peaks(power, least=16))


def _mains_hz(bench: Bench, white: Floats) -> tuple[float, ...]:
    """Where the mains' 50 and 60 Hz really are: the strongest line near each, as the sampling folds it."""
    part = white[bench.channels[0].rows]
    row_s = _row_s(bench)
    size = 8 * part.size
    power = np.abs(np.fft.rfft(part, size)) ** 2
    found = []
    for nominal_hz in (50.0, 60.0):
        tried_hz = nominal_hz + np.arange(-_MAINS_HZ, _MAINS_HZ, 1.0 / (size * row_s))
        folded = np.abs(tried_hz * row_s - np.round(tried_hz * row_s))
        index = np.minimum(np.round(folded * size).astype(int), power.size - 1)
        found.append(float(tried_hz[int(np.argmax(power[index]))]))
    return tuple(found)


def _pitches_mm(white: Floats, positions_mm: Floats) -> tuple[float, ...]:
    """Periods along the position, strongest first, from the residual averaged in bins of position."""
    rows = np.isfinite(positions_mm)
    low, high = float(np.min(positions_mm[rows])), float(np.max(positions_mm[rows]))
    if high - low < 1.0e-6:
        return ()
    edges = np.linspace(low, high, _PITCH_BINS + 1)
    total, _ = np.histogram(positions_mm[rows], edges, weights=white[rows])
    power = np.abs(np.fft.rfft(total, 8 * _PITCH_BINS)) ** 2
    return tuple(8.0 * (high - low) / peak for peak in _peaks(power[: 8 * 512], least=10))


def _peaks(power: Floats, least: int) -> list[float]:
    """Places of the strongest local maxima, apart from each other, refined by a parabola."""
    power = power.copy()
    power[:least] = 0.0
    found: list[float] = []
    for _ in range(_PEAKS):
        peak = int(np.argmax(power))
        if not 0 < peak < power.size - 1 or power[peak] <= 0.0:
            break
        left, top, right = power[peak - 1 : peak + 2]
        bend = left - 2.0 * top + right
        found.append(peak + (0.5 * (left - right) / bend if bend < 0.0 else 0.0))
        power[max(peak - 12, 0) : peak + 13] = 0.0
    return found


def _positions(bench: Bench) -> Floats | None:
    if "position_mm" not in bench.columns():
        return None
    parts = []
    for channel in bench.channels:
        measurement = bench.measurements[channel.recording]
        position_m = measurement.position_m
        parts.append(np.full(measurement.rows, np.nan) if position_m is None else position_m * 1.0e3)
    return np.concatenate(parts)


def _row_s(bench: Bench) -> float:
    return float(np.median(np.diff(bench.measurements[0].time_s)))


def _quantiles(values: Floats) -> tuple[float, ...]:
    values = values[np.isfinite(values)]
    return tuple(float(each) for each in np.quantile(values, (0.5, 0.7, 0.85, 0.95, 1.0)))


def _fastest_n_per_s(bench: Bench, simulated_n: Floats) -> float:
    """Rate of the simulated force that is hardly ever exceeded, over a few rows: two alone may be next to each other."""
    rates = []
    for channel in bench.channels:
        if channel.is_force:
            seconds, forces = bench.measurements[channel.recording].time_s, simulated_n[channel.rows]
            rates.append(np.abs((forces[_FEW:] - forces[:-_FEW]) / (seconds[_FEW:] - seconds[:-_FEW])))
    return float(np.quantile(np.concatenate(rates), 0.999))
