"""Where two things meet: the end of a run and a lease, weight and mode, a silence and a question, two causes in one step."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import pytest

from gateway.bsfm.model import Response
from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.codes.warning_bits import WarningBit
from gateway.control import CalibrationInUse, Compensation, Controller
from gateway.control.compensation.compensation import OutsideForce
from gateway.control.demand import STOP_S
from gateway.control.settings import Defaults, LeadSettings, LeaseAction, Trim
from gateway.control.supervision.one_shot_events import OneShotEvents
from gateway.registers.words import ControlBit, LimitedBy, Mode, State, StatusBit
from tests.control.bench import Bench, bsfm, enabled, settings
from tests.control.runs.test_ladder_run import SHORT, begun
from tests.control.test_rest_forgets import RESPONSE
from tests.control.valve.valve_bench import ValveBench


def test_behind_a_run_the_way_to_0_is_the_rigs_and_needs_no_master() -> None:
    """Neither its heartbeat, for nothing of it is obeyed any more, nor the slow ramp that it has written."""
    bench = Bench(replace(settings(lease_s=0.2), defaults=Defaults(force_ramp_n_per_s=2.0)))
    bench.heartbeat_every_ms = 50
    bench.run(0.5)
    bench.write(control_word=ControlBit.START_CALIBRATION, force_ramp_n_per_s=0.5)
    bench.seconds_until(lambda output: output.voltage_v >= 2.0, 60.0)
    bench.write(control_word=ControlBit(0))
    bench.heartbeat_every_ms = 0
    took_s = bench.seconds_until(lambda output: output.state is not State.CALIBRATING, 2.0 * STOP_S)
    assert 0.5 < took_s < STOP_S
    assert (bench.last.state, bench.last.fault) == (State.OFF, FaultCode.NONE)


def test_the_way_down_behind_a_run_is_the_same_with_a_payload() -> None:
    """It begins at the force that presses: the slide's, which the run has driven, and the weight."""
    courses = []
    for payload_kg in (0.0, 1.0):
        bench = Bench()
        bench.run(0.3)
        bench.write(payload_kg=payload_kg)
        begun(bench)
        bench.seconds_until(lambda output: output.voltage_v >= 3.0, 20.0)
        bench.controller.active_run.ask_stop("calibration stopped by a person")
        bench.history.clear()
        bench.run(0.05)
        assert bench.last.state is State.CALIBRATING
        courses.append([one.output.voltage_v for one in bench.history])
    assert courses[1] == pytest.approx(courses[0], abs=0.1)


@pytest.mark.parametrize("stopped_s", [2.0, 3.66, 4.26, 4.3])
def test_wherever_a_run_is_stopped_the_voltage_only_falls_from_where_it_is(stopped_s: float) -> None:
    """Also right behind a stair downwards, where the force that the model expects is still that of the stair before."""
    bench = Bench()
    begun(bench, SHORT)
    bench.run(stopped_s)
    assert bench.last.state is State.CALIBRATING
    before_v = bench.last.voltage_v
    bench.controller.active_run.ask_stop("calibration stopped by a person")
    bench.history.clear()
    bench.run(0.3)
    volts = [before_v, *(one.output.voltage_v for one in bench.history)]
    assert all(later_v <= earlier_v for earlier_v, later_v in pairwise(volts))
    applied_n = next(one.output.force_applied_n for one in bench.history if not bench.controller.active_run.running)
    assert applied_n <= bsfm().branches.falling.value(before_v) + 0.1
    assert {one.output.force_accepted_n for one in bench.history} == {0.0}


def test_a_release_goes_along_its_ramp_in_volts_and_is_not_led() -> None:
    """What the lead would add is a push: it would vent the tool at once."""
    control = replace(settings(), lead=LeadSettings(lag_s=0.08))
    bench = enabled(control)
    bench.force(30.0)
    bench.run(1.0)
    bench.history.clear()
    bench.force(0.0)
    bench.run(0.2)
    falling = bsfm().branches.falling
    outputs = [one.output for one in bench.history if one.output.force_applied_n > 1.0]
    assert len(outputs) > 10
    assert all(one.voltage_v - one.trim_v >= falling.inverse(one.force_applied_n)[0] - 0.02 for one in outputs)


def test_while_the_voltage_is_still_on_its_way_the_trim_learns_nothing() -> None:
    control = settings()
    bench = enabled(replace(control, limits=replace(control.limits, voltage_slew_v_per_s=1.0)))
    bench.force(30.0)
    bench.run(2.0)
    slewing = [one.output for one in bench.history if one.output.limited_by is LimitedBy.VOLTAGE_SLEW]
    assert len(slewing) > 100 and {one.trim_v for one in slewing} == {0.0}


def test_a_lost_master_that_comes_back_ends_no_ramp_and_no_warning() -> None:
    bench = enabled(settings(lease_s=0.2, lease_action=LeaseAction.RAMP))
    bench.heartbeat_every_ms = 50
    bench.force(40.0)
    bench.run(1.0)
    bench.heartbeat_every_ms = 0
    bench.run(0.22)
    bench.heartbeat_every_ms = 50
    bench.run(0.1)
    assert bench.last.voltage_v > 0.0 and bench.last.warnings & WarningBit.MASTER_LOST
    bench.force(20.0)
    assert bench.refused and bench.refused.reason is RefusalReason.STOPPING
    assert bench.run(1.0).state is State.OFF


def test_a_force_behind_a_voltage_goes_on_from_the_contact_force_with_the_payloads_weight() -> None:
    bench = enabled()
    bench.write(control_word=ControlBit.ENABLE, mode=Mode.VOLTAGE, voltage_setpoint_v=3.0, payload_kg=2.0)
    bench.run(1.0)
    pressed_n = bench.last.force_measured_n
    output = bench.write(mode=Mode.FORCE, force_setpoint_n=pressed_n, voltage_setpoint_v=0.0)
    assert output.force_applied_n == pytest.approx(pressed_n, abs=4.0)


def test_a_force_by_a_measured_response_goes_on_from_the_voltage_too_with_the_payloads_weight() -> None:
    """The weight turns no friction round: it pressed before, too."""
    bench = Bench()
    bench.controller = Controller(bench.settings, CalibrationInUse(bsfm(), 1, RESPONSE))
    bench.run(0.3)
    bench.write(control_word=ControlBit.ENABLE, mode=Mode.VOLTAGE, voltage_setpoint_v=4.0, payload_kg=1.0)
    expected_n = bench.run(1.5).force_measured_n - bench.last.model_residual_n
    bench.write(mode=Mode.FORCE, force_setpoint_n=expected_n, voltage_setpoint_v=0.0)
    bench.history.clear()
    bench.run(0.1)
    assert [one.output.voltage_v for one in bench.history] == pytest.approx([4.0] * len(bench.history), abs=0.1)


def test_a_question_behind_a_silence_of_which_no_step_knows_is_answered_by_the_time_of_now() -> None:
    bench = Bench()
    bench.run(0.3)
    bench.loop_blocked = True
    bench.run(0.2)
    bench.enable(12.0)
    assert bench.refused and bench.refused.reason is RefusalReason.CELL_SILENT


def test_a_calibration_taken_under_a_force_from_outside_makes_no_bump() -> None:
    bench = Bench()
    outside = Compensation(outside=OutsideForce(tilt_n=4.0))
    bench.controller = Controller(bench.settings, CalibrationInUse(bsfm(), 1), compensation=outside)
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + 4.0)
    bench.run(0.3)
    bench.enable(20.0)
    assert bench.run(1.0).state is State.HOLDING, bench.events
    before_v = bench.last.voltage_v
    bench.controller.use(CalibrationInUse(bsfm(0.7), 2))
    assert bench.step().voltage_v == pytest.approx(before_v, abs=0.01)


def test_of_a_valve_and_an_output_that_fail_at_once_the_output_is_the_cause() -> None:
    bench = ValveBench().pulling()
    bench.is_silent, bench.silent_s = True, bench.now_s - 10.0
    bench.line = bench.line._replace(fault=FaultCode.OUTPUT_LOST)
    assert bench.step().fault is FaultCode.OUTPUT_LOST


def test_a_voltage_without_an_answer_is_no_matter_of_the_force_behind_it() -> None:
    bench = enabled(contact=False)
    bench.voltage(3.0)
    bench.run(settings().supervision.unreachable_s + 0.5)
    assert bench.last.warnings & WarningBit.TARGET_UNREACHABLE
    bench.plant.contact = True
    bench.write(mode=Mode.FORCE, voltage_setpoint_v=0.0, force_setpoint_n=20.0)
    bench.run(1.0)
    assert bench.last.state is State.HOLDING and not bench.last.warnings


def test_a_new_setpoint_ends_the_band_of_the_one_before_in_its_own_step() -> None:
    bench = enabled()
    bench.force(12.0)
    bench.run(1.0)
    assert bench.last.status & StatusBit.IN_BAND
    output = bench.force(40.0)
    assert not output.status & StatusBit.IN_BAND and output.state is State.RAMPING


def test_a_voltage_that_stood_is_no_force_that_was_held_when_the_mode_changes_on_its_way() -> None:
    bench = enabled()
    bench.voltage(2.0)
    bench.run(2.0)
    bench.voltage(7.0)
    assert bench.run(0.16).status & StatusBit.IN_BAND, "of a voltage: it stands, while the force still rises"
    output = bench.write(mode=Mode.FORCE, force_setpoint_n=bench.last.force_measured_n + 0.5, voltage_setpoint_v=0.0)
    assert not output.status & StatusBit.IN_BAND and output.state is State.RAMPING


def test_a_run_begins_with_nothing_of_the_one_before_and_keeps_its_own_ceiling_under_another_calibration() -> None:
    bench = begun(Bench())
    run = bench.controller.active_run
    bench.run(4.0)
    assert run.last_row is not None
    ceiling = run._ceiling
    bench.controller.use(CalibrationInUse(bsfm(1.1), 2))
    assert run._ceiling is ceiling
    run.ask_stop("calibration stopped by a person")
    bench.run(1.0)
    bench.enable(12.0)
    run.ask(SHORT)
    bench.run(0.1)
    assert run.refused and not run.running
    bench.disable()
    bench.run(1.0)
    run.ask(SHORT)
    assert run.refused == ""
    bench.run(0.05)
    assert run.running and run.last_row is None


def test_that_the_trim_hunts_is_told_once_each_time_it_begins() -> None:
    loop, events = SimpleNamespace(is_hunting=False, is_gain_own=False, applied_n=20.0), OneShotEvents(stuck_n=5.0)
    told = []
    for loop.is_hunting in (False, True, True, True, False, True):
        told.append(bool(events.hunting_event(loop)))  # type: ignore[arg-type]
    assert told == [False, True, False, False, False, True]


def test_a_trim_with_the_rig_files_gain_names_it_and_a_measured_one_does_not() -> None:
    for is_gain_own in (False, True):
        loop = SimpleNamespace(is_hunting=True, is_gain_own=is_gain_own, is_trim_off=False, applied_n=20.0)
        told = OneShotEvents(stuck_n=5.0).hunting_event(loop)  # type: ignore[arg-type]
        assert told.startswith("W360 at 20.0 N ") and ("gain_v_per_n_s" in told) == is_gain_own


@pytest.mark.parametrize(("gain_v_per_n_s", "is_named"), [(0.0, False), (0.02, True)])
def test_a_swinging_force_is_blamed_on_the_trims_gain_only_where_there_is_one(
    gain_v_per_n_s: float, is_named: bool
) -> None:
    bench = enabled(replace(settings(), trim=Trim(gain_v_per_n_s=gain_v_per_n_s)))
    bench.force(20.0)
    bench.alter_sample = lambda sample: replace(
        sample, force_n=sample.force_n + (8.0 if bench.ms % 600 < 300 else -8.0)
    )
    bench.run(6.0)
    told = [one for one in bench.events if one.startswith("W360")]
    assert [("gain_v_per_n_s" in one) for one in told] == [is_named]


def test_a_path_of_setpoints_that_a_voltage_has_broken_off_leads_no_force_behind_it() -> None:
    """Where the aim was on its way to when the mode changed, seconds ago, is nowhere that the new setpoint goes."""
    highest_v = []
    for setpoints_n in ((33.5,), [20.0 + 1.5 * k for k in range(10)]):
        bench = Bench(noise_n=0.02)
        bench.controller = Controller(
            bench.settings, CalibrationInUse(bsfm(), 1, Response(dead_time_s=0.1, lag_s=0.15))
        )
        bench.run(0.5)
        bench.enable(20.0)
        bench.run(2.0)
        for setpoint_n in setpoints_n:
            bench.force(setpoint_n)
            bench.run(0.03)
        bench.voltage(bsfm().voltage_v(33.5, 1.0)[0])
        bench.run(5.0)
        bench.history.clear()
        bench.write(mode=Mode.FORCE, force_setpoint_n=33.5, voltage_setpoint_v=0.0)
        bench.run(0.5)
        highest_v.append(max(one.output.voltage_v for one in bench.history))
    assert highest_v[1] < highest_v[0] + 0.1
