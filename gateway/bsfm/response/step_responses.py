"""From the rows of a run to its step responses: each step of the command, and what came back.

Of each step the model gives the way from the settled force before to the settled force after it, as voltages (so that
neither a bent characteristic nor friction after a reversal passes for a lag); both ends are the measured ones, so an error
of the model's level does not matter. The voltages are linearized (gateway.bsfm.drive_map), because a regulator's lags carry
what its command map has bent.
"""

from dataclasses import dataclass, replace
from math import inf
from typing import Final

import numpy as np

from gateway.bsfm.drive_map import DriveMap
from gateway.bsfm.ladder.lone_reading import without_lone_reading
from gateway.bsfm.ladder.settled_points import SAME_V, TAIL_SHARE
from gateway.bsfm.model import Bsfm
from gateway.bsfm.response.response_model import PATH_POINTS, Floats, Lags, StepResponse, missing_share
from gateway.bsfm.slip.reversal import Memory
from gateway.defaults import TICK_S

LEAST_STEP_N: Final = 3.0  # smaller ones tell more of friction than of lags
NOISE_AT: Final = 12.0  # a step must be so many sigmas
FEWEST_ROWS: Final = 4
LONGEST_S: Final = 2.0  # a lag or dead time beyond it is no response but drift
MOST_MISSING: Final = 0.2  # of a step at its end, that is believed to come still
SHORTEST_HOLD_S: Final = 0.1  # a command held for less is a part of a slew
BACK_N: Final = (0.0, 0.25, 0.5, 1.0, 2.0, 3.5, 6.0)  # of the way back from a peak, where the model is asked
MOST_CHANGES: Final = 40  # of the command that are remembered from step to step


@dataclass(frozen=True, slots=True, eq=False)
class RecordedRun:
    """Rows of a run: time in s, command in V, force in N, each of shape (rows,).

    slew_v_per_s: how fast a command may rise, which the rows between do not show.
    """

    time_s: Floats
    command_v: Floats
    force_n: Floats
    slew_v_per_s: float = inf


def tail_rows(rows: int) -> int:
    """Return how many rows at the end of a step count as settled."""
    return max(2, round(TAIL_SHARE * rows))


def step_responses_of(run: RecordedRun, model: Bsfm, lags: Lags | None = None) -> list[StepResponse]:
    """Return the steps of a run that say something of the plant's lags, in linearized volts.

    lags: by which the ends of the steps are corrected that had not settled; None where none are known yet.
    """
    plateaus = _plateaus(run.time_s, run.command_v)
    steps, memory, scale = [], model.reversal.start(), DriveMap(model)
    settled_n = [_mean_settled_n(run.force_n, plateau) for plateau in plateaus]
    if lags:
        settled_n = _correct_ends(settled_n, plateaus, run.time_s, lags)
    earlier: tuple[tuple[float, float], ...] = ()
    for k in range(1, len(plateaus)):
        before, now = plateaus[k - 1], plateaus[k]
        from_v, to_v = float(run.command_v[before.last]), float(run.command_v[now.last])
        is_ramp = _is_ramp(run, now)
        at_s = float(run.time_s[now.first])
        changes = _row_changes(run, now) if is_ramp else _changes(at_s, from_v, to_v, run.slew_v_per_s)
        way = _way(model, memory, (from_v, to_v), (settled_n[k - 1], settled_n[k]))
        memory = model.memory_after(memory, settled_n[k - 1], settled_n[k])
        rows = slice(now.first + 1, now.end + 1)
        if way is not None and not is_ramp and _stands_out(run.force_n[rows], settled_n[k - 1], settled_n[k]):
            lasting = tuple(change for change in earlier if change[0] > run.time_s[now.first] - LONGEST_S)
            step = StepResponse(run.time_s[rows], run.force_n[rows], (*lasting, *changes), to_v, *way)
            steps.append(_linearize(step, scale))
        earlier = (*earlier, *changes)[-MOST_CHANGES:]
    return steps


@dataclass(frozen=True, slots=True)
class _Plateau:
    """Rows first .. last of one command; end: the row at which the next begins, which still reads this one's force."""

    first: int
    last: int
    end: int


def _plateaus(time_s: Floats, command_v: Floats) -> list[_Plateau]:
    """Stretches of one command, the slew up to it taken with it."""
    starts = np.concatenate([[0], 1 + np.flatnonzero(np.abs(np.diff(command_v)) > SAME_V)])
    lasts = np.concatenate([starts[1:] - 1, [len(command_v) - 1]])
    plateaus: list[_Plateau] = []
    first = None
    for start, last in zip(starts.tolist(), lasts.tolist(), strict=True):
        first = start if first is None else first
        if time_s[last] - time_s[start] < SHORTEST_HOLD_S and last < len(command_v) - 1:
            continue  # on its way
        plateaus.append(_Plateau(first, last, min(last + 1, len(command_v) - 1)))
        first = None
    return plateaus


def _mean_settled_n(force_n: Floats, plateau: _Plateau) -> float:
    rows = force_n[plateau.first + 1 : plateau.end + 1]
    return (
        float(np.mean(without_lone_reading(rows[-tail_rows(len(rows)) :].tolist())))
        if len(rows)
        else float(force_n[plateau.last])
    )


def _correct_ends(settled_n: list[float], plateaus: list[_Plateau], time_s: Floats, lags: Lags) -> list[float]:
    """Where each step would have ended: its tail, and what was missing then."""
    ends_n = settled_n[:1]
    for k in range(1, len(plateaus)):
        now = plateaus[k]
        since_s = time_s[now.first + 1 : now.end + 1] - time_s[now.first] - lags.dead_time_s
        tail_s = since_s[-tail_rows(len(since_s)) :]
        share = (
            float(np.mean(missing_share(tail_s, lags.lag_s, lags.second_lag_s, lags.damping))) if len(tail_s) else 0.0
        )
        ends_n.append(ends_n[-1] + (settled_n[k] - ends_n[-1]) / (1.0 - min(share, MOST_MISSING)))
    return ends_n


def _stands_out(force_n: Floats, from_n: float, to_n: float) -> bool:
    """Whether the step has enough readings, and is far larger than their noise."""
    noise_n = float(np.std(force_n[-tail_rows(len(force_n)) :])) if len(force_n) >= FEWEST_ROWS else inf
    return abs(to_n - from_n) >= max(LEAST_STEP_N, NOISE_AT * noise_n) and len(force_n) >= FEWEST_ROWS


def _is_ramp(run: RecordedRun, plateau: _Plateau) -> bool:
    """Whether the command took its time, more than the slew asks for: such a way tells little of the lags."""
    volts = run.command_v[plateau.first : plateau.last + 1]
    moving = np.flatnonzero(np.abs(np.diff(volts)) > SAME_V)
    took_s = float(run.time_s[plateau.first + moving[-1] + 1] - run.time_s[plateau.first]) if len(moving) else 0.0
    before_v = float(run.command_v[plateau.first - 1])
    return took_s > max(0.0, float(volts[-1]) - before_v) / run.slew_v_per_s + SHORTEST_HOLD_S


def _row_changes(run: RecordedRun, plateau: _Plateau) -> tuple[tuple[float, float], ...]:
    """The way to a plateau, as the rows have it."""
    rows = slice(plateau.first - 1, plateau.last + 1)
    moved_v = np.diff(run.command_v[rows])
    at_s = run.time_s[plateau.first : plateau.last + 1]
    return tuple((float(when_s), float(by_v)) for when_s, by_v in zip(at_s, moved_v, strict=True) if by_v)


def _changes(at_s: float, from_v: float, to_v: float, slew_v_per_s: float) -> tuple[tuple[float, float], ...]:
    """The step as it was put out: at once, or tick by tick where it had to rise slowly."""
    if to_v <= from_v or to_v - from_v <= slew_v_per_s * TICK_S:
        return ((at_s, to_v - from_v),)
    by_v = slew_v_per_s * TICK_S
    whole = int((to_v - from_v) / by_v)
    steps = [(at_s + TICK_S * k, by_v) for k in range(whole)]
    rest_v = to_v - from_v - whole * by_v
    return (*steps, (at_s + TICK_S * whole, rest_v)) if rest_v > SAME_V else tuple(steps)


def _way(
    model: Bsfm, memory: Memory, volts: tuple[float, float], forces_n: tuple[float, float]
) -> tuple[Floats, Floats, Floats, Floats] | None:
    """(V, N) on the way by the model, stretched so that it goes through both settled readings, by rising voltage; then the
    same on the way back from the end. None where the model sees no way."""
    (from_v, to_v), (from_n, to_n) = volts, forces_n
    if abs(to_n - from_n) < LEAST_STEP_N or (to_n - from_n) * (to_v - from_v) <= 0.0:
        return None
    path_n = np.linspace(from_n, to_n, PATH_POINTS)
    path_v = []
    for force_n in path_n.tolist():
        share = model.branch_share(model.memory_after(memory, from_n, force_n))
        path_v.append(model.voltage_v(force_n, share)[0])
    way_v = np.maximum.accumulate((np.array(path_v) - path_v[0]) / (path_v[-1] - path_v[0] or 1.0))
    way_v = way_v / way_v[-1] if way_v[-1] > 0.5 else np.linspace(0.0, 1.0, PATH_POINTS)
    stretched_v = from_v + way_v * (to_v - from_v)
    back_n = np.array(BACK_N)
    back_v = to_v + _back_v(model, model.memory_after(memory, from_n, to_n), to_n, np.sign(to_n - from_n) * back_n)
    if to_v > from_v:
        return stretched_v, path_n, back_v, back_n
    return stretched_v[::-1].copy(), path_n[::-1].copy(), back_v, back_n


def _back_v(model: Bsfm, memory: Memory, from_n: float, back_n: Floats) -> Floats:
    """By how much the voltage changes where the force goes back."""
    asked_v = []
    for force_n in (from_n - back_n).tolist():
        share = model.branch_share(model.memory_after(memory, from_n, force_n))
        asked_v.append(model.voltage_v(force_n, share)[0])
    return np.array(asked_v) - asked_v[0]


def _linearize(step: StepResponse, scale: DriveMap) -> StepResponse:
    """The same in volts that the plant's lags are linear in. Changes lead from one voltage to the next, so they are
    converted from the last one backwards."""
    changes, after_v = [], step.end_v
    for at_s, moved_v in reversed(step.changes):
        before_v = after_v - moved_v
        changes.append((at_s, scale.linear_v(after_v) - scale.linear_v(before_v)))
        after_v = before_v
    path_v = np.array([scale.linear_v(volts) for volts in step.path_v.tolist()])
    end_v = scale.linear_v(step.end_v)
    back_v = np.maximum.accumulate(np.abs([scale.linear_v(volts) - end_v for volts in step.back_v.tolist()]))
    return replace(step, changes=tuple(reversed(changes)), end_v=end_v, path_v=path_v, back_v=back_v)
