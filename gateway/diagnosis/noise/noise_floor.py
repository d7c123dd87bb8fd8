"""The noise floor that recordings prove by themselves: replicate cycles, and rests.

Replicates are the same command history twice. A rest is a stretch in which the command stands until lags have passed: what the
model leaves there, without a slow curve, is the cell's noise. Its spectrum is fitted (white, slow, a frame that rings), and the
floor is its sum over the band that the residual has; below the slowest line that a rest resolves the spectrum is taken to
be flat. So slower noise makes the floor too low, never too high: then nothing is confirmed that noise could be.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.measurement import Floats, Measurement
from gateway.diagnosis.noise.spectrum import fit_to_lines
from gateway.diagnosis.noise.whitening import fast_noise_n
from gateway.diagnosis.result import FloorSource

_LEAST_PERIOD_S: Final = 2.0
_MEMORY_S: Final = 2.0  # command history that must agree before two readings count as replicates
_LEAST_SHARE: Final = 0.2  # of the rows
_STILL_SHARE: Final = 0.3  # of the noise: what a command may do to the force in a rest
_SETTLING_S: Final = 1.0  # of a rest: lags and the fast part of creep
_LEAST_REST_S: Final = 0.5  # behind that
_LEAST_REST_ROWS: Final = 40
_LEAST_RESTS_S: Final = 2.0  # of all rests together
_FIRST_LINE: Final = 3  # of a rest: a parabola was taken out, and with it what is slower
_LARGEST_ERROR: Final = 0.1  # standard error, of the floor, from which rests say too little


@dataclass(frozen=True, slots=True)
class NoiseFloor:
    """Standard deviation of a reading that no model could explain, N; error_share: its standard error, as a share of it."""

    value_n: float
    source: FloorSource
    error_share: float = 0.0


def find_floor(bench: Bench, residual_n: Floats, calibration_n: float | None) -> NoiseFloor | None:
    """Return the floor that the recordings prove, else that of the rig's calibration; None where nobody knows.

    residual_n: (rows,) of the bench, what the best model leaves; calibration_n: see Options.
    """
    replicates = [floor for each in bench.measurements if (floor := replicate_floor_n(each)) is not None]
    if len(replicates) == len(bench.measurements):
        return NoiseFloor(max(replicates), FloorSource.REPLICATES)
    at_rest = rest_floor(bench, residual_n)
    if at_rest is not None or calibration_n is None:
        return at_rest
    return NoiseFloor(calibration_n, FloorSource.CALIBRATION)


def rest_floor(bench: Bench, residual_n: Floats) -> NoiseFloor | None:
    """Return the floor that rests show; None where there are none, or too short to know it."""
    squares, readings = [], 0.0
    for channel in bench.channels:
        if channel.is_force:
            measurement = bench.measurements[channel.recording]
            usable = bench.usable[channel.rows]
            found = _rest_noise(measurement, residual_n[channel.rows], list(find_rests(measurement, usable)))
            if found is not None:
                squares.append(found[0] ** 2)
                readings += found[1]
    if not squares or readings * _LARGEST_ERROR**2 * 2.0 < 1.0:
        return None
    return NoiseFloor(float(np.sqrt(np.mean(squares))), FloorSource.RESTS, float(np.sqrt(0.5 / readings)))


def find_rests(measurement: Measurement, usable: np.ndarray) -> Iterator[slice]:
    """Yield the rows of each stretch in which the command stands, behind its settling."""
    drive, time_s = measurement.command_v, measurement.time_s
    if drive is None or not usable.any():
        return
    force_n = measurement.force_n[usable]
    per_volt = float(np.ptp(force_n)) / max(float(np.ptp(drive)), 1.0e-9)
    slack = _STILL_SHARE * fast_noise_n(force_n) / max(per_volt, 1.0e-9)
    breaks = np.flatnonzero((np.abs(np.diff(drive)) > slack) | (np.diff(usable.astype(int)) != 0)) + 1
    for rows in np.split(np.arange(measurement.rows), breaks):
        rest = rows[time_s[rows] >= time_s[rows[0]] + _SETTLING_S]
        stands = rest.size >= _LEAST_REST_ROWS and time_s[rest[-1]] - time_s[rest[0]] >= _LEAST_REST_S
        if stands and bool(usable[rest[0]]) and float(np.ptp(drive[rest])) <= slack:
            yield slice(int(rest[0]), int(rest[-1]) + 1)


def _rest_noise(measurement: Measurement, left_n: Floats, rests: Sequence[slice]) -> tuple[float, float] | None:
    """Standard deviation of the noise, N, and how many independent readings of it there are; None where rests are short, or
    nothing moves in them."""
    row_s = float(np.median(np.diff(measurement.time_s)))
    rested_rows = sum(rest.stop - rest.start for rest in rests)
    if rested_rows * row_s < _LEAST_RESTS_S:
        return None
    rows = measurement.rows
    lines, power = [], []
    for rest in rests:
        noise_n = _without_parabola(left_n[rest])
        lines.append(np.arange(_FIRST_LINE, noise_n.size // 2) * (rows / noise_n.size))
        power.append((np.abs(np.fft.rfft(noise_n)) ** 2 / noise_n.size)[_FIRST_LINE : noise_n.size // 2])
    seen = np.concatenate(lines)
    spectrum = fit_to_lines(seen, np.concatenate(power), rows)
    model = spectrum(np.maximum(np.arange(rows // 2 + 1), float(seen.min())))
    squares = float(np.sum(model**2))
    if squares <= 0.0:
        return None  # one value, bit for bit: of a dead cell nobody knows the noise
    independent = float(np.sum(model)) ** 2 / squares * 2.0 * rested_rows / rows
    return float(np.sqrt(np.mean(model))), independent


def _without_parabola(values: Floats) -> Floats:
    place = np.linspace(-1.0, 1.0, values.size)
    return np.asarray(
        values - np.polynomial.polynomial.polyval(place, np.polynomial.polynomial.polyfit(place, values, 2))
    )


def replicate_floor_n(measurement: Measurement) -> float | None:
    """Return the standard deviation of one reading from replicates, N; None where the command does not repeat itself.

    Slow changes between the cycles (drift, temperature) count as floor only as far as they are common to no model: the
    differences of replicates are taken about their median.
    """
    drive = measurement.command_v if measurement.command_v is not None else measurement.position_m
    if drive is None or measurement.rows < 200 or not np.ptp(drive) > 0.0:
        return None
    row_s = float(np.median(np.diff(measurement.time_s)))
    least = max(int(_LEAST_PERIOD_S / row_s), 2)
    period = _period(drive, least)
    if period is None:
        return None
    same = np.abs(drive[period:] - drive[:-period]) <= 1.0e-9 * float(np.ptp(drive))
    memory = max(int(_MEMORY_S / row_s), 1)
    run = np.convolve(same, np.ones(memory), mode="full")[: same.size] >= memory - 0.5
    rows = run & measurement.usable[period:] & measurement.usable[:-period]
    if rows.sum() < _LEAST_SHARE * measurement.rows:
        return None
    differences = (measurement.force_n[period:] - measurement.force_n[:-period])[rows]
    return float(np.std(differences - np.median(differences)) / np.sqrt(2.0))


def _period(drive: Floats, least: int) -> int | None:
    """Rows after which the drive repeats itself best."""
    centred = drive - float(np.mean(drive))
    size = 2 * drive.size
    correlation = np.fft.irfft(np.abs(np.fft.rfft(centred, size)) ** 2, size)[: drive.size]
    overlap = np.arange(drive.size, 0, -1)
    likeness = correlation / overlap
    reach = drive.size // 2
    if reach <= least:
        return None
    best = least + int(np.argmax(likeness[least:reach]))
    return best if likeness[best] > 0.9 * likeness[0] else None
