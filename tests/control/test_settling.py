"""The force follows: steps up and down, partial reversals, ramps, contact, gravity, on a plant that differs from the
model."""

from dataclasses import replace
from math import cos, e, pi, radians, sin

import pytest

from gateway.codes.warning_bits import WarningBit
from gateway.control import CalibrationInUse, Controller, Trim
from gateway.control.force_loop.feedforward import Feedforward
from gateway.control.force_loop.trim import TrimIntegral
from gateway.registers.words import LimitedBy, Mode, State, StatusBit
from gateway.units import STANDARD_GRAVITY_M_PER_S2
from tests.control.bench import Bench, bsfm, enabled, settings
from tests.control.test_rest_forgets import RESPONSE

UP = [5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0]
STAIRS = [*UP, *UP[-2::-1]]
PARTIAL = [20.0, 12.0, 15.0, 13.0, 14.0, 12.0, 30.0, 26.0, 28.0]


def settling_s(bench: Bench, target_n: float, seconds: float = 2.0) -> float:
    """Time after which the true force stays within 1 N of the target."""
    start_s, first = bench.now_s, len(bench.history)
    bench.force(target_n)
    bench.run(seconds)
    outside = [record.time_s for record in bench.history[first:] if abs(record.force_n - target_n) > 1.0]
    return max(outside, default=start_s) - start_s


@pytest.mark.sampled
@pytest.mark.parametrize("friction_n", [0.0, 1.0, 2.0, 3.0])
@pytest.mark.parametrize("seed", [1, 2])
def test_steps_up_and_down_and_partial_reversals_settle_within_a_newton(friction_n, seed):
    bench = enabled(seed=seed, friction_n=friction_n)
    slow = {target: t for target in STAIRS + PARTIAL if (t := settling_s(bench, target, 1.5)) > 1.0}
    assert not slow
    assert abs(bench.last.force_measured_n - PARTIAL[-1]) < 1.0


@pytest.mark.parametrize("gain", [6.6, 7.8])
def test_the_trim_mends_a_gain_that_is_ten_percent_off(gain):
    bench = enabled(gain_n_per_v=gain)
    assert all(settling_s(bench, target) < 1.8 for target in (10.0, 25.0, 15.0))


def test_feedforward_alone_does_not_reach_what_the_trim_reaches():
    alone = enabled(replace(settings(), trim=Trim()), friction_n=3.0)
    trimmed = enabled(friction_n=3.0)
    misses = [settling_s(alone, target) >= 1.98 for target in (20.0, 12.0, 15.0)]
    assert any(misses)
    assert not any(settling_s(trimmed, target) >= 1.5 for target in (20.0, 12.0, 15.0))
    assert all(record.output.trim_v == 0.0 for record in alone.history)


@pytest.mark.parametrize("friction_n", [1.0, 3.0])
def test_stiction_makes_no_limit_cycle(friction_n):
    bench = enabled(friction_n=friction_n)
    bench.force(12.0)
    bench.run(2.0)
    first = len(bench.history)
    bench.run(10.0)
    forces = [record.force_n for record in bench.history[first:]]
    assert max(forces) - min(forces) < 0.6


def test_the_trim_stays_within_its_limit_and_says_so():
    bench = enabled(gain_n_per_v=4.0)
    bench.force(30.0)
    output = bench.run(3.0)
    assert output.trim_v == bench.settings.trim.limit_v
    assert output.limited_by is LimitedBy.TRIM_RANGE
    assert output.warnings & WarningBit.TRIM_SATURATED
    assert output.status & StatusBit.LIMITED


def test_errors_within_the_dead_zone_are_left_to_stiction():
    trim = TrimIntegral(Trim(gain_v_per_n_s=1.0, limit_v=0.5, dead_zone_n=0.15))
    for _ in range(1000):
        trim.integrate(0.14, 0.01)
        trim.integrate(-0.14, 0.01)
    assert trim.value_v == 0.0
    trim.integrate(1.15, 0.1)
    assert trim.value_v == pytest.approx(0.1)


def test_what_the_trim_learned_fades_with_the_travel_of_the_target():
    trim = TrimIntegral(Trim(gain_v_per_n_s=1.0, limit_v=0.5, memory_n=20.0))
    trim.integrate(10.0, 0.1)
    assert trim.limited_by is LimitedBy.TRIM_RANGE
    for _ in range(10):
        trim.travel(-2.0)
    assert trim.value_v == pytest.approx(0.5 / e)
    assert trim.limited_by is LimitedBy.NONE


def test_a_vented_tool_starts_on_the_rising_branch_again():
    law = Feedforward(bsfm(span_n=6.0), settings().limits, 0.1)

    def go(goal_n: float) -> float:
        for _ in range(100):
            law.advance(goal_n, 200.0, 0.01)
        return law.compute_voltage(0.0)[0]

    first_v = go(3.0)  # half of the blend's span
    go(30.0)
    assert go(3.0) < first_v
    go(0.0)
    assert go(3.0) == first_v


def test_the_trim_learns_nothing_without_contact():
    bench = enabled(contact=False)
    bench.force(12.0)
    assert bench.run(1.5).trim_v == 0.0


def test_the_force_ramp_of_the_command_bounds_the_target_both_ways():
    bench = enabled()
    bench.force(5.0)
    bench.run(1.0)
    bench.write(force_ramp_n_per_s=20.0, force_setpoint_n=25.0)
    bench.run(0.5)
    assert bench.last.force_applied_n == pytest.approx(15.0, abs=0.5)
    bench.run(1.0)
    assert bench.last.force_applied_n == 25.0
    bench.force(5.0)
    bench.run(0.5)
    assert bench.last.force_applied_n == pytest.approx(15.0, abs=0.5)


def test_writes_in_quick_succession_do_not_speed_up_the_ramp():
    bench = enabled()
    bench.force(5.0)
    bench.run(1.0)
    bench.write(force_ramp_n_per_s=20.0)
    for _ in range(200):
        bench.force(25.0)
    assert bench.last.force_applied_n <= 5.0 + 20.0 * 0.02


def test_without_contact_the_tool_waits_ready_at_the_precontact_force():
    bench = enabled(contact=False)
    bench.force(12.0)
    output = bench.run(0.5)
    assert (output.state, output.force_applied_n, output.force_accepted_n) == (State.READY, 2.0, 12.0)
    assert not output.status & StatusBit.CONTACT
    bench.plant.contact = True
    output = bench.run(1.0)
    assert (output.state, output.force_applied_n) == (State.HOLDING, 12.0)


def test_from_contact_the_force_rises_over_the_contact_ramp():
    bench = enabled(contact=False)
    bench.write(force_setpoint_n=12.0, contact_ramp_s=2.0)
    bench.run(0.5)
    bench.plant.contact = True
    touched_s = bench.seconds_until(lambda output: bool(output.status & StatusBit.CONTACT), 1.0)
    assert touched_s < 0.2
    bench.run(1.0)
    assert bench.last.force_applied_n == pytest.approx(7.0, abs=0.3)
    bench.run(0.9)
    assert bench.last.force_applied_n < 12.0
    bench.run(0.2)
    assert bench.last.force_applied_n == 12.0


def test_a_precontact_force_that_a_master_writes_below_the_smallest_usable_one_moves_the_tool_all_the_same():
    control = settings()
    bench = enabled(replace(control, limits=replace(control.limits, smallest_force_n=3.0)))
    bench.write(force_setpoint_n=20.0, precontact_force_n=1.5)
    assert bench.run(2.0).state is State.HOLDING


def test_lost_contact_takes_the_force_back_at_once():
    bench = enabled()
    bench.force(30.0)
    bench.run(1.0)
    bench.plant.contact = False
    lost_s = bench.seconds_until(lambda output: not output.status & StatusBit.CONTACT, 1.0)
    assert lost_s < 0.3
    assert bench.last.force_applied_n == 2.0
    assert bench.last.state is State.READY


@pytest.mark.parametrize("response", [None, RESPONSE], ids=["by the rig file", "by a measured response"])
def test_a_tool_that_has_lost_its_contact_waits_at_no_more_than_the_precontact_force(response):
    """What the trim has learned was of the force before, and what it took for an error until the loss was seen is none."""
    bench = Bench(gain_n_per_v=6.6)
    bench.controller = Controller(bench.settings, CalibrationInUse(bsfm(), 1, response))
    bench.run(0.3)
    bench.enable(30.0)
    assert bench.run(1.5).trim_v > 0.2
    bench.plant.contact = False
    output = bench.run(0.6)
    assert output.state is State.READY and output.trim_v == 0.0
    assert output.voltage_v == pytest.approx(bsfm().voltage_v(2.0, 1.0)[0], abs=0.02)


def test_a_setpoint_below_the_smallest_usable_force_is_zero_volts():
    bench = enabled()
    bench.force(0.1)
    output = bench.run(0.2)
    assert (output.voltage_v, output.limited_by) == (0.0, LimitedBy.SMALLEST_FORCE)


def test_a_force_beyond_the_calibration_is_named():
    weak = settings()
    bench = Bench(replace(weak, limits=replace(weak.limits, force_max_n=58.0, over_force_n=80.0)), gain_n_per_v=7.4)
    bench.run(0.1)
    bench.enable(58.0)
    bench.run(1.0)
    assert bench.last.limited_by is LimitedBy.CALIBRATION_RANGE


@pytest.mark.parametrize("tilt_deg", [0.0, 60.0, 90.0, 180.0])
def test_the_payload_presses_with_m_g_cos_tilt(tilt_deg):
    bench = enabled()
    bench.write(payload_kg=0.6, tilt_angle_rad=tilt_deg * pi / 180.0, force_setpoint_n=15.0)
    output = bench.run(1.5)
    weight_n = 0.6 * STANDARD_GRAVITY_M_PER_S2 * cos(radians(tilt_deg))
    assert output.force_measured_n == pytest.approx(15.0, abs=1.0)
    assert bench.plant.force_n == pytest.approx(15.0 - weight_n, abs=1.0)  # what the cell carries


def test_the_residual_is_measured_minus_model():
    bench = enabled(gain_n_per_v=7.0)
    bench.force(20.0)
    output = bench.run(1.5)
    expected_n = bsfm().force_n(output.voltage_v, 1.0)
    assert output.model_residual_n == pytest.approx(output.force_measured_n - expected_n, abs=0.3)


def test_chatter_of_the_setpoint_does_not_leave_the_band():
    bench = enabled()
    bench.force(20.0)
    bench.run(1.0)
    for index in range(100):
        bench.force(20.0 + (0.05 if index % 2 else -0.05))
        bench.run(0.02)
    assert bench.last.state is State.HOLDING
    assert abs(bench.plant.force_n - 20.0) < 1.0


def test_mode_changes_while_enabled_do_not_jump():
    bench = enabled()
    bench.force(20.0)
    bench.run(1.0)
    volts = bench.last.voltage_v
    bench.write(mode=Mode.VOLTAGE, voltage_setpoint_v=volts)
    bench.run(1.0)
    assert bench.last.voltage_v == volts
    assert bench.last.state is State.HOLDING
    bench.write(mode=Mode.FORCE)
    first = len(bench.history)
    bench.run(1.5)
    assert min(record.force_n for record in bench.history[first:]) > 16.0
    assert bench.last.state is State.HOLDING


@pytest.mark.parametrize(("noise_n", "times"), [(1.5, 1), (0.04, 0)])
def test_noise_as_large_as_the_band_is_told_once_an_enable_as_what_keeps_the_state_from_holding(
    noise_n: float, times: int
) -> None:
    """It was ramping for ever, and no word told why."""
    bench = enabled(noise_n=noise_n)
    for enables in (1, 2):
        bench.enable(20.0)
        bench.run(12.0)
        told = [one for one in bench.events if one.startswith("W361 at 20.0 N single readings keep leaving the band")]
        assert len(told) == times * enables
        assert (bench.last.state is State.HOLDING) is not bool(times)
        assert (WarningBit.FORCE_UNSTEADY in bench.last.warnings) is bool(times)
        bench.write(control_word=0)
        bench.run(0.5)
        assert not bench.last.warnings


def test_the_warning_of_noise_ends_with_the_setpoint_that_it_is_of() -> None:
    bench = enabled(noise_n=1.5)
    bench.enable(20.0)
    bench.run(12.0)
    assert bench.last.warnings == WarningBit.FORCE_UNSTEADY
    bench.force(30.0)
    bench.run(0.02)
    assert (bench.last.state, bench.last.warnings) == (State.RAMPING, WarningBit(0))


@pytest.mark.parametrize("frequency_hz", [3.0, 7.0, 11.0])
def test_a_force_that_swings_far_over_both_edges_of_the_band_is_told(frequency_hz: float) -> None:
    """A regulator that hunts: the smoothed force crosses the edges, too, so it was neither noise nor a target that is missed,
    and with a trim that stands nothing was said for as long as it went on."""
    bench = enabled(replace(settings(), trim=Trim()), gain_n_per_v=7.2)
    turn = 2.0 * pi * frequency_hz
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + 9.0 * sin(turn * sample.time_s))
    bench.force(20.0)
    bench.run(12.0)
    assert bench.last.state is State.RAMPING
    assert len([one for one in bench.events if one.startswith(("W360", "W361", "A301"))]) > 0
