"""Everything else that was recorded: numbers that the force may depend on, under their own names and units.

Left out is what could explain nothing or everything: constants, copies of the measured force (its raw voltage, say),
and what our own recorder derives from the measured force and from the command.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.bsfm.ladder.plan import LABELS
from gateway.recording.tables.column_mapping import join_names
from gateway.recording.tables.column_names import CALIBRATION, CONTRACT, DERIVED, PULLING, SENT

Floats = NDArray[np.float64]

MEASUREMENT_COLUMNS: Final = ("time_s", "force_n", "command_v", "pressure_kpa", "position_mm", "quality")
"""Columns that a measurement has fields for."""
MANY_COVARIATES: Final = 200
_TURNS_WHILE_CONSTANT: Final = "spindle_rpm"
_COPY: Final = 1.0 - 5.0e-4
_COPY_OF_STEPS: Final = 0.98
_COUNTER: Final = 1.0e-9
_MOST_NAMES: Final = 6


def is_own_recording(columns: Mapping[str, Floats]) -> bool:
    """Return whether our recorder wrote these columns."""
    return set(DERIVED) <= set(columns)


def extract_covariates(
    columns: Mapping[str, Floats], time_s: Floats, force_n: Floats
) -> tuple[dict[str, Floats], list[str]]:
    """Return the covariates without holes, and what was left out or filled. columns: all of the recording, at these times."""
    ours = is_own_recording(columns)
    own = (*DERIVED, *LABELS, *SENT, PULLING, CALIBRATION) if ours else ()
    names = [name for name in columns if name not in (*MEASUREMENT_COLUMNS, *own)]
    dropped: dict[str, list[str]] = {}
    covariates: dict[str, Floats] = {}
    filled: list[str] = []
    for name in names:
        values = columns[name]
        why = _why_useless(name, values, time_s, force_n)
        if why:
            dropped.setdefault(why, []).append(name)
            continue
        known = np.isfinite(values)
        if not known.all():
            filled.append(f"{name} ({int((~known).sum())})")
        covariates[name] = values if known.all() else interpolate_missing(values, time_s)
    notes = [f"left out, {why}: {join_names(which, _MOST_NAMES)}" for why, which in dropped.items()]
    if filled:
        notes.append(f"values missing, drawn straight from the ones around: {join_names(filled, _MOST_NAMES)}")
    if len(covariates) >= MANY_COVARIATES:
        notes.append(
            f"{len(covariates)} covariates: with so many, some seem to matter by chance, so each is trusted less"
        )
    return covariates, notes


def interpolate_missing(values: Floats, time_s: Floats) -> Floats:
    """Draw NaN and infinite values straight between the known ones; hold beyond the first and the last."""
    known = np.isfinite(values)
    return np.asarray(np.interp(time_s, time_s[known], values[known]), dtype=np.float64)


def is_constant(values: Floats) -> bool:
    """Return whether there is one value in all rows where it is known. values: one finite at least."""
    known = values[np.isfinite(values)]
    return bool(np.ptp(known) <= 1.0e-12 * np.abs(known).max())


def _why_useless(name: str, values: Floats, time_s: Floats, force_n: Floats) -> str:
    """Return why a column is no covariate, "" when it is one."""
    known = np.isfinite(values)
    if not known.any():
        return "no value in any row"
    if is_constant(values):
        turns = name == _TURNS_WHILE_CONSTANT and bool(values[known][0])
        return "" if turns else "constant, so nothing can be seen to depend on it"
    if name in CONTRACT:
        return ""
    if _correlation(values[known], time_s[known]) > 1.0 - _COUNTER:
        return "it only counts time"
    return "a copy of the measured force" if _is_copy(values, force_n) else ""


def _is_copy(values: Floats, force_n: Floats) -> bool:
    """Return whether this is the same sensor in another unit: it shares the readings' noise, which no other sensor does."""
    both = np.isfinite(values) & np.isfinite(force_n)
    if both.sum() < 3 or _correlation(values[both], force_n[both]) < _COPY:
        return False
    return _correlation(np.diff(values[both]), np.diff(force_n[both])) > _COPY_OF_STEPS


def _correlation(first: Floats, second: Floats) -> float:
    """Absolute correlation; 0 where one of the two is constant."""
    one, two = first - first.mean(), second - second.mean()
    scale = float(np.sqrt(np.dot(one, one) * np.dot(two, two)))
    return abs(float(np.dot(one, two))) / scale if scale > 0.0 and np.isfinite(scale) else 0.0
