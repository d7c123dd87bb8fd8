"""What the residual watch looks at: the newest rows of the sample ring as a measurement, with a lead-in.

The replay begins at rest without pressure; the machine does not, and its friction remembers. So rows before the window
are replayed too and not judged. They begin where both agree: at the last 0 V, or else at the highest command of the lead,
for whoever comes up to that from below, the replay from 0 as well, has all friction elements turned the same way (what is
within the largest loop has no memory of what was before it). Ten seconds of any lead left 0.4 N of wrong friction.
A gap (control was restarted) ends what can be replayed; rows in and shortly after a fault, or behind a standstill of this
machine, are no witness of the plant.

The pressure is left out: an output device measures it for its display, late and seldom, which is no second channel.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from gateway.defaults import WATCH_SETTLED_S, WATCHED_SHARE
from gateway.diagnosis.measurement import Flags, Floats, Measurement
from gateway.recording import Recording, RecordingError
from gateway.recording.measurement import measurement_of
from gateway.recording.tables.time_axis import gaps_of, rows_after_gaps
from gateway.watch.pushed_rows import pushed_rows

LEAD_S: Final = 12.0
"""How far before the window a replay may begin; the search takes its blocks from all rows, so that more costs certainty."""
_GAP_S: Final = 0.5
_AFTER_FAULT_S: Final = 2.0
_OFF_V: Final = 0.01


@dataclass(frozen=True, slots=True)
class Window:
    """A measurement whose lead-in is not usable. end_s: time of its newest row, by the machine's monotonic clock;
    excitation_v: standard deviation of the command in the window; moves: how often the command turned."""

    measurement: Measurement
    end_s: float
    excitation_v: float
    moves: int


def window_of(data: bytes, columns: tuple[str, ...], window_s: float) -> Window | str:
    """Return the window that ends with the newest row; a sentence where there is nothing to judge."""
    rows = _after_last_gap(pushed_rows(data, columns))
    time_s = rows["time_s"]
    if time_s.size < 2 or time_s[-1] - time_s[0] < window_s * WATCHED_SHARE + WATCH_SETTLED_S:
        return "the run is younger than the window"
    first = _first_replayed_row(rows["command_v"], time_s, window_s)
    rows = {name: values[first:].copy() for name, values in rows.items()}
    window = rows["time_s"] >= max(time_s[-1] - window_s, rows["time_s"][0] + WATCH_SETTLED_S)
    usable = window & ~_faulty(rows)
    if usable.sum() < WATCHED_SHARE * window.sum():
        return "a fault stood"
    usable &= ~_after_standstills(rows["time_s"])
    if usable.sum() < WATCHED_SHARE * window.sum():
        return "this machine stood still, or readings were lost, for too much of the time (A342)"
    command_v = rows["command_v"][usable]
    if not np.any(command_v > _OFF_V):
        return "nothing was commanded"
    measurement = _measurement(rows, usable)
    return (
        measurement if isinstance(measurement, str) else Window(measurement, float(time_s[-1]), *_excitation(command_v))
    )


def _measurement(rows: dict[str, Floats], usable: Flags) -> Measurement | str:
    """As a recording of the run would be read, judged where it may be."""
    time_s = rows["time_s"]
    marked = rows | {
        "time_s": time_s - time_s[0],
        "pressure_kpa": np.full(time_s.size, np.nan),
        "force_n": np.where(usable, rows["force_n"], np.nan),
    }
    try:
        measurement = measurement_of(Recording(Path("window"), {}, marked, time_s.size, False))
    except RecordingError as error:
        return str(error)
    return replace(measurement, force_n=np.where(measurement.usable, measurement.force_n, 0.0))


def _after_last_gap(rows: dict[str, Floats]) -> dict[str, Floats]:
    """Return what follows the last gap, or the last time that runs backwards."""
    steps_s = np.diff(rows["time_s"])
    breaks = np.flatnonzero((steps_s > _GAP_S) | (steps_s < 0.0))
    first = int(breaks[-1]) + 1 if breaks.size else 0
    return {name: values[first:] for name, values in rows.items()}


def _first_replayed_row(command_v: Floats, time_s: Floats, window_s: float) -> int:
    """Return the row where the replay begins."""
    begin_s = time_s[-1] - window_s
    stop = max(1, int(np.searchsorted(time_s, begin_s - WATCH_SETTLED_S)))
    start = int(np.searchsorted(time_s, begin_s - LEAD_S))
    rows_held = max(1, int(np.searchsorted(time_s, time_s[0] + WATCH_SETTLED_S)))
    resting = np.flatnonzero(
        _moving_sum(command_v[start:stop] <= _OFF_V, rows_held) >= rows_held
    )  # a dip of the command is no rest
    if resting.size:
        return start + rows_held - 1 + int(resting[-1])
    return start + int(np.argmax(_moving_sum(command_v[start : stop + rows_held], rows_held)[: stop - start]))


def _moving_sum(values: Floats | Flags, rows: int) -> Floats:
    """Sums over so many rows, from each row on."""
    return np.convolve(values, np.ones(rows), mode="valid") if values.size >= rows else np.zeros(1)


def _faulty(rows: dict[str, Floats]) -> Flags:
    """Return rows with a latched fault, and those shortly after."""
    faulty = rows["fault_code"] != 0.0
    time_s = rows["time_s"]
    last_s = np.maximum.accumulate(np.where(faulty, time_s, -np.inf))
    return np.asarray(time_s - last_s < _AFTER_FAULT_S)


def _after_standstills(time_s: Floats) -> Flags:
    """Return rows shortly after others are missing: while control or the simulated rig stood still, what was sent came late,
    and a busy machine was called another gain (A345)."""
    ends, _ = gaps_of(time_s, is_own=True)
    return rows_after_gaps(time_s, ends)


def _excitation(command_v: Floats) -> tuple[float, int]:
    signs = np.sign(np.diff(command_v))
    signs = signs[signs != 0.0]
    return float(np.std(command_v)), int(np.count_nonzero(np.diff(signs)))
