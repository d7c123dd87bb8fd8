"""From a recording to what the diagnosis takes: checked against the contract, in SI units, every decision noted.

Refused is what only the user can know (no force, nothing that drives, times that run backwards, too little); what the
table itself decides is repaired or set aside, with a sentence. A force or a command that never changes is no fault here:
whether it shows anything is the diagnosis' question. This module imports numpy; the room's other readers do not.
"""

from collections.abc import Mapping
from math import inf
from typing import Final

import numpy as np

from gateway.diagnosis.measurement import Flags, Floats, Measurement
from gateway.recording.errors import RecordingError
from gateway.recording.reader import Recording
from gateway.recording.tables.column_mapping import EXAMPLE, join_names
from gateway.recording.tables.column_names import SENT
from gateway.recording.tables.covariates import extract_covariates, interpolate_missing, is_constant, is_own_recording
from gateway.recording.tables.even_rows import resample_evenly
from gateway.recording.tables.row_validity import (
    flag_clipped,
    flag_dropouts,
    flag_repeated,
    pulled_rows,
    rows_about_pulls,
    valid_by_quality,
)
from gateway.recording.tables.time_axis import TimeAxis, check_time_axis
from gateway.robust import LARGEST_VALUE
from gateway.units import linear_conversion

FEWEST_ROWS: Final = 50
SHORTEST_S: Final = 1.0
_DRIVES: Final = ("command_v", "pressure_kpa")
_NEEDED: Final = f"at least {FEWEST_ROWS} usable rows over {SHORTEST_S:g} s are needed, 60 s at 200 Hz are good"
_HIGHEST_COMMAND_V: Final = 50.0
_RANGES: Final = {
    "command_v": (-_HIGHEST_COMMAND_V, _HIGHEST_COMMAND_V),
    "temperature_c": (-273.15, 5000.0),  # nothing is colder
    "pressure_kpa": (-102.0, 9000.0),  # or less air
    "supply_kpa": (-102.0, 9000.0),
}
"""Beyond these stands what a logger writes for no value: -9999, 32767."""
_RARE_SHARE: Final = 0.2  # more of them are another unit, or a turned sign
_TURNED: Final = -0.8  # correlation of force and command at which the sign is asked for
_PASCAL: Final = linear_conversion("pressure", "kpa", "pa")[0]
_METRE: Final = linear_conversion("length", "mm", "m")[0]


def measurement_of(recording: Recording) -> Measurement:
    """Return the checked measurement. RecordingError in the user's words, with row and column where there is one."""
    _check_columns(recording)
    axis = check_time_axis(recording)
    columns, more_notes = _replace_absurd(recording, axis)
    notes = [*recording.notes, *axis.notes, *more_notes]
    usable, more_notes = _usable_rows(columns, axis)
    notes += more_notes
    drive, driven, more_notes = _drive(columns, axis.time_s)
    notes += more_notes
    position_m, position_notes = _position_m(columns, axis.time_s)
    drives = [*drive.values(), *([] if position_m is None else [position_m])]
    dropouts, more_notes = flag_dropouts(columns["force_n"], axis.time_s, drives)
    notes += more_notes
    columns = columns | {"force_n": np.where(dropouts, np.nan, columns["force_n"])}
    usable &= driven & ~dropouts
    clipped, more_notes = flag_clipped(columns["force_n"], usable)
    notes += more_notes
    usable &= ~clipped
    _check_enough(recording, axis, usable, notes)
    repeated, more_notes = flag_repeated(columns["force_n"])
    others, suspicions = extract_covariates(columns, axis.time_s, columns["force_n"])
    suspicions += _suspicious(columns["force_n"][usable], {name: values[usable] for name, values in drive.items()})
    measurement = Measurement(
        name=recording.path.name,
        time_s=axis.time_s,
        force_n=columns["force_n"],
        usable=usable,
        repeated=repeated,
        command_v=drive.get("command_v"),
        pressure_pa=drive.get("pressure_pa"),
        position_m=position_m,
        covariates=others,
        notes=(*notes, *more_notes, *position_notes, *suspicions),
    )
    return resample_evenly(measurement, *(columns[name] for name in SENT)) if set(SENT) <= set(columns) else measurement


def _check_columns(recording: Recording) -> None:
    """time_s, force_n and something that drives must be there."""
    names = recording.columns
    missing = [name for name in ("time_s", "force_n") if name not in names]
    if not any(name in names for name in _DRIVES):
        missing.append("command_v (or pressure_kpa)")
    if missing:
        raise RecordingError(
            f"{recording.path}: no column {' and no column '.join(missing)}; there: {join_names(list(names))}."
            f" {recording.suggestion or f'Say which is which: {EXAMPLE}'}"
        )
    if recording.rows < FEWEST_ROWS:
        raise RecordingError(f"{recording.path}: {recording.rows} rows: {_NEEDED}")


def _replace_absurd(recording: Recording, axis: TimeAxis) -> tuple[dict[str, Floats], list[str]]:
    """Return the columns with NaN where a number is none of a measurement, and a sentence for each such column."""
    columns, notes = {}, []
    for name, values in recording.columns.items():
        column, (low, high) = values[axis.kept], _RANGES.get(name, (-inf, inf))
        for least, most, what, share in (
            (-LARGEST_VALUE, LARGEST_VALUE, f"beyond {LARGEST_VALUE:.0e}", 1.0),
            (low, high, f"below {low:g} or above {high:g}, which none is", _RARE_SHARE),
        ):
            strange = np.isfinite(column) & ((column < least) | (column > most))
            if strange.any() and strange.mean() <= share:
                first = recording.place(int(axis.kept[int(np.argmax(strange))]))
                column = np.where(strange, np.nan, column)
                notes.append(f"{int(strange.sum())} values of {name} are {what} (the first: {first}): taken as missing")
        columns[name] = column
    return columns, notes


def _suspicious(force_n: Floats, drive: Mapping[str, Floats]) -> list[str]:
    """Return notes on what an intact machine would not show. Told only: each has an honest reason as well."""
    if is_constant(force_n):
        return [f"force_n is {force_n[0]:.5g} in every row: an unplugged or frozen cell? Nothing can be seen in it"]
    command_v = drive.get("command_v")
    if command_v is None or is_constant(command_v):
        return []
    alike = float(np.corrcoef(force_n, command_v)[0, 1])
    if alike > _TURNED:
        return []
    return [f"force_n falls as command_v rises (correlation {alike:.2f}): the cell's sign turned, or the wrong column?"]


def _usable_rows(columns: Mapping[str, Floats], axis: TimeAxis) -> tuple[Flags, list[str]]:
    """Return the rows with a finite, valid reading, not too soon after a gap, and notes."""
    read = np.isfinite(columns["force_n"])
    notes = [] if read.all() else [f"{int((~read).sum())} rows without a force are not judged"]
    usable = read & ~axis.after_gap
    if (about := rows_about_pulls(columns)).any():
        pulled = int(pulled_rows(columns).sum())
        beside = f"{pulled} rows in which the tool pulled, and {int(about.sum()) - pulled} right before or behind"
        notes.append(f"{beside}, are not judged: the plant pushes")
        usable &= ~about
    if "quality" in columns:
        valid, quality_note = valid_by_quality(columns["quality"], is_own_recording(columns))
        return usable & valid, notes + quality_note
    return usable, notes


def _drive(columns: Mapping[str, Floats], time_s: Floats) -> tuple[dict[str, Floats], Flags, list[str]]:
    """Command and pressure without holes, the rows at which what drives is known, and what was filled."""
    notes: list[str] = []
    drive: dict[str, Floats] = {}
    driven = np.zeros(time_s.size, dtype=bool)
    command_v = columns.get("command_v")
    if command_v is not None and np.isfinite(command_v).any():
        drive["command_v"], driven, notes = _hold_command(command_v)
    elif command_v is not None:
        notes.append("command_v holds no value and was left out")
    pressure_kpa = columns.get("pressure_kpa")
    if pressure_kpa is None or not np.isfinite(pressure_kpa).any():
        return drive, driven, notes + ([] if pressure_kpa is None else ["pressure_kpa holds no value and was left out"])
    known = np.isfinite(pressure_kpa)
    drive["pressure_pa"] = (pressure_kpa if known.all() else interpolate_missing(pressure_kpa, time_s)) * _PASCAL
    if not known.all():
        notes.append(f"pressure_kpa is missing in {int((~known).sum())} rows: drawn straight from those around")
    return drive, driven if "command_v" in drive else known, notes


def _hold_command(command_v: Floats) -> tuple[Floats, Flags, list[str]]:
    """Return the commands without holes, the rows with a known one, and notes: a command stands until the next one."""
    known = np.isfinite(command_v)
    latest = np.maximum.accumulate(np.where(known, np.arange(command_v.size), -1))
    held = command_v[np.where(latest < 0, int(np.argmax(known)), latest)]
    notes = [] if known.all() else [f"{int((~known).sum())} rows without a command keep the one before"]
    if np.abs(held).max() > _HIGHEST_COMMAND_V:
        notes.append(f"command_v goes to {np.abs(held).max():.5g}: is it in mV? then --columns command_v=...:mv")
    return held, latest >= 0, notes


def _position_m(columns: Mapping[str, Floats], time_s: Floats) -> tuple[Floats | None, list[str]]:
    """Return the measured position; None when it says nothing about the direction of motion."""
    values = columns.get("position_mm")
    if values is None:
        return None, []
    known = np.isfinite(values)
    if not known.any() or is_constant(values):
        state = "never changes" if known.any() else "holds no value"
        return None, [f"position_mm {state} and was left out: the direction of motion is inferred"]
    if known.all():
        return values * _METRE, []
    note = f"position_mm is missing in {int((~known).sum())} rows: drawn straight from those around"
    return interpolate_missing(values, time_s) * _METRE, [note]


def _check_enough(recording: Recording, axis: TimeAxis, usable: Flags, notes: list[str]) -> None:
    rows = int(usable.sum())
    duration_s = float(axis.time_s[-1]) if axis.time_s.size else 0.0
    if rows >= FEWEST_ROWS and duration_s >= SHORTEST_S:
        return
    why = f"; {'; '.join(notes)}" if notes else ""
    raise RecordingError(f"{recording.path}: {rows} usable rows in {duration_s:.7g} s: {_NEEDED}{why}")
