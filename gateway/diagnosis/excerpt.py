"""The part of a long recording that is judged.

A search holds some hundred columns as long as the recording: a million rows would take gigabytes, and would say no more
of a cause than their most lively minutes do. So a recording beyond MOST_ROWS is cut to the stretch in which its drive
moves most, and says so. What only hours can show (wear, drift) needs a thinner recording, not a longer one.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from gateway.diagnosis.measurement import Floats, Measurement

MOST_ROWS: Final = 40_000  # of all recordings together


def excerpt(measurement: Measurement, most_rows: int) -> Measurement:
    """The liveliest stretch of at most `most_rows` rows, with a note; the measurement itself if it is short enough."""
    if measurement.rows <= most_rows:
        return measurement
    first = _liveliest(measurement, most_rows)
    rows = slice(first, first + most_rows)
    start_s, end_s = float(measurement.time_s[first]), float(measurement.time_s[rows.stop - 1])
    note = (
        f"{measurement.name} has {measurement.rows} rows: judged are the {most_rows} in which the drive moves most, "
        f"{start_s:.0f} to {end_s:.0f} s; for slow effects record fewer rows a second"
    )
    return replace(
        measurement,
        time_s=measurement.time_s[rows] - start_s,
        force_n=measurement.force_n[rows],
        usable=measurement.usable[rows],
        repeated=measurement.repeated[rows],
        command_v=_cut(measurement.command_v, rows),
        pressure_pa=_cut(measurement.pressure_pa, rows),
        position_m=_cut(measurement.position_m, rows),
        covariates={name: column[rows] for name, column in measurement.covariates.items()},
        notes=(*measurement.notes, note),
    )


def _cut(column: Floats | None, rows: slice) -> Floats | None:
    return None if column is None else column[rows]


def _liveliest(measurement: Measurement, most_rows: int) -> int:
    """First row of the stretch with the longest way of the drive over rows that count."""
    drive = measurement.command_v if measurement.command_v is not None else measurement.pressure_pa
    way = np.zeros(measurement.rows) if drive is None else np.abs(np.diff(drive, prepend=drive[:1]))
    gone = np.concatenate([[0.0], np.cumsum(way * measurement.usable)])
    return int(np.argmax(gone[most_rows:] - gone[:-most_rows]))
