"""A calibration that is swapped while the tool presses, or rests: no bump, its own limits, its own residual."""

from dataclasses import replace

import pytest

from gateway.bsfm.model import Response
from gateway.control import CalibrationInUse, Controller
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.control.self_test.items import SelfTestPlan
from gateway.control.settings import SelfTestSettings
from gateway.registers.words import LimitedBy, Mode, State, StatusBit
from tests.control.bench import Bench, bsfm, enabled, settings


def test_a_calibration_is_swapped_without_a_bump():
    bench = enabled()
    bench.force(20.0)
    bench.run(1.0)
    before_v, fed_v = bench.last.voltage_v, bench.last.feedforward_v
    bench.controller.use(CalibrationInUse(bsfm(scale=1.1), 2))
    assert bench.step().voltage_v == pytest.approx(before_v, abs=0.02)
    first = len(bench.history)
    bench.run(2.0)
    forces = [record.force_n for record in bench.history[first:]]
    assert max(abs(force_n - 20.0) for force_n in forces) < 1.5
    assert bench.controller.calibration_id == 2
    less_v = bsfm().voltage_v(20.0, 1.0)[0] - bsfm(scale=1.1).voltage_v(20.0, 1.0)[0]
    assert fed_v - bench.last.feedforward_v == pytest.approx(less_v, abs=0.05), "the new set is what feeds forward"


def test_what_a_swap_carries_over_ends_with_the_output():
    """Volts of the set before, added to the next enable's."""
    swapped, fresh = enabled(), enabled()
    swapped.force(20.0)
    swapped.run(1.0)
    swapped.controller.use(CalibrationInUse(bsfm(scale=1.2), 2))
    fresh.controller.use(CalibrationInUse(bsfm(scale=1.2), 2))
    fed_v = []
    for bench in (swapped, fresh):
        bench.disable()
        bench.run(1.0)
        bench.enable(20.0)
        bench.seconds_until(lambda output: output.force_applied_n >= 20.0, 3.0)
        fed_v.append(bench.last.feedforward_v)
    assert fed_v[0] == pytest.approx(fed_v[1], abs=0.01)


def test_the_residual_is_that_of_the_set_in_use():
    """Also where nothing moves any more: the model's expectation changes with the set and not with the next voltage."""
    bench = enabled()
    bench.voltage(3.0)
    bench.run(2.0)
    before_n = bench.last.model_residual_n
    bench.controller.use(CalibrationInUse(bsfm(scale=1.2), 2))
    after_n = bench.step().model_residual_n
    changed_n = bsfm().force_n(3.0, 1.0) - bsfm(scale=1.2).force_n(3.0, 1.0)
    assert after_n - before_n == pytest.approx(changed_n, abs=0.3)
    assert bench.controller.active_run.model == bsfm(scale=1.2), "the check of the next ladder compares with this one"


def test_a_set_with_a_lower_force_limit_is_swapped_in_by_the_ramp_and_out_again():
    bench = enabled()
    bench.force(20.0)
    bench.run(1.0)
    before_v = bench.last.voltage_v
    bench.controller.use(CalibrationInUse(replace(bsfm(), limits_n=(1.0, 15.0)), 2))
    assert bench.step().voltage_v == pytest.approx(before_v, abs=0.5), "2 N of the ramp at most"
    output = bench.run(1.5)
    assert output.force_accepted_n == 15.0
    assert output.limited_by is LimitedBy.FORCE_RANGE
    assert abs(bench.plant.force_n - 15.0) < 1.0
    bench.controller.use(CalibrationInUse(bsfm(), 3))
    output = bench.run(1.5)
    assert (output.force_accepted_n, output.limited_by) == (20.0, LimitedBy.NONE)
    assert abs(bench.plant.force_n - 20.0) < 1.0


def test_the_smallest_force_of_a_set_does_not_keep_the_tool_from_its_first_contact():
    bench = enabled()
    bench.controller.use(CalibrationInUse(replace(bsfm(), limits_n=(5.0, 40.0)), 2))
    bench.force(10.0)
    bench.run(1.5)
    assert bench.last.state is State.HOLDING
    assert abs(bench.plant.force_n - 10.0) < 1.0


def test_a_force_that_goes_to_0_is_limited_by_no_range_that_its_setpoint_had_passed():
    bench = enabled()
    bench.force(20.0)
    bench.controller.use(CalibrationInUse(replace(bsfm(), limits_n=(1.0, 15.0)), 2))
    assert bench.run(1.5).limited_by is LimitedBy.FORCE_RANGE
    bench.controller.stop()
    output = bench.run(0.05)
    assert output.force_applied_n > 0.0 and output.limited_by is LimitedBy.NONE
    assert not output.status & StatusBit.LIMITED


def test_a_self_test_judges_by_the_set_in_use():
    bench = Bench(replace(settings(), self_test=SelfTestSettings(force_n=10.0)))
    run = bench.controller.active_run
    before = run.build(SelfTestPlan())._known
    bench.controller.use(CalibrationInUse(bsfm(1.1), 2, Response(dead_time_s=0.2, lag_s=0.3), noise_n=0.05))
    known = run.build(SelfTestPlan())._known
    assert (known.has_measured_response, known.noise_n, known.model) == (True, 0.05, bsfm(1.1))
    assert known.response_s == pytest.approx(0.5)
    bench.controller.use(CalibrationInUse(bsfm(), 3))
    assert run.build(SelfTestPlan())._known == before


def test_the_limits_of_the_set_that_control_begins_with_hold_as_those_of_a_later_one_do():
    """After a restart nobody swaps: the first enable already presses no more than its set allows."""
    bench = Bench()
    bench.controller = Controller(bench.settings, CalibrationInUse(replace(bsfm(), limits_n=(1.0, 15.0)), 2))
    bench.run(0.1)
    bench.enable(30.0)
    bench.run(2.0)
    assert max(record.force_n for record in bench.history) < 16.0
    assert bench.last.limited_by is LimitedBy.FORCE_RANGE


def test_a_run_of_this_machine_that_cannot_begin_says_why_once_in_the_log():
    bench = enabled()
    bench.force(20.0)
    bench.run(1.0)
    bench.controller.active_run.ask(CalibrationPlan())
    bench.run(0.1)
    assert bench.controller.active_run.refused.startswith("W305 ")
    assert bench.events.count(bench.controller.active_run.refused) == 1
    assert bench.controller.state is State.HOLDING


@pytest.mark.parametrize("begins_with", [None, Response(dead_time_s=0.3, lag_s=1.0)], ids=["a faster", "a slower"])
def test_the_patience_with_a_force_is_that_of_the_set_in_use(begins_with: Response | None):
    """Whether it was swapped in, or control began with it."""
    in_use = CalibrationInUse(bsfm(), 2, Response(dead_time_s=0.1, lag_s=0.5, second_lag_s=0.3))
    waited_s = []
    for first in (in_use, CalibrationInUse(bsfm(), 1, begins_with)):
        bench = Bench(contact=False)
        bench.controller = Controller(bench.settings, first)
        bench.controller.use(in_use)
        bench.run(0.2)
        bench.enable(20.0)
        waited_s.append(bench.seconds_until(lambda output: bool(output.status & StatusBit.TARGET_UNREACHABLE), 8.0))
    assert waited_s[1] == pytest.approx(waited_s[0], abs=0.02)


@pytest.mark.parametrize("before", [{"dead_time_s": 0.02, "lag_s": 0.1}, {"dead_time_s": 0.3, "lag_s": 0.05}, None])
def test_a_set_of_the_same_curves_is_controlled_by_its_own_response(before: dict[str, float] | None) -> None:
    """By another one's dead time the trim would be four times as fast as this machine bears."""
    volts = []
    own = Response(dead_time_s=0.3, lag_s=0.1)
    for responses in ((own,), (Response(**before) if before else None, own)):
        bench = Bench()
        for response in responses:
            bench.controller.use(CalibrationInUse(bsfm(), 2, response))
        bench.run(0.3)
        bench.enable(12.0)
        bench.run(2.0)
        volts.append([record.output.voltage_v for record in bench.history])
    assert volts[0] == volts[1] and max(volts[0]) > 1.0


@pytest.mark.parametrize("scale", [0.7, 1.4])
def test_a_set_that_is_swapped_in_voltage_mode_carries_nothing_over_into_force_mode(scale: float):
    """The voltage was the master's, so none has to fade: it goes on from the force that the new set expects of it."""
    bench = enabled(gain_n_per_v=7.4 * scale)
    bench.voltage(3.0)
    bench.run(2.0)
    bench.controller.use(CalibrationInUse(bsfm(scale=scale), 2))
    assert bench.run(1.0).voltage_v == 3.0
    expected_n = bsfm(scale=scale).force_n(3.0, 1.0)
    bench.write(mode=Mode.FORCE, force_setpoint_n=expected_n, voltage_setpoint_v=0.0)
    assert bench.last.voltage_v == pytest.approx(3.0, abs=0.05)
    assert bench.run(0.1).feedforward_v == pytest.approx(3.0, abs=0.05)


MEASURED = pytest.mark.parametrize("response", [None, Response(dead_time_s=0.02, lag_s=0.08)], ids=["rig", "measured"])


def held_by_two(response: Response | None, scale: float) -> Bench:
    """40 N, and a set of another strength a moment ago: volts are carried over."""
    bench = Bench()
    bench.controller = Controller(bench.settings, CalibrationInUse(bsfm(), 1, response))
    bench.run(0.2)
    bench.enable(40.0)
    bench.run(2.0)
    bench.controller.use(CalibrationInUse(bsfm(scale=scale), 2, response))
    bench.run(0.02)
    return bench


@MEASURED
def test_what_a_swap_carries_over_shrinks_with_a_setpoint_that_falls_right_behind_it(response: Response | None):
    """A volt and a half of a force of 40 N were 6 N too much of 5 N, for half a second."""
    forces_n = {}
    for scale in (1.0, 1.5):
        bench = held_by_two(response, scale)
        bench.force(5.0)
        bench.run(0.4)
        forces_n[scale] = bench.plant.force_n
    assert forces_n[1.5] < forces_n[1.0] + 1.0


@MEASURED
def test_what_a_swap_carries_over_does_not_push_a_tool_that_loses_its_contact_right_behind_it(
    response: Response | None,
):
    bench = held_by_two(response, 1.5)
    bench.plant.contact = False
    bench.seconds_until(lambda output: not output.status & StatusBit.CONTACT, 1.0)
    assert bench.run(0.05).voltage_v < bsfm().voltage_v(bench.settings.defaults.precontact_force_n, 1.0)[0] + 0.1


@pytest.mark.parametrize("scale", [0.5, 0.7, 1.0, 1.5])
def test_a_set_that_comes_amid_a_ladder_changes_neither_its_volts_nor_lets_its_stop_raise_them(scale: float):
    bench = Bench()
    bench.run(1.0)
    bench.controller.active_run.ask(CalibrationPlan(groups=1, step_v=1.0, minor_points=0, response_steps=0))
    bench.seconds_until(lambda output: output.voltage_v > 3.4, 20.0)
    begun_v, run = bench.voltage_v, bench.controller.active_run.run
    bench.controller.use(CalibrationInUse(bsfm(scale=scale), 2))
    assert bench.run(0.05).voltage_v == begun_v
    assert run.model == bsfm(), "it goes on by what it began with"
    bench.controller.active_run.ask_stop("stopped")
    first = len(bench.history)
    bench.run(2.0)
    volts = [record.output.voltage_v for record in bench.history[first:]]
    assert max(volts) <= begun_v and volts[-1] == 0.0
