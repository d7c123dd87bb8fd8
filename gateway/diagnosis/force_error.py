"""Compare two real runs by the error of their commanded force: what was measured minus what the master asked for.

Two runs are comparable only where the same was asked of both. So the rows under force are cut into blocks, at every change
of what is asked and every few seconds, and a block belongs to a task: a force that is held, come to from below or from
above, or a way from one force to another. Forces count as the same within an eighth of the largest. A task that only one
run has counts for nothing; the others weigh as many rows as the run with fewer of them has. The interval resamples blocks
of both runs with replacement (Efron and Tibshirani 1993, chapter 8), for rows beside each other have the same error.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise
from math import isfinite, nan
from typing import Final

import numpy as np

from gateway.diagnosis.measurement import Flags, Floats
from gateway.registers.words import State
from gateway.robust import LARGEST_VALUE

SETTLED_S: Final = 0.6
"""From a change of the force that is asked until a rig of this kind has arrived: README, "How well it holds"."""
LONGEST_BLOCK_S: Final = 5.0
_SAME_N: Final = 0.005  # half a count of the setpoint register: less is no change
_LEVELS: Final = 8
_RESAMPLES: Final = 2000
FEWEST_BLOCKS: Final = 6
"""Comparable blocks of a run below which nothing is said: a resample of five has hardly any ways to be another one."""


NEEDED: Final = ("time_s", "force_n", "setpoint_n")
"""Columns without which nobody knows what was asked and what came."""


class GainVerdict(StrEnum):
    """What a comparison says."""

    BETTER = "better"
    WORSE = "worse"
    UNKNOWN = "cannot be told"


@dataclass(frozen=True, slots=True)
class CommandedForce:
    """Rows of a run: time, s; the force that the master asks for and the one measured, N, negative where the tool pulls;
    whether the row counts."""

    time_s: Floats
    wanted_n: Floats
    measured_n: Floats
    counts: Flags


@dataclass(frozen=True, slots=True)
class ErrorBlock:
    """One stretch of a run: from_n to to_n was asked, equal where it was held; rising: how the held force was come to;
    rows, and the sum of their squared errors, N^2."""

    from_n: float
    to_n: float
    rising: bool
    settled: bool
    rows: int
    squares_n2: float


@dataclass(frozen=True, slots=True)
class ForceChange:
    """RMS error of the commanded force before and after, N, on the tasks that both runs have; ratio after to before and
    difference before minus after, each with its 95 % interval (nan: none); blocks that were compared, and their share of
    each run's rows; why: of a verdict that cannot be told."""

    before_rms_n: float
    after_rms_n: float
    ratio: float
    gain_n: float
    blocks: tuple[int, int]
    comparable_share: tuple[float, float]
    ratio_ci95: tuple[float, float] = (nan, nan)
    gain_ci95: tuple[float, float] = (nan, nan)
    verdict: GainVerdict = GainVerdict.UNKNOWN
    why: str = ""


def commanded_force(columns: Mapping[str, Floats]) -> CommandedForce:
    """Return the rows of a recording, or of the sample ring, by its column names. ValueError names a column that is missing.

    A row counts where the state says that a force is held or on its way, without a fault; without these columns where the
    setpoint is above 0. What is asked stands until the next row that says it; asked with a valve that pulls, it is negative.
    """
    if missing := [name for name in NEEDED if name not in columns]:
        raise ValueError(f"no column {' and no column '.join(missing)}")
    wanted_n, counts = _hold(columns["setpoint_n"])
    if "state" in columns:
        counts &= np.isin(columns["state"], (State.RAMPING, State.HOLDING))
    if "fault_code" in columns:
        counts &= columns["fault_code"] == 0.0
    if "pulling" in columns:
        wanted_n = np.where(columns["pulling"] == 1.0, -wanted_n, wanted_n)
    return CommandedForce(columns["time_s"], wanted_n, _without_absurd(columns["force_n"]), counts)


def _hold(setpoint_n: Floats) -> tuple[Floats, Flags]:
    """Return what is asked at each row, and whether it is known: some tables have it only where it changes."""
    setpoint_n = _without_absurd(setpoint_n)
    latest = np.maximum.accumulate(np.where(np.isfinite(setpoint_n), np.arange(setpoint_n.size), -1))
    return np.where(latest < 0, 0.0, setpoint_n[np.maximum(latest, 0)]), latest >= 0


def _without_absurd(values: Floats) -> Floats:
    """Return the column with NaN for what no force is, and whose square overflows."""
    return np.where(np.abs(values) <= LARGEST_VALUE, values, nan)


def error_blocks(run: CommandedForce) -> tuple[ErrorBlock, ...]:
    """Return the blocks of a run in the order of time."""
    run = replace(run, wanted_n=np.where(run.counts, run.wanted_n, 0.0))  # where nothing is asked, 0 N is
    settled, from_n = _since_change(run)
    began = np.maximum.accumulate(np.abs(run.wanted_n - run.wanted_n[:1]) > _SAME_N)
    is_known = began | (run.time_s - run.time_s[:1] >= SETTLED_S)  # a run may begin on the way to its first force
    counts = (
        run.counts
        & is_known
        & np.isfinite(run.measured_n)
        & np.isfinite(run.wanted_n)
        & (np.abs(run.wanted_n) > _SAME_N)
    )
    squares_n2 = (run.measured_n - run.wanted_n) ** 2
    blocks = []
    for first, stop in _stretches(run, counts, settled):
        came_from_n, to_n = float(from_n[first]), float(run.wanted_n[stop - 1])
        is_settled = bool(settled[first])
        start_n = to_n if is_settled else came_from_n
        total_n2 = float(squares_n2[first:stop].sum())
        blocks.append(ErrorBlock(start_n, to_n, abs(to_n) >= abs(came_from_n), is_settled, stop - first, total_n2))
    return tuple(blocks)


def rms_n(blocks: Iterable[ErrorBlock]) -> float:
    """Return the root mean square error over all rows of the blocks, N; nan without any."""
    known = list(blocks)
    rows = sum(block.rows for block in known)
    return float(np.sqrt(sum(block.squares_n2 for block in known) / rows)) if rows else nan


def compare_runs(before: Sequence[ErrorBlock], after: Sequence[ErrorBlock]) -> ForceChange:
    """Return what has changed from one run to the other, on the tasks that both have."""
    width_n = max((abs(block.to_n) for block in (*before, *after)), default=1.0) / _LEVELS
    tasks = sorted({_task(block, width_n) for block in before} & {_task(block, width_n) for block in after})
    runs = [[block for block in run if _task(block, width_n) in tasks] for run in (before, after)]
    rows, squares = zip(*(_by_task(run, tasks, width_n) for run in runs), strict=True)
    rms = _comparable_rms_n([np.ones((1, len(run))) for run in runs], rows, squares)[:, 0].tolist()
    change = ForceChange(
        before_rms_n=rms[0],
        after_rms_n=rms[1],
        ratio=rms[1] / rms[0] if rms[0] > 0.0 else nan,
        gain_n=rms[0] - rms[1],
        blocks=(len(runs[0]), len(runs[1])),
        comparable_share=(_row_share(runs[0], before), _row_share(runs[1], after)),
    )
    if min(change.blocks) < FEWEST_BLOCKS or not isfinite(change.ratio):
        there = f"{change.blocks[0]} and {change.blocks[1]} stretches in which the same was asked of both runs"
        return replace(change, why=f"{there}, {FEWEST_BLOCKS} of each are needed")
    drawn = _comparable_rms_n([_resample(len(run), seed) for seed, run in enumerate(runs)], rows, squares)
    drawn = drawn[:, np.isfinite(drawn).all(axis=0) & (drawn[0] > 0.0)]
    ratio_ci95 = _interval(drawn[1] / drawn[0])
    verdict = _verdict(ratio_ci95)
    return replace(
        change,
        ratio_ci95=ratio_ci95,
        gain_ci95=_interval(drawn[0] - drawn[1]),
        verdict=verdict,
        why="the interval holds 1: longer runs make it narrower" if verdict is GainVerdict.UNKNOWN else "",
    )


def _since_change(run: CommandedForce) -> tuple[Flags, Floats]:
    """Return whether what is asked has stood for long enough, and what was asked before it began to change, by row."""
    changes = np.flatnonzero(np.abs(np.diff(run.wanted_n, prepend=run.wanted_n[:1])) > _SAME_N)
    last = np.full(run.time_s.size, -1)
    last[changes] = np.arange(changes.size)
    last = np.maximum.accumulate(last)
    moved_s = run.time_s[changes] if changes.size else np.zeros(0)
    since_s = np.where(last < 0, np.inf, run.time_s - moved_s[last] if changes.size else np.inf)
    begins = np.diff(moved_s, prepend=-np.inf) >= SETTLED_S  # the first change of a way; a ramp changes with each row
    before_n = run.wanted_n[np.maximum(changes - 1, 0)]
    first_of_way = np.maximum.accumulate(np.where(begins, np.arange(changes.size), 0)) if changes.size else changes
    from_n = np.where(last < 0, run.wanted_n, before_n[first_of_way][last] if changes.size else run.wanted_n)
    return since_s >= SETTLED_S, from_n


def _stretches(run: CommandedForce, counts: Flags, settled: Flags) -> Iterable[tuple[int, int]]:
    """Yield first row and end of each block: rows that count, of one way or one held force, no longer than a block."""
    starts = np.zeros(counts.size, dtype=bool)
    starts[:1] = True
    starts[1:] = (counts[1:] != counts[:-1]) | (settled[1:] != settled[:-1])
    edges = [*np.flatnonzero(starts), counts.size]
    for first, stop in pairwise(edges):
        if not counts[first]:
            continue
        pieces = 1 + int((run.time_s[stop - 1] - run.time_s[first]) / LONGEST_BLOCK_S)
        cuts = np.linspace(first, stop, pieces + 1).astype(int)
        yield from ((int(a), int(b)) for a, b in pairwise(cuts) if b > a)


def _task(block: ErrorBlock, width_n: float) -> tuple[bool, bool, int, int]:
    return block.settled, block.rising, round(block.from_n / width_n), round(block.to_n / width_n)


def _by_task(run: Sequence[ErrorBlock], tasks: Sequence[object], width_n: float) -> tuple[Floats, Floats]:
    """Return rows and squares, each of shape (blocks, tasks)."""
    rows, squares = np.zeros((len(run), len(tasks))), np.zeros((len(run), len(tasks)))
    for index, block in enumerate(run):
        place = tasks.index(_task(block, width_n))
        rows[index, place], squares[index, place] = block.rows, block.squares_n2
    return rows, squares


def _comparable_rms_n(times: Sequence[Floats], rows: Sequence[Floats], squares: Sequence[Floats]) -> Floats:
    """Return the RMS of both runs, N, shape (2, resamples). times: how often each block was drawn, (resamples, blocks)."""
    rows_by_task = [drawn @ each for drawn, each in zip(times, rows, strict=True)]
    squares_by_task = [drawn @ each for drawn, each in zip(times, squares, strict=True)]
    weights = np.minimum(*rows_by_task)
    means = [total / np.maximum(count, 1.0) for total, count in zip(squares_by_task, rows_by_task, strict=True)]
    with np.errstate(invalid="ignore", divide="ignore"):
        squares_n2 = np.array([(weights * mean).sum(axis=1) for mean in means]) / weights.sum(axis=1)
        return np.asarray(np.sqrt(squares_n2))


def _resample(blocks: int, seed: int) -> Floats:
    rng = np.random.default_rng([seed, blocks])
    return rng.multinomial(blocks, np.full(blocks, 1.0 / blocks), _RESAMPLES).astype(float)


def _interval(values: Floats) -> tuple[float, float]:
    if not values.size:
        return nan, nan
    low, high = np.quantile(values, (0.025, 0.975)).tolist()
    return low, high


def _verdict(ratio_ci95: tuple[float, float]) -> GainVerdict:
    low, high = ratio_ci95
    return GainVerdict.BETTER if high < 1.0 else GainVerdict.WORSE if low > 1.0 else GainVerdict.UNKNOWN


def _row_share(part: Sequence[ErrorBlock], run: Sequence[ErrorBlock]) -> float:
    rows = sum(block.rows for block in run)
    return sum(block.rows for block in part) / rows if rows else 0.0
