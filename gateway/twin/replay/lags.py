"""Lags in a replay, exactly, whatever the distances of the rows: between two commands the target is held.

While a target u holds for a time h, two lags make of their states p1 and p2
    p1' = u + e1 (p1 - u),  p2' = u + e2 (p2 - u) + K (p1 - u),  K = t1 (e1 - e2) / (t1 - t2),  e = exp(-h / t),
so the states when each command arrives are a linear recursion with coefficients of its own in every row (`scanned`), and
a pressure at any time is one more such piece of what was held last. A delay only shifts this time. A lag that differs
with the direction, and the slew limit behind the lags, are stepped through from command to command instead. Between
evenly spaced rows all of it, the piece at the end and the delay as well, is one linear filter (`evenly`), three times as fast.
"""

import math
from collections.abc import Iterable
from itertools import repeat

import numpy as np

from gateway.defaults import UNLIMITED
from gateway.twin.elementwise import Real
from gateway.twin.replay.drive import Floats
from gateway.twin.sections import Regulator


def has_lags(regulator: Regulator) -> bool:
    """Return whether the pressure takes any time at all; if not, it jumps with the target."""
    return regulator.lag_s > 0.0 or regulator.second_lag_s > 0.0 or regulator.slew_pa_per_s < UNLIMITED


def is_linear(regulator: Regulator) -> bool:
    """Return whether there are lags, and neither another one for rising nor a slew limit."""
    slews = regulator.slew_pa_per_s < UNLIMITED
    return has_lags(regulator) and not slews and regulator.fill_slowdown == 0.0


def filter_even_rows(regulator: Regulator, target_pa: Floats, step_s: float) -> Floats:
    """Return the pressure at rows that lie evenly, (rows,), of a linear regulator; target_pa: one more, from before the first.

    The taps come from what one target for one step leaves in the row where it is seen first and in the two after that.
    """
    from scipy.signal import lfilter

    whole = math.floor(regulator.delay_s / step_s)
    kept_1, kept_2, across = lag_coupling(regulator.lag_s, regulator.second_lag_s, step_s)
    _, part_2, part = lag_coupling(regulator.lag_s, regulator.second_lag_s, (whole + 1) * step_s - regulator.delay_s)
    first, second = 1.0 - kept_1, 1.0 - kept_2 - across
    left = [1.0 - part_2 - part, part * first + part_2 * second]
    left.append(part * kept_1 * first + part_2 * (kept_2 * second + across * first))
    back = (1.0, -(kept_1 + kept_2), kept_1 * kept_2)
    ahead = [sum(left[tap - i] * back[i] for i in range(tap + 1)) for tap in range(3)]
    start, late = target_pa[0], min(whole, target_pa.size - 1)
    found = np.full(target_pa.size - 1, start)
    found[late:] += lfilter(ahead, back, target_pa[: target_pa.size - 1 - late] - start)
    return found


def scan_recursion(kept: Real, gained: Floats, start: float) -> Floats:
    """Solve x[0] = start, x[k + 1] = kept[k] x[k] + gained[k]; kept: a float, or one for each step.

    BLAS solves it as a triangular band; lfilter takes no coefficients that change. Imported here, as above: the twin's
    real-time part knows no scipy.
    """
    from scipy.linalg.blas import dtbsv

    band = np.empty((gained.size + 1, 2))  # the diagonal is 1, and not looked at
    band[:-1, 1] = -kept
    found: Floats = dtbsv(1, band.T, np.concatenate([[start], gained]), lower=1, diag=1, overwrite_x=1)
    return found


def follow_lag(series: Floats, lag_s: float, steps_s: Real) -> Floats:
    """Return a first-order lag behind a series that is straight between its points, from rest at its first value."""
    if lag_s <= 0.0:
        return series
    ratio = steps_s / lag_s
    kept, slope = np.exp(-ratio), -np.expm1(-ratio) / ratio
    return scan_recursion(kept, (1.0 - slope) * series[1:] + (slope - kept) * series[:-1], float(series[0]))


def lag_coupling(first_s: float, second_s: float, held_s: Real) -> tuple[Real, Real, Real]:
    """Return (e1, e2, K) of two lags over the times that targets are held; see the module's text. Lags of 0 are none."""
    kept_1 = np.exp(held_s * (-1.0 / first_s)) if first_s > 0.0 else 0.0
    kept_2 = np.exp(held_s * (-1.0 / second_s)) if second_s > 0.0 else 0.0
    if second_s == 0.0:
        return kept_1, 0.0, kept_1
    if abs(first_s - second_s) > 1.0e-3 * max(first_s, second_s):
        return kept_1, kept_2, (kept_1 - kept_2) * (first_s / (first_s - second_s))
    between = held_s * ((first_s - second_s) / (first_s * second_s))
    growth = 1.0 + between * (0.5 + between / 6.0)  # expm1(x) / x, also at 0
    return kept_1, kept_2, held_s / second_s * kept_2 * growth


def states_at_commands(regulator: Regulator, target_pa: Floats, held_s: Real) -> Floats:
    """Return states when each target arrives: rows for the first lag, for the second and for the slew limit where there are.

    held_s: of all targets but the last, a float or (targets - 1,). At rest under the first target, which lasts.
    """
    fills = regulator.fill_slowdown != 0.0 and regulator.lag_s > 0.0
    states = (_fill_states if fills else _lag_states)(regulator, target_pa, held_s)
    if regulator.slew_pa_per_s < UNLIMITED:
        states.append(_limit_slew(states[-1], regulator.slew_pa_per_s * held_s))
    return np.stack(states) if len(states) > 1 else states[0][None]


def pressure_after(regulator: Regulator, states: Floats, target_pa: Floats, held_s: Floats) -> Floats:
    """Return the pressure (points,) after the states of each point (as above, points) have lived under a target for so long."""
    _, kept_2, across = lag_coupling(regulator.lag_s, regulator.second_lag_s, held_s)
    ahead = states[0] - target_pa
    if regulator.fill_slowdown != 0.0:
        filling = lag_coupling(_filling_s(regulator), regulator.second_lag_s, held_s)[2]
        across = np.where(ahead < 0.0, filling, across)
    pressure: Floats = target_pa + across * ahead
    if regulator.second_lag_s > 0.0:
        pressure += kept_2 * (states[1] - target_pa)
    if regulator.slew_pa_per_s < UNLIMITED:
        most = regulator.slew_pa_per_s * held_s
        pressure = np.clip(pressure, states[-1] - most, states[-1] + most)
    return pressure


def _filling_s(regulator: Regulator) -> float:
    return regulator.lag_s * (1.0 + regulator.fill_slowdown)


def _lag_states(regulator: Regulator, target_pa: Floats, held_s: Real) -> list[Floats]:
    """Both lags' states when each target arrives."""
    kept_1, kept_2, across = lag_coupling(regulator.lag_s, regulator.second_lag_s, held_s)
    start, held = float(target_pa[0]), target_pa[:-1]
    first = scan_recursion(kept_1, (1.0 - kept_1) * held, start)
    if regulator.second_lag_s == 0.0:
        return [first]
    return [first, scan_recursion(kept_2, across * first[:-1] + (1.0 - kept_2 - across) * held, start)]


def _fill_states(regulator: Regulator, target_pa: Floats, held_s: Real) -> list[Floats]:
    """Lags of which the first is another one while the pressure rises, command by command."""
    steps = target_pa.size - 1
    ways = []
    for lag_s in (_filling_s(regulator), regulator.lag_s):
        shares = lag_coupling(lag_s, regulator.second_lag_s, held_s)
        ways.append(zip(*(_one_for_each(share, steps) for share in shares), strict=True))
    first = second = float(target_pa[0])
    firsts, seconds = [first], [second]
    for target, filling, emptying in zip(target_pa[:-1].tolist(), *ways, strict=True):
        kept_1, kept_2, across = filling if target > first else emptying
        second = kept_2 * second + across * first + (1.0 - kept_2 - across) * target
        first = target + kept_1 * (first - target)
        firsts.append(first)
        seconds.append(second)
    return [np.array(firsts), np.array(seconds)]


def _limit_slew(pressure_pa: Floats, most_pa: Real) -> Floats:
    """Return what a slew limit of `most_pa` per step lets through.

    Marched only where it binds: from a step that is too large until the pressure has caught up.
    """
    binds = np.flatnonzero(np.abs(np.diff(pressure_pa)) > most_pa)
    if binds.size == 0:
        return pressure_pa
    asked, last = pressure_pa.tolist(), pressure_pa.size - 1
    most = most_pa.tolist() if np.ndim(most_pa) else [float(most_pa)] * last
    passed, k = list(asked), 0
    while k < binds.size:
        at = int(binds[k])
        pressure = passed[at]
        while at < last:
            travel, step = asked[at + 1] - pressure, most[at]
            at += 1
            if -step <= travel <= step:
                break
            pressure += step if travel > 0.0 else -step
            passed[at] = pressure
        k = int(np.searchsorted(binds, at))
    return np.array(passed)


def _one_for_each(values: Real, steps: int) -> Iterable[float]:
    """What is one for all steps, or one for each, as floats for each."""
    return values.tolist() if np.ndim(values) else repeat(float(values), steps)
