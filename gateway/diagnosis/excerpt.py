"""The part of a long recording that is judged.

A search holds some hundred columns as long as the recording: a million rows would take gigabytes, and would say no more
of a cause than their most lively minutes do. So a recording beyond MOST_ROWS is cut to the stretch in which its drive
moves most, and says so; rows closer than they need to be are taken together before. What only hours can show (wear,
drift) needs a thinner recording, not a longer one.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from gateway.diagnosis.measurement import Floats, Measurement

MOST_ROWS: Final = 40_000  # of all recordings together
_UNJUDGED_SHARE: Final = 0.05  # of a stretch, at its beginning: a rest there is none that a machine begins with
_CLOSEST_S: Final = 2.0e-3  # rows closer than this may be taken together: a regulator's lag is tens of milliseconds


def take_excerpt(measurement: Measurement, most_rows: int) -> Measurement:
    """Return a thinner recording where rows are closer than they need to be; of that the liveliest stretch of at most
    `most_rows` rows, with a note; the measurement itself if it is short enough."""
    if measurement.rows <= most_rows:
        return measurement
    row_s = float(np.median(np.diff(measurement.time_s)))
    together = min(-(-measurement.rows // most_rows), max(int(_CLOSEST_S / row_s), 1))
    thin = _thin_out(measurement, together) if together > 1 else measurement
    return thin if thin.rows <= most_rows else _cut_stretch(thin, most_rows)


def _thin_out(measurement: Measurement, together: int) -> Measurement:
    """So many rows become one: means of the readings, and the command as it stood in their middle."""
    rows = measurement.rows // together
    note = f"{measurement.name}: {together} rows each were taken together to one, {rows} in all"

    def mean(column: Floats) -> Floats:
        return np.asarray(column[: rows * together].reshape(rows, together).mean(axis=1))

    middle = slice(together // 2, rows * together, together)
    usable, repeated = (
        np.asarray(np.all(flags[: rows * together].reshape(rows, together), axis=1))
        for flags in (measurement.usable, measurement.repeated)
    )
    return replace(
        measurement,
        time_s=measurement.time_s[middle] - measurement.time_s[middle][0],
        force_n=mean(measurement.force_n),
        usable=usable,
        repeated=repeated,
        command_v=_cut_column(measurement.command_v, middle),
        pressure_pa=None if measurement.pressure_pa is None else mean(measurement.pressure_pa),
        position_m=None if measurement.position_m is None else mean(measurement.position_m),
        covariates={name: mean(column) for name, column in measurement.covariates.items()},
        notes=(*measurement.notes, note),
    )


def _cut_stretch(measurement: Measurement, most_rows: int) -> Measurement:
    """The liveliest stretch."""
    first = _liveliest_row(measurement, most_rows)
    rows = slice(first, first + most_rows)
    start_s, end_s = float(measurement.time_s[first]), float(measurement.time_s[rows.stop - 1])
    note = (
        f"{measurement.name} has {measurement.rows} rows: judged are the {most_rows} in which the drive moves most, "
        f"{start_s:.0f} to {end_s:.0f} s; for slow effects record fewer rows a second"
    )
    usable = measurement.usable[rows].copy()
    usable[: int(_UNJUDGED_SHARE * most_rows)] = False
    return replace(
        measurement,
        time_s=measurement.time_s[rows] - start_s,
        force_n=measurement.force_n[rows],
        usable=usable,
        repeated=measurement.repeated[rows],
        command_v=_cut_column(measurement.command_v, rows),
        pressure_pa=_cut_column(measurement.pressure_pa, rows),
        position_m=_cut_column(measurement.position_m, rows),
        covariates={name: column[rows] for name, column in measurement.covariates.items()},
        sent=None
        if measurement.sent is None
        else replace(measurement.sent, times_s=measurement.sent.times_s - start_s),
        notes=(*measurement.notes, note),
    )


def _cut_column(column: Floats | None, rows: slice) -> Floats | None:
    return None if column is None else column[rows]


def _liveliest_row(measurement: Measurement, most_rows: int) -> int:
    """First row of the stretch with the longest way of the drive over rows that count."""
    drive = measurement.command_v if measurement.command_v is not None else measurement.pressure_pa
    way = np.zeros(measurement.rows) if drive is None else np.abs(np.diff(drive, prepend=drive[:1]))
    gone = np.concatenate([[0.0], np.cumsum(way * measurement.usable)])
    return int(np.argmax(gone[most_rows:] - gone[:-most_rows]))
