"""The time stamps of a recording, checked: which rows stay, and where rows are missing.

A time that runs backwards is refused, never sorted: it is two files in one, a clock that was set, or the wrong column,
and each of them makes another order right.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.recording.errors import RecordingError
from gateway.recording.reader import Recording
from gateway.recording.tables.column_names import SENT

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

LARGEST_UNKNOWN_SHARE: Final = 0.2
GAP_STEPS: Final = 10.0
"""A step longer than this many median steps, and than GAP_S, is a gap: what was commanded in it is not known."""
OWN_GAP_STEPS: Final = 4.0
"""The same of the gateway's own recordings, whose rows come one per reading: so many are missing because the machine stood
still, control, the simulated rig or both, and what was sent came late. Standstills of 60 to 98 ms left 0.9 N of the demo rig's
force unexplained."""
GAP_S: Final = 0.05
SETTLING_S: Final = 0.5
"""How long after a gap the force still depends on what happened in it (slowest regulator lag of the catalogue, thrice)."""
_COARSE_S: Final = 1.0
TOO_COARSE_S: Final = 2.0
"""From here on every response that the catalogue knows is over between two rows; times in ms look like this."""
_MICROSECONDS_S: Final = 1000.0  # as ms, that would still be one row a second
_NANOSECONDS_S: Final = 1.0e6  # so it would as us
LONGEST_GAP_S: Final = 7200.0
"""A clock that was set while it was recorded leaps further (from 1970, by a day), and a simulation that spans more has steps
longer than a regulator's lag, or more rows than fit into memory."""
_SAME_S: Final = 1.0e-9  # what adding and scaling leaves of two equal stamps


@dataclass(frozen=True, slots=True)
class TimeAxis:
    """kept: rows of the recording that stay, in order; time_s: theirs, from 0; after_gap: too soon after a gap."""

    kept: NDArray[np.int64]
    time_s: Floats
    after_gap: Flags
    notes: tuple[str, ...]


def check_time_axis(recording: Recording) -> TimeAxis:
    """Check the times; RecordingError that names the row, for times that run backwards or are mostly missing."""
    stamps = recording.columns["time_s"]
    known = np.isfinite(stamps)
    notes = _check_unknown(recording, known)
    rows = np.flatnonzero(known).astype(np.int64)
    steps = np.diff(stamps[rows])
    if (steps < -_SAME_S).any():
        at = int(np.flatnonzero(steps < -_SAME_S)[0])
        times = int((steps < -_SAME_S).sum())
        before, after = stamps[rows[at]], stamps[rows[at + 1]]
        clock = (
            "a clock that went from summer time to winter time"
            if abs(steps[at] + 3600.0) < 60.0
            else "a clock that was set"
        )
        raise RecordingError(
            f"{recording.place(int(rows[at + 1]))}, column time_s: {after:.12g} after {before:.12g}: time runs backwards "
            f"({times} time{'s' * (times > 1)} in the file). Two recordings in one file, {clock}, or the "
            "wrong column? Split it there, or name the column with --columns time_s=..."
        )
    last_of_stamp = np.append(steps > _SAME_S, True)[: rows.size]
    if not last_of_stamp.all():
        first = recording.place(int(rows[np.argmin(last_of_stamp) + 1]))
        notes.append(
            f"{int((~last_of_stamp).sum())} rows repeat the time stamp before (the first: {first}): the last of each stays"
        )
    kept_rows = rows[last_of_stamp]
    time_s = stamps[kept_rows] - stamps[kept_rows[0]] if kept_rows.size else stamps[kept_rows]
    _refuse_coarse(recording, time_s)
    _refuse_leap(recording, kept_rows, time_s)
    after_gap, gap_notes = _flag_after_gaps(time_s, is_own=set(SENT) <= set(recording.columns))
    return TimeAxis(kept_rows, time_s, after_gap, (*notes, *gap_notes))


def _check_unknown(recording: Recording, known: Flags) -> list[str]:
    unknown = int((~known).sum())
    if not unknown:
        return []
    place = recording.place(int(np.flatnonzero(~known)[0]))
    if unknown > LARGEST_UNKNOWN_SHARE * known.size:
        raise RecordingError(f"{place}, column time_s: no number; so in {unknown} of {known.size} rows: not a time")
    return [f"{unknown} rows without a time (the first: {place}) are left out"]


def _refuse_coarse(recording: Recording, time_s: Floats) -> None:
    median_s = float(np.median(np.diff(time_s))) if time_s.size > 1 else 0.0
    if median_s >= TOO_COARSE_S:
        unit = "ns" if median_s >= _NANOSECONDS_S else "us" if median_s >= _MICROSECONDS_S else "ms"
        raise RecordingError(
            f"{recording.path}, column time_s: one row every {median_s:.3g} s, and a force follows its command within one: "
            f"nothing can be judged between such rows. Are the times in {unit}? then --columns time_s=...:{unit}"
        )


def _refuse_leap(recording: Recording, rows: NDArray[np.int64], time_s: Floats) -> None:
    far = np.flatnonzero(np.diff(time_s) > LONGEST_GAP_S)
    if far.size:
        place = recording.place(int(rows[far[0] + 1]))
        leap_h = float(time_s[far[0] + 1] - time_s[far[0]]) / 3600.0
        raise RecordingError(
            f"{place}, column time_s: {leap_h:.0f} h after the row before ({far.size} time{'s' * (far.size > 1)} in the file): "
            "nothing is known of what happened meanwhile. Two recordings in one file, or a clock that was set? Split it there"
        )


def gaps_of(time_s: Floats, *, is_own: bool = False) -> tuple[NDArray[np.int64], str]:
    """Return the rows before which there is a gap, and how many there are, how long and where, in words; empty without one.
    is_own: the gateway has recorded it."""
    steps = np.diff(time_s)
    if not steps.size:
        return np.zeros(0, dtype=np.int64), ""
    least_steps = OWN_GAP_STEPS if is_own else GAP_STEPS
    ends = np.flatnonzero((steps > least_steps * float(np.median(steps))) & (steps > GAP_S)) + 1
    if not ends.size:
        return ends, ""
    longest_s, first_s = float(steps[ends - 1].max()), float(time_s[ends[0] - 1] - time_s[0])
    count = f"{ends.size} gap{'s' * (ends.size > 1)}"
    return ends, f"{count} in time (the longest {longest_s:.3g} s, at {first_s:.3f} s the first)"


def rows_after_gaps(time_s: Floats, ends: NDArray[np.int64]) -> Flags:
    """Return the rows up to SETTLING_S after gaps. ends: the rows that end them."""
    upto = np.searchsorted(time_s, time_s[ends] + SETTLING_S)
    edges = np.zeros(time_s.size + 1)
    np.add.at(edges, ends, 1.0)
    np.add.at(edges, upto, -1.0)
    return np.asarray(np.cumsum(edges)[:-1] > 0.0)


def _flag_after_gaps(time_s: Floats, *, is_own: bool) -> tuple[Flags, list[str]]:
    if time_s.size < 2:
        return np.zeros(time_s.size, dtype=bool), []
    median_s = float(np.median(np.diff(time_s)))
    ends, told = gaps_of(time_s, is_own=is_own)
    flags = rows_after_gaps(time_s, ends)
    why = ", in which the gateway's machine stood still or readings were lost" if is_own else ""
    notes = [f"{told}{why}: {int(flags.sum())} rows up to {SETTLING_S:g} s after them are not judged"] if told else []
    if median_s >= _COARSE_S:
        notes.append(f"one row every {median_s:.3g} s: are the times in ms? then --columns time_s=...:ms")
    return flags, notes
