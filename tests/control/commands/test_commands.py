"""Direct voltage, stop, bands and warnings, as a master sees them."""

from dataclasses import replace
from math import isnan, nan

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.codes.warning_bits import WarningBit
from gateway.control import LeaseAction, LineStatus
from gateway.control.command_edges import CommandTracker
from gateway.control.demand import demand_of
from gateway.devices.messages import Quality
from gateway.registers.command import Command
from gateway.registers.words import ControlBit, LimitedBy, Mode, State, StatusBit
from tests.control.bench import Bench, enabled, settings


def test_direct_voltage_goes_out_as_it_came_within_range_and_slew():
    bench = enabled(gain_n_per_v=5.0)
    assert 0.0 < bench.voltage(3.0).voltage_v <= 1.0  # one tick of 100 V/s
    output = bench.run(0.5)
    assert (output.voltage_v, output.state, output.trim_v) == (3.0, State.HOLDING, 0.0)
    assert output.feedforward_v == 3.0 and not output.status & StatusBit.LIMITED
    output = bench.voltage(9.9)
    output = bench.run(0.3)
    assert (output.voltage_v, output.limited_by) == (9.0, LimitedBy.VOLTAGE_RANGE)
    assert output.feedforward_v == 9.9 and output.status & StatusBit.LIMITED


def test_direct_voltage_is_still_supervised_for_over_force():
    bench = enabled()
    bench.plant.gain_n_per_v = 12.0
    bench.voltage(6.0)
    output = bench.run(1.0)
    assert (output.state, output.fault, output.voltage_v) == (State.FAULT, FaultCode.OVER_FORCE, 0.0)


def test_direct_voltage_without_an_answer_warns_in_numbers():
    bench = enabled(air=False)
    bench.voltage(2.31)
    output = bench.run(3.0)
    assert output.status & StatusBit.TARGET_UNREACHABLE
    sentence = next(event for event in bench.events if event.startswith("A301"))
    assert sentence.startswith("A301 2.31 V out, ")
    assert sentence.endswith("no air, valve closed or no contact")


def test_no_air_is_a_warning_with_numbers_and_no_fault():
    bench = enabled()
    bench.force(18.0)
    bench.run(1.0)
    bench.plant.air = False
    output = bench.run(4.0)
    assert output.state is State.READY  # waits at the pre-contact force
    assert output.status & StatusBit.TARGET_UNREACHABLE
    assert output.warnings & WarningBit.TARGET_UNREACHABLE
    assert sum(event.startswith("A301") for event in bench.events) == 1
    bench.plant.air = True
    output = bench.run(2.0)
    assert output.state is State.HOLDING
    assert not output.warnings & WarningBit.TARGET_UNREACHABLE


def test_low_pressure_is_unreachable_once_the_trim_is_spent():
    bench = enabled(gain_n_per_v=4.5)
    bench.force(30.0)
    output = bench.run(4.0)
    assert output.state is State.RAMPING
    assert output.status & StatusBit.TARGET_UNREACHABLE
    assert any("supply pressure too low" in event for event in bench.events)


def test_in_band_needs_the_tolerance_and_the_time_of_the_command():
    bench = enabled()
    bench.write(force_setpoint_n=12.0, in_band_time_s=1.0)
    within_s = bench.seconds_until(lambda output: abs(output.force_measured_n - 12.0) < 1.0, 2.0)
    held_s = bench.seconds_until(lambda output: bool(output.status & StatusBit.IN_BAND), 3.0)
    assert within_s < 1.0
    assert held_s >= 0.95


def test_in_band_is_left_when_the_force_leaves():
    bench = enabled()
    bench.force(12.0)
    assert bench.run(1.0).state is State.HOLDING
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n - 3.0, raw=sample.raw - 3.0)
    bench.run(0.02)
    assert bench.last.state is State.RAMPING
    assert not bench.last.status & StatusBit.IN_BAND


@pytest.mark.parametrize("before", [{"mode": Mode.VOLTAGE, "voltage_setpoint_v": 5.0}, {"force_setpoint_n": 30.0}])
def test_in_band_begins_anew_at_each_voltage_also_at_a_lower_one_that_is_out_at_once(before):
    bench = enabled()
    bench.write(control_word=ControlBit.ENABLE, in_band_time_s=0.5, **before)
    assert bench.run(2.0).status & StatusBit.IN_BAND
    output = bench.write(mode=Mode.VOLTAGE, voltage_setpoint_v=2.0)
    assert (output.voltage_v, output.state) == (2.0, State.RAMPING)
    assert not output.status & StatusBit.IN_BAND, "the force is still that of before"
    held_s = bench.seconds_until(lambda output: bool(output.status & StatusBit.IN_BAND), 2.0)
    assert held_s == pytest.approx(0.5, abs=0.02)
    bench.write(heartbeat=7)
    assert bench.last.status & StatusBit.IN_BAND, "the same voltage again changes nothing"


def test_stop_ramps_to_zero_within_the_time_and_ends_in_off():
    bench = enabled()
    bench.write(force_setpoint_n=40.0, force_ramp_n_per_s=5.0)
    bench.run(9.0)
    assert bench.plant.force_n > 35.0
    bench.controller.stop()
    assert not bench.controller.has_stopped
    bench.run(0.05)
    assert bench.last.voltage_v > 0.0
    bench.force(20.0)
    assert bench.refused and bench.refused.reason is RefusalReason.STOPPING
    took_s = bench.seconds_until(lambda output: output.state is State.OFF, 4.5)
    assert took_s <= 4.0
    assert bench.controller.has_stopped
    assert bench.last.voltage_v == 0.0
    assert bench.enable(12.0).enable_block is RefusalReason.NOT_READY


def test_stop_from_direct_voltage_ramps_too():
    bench = enabled()
    bench.voltage(5.0)
    bench.run(0.5)
    bench.controller.stop()
    bench.run(0.03)
    assert 1.0 < bench.last.voltage_v < 5.0
    bench.run(1.0)
    assert bench.controller.has_stopped


def test_stop_while_off_is_stopped_at_once():
    bench = Bench()
    bench.run(0.1)
    bench.controller.stop()
    assert bench.controller.has_stopped


@pytest.mark.parametrize("force_n", [22.0, -22.0])
def test_a_force_that_stays_at_the_safe_voltage_refuses_enable(force_n: float):
    """Below 0 the zero is wrong, and all that is pressed would be that much too much."""
    bench = Bench()
    bench.alter_sample = lambda sample: replace(sample, force_n=force_n)
    output = bench.run(1.5)
    assert output.enable_block is RefusalReason.NOT_READY
    assert sum(event.startswith(f"W304 {force_n} N measured") for event in bench.events) == 1


def test_an_overloaded_cell_refuses_enable():
    bench = Bench()
    bench.alter_sample = lambda sample: replace(sample, quality=Quality.OVERLOAD, force_n=float("nan"))
    output = bench.run(0.2)
    assert output.enable_block is RefusalReason.NOT_READY
    assert isnan(output.force_measured_n)


def test_a_stale_force_is_unavailable_and_its_age_is_true():
    bench = Bench()
    bench.run(0.1)
    bench.cell_silent = True
    output = bench.run(0.5)
    assert isnan(output.force_measured_n)
    assert output.sample_age_s == pytest.approx(0.505, abs=0.011)


def test_warnings_of_the_line_are_passed_on():
    bench = Bench()
    bench.line = LineStatus(acknowledged_v=0.0, warnings=WarningBit.SERIAL_NOISE)
    assert bench.run(0.1).warnings == WarningBit.SERIAL_NOISE


def test_what_is_read_in_free_air_is_no_held_force_however_little_was_asked_for():
    bench = Bench(contact=False)
    bench.run(0.1)
    bench.enable(0.8)
    bench.run(1.5)
    assert bench.last.force_applied_n == 0.8 and not bench.last.status & StatusBit.IN_BAND


def test_a_lease_that_holds_keeps_the_force_and_warns():
    bench = enabled(settings(lease_s=0.2, lease_action=LeaseAction.HOLD))
    bench.heartbeat_every_ms = 50
    bench.force(12.0)
    bench.run(1.0)
    bench.heartbeat_every_ms = 0
    output = bench.run(1.0)
    assert (output.state, output.fault) == (State.HOLDING, FaultCode.NONE)
    assert output.warnings & WarningBit.MASTER_LOST
    assert bench.releases == 1
    bench.heartbeat_every_ms = 50
    assert not bench.run(0.2).warnings & WarningBit.MASTER_LOST
    bench.heartbeat_every_ms = 0
    assert bench.run(0.5).warnings & WarningBit.MASTER_LOST
    assert not bench.disable().warnings & WarningBit.MASTER_LOST, "nobody is missed any more"


def test_a_lease_that_ramps_ends_in_off_without_a_fault():
    bench = enabled(settings(lease_s=0.2, lease_action=LeaseAction.RAMP))
    bench.heartbeat_every_ms = 50
    bench.write(force_setpoint_n=30.0)
    bench.run(1.0)
    bench.heartbeat_every_ms = 0
    bench.run(0.23)
    assert bench.last.voltage_v > 0.0
    output = bench.run(1.0)
    assert (output.state, output.fault, output.voltage_v) == (State.OFF, FaultCode.NONE, 0.0)
    assert any(event.startswith("A310") for event in bench.events)


def test_an_enable_right_behind_an_output_that_went_off_by_itself_counts():
    """Nothing has been decided since the bits were cleared."""
    bench = enabled(settings(lease_s=0.2, lease_action=LeaseAction.RAMP))
    bench.write(force_setpoint_n=30.0)
    bench.seconds_until(lambda output: output.state is State.OFF, 3.0)
    assert bench.last.clear_command
    assert bench.enable(12.0, heartbeat=7).state is not State.OFF


def test_without_a_lease_a_closed_connection_changes_nothing():
    bench = enabled()
    bench.force(12.0)
    bench.run(1.0)
    bench.line = bench.line._replace(owner_connected=False)
    assert bench.run(1.0).state is State.HOLDING


FIELDS = st.sampled_from((0.0, 0.5, 3.0))


WRITTEN = (
    "force_setpoint_n", "force_ramp_n_per_s", "payload_kg", "tilt_angle_rad", "in_band_tolerance_n",
    "precontact_force_n", "contact_ramp_s", "in_band_time_s",
)  # fmt: skip


@given(st.lists(st.dictionaries(st.sampled_from(WRITTEN), FIELDS), max_size=8), st.booleans())
@example([{name: value} for name in WRITTEN for value in (0.5, 3.0)], False)
def test_a_demand_is_that_of_its_own_command_whatever_came_before(writes, pulls):
    tracker = CommandTracker(settings())
    if pulls:
        tracker.turn(-1.0)
    for number, written in enumerate(writes, 1):
        command = Command(number=number, **written)
        tracker.take(0.1 * number, command)
        alone = demand_of(command, settings())
        weight_n = -alone.manner.gravity_n if pulls else alone.manner.gravity_n
        assert tracker.demand == alone._replace(manner=alone.manner._replace(gravity_n=weight_n))


def test_a_number_that_is_none_is_named_and_the_next_command_is_whole_again():
    tracker = CommandTracker(settings())
    tracker.take(0.1, Command(number=1, force_setpoint_n=5.0, payload_kg=nan))
    assert tracker.not_finite.startswith("payload_kg")
    tracker.take(0.2, Command(number=2, force_setpoint_n=6.0))
    assert not tracker.not_finite
    assert tracker.demand == demand_of(Command(number=2, force_setpoint_n=6.0), settings())
    tracker.take(0.3, Command(number=3, force_setpoint_n=6.0, payload_kg=nan))
    assert tracker.not_finite.startswith("payload_kg")


def test_turning_round_counts_the_weight_of_the_command_in_use_the_other_way_at_once():
    tracker = CommandTracker(settings())
    tracker.take(0.1, Command(number=1, payload_kg=1.0))
    pressing_n = tracker.gravity_n
    tracker.turn(-1.0)
    assert tracker.gravity_n == tracker.demand.manner.gravity_n == -pressing_n < 0.0
