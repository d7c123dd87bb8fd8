"""Runs of a rig whose command map is compensated: they say volts as they are sent, and a force of a plan is that force."""

from dataclasses import replace

import pytest

from gateway.control import CommandMap, apply_command_map
from gateway.control.runs.experiment_plan import Move, MoveKind
from gateway.control.runs.experiment_schedule import segments_of
from gateway.control.runs.ladder_stairs import FIRST_STAIR_N, check_stairs, highest_force_n, highest_voltage_v
from gateway.control.self_test.judgement import Known
from gateway.control.self_test.levels import FORCE_SHARE, NEAR_SHARE, Levels
from gateway.control.settings import SelfTestSettings
from tests.control.bench import bsfm, settings
from tests.control.runs.test_experiment import plan

LIMITS = settings().limits
BENT = [apply_command_map(bsfm(), CommandMap(bow=bow, s=0.0)) for bow in (0.04, -0.04)]


@pytest.mark.parametrize("model", BENT, ids=["bowed up", "bowed down"])
def test_a_run_goes_as_high_as_the_force_allows(model) -> None:
    top_v = highest_voltage_v(LIMITS, model)
    assert model.force_n(top_v, 1.0) <= highest_force_n(LIMITS) < model.force_n(top_v + 0.01, 1.0)
    assert model.force_n(check_stairs(top_v, model)[0].voltage_v, 1.0) == pytest.approx(FIRST_STAIR_N, abs=1e-6)


@pytest.mark.parametrize("model", BENT, ids=["bowed up", "bowed down"])
def test_a_force_of_a_plan_is_that_force(model) -> None:
    (segment,) = segments_of(plan(Move(do=MoveKind.STEP, to_n=30.0, hold_s=1.0)), LIMITS, model)
    assert model.force_n(segment.to_v, 1.0) == pytest.approx(30.0, abs=1e-6)


@pytest.mark.parametrize("model", BENT, ids=["bowed up", "bowed down"])
def test_the_levels_of_a_self_test_lie_where_they_are_meant(model) -> None:
    control = replace(settings(), self_test=SelfTestSettings(force_n=34.0))
    levels = Levels(Known(control, model), 34.0, 0.0)
    assert levels.set_second(levels.expected_n(levels.first_v))
    second_n = levels.expected_n(levels.second_v)
    assert model.force_n(levels.second_v, 0.0) <= (1.0 - NEAR_SHARE) * 34.0 + 0.1
    straight = Levels(Known(control, bsfm()), 34.0, 0.0)
    assert straight.set_second(straight.expected_n(straight.first_v))
    assert second_n == pytest.approx(straight.expected_n(straight.second_v), abs=0.05)
    assert second_n < FORCE_SHARE * 34.0 + 1e-6
