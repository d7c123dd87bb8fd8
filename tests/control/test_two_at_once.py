"""Where two things meet: the end of a run and a lease, weight and mode, a silence and a question, two causes in one step."""

from dataclasses import replace

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.codes.warning_bits import WarningBit
from gateway.control import CalibrationInUse, Compensation, Controller
from gateway.control.compensation.compensation import OutsideForce
from gateway.control.demand import STOP_S
from gateway.control.settings import Defaults, LeaseAction
from gateway.registers.words import ControlBit, Mode, State
from tests.control.bench import Bench, bsfm, enabled, settings
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
