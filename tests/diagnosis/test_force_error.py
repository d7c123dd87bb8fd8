"""What two real runs say of the force that was commanded: same tasks, blocks, an interval, and an honest `cannot be told`."""

import numpy as np
import pytest

from gateway.diagnosis.force_error import (
    CommandedForce,
    ErrorBlock,
    GainVerdict,
    _interval,
    commanded_force,
    compare_runs,
    error_blocks,
    rms_n,
)
from gateway.registers.words import State

ROWS_HZ = 50.0


def run(error_n: float, seed: int, *, levels=(5.0, 20.0, 10.0, 30.0, 15.0), hold_s=3.0, noise_n=0.05) -> CommandedForce:
    """Held forces, each with an error that decays after the step to a share of `error_n` of either sign."""
    rng = np.random.default_rng(seed)
    wanted_n = np.repeat(levels, int(hold_s * ROWS_HZ)).astype(float)
    time_s = np.arange(wanted_n.size) / ROWS_HZ
    since_s = time_s % hold_s
    before_n = np.repeat((0.0, *levels[:-1]), int(hold_s * ROWS_HZ))
    measured_n = wanted_n + (before_n - wanted_n) * np.exp(-since_s / 0.15) + rng.normal(0.0, noise_n, wanted_n.size)
    measured_n += np.where(
        since_s > 0.6, error_n * rng.choice((-1.0, 1.0), wanted_n.size // 25 + 1).repeat(25)[: time_s.size], 0.0
    )
    return CommandedForce(time_s, wanted_n, measured_n, np.ones(time_s.size, dtype=bool))


def test_the_blocks_are_all_rows_that_count_cut_where_the_task_changes():
    blocks = error_blocks(run(0.2, 1))
    assert sum(block.rows for block in blocks) == 5 * 150 - 30, "nobody knows what was asked before the first row"
    assert [(block.from_n, block.to_n, block.rising) for block in blocks if not block.settled] == [
        (5.0, 20.0, True),
        (20.0, 10.0, False),
        (10.0, 30.0, True),
        (30.0, 15.0, False),
    ]
    assert all(block.from_n == block.to_n for block in blocks if block.settled)


def test_an_enable_is_a_step_from_0_n():
    started = run(0.0, 1, levels=(10.0, 10.0))
    started.counts[:75] = False
    first, *_ = error_blocks(started)
    assert (first.from_n, first.to_n, first.settled) == (0.0, 10.0, False)


def test_a_recording_that_begins_on_the_way_to_its_first_force_does_not_call_it_held():
    late = run(0.0, 1, levels=(20.0, 20.0))
    late.measured_n[:25] = np.linspace(0.0, 20.0, 25)
    assert rms_n(error_blocks(late)) < 0.3


def test_a_smaller_error_is_better_a_larger_one_worse_and_the_interval_excludes_1():
    small, large = (error_blocks(run(error_n, seed, hold_s=6.0)) for error_n, seed in ((0.2, 1), (2.0, 2)))
    better, worse = compare_runs(large, small), compare_runs(small, large)
    assert (better.verdict, worse.verdict) == (GainVerdict.BETTER, GainVerdict.WORSE)
    assert better.ratio_ci95[0] <= better.ratio <= better.ratio_ci95[1] < 1.0 < worse.ratio_ci95[0]
    assert better.gain_ci95[0] > 0.0
    assert better.gain_n == pytest.approx(better.before_rms_n - better.after_rms_n)
    assert better.before_rms_n == pytest.approx(rms_n(large)), "the same was asked of both: everything is compared"


def test_the_same_machine_twice_cannot_be_told_apart():
    """Of 60 pairs few may be called different: the interval holds 95 %."""
    told = [
        compare_runs(error_blocks(run(0.3, seed)), error_blocks(run(0.3, 1000 + seed))).verdict for seed in range(60)
    ]
    assert told.count(GainVerdict.UNKNOWN) >= 54


def test_only_what_was_asked_of_both_is_compared():
    """The later run holds forces besides that the earlier one never held, badly."""
    before, after = error_blocks(run(0.2, 1)), error_blocks(run(0.2, 2))
    more = [ErrorBlock(38.0, 38.0, True, True, 500, 5000.0)] * 20
    change = compare_runs(before, (*after, *more))
    assert change.after_rms_n < 10.0 * change.before_rms_n
    assert change.comparable_share[1] < 0.5
    apart = compare_runs(before, more)
    assert (apart.verdict, apart.blocks) == (GainVerdict.UNKNOWN, (0, 0))
    assert "are needed" in apart.why


def test_a_force_that_is_come_to_from_above_is_not_compared_with_one_from_below():
    """Friction stands the other way round: a machine that is as it was would have become worse."""
    risen, fallen = ([ErrorBlock(20.0, 20.0, rising, True, 250, 25.0)] * 10 for rising in (True, False))
    assert compare_runs(risen, fallen).blocks == (0, 0)
    assert compare_runs(risen, (*fallen, *risen)).blocks == (10, 10)


def as_pull(pushed: CommandedForce) -> CommandedForce:
    columns = {"time_s": pushed.time_s, "setpoint_n": pushed.wanted_n, "force_n": -pushed.measured_n}
    return commanded_force(columns | {"pulling": np.ones(pushed.time_s.size)})


def test_a_pull_is_compared_with_a_pull_and_its_error_is_not_twice_the_force():
    """Its setpoint is positive and its readings negative: each row was off by twice the force that was asked."""
    pushed, pushed_later = run(0.2, 1), run(0.2, 1, levels=(5.2, 20.4, 10.3, 30.4, 15.1))
    pulled, pulled_later = as_pull(pushed), as_pull(pushed_later)
    ways = [(block.rising, block.rows) for block in error_blocks(pulled)]
    assert ways == [(block.rising, block.rows) for block in error_blocks(pushed)]
    assert rms_n(error_blocks(pulled)) == pytest.approx(rms_n(error_blocks(pushed)))
    assert compare_runs(error_blocks(pulled), error_blocks(pushed)).blocks == (0, 0)
    pairs = ((pulled, pulled_later), (pushed, pushed_later))
    changes = [compare_runs(error_blocks(before), error_blocks(after)) for before, after in pairs]
    assert changes[0].blocks == changes[1].blocks != (0, 0), "levels a little apart are the same task"


def test_a_row_counts_where_a_force_is_held_or_on_its_way_and_no_fault_stands() -> None:
    """A way that is too slow is an error of the commanded force; what a fault let go of, or a calibration pressed, is none."""
    states = list(State)
    rows = len(states)
    columns = {
        "time_s": np.arange(rows, dtype=float),
        "setpoint_n": np.full(rows, 10.0),
        "force_n": np.full(rows, 9.0),
        "state": np.array(states, dtype=float),
        "fault_code": np.zeros(rows),
    }
    counted = [state for state, counts in zip(states, commanded_force(columns).counts, strict=True) if counts]
    assert counted == [State.RAMPING, State.HOLDING]
    columns["fault_code"] = np.full(rows, 310.0)
    assert not commanded_force(columns).counts.any()


def test_each_task_weighs_as_many_rows_as_the_run_with_fewer_of_them_has() -> None:
    """By the larger number a run that stood for long at its hardest task would look worse than the other by that alone."""

    def played(easy_rows: int, hard_rows: int) -> list[ErrorBlock]:
        easy = ErrorBlock(10.0, 10.0, True, True, easy_rows, 1.0 * easy_rows)
        return [easy, ErrorBlock(30.0, 30.0, True, True, hard_rows, 9.0 * hard_rows)]

    change = compare_runs(played(100, 10), played(50, 40))
    assert change.before_rms_n == change.after_rms_n == pytest.approx(((50 * 1.0 + 10 * 9.0) / 60) ** 0.5)


def test_an_interval_of_95_percent_leaves_a_fortieth_out_at_either_end() -> None:
    assert _interval(np.arange(1001.0)) == pytest.approx((25.0, 975.0))
