"""Plans of ladders and experiments by their numbers: where each stair and each turn is, and how far a rig lets them."""

from dataclasses import replace
from itertools import pairwise

import pytest

from gateway.control.runs.experiment_plan import Move, MoveKind
from gateway.control.runs.ladder_stairs import (
    CHECK_SHARES,
    FIRST_STAIR_N,
    RESPONSE_SHARES,
    TURNS,
    CalibrationPlan,
    check_stairs,
    highest_force_n,
    highest_voltage_v,
    stairs_of,
)
from gateway.registers.words import CalibrationPhase
from tests.control.bench import bsfm, settings
from tests.control.runs.test_experiment import schedule

LIMITS = settings().limits
WIDE = replace(LIMITS, force_max_n=100.0, over_force_n=200.0)
UP, DOWN = 1, -1


def test_the_highest_voltage_is_a_whole_hundredth_that_model_rig_and_both_forces_allow() -> None:
    assert highest_voltage_v(WIDE, bsfm()) == 8.0, "the model's end"
    assert highest_voltage_v(replace(WIDE, voltage_max_v=7.0), bsfm()) == 7.0
    assert highest_force_n(replace(LIMITS, force_max_n=50.0, over_force_n=60.0)) == pytest.approx(49.25)
    assert highest_force_n(replace(LIMITS, force_max_n=60.0, over_force_n=60.0)) == pytest.approx(55.8)
    top_v = highest_voltage_v(LIMITS, bsfm())
    assert bsfm().force_n(top_v, 1.0) <= highest_force_n(LIMITS) < bsfm().force_n(top_v + 0.01, 1.0)


@pytest.mark.parametrize(("field", "words"), [("force_max_n", "the rig allows"), ("over_force_n", "over-force trips")])
def test_a_top_that_is_asked_for_may_make_just_the_force_that_the_rig_allows(field: str, words: str) -> None:
    force_n = bsfm().force_n(6.0, 1.0)
    plan = CalibrationPlan(v_max_v=6.0)
    assert stairs_of(plan, replace(WIDE, **{field: force_n + 0.01}), bsfm())  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=words):
        stairs_of(plan, replace(WIDE, **{field: force_n - 0.01}), bsfm())  # type: ignore[arg-type]


def test_beyond_the_model_s_end_the_force_is_taken_to_grow_with_the_voltage() -> None:
    plan, force_n = CalibrationPlan(v_max_v=8.8), 1.1 * bsfm().force_n(8.8, 1.0)
    assert stairs_of(plan, replace(WIDE, force_max_n=force_n + 0.01), bsfm())
    with pytest.raises(ValueError, match="the rig allows"):
        stairs_of(plan, replace(WIDE, force_max_n=force_n - 0.01), bsfm())


def ladder(**plan: float) -> CalibrationPlan:
    return CalibrationPlan(**{"v_max_v": 5.0, "minor_points": 0, **plan})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("most", "beyond"),
    [
        ({"step_v": 0.01, "groups": 20}, {"step_v": 0.01, "groups": 21}),  # 20 000 stairs
        ({"step_v": 5.0 / 3.0}, {"step_v": 1.67}),
        ({"step_v": 0.01, "groups": 1}, {"step_v": 0.0099, "groups": 1}),
        ({"groups": 100, "step_v": 1.0}, {"groups": 101, "step_v": 1.0}),
        ({"groups": 1}, {"groups": 0}),
        ({"groups": 3, "first_group": 2}, {"groups": 3, "first_group": 3}),
        ({"groups": 3, "first_group": 3, "minor_points": 9}, {"groups": 3, "first_group": 4, "minor_points": 9}),
        ({"first_group": 0}, {"first_group": -1}),
        ({"minor_points": 2000}, {"minor_points": 2001}),
        ({"response_steps": 200}, {"response_steps": 201}),
        ({"response_steps": 0}, {"response_steps": -1}),
        ({"v_max_v": 9.0}, {"v_max_v": 9.01}),
    ],
)
def test_each_number_of_a_plan_is_allowed_up_to_its_bound_and_not_beyond(
    most: dict[str, float], beyond: dict[str, float]
) -> None:
    assert stairs_of(ladder(**most), WIDE, bsfm())
    with pytest.raises(ValueError, match=r"allowed|at most"):
        stairs_of(ladder(**beyond), WIDE, bsfm())


@pytest.mark.parametrize("top_v", [1.0, 5.0])
def test_a_check_begins_small_and_goes_up_and_down_by_quarters(top_v: float) -> None:
    stairs = check_stairs(top_v, bsfm())
    rising = bsfm().branches.rising
    first_v = min(0.2 * top_v, rising.inverse(FIRST_STAIR_N + rising.value(0.0))[0])
    assert [stair.voltage_v for stair in stairs] == pytest.approx([first_v, *(s * top_v for s in CHECK_SHARES)])
    assert [stair.direction for stair in stairs] == [UP] * 5 + [DOWN] * 4
    assert {(stair.group, stair.phase, stair.is_step) for stair in stairs} == {(-1, CalibrationPhase.CHECK, False)}


def test_a_check_begins_and_ends_where_a_rig_rests_that_presses_there() -> None:
    stairs = check_stairs(5.0, bsfm(), 2.0)
    first_v = min(2.0 + 0.2 * 3.0, bsfm().voltage_v(FIRST_STAIR_N + bsfm().force_n(2.0, 1.0), 1.0)[0])
    assert [stair.voltage_v for stair in stairs] == pytest.approx([first_v, *(2.0 + s * 3.0 for s in CHECK_SHARES)])
    assert [stair.direction for stair in stairs] == [UP] * 5 + [DOWN] * 4
    pressing = replace(WIDE, safe_voltage_v=2.0, voltage_min_v=0.5)
    assert stairs_of(ladder(), pressing, bsfm())[: len(stairs)] == stairs


def test_the_walk_of_reversals_ends_with_steps_at_once_for_the_response() -> None:
    stairs = stairs_of(ladder(minor_points=60, response_steps=8), WIDE, bsfm())
    walk = [stair for stair in stairs if stair.phase is CalibrationPhase.MINOR_LOOPS]
    steps = walk[-8:]
    shares = [*RESPONSE_SHARES, *RESPONSE_SHARES[:2]]
    assert [stair.voltage_v for stair in steps] == pytest.approx([5.0 * share for share in shares])
    assert [stair.direction for stair in steps] == [
        UP if share > before else DOWN for before, share in zip([TURNS[-1], *shares], shares, strict=False)
    ]
    assert all(stair.is_step for stair in steps) and not any(stair.is_step for stair in walk[:-8])
    assert {stair.group for stair in walk} == {-1}
    turns_v = [a.voltage_v for a, b in pairwise(walk[:-7]) if a.direction != b.direction]
    assert turns_v == pytest.approx([5.0 * share for share in TURNS[1:-1]] + [5.0 * TURNS[-1]])


def test_an_experiment_begins_at_the_lowest_voltage_and_a_dwell_only_takes_its_time() -> None:
    moved = schedule(Move(do=MoveKind.DWELL, hold_s=1.0), Move(do=MoveKind.STEP, to_v=2.0, hold_s=1.0))
    assert (moved.voltage_v(0.5), moved.voltage_v(1.0), moved.duration_s) == (0.0, 2.0, 2.0)


def test_the_branch_of_a_voltage_that_stands_is_that_of_the_way_there() -> None:
    dwell = Move(do=MoveKind.DWELL, hold_s=1.0)
    moved = schedule(dwell, Move(do=MoveKind.STEP, to_v=4.0), dwell, Move(do=MoveKind.STEP, to_v=2.0), dwell)
    assert [moved.direction(at_s) for at_s in (0.5, 1.5, 2.5, 9.0)] == [1, 1, -1, -1]


def test_a_swing_is_half_of_its_size_up_and_down_and_ends_where_it_began() -> None:
    swings = Move(do=MoveKind.REVERSALS, size_v=1.0, times=2, over_s=1.0, hold_s=0.5)
    moved = schedule(Move(do=MoveKind.STEP, to_v=3.0), swings)
    times_s = (0.25, 0.5, 0.75, 1.5, 2.0, 2.25, 3.0, 3.5, 5.25, 5.75, 9.0)
    seen = [moved.voltage_v(at_s) for at_s in times_s]
    assert seen == pytest.approx([3.25, 3.5, 3.5, 3.0, 2.5, 2.5, 3.0, 3.5, 2.5, 2.75, 3.0])
    assert moved.duration_s == pytest.approx(swings.duration_s)


def test_a_move_to_0_goes_to_0() -> None:
    for goal in ({"to_v": 0.0}, {"to_share": 0.0}, {"to_n": 0.0}):
        moved = schedule(Move(do=MoveKind.STEP, to_v=3.0, hold_s=1.0), Move(do=MoveKind.STEP, hold_s=1.0, **goal))  # type: ignore[arg-type]
        assert [moved.voltage_v(at_s) for at_s in (0.5, 1.5)] == pytest.approx([3.0, 0.0])
