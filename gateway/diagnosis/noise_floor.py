"""The noise floor that a recording proves by itself: replicate cycles, the same command history twice."""

from typing import Final

import numpy as np

from gateway.diagnosis.measurement import Floats, Measurement

_LEAST_PERIOD_S: Final = 2.0
_MEMORY_S: Final = 2.0  # command history that must agree before two readings count as replicates
_LEAST_SHARE: Final = 0.2  # of the rows


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
