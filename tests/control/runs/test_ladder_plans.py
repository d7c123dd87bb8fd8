"""Plans of a ladder: what a rig allows, how far they go, how long they take."""

from dataclasses import replace

import pytest

from gateway.control.runs.ladder_run import GUESSED_DWELL_S
from gateway.control.runs.ladder_stairs import QUICK, CalibrationPlan, highest_voltage_v, stairs_of
from gateway.registers.words import CalibrationPhase
from tests.control.bench import bsfm, settings
from tests.control.runs.test_ladder_run import SHORT


def test_a_resumed_run_leaves_out_the_groups_that_are_done() -> None:
    whole = stairs_of(SHORT, settings().limits, bsfm())
    rest = stairs_of(replace(SHORT, first_group=1), settings().limits, bsfm())
    assert [stair.group for stair in whole if stair.group >= 0].count(1) == 9
    assert {stair.group for stair in rest} == {-1, 1}
    assert len(whole) - len(rest) == 9


def test_a_resumed_run_may_have_only_the_reversal_part_left() -> None:
    rest = stairs_of(replace(SHORT, first_group=2), settings().limits, bsfm())
    assert {stair.phase for stair in rest} == {CalibrationPhase.CHECK, CalibrationPhase.MINOR_LOOPS}
    with pytest.raises(ValueError, match="groups = 2 from 2"):
        stairs_of(replace(SHORT, first_group=2, minor_points=0), settings().limits, bsfm())


def test_the_top_stays_below_the_over_force_trip() -> None:
    limits, model = settings().limits, bsfm()
    top_v = highest_voltage_v(limits, model)
    assert model.force_n(top_v, -1.0) <= 0.93 * limits.over_force_n + 0.5
    with pytest.raises(ValueError, match=r"over-force trips at 45 N"):
        stairs_of(CalibrationPlan(v_max_v=8.0), replace(limits, over_force_n=45.0), model)
    with pytest.raises(ValueError, match=r"the rig allows force_max_n = 30 N"):
        stairs_of(CalibrationPlan(v_max_v=6.0), replace(limits, force_max_n=30.0), model)


@pytest.mark.parametrize(
    ("plan", "words"),
    [
        (CalibrationPlan(step_v=0.0), "step = 0 V, allowed"),
        (CalibrationPlan(step_v=float("nan")), "step = nan V"),
        (CalibrationPlan(step_v=float("inf")), "step = inf V"),
        *((CalibrationPlan(v_max_v=float(told)), f"v_max = {told} V") for told in ("nan", "inf", "-inf")),
        (CalibrationPlan(v_max_v=12.0), "allowed up to 9 V"),
        (CalibrationPlan(v_max_v=9.01), "allowed up to 9 V"),
        (CalibrationPlan(groups=0), "groups = 0"),
        (CalibrationPlan(minor_points=-1), "minor_points = -1"),
        (CalibrationPlan(step_v=0.01, groups=50), "at most 20000"),
    ],
)
def test_a_plan_that_the_rig_does_not_allow_is_refused_in_words(plan: CalibrationPlan, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        stairs_of(plan, settings().limits, bsfm())


def test_the_minor_walk_never_spans_the_loop_and_has_the_points_asked_for() -> None:
    stairs = [
        s
        for s in stairs_of(CalibrationPlan(response_steps=0), settings().limits, bsfm())
        if s.phase is CalibrationPhase.MINOR_LOOPS
    ]
    assert len(stairs) == pytest.approx(150, abs=5)
    assert max(stair.voltage_v for stair in stairs) < 0.9 * highest_voltage_v(settings().limits, bsfm())


def test_a_quick_run_is_shorter_than_a_minute() -> None:
    assert GUESSED_DWELL_S * len(stairs_of(QUICK, settings().limits, bsfm())) < 60.0
