"""What the readings of a self-test say, as numbers: pure functions of (seconds, N) pairs in the order of time."""

from collections.abc import Sequence
from itertools import pairwise, repeat
from math import ceil, inf, sqrt
from statistics import fmean, median
from typing import Final, NamedTuple

from gateway.bsfm.ladder.lone_reading import find_lone_reading

Trace = Sequence[tuple[float, float]]

MEAN_S: Final = 0.3  # of readings for the force of a level
_RATE_S: Final = 0.1  # of neighbouring windows, whose difference is a rate
_STILL_N: Final = 0.05  # between neighbouring windows: less is no rise
_NOT_REACHED: Final = 0.1  # of a step: standard error of a mean that is two thirds of the step away from where it began
_MOST_SMOOTHED: Final = 30
_SMOOTHED: Final = 3  # readings whose mean is compared with a level: one spike is no crossing
_SAME_N: Final = 1.0e-9  # two readings nearer than this are equal but for arithmetic
_LONE_N: Final = 1.5  # off the median: of one false reading LeapLimit believes 3 N
_CLOSE: Final = 0.5  # median intervals, below which a reading is nearer to the one before than it was sent
_MISSED: Final = 1.75  # median intervals from which on a message is missing


class Slope(NamedTuple):
    """Of a line through readings. error: its standard error by the noise around the line."""

    n_per_s: float
    error_n_per_s: float


class Intervals(NamedTuple):
    """Of the times of readings, without what others that came with them have filled. missing: messages that did not come, by
    the median interval."""

    median_s: float
    longest_s: float
    missing: int


def without_lone_reading(trace: Trace) -> Trace:
    """Return the readings without the one that alone is far off, if there is one: in a noise or a fall it would count whole."""
    lone = find_lone_reading([force_n for _, force_n in trace], _LONE_N)
    return trace if lone is None else [*trace[:lone], *trace[lone + 1 :]]


def mean_n(trace: Trace) -> float:
    """Return the mean force."""
    return fmean(force_n for _, force_n in trace)


def noise_n(trace: Trace) -> float:
    """Return the standard deviation by what neighbouring readings differ: a slow drift counts little. 0 for fewer than two."""
    if len(trace) < 2:
        return 0.0
    return sqrt(sum((b - a) ** 2 for (_, a), (_, b) in pairwise(trace)) / (2.0 * (len(trace) - 1)))


def count_n(trace: Trace) -> float:
    """Return the smallest difference between unlike readings, N: one count of the amplifier; 0 where all are equal."""
    steps = pairwise(sorted(force_n for _, force_n in trace))
    return min((b - a for a, b in steps if b - a > _SAME_N), default=0.0)


def is_constant(trace: Trace) -> bool:
    """Decide whether all readings are the same."""
    return count_n(trace) == 0.0


def last(trace: Trace, seconds: float) -> Trace:
    """Return the readings of the last seconds."""
    first = len(trace)
    while first and trace[first - 1][0] > trace[-1][0] - seconds:
        first -= 1
    return trace[first:]


def fit_slope(trace: Trace) -> Slope:
    """Return the least-squares line's slope; 0 with 0 error for fewer than three readings."""
    if len(trace) < 3:
        return Slope(0.0, 0.0)
    mid_s, mid_n = fmean(at_s for at_s, _ in trace), mean_n(trace)
    spread = sum((at_s - mid_s) ** 2 for at_s, _ in trace)
    slope = sum((at_s - mid_s) * (force_n - mid_n) for at_s, force_n in trace) / spread
    left = sum((force_n - mid_n - slope * (at_s - mid_s)) ** 2 for at_s, force_n in trace)
    return Slope(slope, sqrt(left / (len(trace) - 2) / spread))


def time_to_share_s(trace: Trace, from_n: float, to_n: float, share: float, noise_n: float) -> float:
    """Return the seconds until the force has done this share of the way; the last time where it has not.

    The mean of so many readings is compared that noise alone does not reach the level, and has the time of the middle one; the
    level is reached on the straight way from the mean before. At the time of the reading itself a cell of 5 Hz made a quarter
    of a second of it, and a healthy machine slow."""
    level_n = from_n + share * (to_n - from_n)
    smoothed = max(_SMOOTHED, min(_MOST_SMOOTHED, ceil((noise_n / (_NOT_REACHED * (to_n - from_n))) ** 2)))
    before_s, before_n = 0.0, from_n
    for k in range(smoothed, len(trace) + 1):
        window = trace[k - smoothed : k]
        at_s, at_n = fmean(at_s for at_s, _ in window), mean_n(window)
        if (at_n - level_n) * (to_n - from_n) >= 0.0:
            reached = (level_n - before_n) / (at_n - before_n) if at_n != before_n else 1.0
            return before_s + max(0.0, reached) * (at_s - before_s)
        before_s, before_n = at_s, at_n
    return trace[-1][0] if trace else 0.0


def still_rises(trace: Trace, noise_n: float) -> bool:
    """Decide whether neighbouring windows at the end differ by more than their noise, upwards."""
    now, before = _neighbours(trace, MEAN_S)
    if not now or not before:
        return False
    error_n = noise_n * sqrt(1.0 / len(now) + 1.0 / len(before))
    return mean_n(now) - mean_n(before) > max(_STILL_N, 3.0 * error_n)


def rate_n_per_s(trace: Trace, floor_n: float = -inf) -> float:
    """Return how fast the force rises above floor_n at the end of the trace, N/s; 0 where it does not, or nobody knows."""
    now, before = ([(at_s, max(force_n, floor_n)) for at_s, force_n in part] for part in _neighbours(trace, _RATE_S))
    return max(0.0, mean_n(now) - mean_n(before)) / _RATE_S if now and before else 0.0


def _neighbours(trace: Trace, seconds: float) -> tuple[Trace, Trace]:
    """The last window, and the one before it."""
    now, both = last(trace, seconds), last(trace, 2.0 * seconds)
    return now, both[: len(both) - len(now)]


def readings_to_know(noise_n: float, within_n: float) -> int:
    """Return how many readings' mean is known to within_n, to three standard errors."""
    return max(_SMOOTHED, min(_MOST_SMOOTHED, ceil((3.0 * noise_n / within_n) ** 2)))


def intervals_of(times_s: Sequence[float], beside: Sequence[int] = ()) -> Intervals:
    """Return how regularly readings came; zeros for fewer than two. beside: how many others each has brought, which waited for
    a loop that came late; none where it is left out."""
    steps = list(zip((b - a for a, b in pairwise(times_s)), beside[1:] or repeat(0), strict=False))
    if not steps:
        return Intervals(0.0, 0.0, 0)
    usual_s = median(step / (1 + others) for step, others in steps)
    gaps_s = [max(min(step, usual_s), step - others * usual_s) for step, others in steps]
    return Intervals(usual_s, max(gaps_s), _missing([gap_s / usual_s for gap_s in gaps_s]) if usual_s > 0.0 else 0)


def _missing(gaps: Sequence[float]) -> int:
    """Count what did not come, by gaps in usual ones: what only came late follows close behind its gap."""
    missing, owed, made_up = 0, 0, 0.0
    for gap in (*gaps, 1.0):
        if gap < _CLOSE:
            made_up += 1.0 - gap
            continue
        missing += max(0, owed - round(made_up))
        owed, made_up = (round(gap) - 1 if gap > _MISSED else 0), 0.0
    return missing
