"""From a recording to settled points: one per dwell, found in the data.

By the recording contract `command_v` holds until the next row and `force_n` is read before it acts, so a row's force
belongs to the command of the row before. A dwell is a stretch of one command; its point is the mean of the last quarter,
which is as settled as the dwell let it become, without a reading that alone is far off. A table with one row per stair has
no dwell to look into; whether its forces belong to their own row or to the row before is decided at the turning points,
where the two differ.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.bsfm.fit.projected_problem import Floats
from gateway.bsfm.ladder.lone_reading import without_lone_reading

Integers = NDArray[np.int64]

SAME_V: Final = 2.0e-3  # commands closer than this are one: a read-back jitters by a count
TAIL_SHARE: Final = 0.25
FEWEST_TAIL_ROWS: Final = 5
SHORTEST_DWELL_S: Final = 0.1  # shorter stretches are the slew between two stairs
LINE_NUMBERS: Final = 2  # of a straight line
FEWEST_READINGS: Final = 20  # beyond the lines' own numbers: the noise is known to a sixth then
KNOCKED: Final = 25.0  # times the usual variance, median: noise alone makes so much of a single difference once in 1000
LOST: Final = 1.5  # times the usual time between rows: some are missing
FEWEST_DWELL_ROWS: Final = 2  # the same where readings are as far apart: one on the way is not settled


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """One settled reading per stair, in order. row: where its dwell begins; noise_n: standard deviation of a single
    reading, nan if unknown (`_noise_n`); drift_n: how much the force still moved within the averaged part; notes: what was
    decided about the table."""

    voltage_v: Floats
    force_n: Floats
    row: Integers
    drift_n: Floats
    noise_n: float
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.voltage_v)


def find_settled_points(time_s: Floats, command_v: Floats, force_n: Floats, stair: Integers | None = None) -> Points:
    """Find the settled points of finite columns whose time does not fall. stair: of each row, where it is known: two stairs of
    one voltage are two points then. ValueError when the command never rests."""
    starts = _starts(command_v) if stair is None else _starts_of_stairs(command_v, stair)
    lengths = np.diff(np.append(starts, len(command_v)))
    if stair is None and np.median(lengths) < 3:
        return _one_row_each(time_s, command_v, force_n)
    return _dwells(time_s, command_v, force_n, starts)


def _starts(command_v: Floats) -> Integers:
    """Rows at which a new command begins; slow drifts within SAME_V per row are followed from the dwell's first row."""
    starts = [0]
    for row in range(1, len(command_v)):
        if abs(command_v[row] - command_v[starts[-1]]) > SAME_V:
            starts.append(row)
    return np.array(starts, dtype=np.int64)


def _starts_of_stairs(command_v: Floats, stair: Integers) -> Integers:
    return np.union1d(_starts(command_v), np.flatnonzero(np.diff(stair)) + 1)


def _dwells(time_s: Floats, command_v: Floats, force_n: Floats, starts: Integers) -> Points:
    ends = np.append(starts[1:], len(time_s) - 1)  # the row of the next command still reads this one's force
    ends[:-1] -= _is_late(time_s, ends[:-1])
    dwells, tails = [], []
    for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
        if time_s[end] - time_s[start] < SHORTEST_DWELL_S or end - start < FEWEST_DWELL_ROWS:
            continue
        tail = _tail(force_n[start + 1 : end + 1])
        half = len(tail) // 2
        drift_n = float(tail[half:].mean() - tail[:half].mean()) if half else 0.0
        dwells.append((command_v[start], tail.mean(), start, drift_n))
        tails.append(tail)
    if not dwells:
        raise ValueError(f"no command is held for {SHORTEST_DWELL_S:g} s: this is a ramp, not a ladder of stairs")
    voltage_v, mean_n, row, drift = (np.array(column) for column in zip(*dwells, strict=True))
    return Points(voltage_v, mean_n, row.astype(np.int64), drift, _noise_n(tails))


def _is_late(time_s: Floats, ends: Integers) -> NDArray[np.bool_]:
    """Return which of the rows at which a next command begins are not its first: rows are missing before it, and its force is
    on its way already."""
    apart_s = np.diff(time_s)
    return np.asarray(apart_s[ends - 1] > LOST * np.median(apart_s)) if len(apart_s) else np.zeros(len(ends), bool)


def _noise_n(tails: Sequence[Floats]) -> float:
    """Standard deviation of a reading about the straight line through its dwell's tail: what still creeps is no noise, nor
    is the dwell in which somebody knocked. nan for too few readings. Noise that is slower than a tail is not seen."""
    usable = [tail for tail in tails if len(tail) > 1]
    free = np.array([max(len(tail) - LINE_NUMBERS, 1) for tail in usable])
    if free.sum() < FEWEST_READINGS:
        return float("nan")
    squares = np.array([_squares_about_line(tail) for tail in usable])
    usual = squares <= KNOCKED * np.median(squares / free) * free
    return float(np.sqrt(squares[usual].sum() / free[usual].sum()))


def _squares_about_line(values: Floats) -> float:
    """Of two values about their mean: a line would leave nothing."""
    away = values - values.mean()
    if len(values) <= LINE_NUMBERS:
        return float(away @ away)
    place = np.arange(len(values)) - 0.5 * (len(values) - 1)
    return float(away @ away - (place @ away) ** 2 / (place @ place))


def _tail(force_n: Floats) -> Floats:
    count = max(FEWEST_TAIL_ROWS, round(TAIL_SHARE * len(force_n)))
    return np.array(without_lone_reading(force_n[-min(count, max(1, len(force_n) // 2)) :].tolist()))


def _one_row_each(time_s: Floats, command_v: Floats, force_n: Floats) -> Points:
    apart_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
    if apart_s < SHORTEST_DWELL_S:
        raise ValueError(
            f"the command changes every {apart_s * 1e3:.0f} ms: the force has no time to settle; hold each stair for "
            "0.3 s or more"
        )
    lag, note = _pairing(command_v, force_n)
    count, nothing = len(command_v) - lag, np.zeros(len(command_v) - lag)
    rows = np.arange(count, dtype=np.int64)
    return Points(command_v[:count], force_n[lag:], rows, nothing, float("nan"), (note,))


def _pairing(command_v: Floats, force_n: Floats) -> tuple[int, str]:
    """(rows by which the force lags its command, note). The force follows the command's turns in the right pairing."""
    step_v, step_n = np.diff(command_v), np.diff(force_n)
    own, before = float(step_v @ step_n), float(step_v[:-1] @ step_n[1:])
    if abs(own) >= abs(before):
        return 0, "one row per stair: each force taken as settled at its own row's command (its turns follow that one)"
    return (
        1,
        "one row per stair: each force taken as settled at the command of the row before (its turns follow that one)",
    )
