"""What control takes back of known defects: each formula undoes what the defect does, and nothing known changes nothing."""

from math import cos, inf, isnan, nan, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.control import (
    NO_COMPENSATION,
    CalibrationInUse,
    CellMap,
    CommandMap,
    Compensation,
    Controller,
    LeadSettings,
    OutsideForce,
    TimingCompensation,
    apply_command_map,
)
from gateway.control.force_loop.transport_delay import TransportDelay
from tests.control.bench import Bench, bsfm, settings

FORCES_N = (0.0, 5.0, 18.0, 40.0, 22.0, 30.0, 9.0, 0.0)
NOTHING = Compensation(
    cell=CellMap(), command=CommandMap(bow=0.0, s=0.0), outside=OutsideForce(), acts=("nothing at all",)
)


def voltages(compensation: Compensation | None) -> list[tuple[float, float]]:
    bench = Bench(seed=3)
    if compensation is not None:
        bench.controller = Controller(
            bench.settings,
            CalibrationInUse(apply_command_map(bsfm(), compensation.command), 1),
            compensation=compensation,
        )
    bench.run(0.1)
    bench.enable()
    for force_n in FORCES_N:
        bench.force(force_n)
        bench.run(0.6)
    return list(bench.voltages())


@pytest.mark.parametrize("compensation", [NO_COMPENSATION, NOTHING], ids=["none", "all of nothing"])
def test_compensating_nothing_changes_no_bit(compensation):
    assert voltages(compensation) == voltages(None)


def test_the_null_compensation_hands_the_same_model_and_settings_back():
    model, control = bsfm(), settings()
    assert apply_command_map(model, NO_COMPENSATION.command) is model
    assert NO_COMPENSATION.settings(control) is control
    assert NO_COMPENSATION.is_null
    assert not NOTHING.is_null


@given(
    force_n=st.floats(-5.0, 90.0),
    quadratic=st.floats(-0.002, 0.004),
    cubic=st.floats(-1.0e-5, 1.0e-4),
    warmer_k=st.floats(-20.0, 30.0),
    voltage_v=st.floats(0.0, 10.0),
    zero_n=st.floats(-3.0, 3.0),
)
def test_the_cell_gives_back_the_force_that_it_bent_warmed_and_disturbed(
    force_n, quadratic, cubic, warmer_k, voltage_v, zero_n
):
    cell = CellMap(
        quadratic_per_n=quadratic,
        cubic_per_n2=cubic,
        span_per_k=0.004,
        zero_n_per_k=-0.2,
        crosstalk_n_per_v=0.3,
        reference_c=21.0,
        zero_n=zero_n,
    )
    reading_n = cell.reading_n(force_n, 21.0 + warmer_k, voltage_v)
    assert cell.force_n(reading_n, 21.0 + warmer_k, voltage_v) == pytest.approx(force_n, abs=1e-6)


def test_the_constant_zero_is_left_to_the_tare():
    cell = CellMap(quadratic_per_n=0.002, zero_n=1.5)
    assert cell.force_n(1.5, nan, 0.0) == pytest.approx(1.5)
    assert cell.force_n(30.0 + 0.002 * 30.0**2 + 1.5, nan, 0.0) == pytest.approx(31.5)


def test_a_curve_of_the_third_power_alone_is_straightened_too():
    assert CellMap(cubic_per_n2=1.0e-4).force_n(30.0 + 1.0e-4 * 30.0**3, nan, 0.0) == pytest.approx(30.0)


def test_without_a_thermometer_a_warm_cell_is_taken_as_it_reads():
    cell = CellMap(span_per_k=0.01, zero_n_per_k=0.5)
    assert cell.force_n(20.0, nan, 3.0) == 20.0
    assert cell.force_n(20.0, 30.0, 3.0) == pytest.approx((20.0 - 5.0) / 1.1)


def test_a_reading_beyond_the_bend_stays_large():
    """A curve that turns back must not hide an overload."""
    assert CellMap(quadratic_per_n=-0.01).force_n(90.0, nan, 0.0) > 60.0
    assert CellMap(quadratic_per_n=0.01).force_n(-90.0, nan, 0.0) < -60.0
    assert 20.0 < CellMap(span_per_k=-0.02).force_n(20.0, 80.0, 0.0) < 200.0, "nor does a heat that leaves no span"


def test_a_reading_that_is_none_is_no_force():
    bent = CellMap(quadratic_per_n=-0.01)
    assert isnan(bent.force_n(nan, 20.0, 0.0))
    assert (bent.force_n(inf, 20.0, 0.0), bent.force_n(-inf, 20.0, 0.0)) == (inf, -inf)


@given(voltage_v=st.floats(0.0, 10.0), bow=st.floats(-0.12, 0.12), s=st.floats(-0.05, 0.05))
def test_what_is_sent_arrives_as_it_was_meant(voltage_v, bow, s):
    command = CommandMap(bow=bow, s=s)
    assert command.straight_v(command.sent_v(voltage_v)) == pytest.approx(voltage_v, abs=1e-7)
    assert (command.sent_v(0.0), command.sent_v(10.0), command.sent_v(11.0)) == (0.0, 10.0, 11.0)


def test_a_model_of_straight_volts_answers_in_sent_volts():
    command, plain = CommandMap(bow=0.06, s=0.0), bsfm()
    model = apply_command_map(plain, command)
    for force_n in (3.0, 20.0, 45.0):
        straight_v, _ = plain.voltage_v(force_n, 0.5)
        volts, _ = model.voltage_v(force_n, 0.5)
        assert volts == pytest.approx(command.sent_v(straight_v))
        assert volts < straight_v
        assert model.force_n(volts, 0.5) == pytest.approx(plain.force_n(straight_v, 0.5), abs=1e-6)
        assert model.settled_n(volts, 0.5) == pytest.approx(force_n, abs=1e-6)
    assert model.voltage_range_v == pytest.approx((0.0, command.sent_v(8.0)))


def test_weight_follows_the_tilt_and_drag_the_feed():
    outside = OutsideForce(tilt_n=4.0, tilt_zero_rad=0.1, feed_drag_n_s_per_mm=0.1, feed_drag_n=1.0)
    assert outside.force_n(0.6, 0.0) == pytest.approx(4.0 * cos(0.5))
    assert outside.force_n(0.1 + pi / 2, -10.0) == pytest.approx(-2.0)
    assert OutsideForce(feed_drag_abs_n_s_per_mm=0.2).force_n(0.0, -10.0) == pytest.approx(2.0)


def test_what_nobody_tells_adds_nothing():
    assert OutsideForce(tilt_n=4.0, feed_drag_n=1.0).force_n(nan, nan) == 0.0


@given(steps_ms=st.lists(st.integers(0, 40), min_size=1, max_size=60))
def test_a_delayed_value_is_heard_as_late_as_the_delay_however_time_is_cut(steps_ms):
    delayed, now_ms = TransportDelay(0.1), 0
    for step_ms in steps_ms:
        now_ms += step_ms
        heard_ms = delayed.advance(float(now_ms), step_ms * 1e-3)
        assert heard_ms <= max(0.0, now_ms - 100.0 + 1e-6)
        assert heard_ms >= now_ms - 100.0 - 40.0 - 1e-6 or heard_ms == 0.0


def test_no_delay_hears_at_once_and_a_restart_forgets():
    assert TransportDelay(0.0).advance(7.0, 0.0) == 7.0
    delayed = TransportDelay(0.05)
    delayed.advance(3.0, 0.01)
    delayed.restart(9.0)
    assert delayed.advance(4.0, 0.04) == 9.0
    assert delayed.advance(4.0, 0.06) == 4.0


def test_a_slower_rig_gets_longer_lags_more_patience_and_a_gentler_trim():
    control = settings(response_lag_s=0.2)
    slower = TimingCompensation(delay_s=0.2, lags_s=0.3, more_s=0.2, more_lag_s=0.05).settings(control)
    assert slower.supervision.response_lag_s == pytest.approx(0.4)
    assert slower.trim.gain_v_per_n_s == pytest.approx(0.5 * control.trim.gain_v_per_n_s)
    assert slower.lead == LeadSettings()  # a lead that is off stays off


def test_a_trim_that_knows_the_delay_does_not_overshoot_what_it_waits_for():
    """The rig hears 0.2 s late and its settings say 0.12 s: only the timing differs between the two runs."""

    def worst_n(timing: TimingCompensation | None) -> float:
        bench = Bench(seed=4, delay_s=0.2, friction_n=0.5)
        compensation = Compensation(timing=timing)
        bench.controller = Controller(bench.settings, CalibrationInUse(bsfm(), 1), compensation=compensation)
        bench.run(0.1)
        bench.enable(10.0)
        bench.run(3.0)
        seen = len(bench.history)
        bench.force(30.0)
        bench.run(2.0)
        assert not any(record.output.fault for record in bench.history)
        return max(record.force_n for record in bench.history[seen:]) - 30.0

    known = TimingCompensation(delay_s=0.2, lags_s=0.1, more_s=0.18)
    assert worst_n(known) < 0.6 * worst_n(None)
