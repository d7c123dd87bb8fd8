"""Which readings may be judged: valid by the quality column, and not the one before written down again."""

from collections.abc import Iterable, Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.recording.tables.column_names import DERIVED, PULLING
from gateway.robust import noise_from_second_differences

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

OVERLOAD: Final = 1.5
"""Our recorder writes 0 ok, 1 unsteady (normal while the force moves) and 2 overload; only the last is no reading."""
_OURS: Final = 2.0
_OPC_GOOD, _OPC_MOST = 192.0, 255.0
_MOST_VALUES: Final = 8
_RARE_SHARE: Final = 0.2
_LEAST_REPEATS: Final = 3
_LEAST_SHARE: Final = 0.002
_ENOUGH: Final = 10
_FINE_STEPS: Final = 5.0
_ENDS: Final = (0.05, 0.95)
_BEYOND: Final = 5.0  # times as far away as nine tenths of all readings lie apart, or from 0
_LEAST_CLIPPED: Final = 20
_CLIPPED_SHARE: Final = 0.01
_NOISE_STEPS: Final = (
    2.0  # of the resolution that the noise must have: then no two readings in a hundred are the largest
)
_OFF_V: Final = 0.01
_FORGOTTEN_S: Final = 12.0  # behind a pull; what comes higher later is not waited for
_REMEMBERED_S: Final = 1.0  # that a force still follows what drove it


def pulled_rows(columns: Mapping[str, Floats]) -> Flags:
    """Return the rows in which the tool pulled, by our recorder: none of what was recorded before it knew, or by others."""
    if PULLING in columns and set(DERIVED) <= set(columns):
        return np.asarray(columns[PULLING] == 1.0)
    return np.zeros(len(columns["time_s"]), dtype=bool)


def rows_about_pulls(columns: Mapping[str, Floats]) -> Flags:
    """Return the rows of which a plant that only pushes can say nothing: those of a pull; those at rest right before it, in
    which the valve turns; and what follows it up to the highest command, where all friction has forgotten it."""
    pulled, command_v = pulled_rows(columns), columns.get("command_v")
    if command_v is None or not pulled.any():
        return pulled
    about, time_s = pulled.copy(), columns["time_s"]
    edges = np.flatnonzero(np.diff(pulled.astype(np.int8), prepend=0, append=0))
    pushes = np.append(0, np.append(edges, pulled.size)).reshape(-1, 2)
    for first, stop in pushes:
        if first > 0 and stop > first:
            lead = first + int(np.searchsorted(time_s[first:stop], time_s[first] + _FORGOTTEN_S))
            about[first : first + int(np.argmax(np.nan_to_num(command_v[first:lead]))) + 1] = True
        if stop < pulled.size:
            pressing = np.flatnonzero(command_v[first:stop] > _OFF_V)
            about[first + (int(pressing[-1]) + 1 if pressing.size else 0) : stop] = True
    return about


def valid_by_quality(quality: Floats, is_ours: bool) -> tuple[Flags, list[str]]:
    """Return rows whose reading is valid, and what was made of the column.

    A foreign table may mean 0 or 1 (or 192) by good: the most frequent value is taken for it, as long as the others are
    rare. Where they are not, 0 and 1 are both kept, as our recorder means them; of other numbers only those are known
    that OPC gives to good readings, 192 and more.
    """
    known = np.isfinite(quality)
    values, counts = np.unique(quality[known], return_counts=True)
    if not values.size:
        return np.ones(quality.size, dtype=bool), ["quality holds no numbers and was not used"]
    if values.size > _MOST_VALUES:
        return np.ones(quality.size, dtype=bool), [
            f"quality takes {values.size} values: no flag, so no row was left out for it"
        ]
    good = float(values[counts.argmax()])
    valid, what = known & (quality == good), f"quality is not {good:g}"
    if is_ours or ((~valid).mean() > _RARE_SHARE and values.max() <= _OURS):
        good, valid, what = 0.0, known & (quality < OVERLOAD), "quality is not 0"
    elif (~valid).mean() > _RARE_SHARE:
        if values.max() < _OPC_GOOD or values.max() > _OPC_MOST:
            return np.ones(quality.size, dtype=bool), [
                "what quality means by a good reading is not clear: it was not used"
            ]
        valid, what = known & (quality >= _OPC_GOOD), f"quality is below {_OPC_GOOD:g}"
    bad = int((~valid).sum())
    what = "overload or unknown" if good == 0.0 and (is_ours or values.size > 2) else what
    return valid, [f"{bad} rows are not judged: {what} by the quality column"] if bad else []


def flag_repeated(force_n: Floats) -> tuple[Flags, list[str]]:
    """Return rows whose reading is bit for bit the one before, where that is more frequent than the resolution explains.

    The number of steps of 0 that a resolution brings is read off those of one and two counts, whose logarithm falls
    with the square of the step. The ends of the range and 0 are left aside: a force that rests there repeats by itself.
    """
    none = np.zeros(force_n.size, dtype=bool)
    finite = force_n[np.isfinite(force_n)]
    if finite.size < 2:
        return none, []
    resting = (force_n == finite.max()) | (force_n == finite.min()) | (force_n == 0.0)
    same = np.append(False, force_n[1:] == force_n[:-1]) & ~resting
    repeats, expected = int(same.sum()), _repeats_by_resolution(force_n, resting)
    enough = max(_LEAST_REPEATS, _LEAST_SHARE * finite.size)
    if expected is None or repeats < enough or repeats < expected + 4.0 * np.sqrt(expected + 1.0) + enough:
        return none, []
    return same, [
        f"{repeats} readings ({repeats / finite.size:.1%}) repeat the one before: logged twice, or not renewed"
    ]


def _repeats_by_resolution(force_n: Floats, resting: Flags) -> float | None:
    """Return how many equal neighbours the resolution explains; None when it may explain any number."""
    steps = np.abs(np.diff(force_n))[~resting[1:]]
    steps = steps[np.isfinite(steps) & (steps > 0.0)]
    if steps.size < _ENOUGH:
        return None  # a force that hardly moves
    unit = float(np.quantile(steps, 0.001))
    counts = np.round(steps / unit)
    ones, twos = int((counts == 1).sum()), int((counts == 2).sum())
    if np.median(counts) >= _FINE_STEPS:
        return 0.5 * max(ones, twos)
    if twos < _ENOUGH:
        return None
    return float(0.75 * ones * max(ones / twos, 1.0) ** (1.0 / 3.0))  # half again as many, for a force that creeps


def flag_clipped(force_n: Floats, usable: Flags) -> tuple[Flags, list[str]]:
    """Return the usable rows at the end of the cell's or its converter's range: the largest reading there is, push or pull,
    again and again, though noise of several steps should tell readings apart. A stretch that is frozen at it is none."""
    none, known = np.zeros(force_n.size, dtype=bool), force_n[usable]
    if known.size < _ENOUGH:
        return none, []
    end_n = float(known[np.argmax(np.abs(known))])
    clipped = usable & (force_n == end_n)
    rows = int(clipped.sum())
    beside = force_n[usable & ~clipped]
    steps_n = np.diff(np.unique(beside))
    if rows < max(_LEAST_CLIPPED, _CLIPPED_SHARE * known.size) or beside.size < _ENOUGH or not steps_n.size:
        return none, []
    step_n = float(np.median(steps_n))
    stretches = int(np.sum(np.diff(clipped.astype(np.int8)) == 1))
    if stretches < _LEAST_REPEATS or noise_from_second_differences(beside) < _NOISE_STEPS * step_n:
        return none, []
    seen = f"{rows} readings ({rows / known.size:.1%}) stand at {end_n:.5g} N"
    return clipped, [f"{seen}: the end of the cell's or its converter's range? They are not judged"]


def flag_dropouts(force_n: Floats, time_s: Floats, drives: Iterable[Floats]) -> tuple[Flags, list[str]]:
    """Return stretches of readings far beyond all others that nothing drives there: what a logger writes for no value, such as
    -9999. A single such reading is left to the diagnosis, which knows spikes.

    drives: columns without holes that move the force; one that leaves its usual range at such a stretch, or within a second
    before it, explains the force.
    """
    none = np.zeros(force_n.size, dtype=bool)
    known = force_n[np.isfinite(force_n)]
    if known.size < _ENOUGH:
        return none, []
    low_n, high_n = np.quantile(known, _ENDS)
    far_n = _BEYOND * max(high_n - low_n, abs(low_n), abs(high_n))
    with np.errstate(invalid="ignore"):
        far = (force_n < low_n - far_n) | (force_n > high_n + far_n)
    beside = np.append(False, far[:-1]) | np.append(far[1:], False)
    far &= beside
    if not far_n > 0.0 or not far.any():
        return none, []
    edges = np.zeros(force_n.size + 1)
    rows = np.flatnonzero(far)
    np.add.at(edges, np.searchsorted(time_s, time_s[rows] - _REMEMBERED_S), 1.0)
    np.add.at(edges, rows + 1, -1.0)
    about = np.cumsum(edges)[:-1] > 0.0
    if about.all() or any(_leaves_its_range(drive, about) for drive in drives):
        return none, []
    first = f"{force_n[rows[0]]:.5g} N at {time_s[rows[0]]:.3f} s"
    note = f"{rows.size} readings are far beyond all others while nothing drives them (the first: {first}): taken as missing"
    return far, [note]


def _leaves_its_range(drive: Floats, about: Flags) -> bool:
    """Decide whether a column goes beyond what it has elsewhere, by more than a hundredth of that."""
    low, high = float(np.min(drive[~about])), float(np.max(drive[~about]))
    slack = 0.01 * (high - low)
    return bool(np.min(drive[about]) < low - slack or np.max(drive[about]) > high + slack)
