"""Limits are named functions, refuse what is not finite, and hold for any pattern of calls."""

from dataclasses import replace
from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.control.limits import (
    TICK_S,
    NotFiniteError,
    RateBudget,
    VoltageLimiter,
    force_limited,
    is_below_usable,
    narrow_limits,
    ramp_limited,
    slew_limited,
    strongest,
    trim_limited,
    voltage_limited,
)
from gateway.control.settings import Limits
from gateway.registers.words import LimitedBy

LIMITS = Limits(force_max_n=50.0, over_force_n=60.0, smallest_force_n=0.5, voltage_max_v=9.0, voltage_slew_v_per_s=40.0)


@pytest.mark.parametrize("bad", [nan, inf, -inf])
def test_nothing_infinite_passes_a_limit(bad):
    for limit in (
        lambda: force_limited(bad, LIMITS),
        lambda: voltage_limited(bad, LIMITS),
        lambda: trim_limited(bad, 0.5),
        lambda: slew_limited(bad, 0.0, 40.0, 0.01),
        lambda: slew_limited(1.0, 0.0, 40.0, bad),
        lambda: ramp_limited(bad, 0.0, 200.0, 0.01),
        lambda: is_below_usable(bad, LIMITS),
    ):
        with pytest.raises(NotFiniteError):
            limit()


def test_each_limit_says_that_it_acted():
    assert force_limited(72.0, LIMITS) == (50.0, LimitedBy.FORCE_RANGE)
    assert force_limited(12.0, LIMITS) == (12.0, LimitedBy.NONE)
    assert voltage_limited(9.5, LIMITS) == (9.0, LimitedBy.VOLTAGE_RANGE)
    assert trim_limited(-0.7, 0.5) == (-0.5, LimitedBy.TRIM_RANGE)
    assert slew_limited(5.0, 1.0, 40.0, 0.01) == (pytest.approx(1.4), LimitedBy.VOLTAGE_SLEW)
    assert is_below_usable(0.4, LIMITS)


def test_falling_is_immediate_and_rising_is_not():
    assert slew_limited(0.0, 8.0, 40.0, 0.0) == (0.0, LimitedBy.NONE)
    assert slew_limited(8.0, 0.0, 40.0, 0.0) == (0.0, LimitedBy.VOLTAGE_SLEW)


def test_a_fall_takes_nothing_from_the_rise_behind_it():
    """As a jam that has gone asks for: down at once, and up again as steeply as ever."""
    limiter = VoltageLimiter(LIMITS)
    for _ in range(30):
        limiter.earn(TICK_S)
        limiter.drive(8.0)
    limiter.earn(TICK_S)
    limiter.drive(2.0)
    assert limiter.drive(8.0) is LimitedBy.VOLTAGE_SLEW
    assert limiter.voltage_v == pytest.approx(2.0 + 40.0 * TICK_S)


def test_the_strongest_of_several_limits_is_reported():
    assert strongest(LimitedBy.NONE, LimitedBy.FORCE_RANGE, LimitedBy.VOLTAGE_SLEW) is LimitedBy.VOLTAGE_SLEW
    assert strongest(LimitedBy.NONE) is LimitedBy.NONE


times = st.floats(0.0, 0.15, allow_nan=False)
targets = st.floats(0.0, 9.0, allow_nan=False)


@given(st.lists(st.tuples(times, targets), min_size=1, max_size=60))
def test_no_pattern_of_calls_beats_the_slew_limit(calls):
    stage, now_s = VoltageLimiter(LIMITS), 0.0
    written = [(0.0, stage.voltage_v)]
    for dt_s, target_v in calls:
        now_s += dt_s
        stage.earn(dt_s)
        stage.drive(target_v)
        written.append((now_s, stage.voltage_v))
    for later, (end_s, end_v) in enumerate(written):
        for start_s, start_v in written[:later]:
            assert end_v - start_v <= LIMITS.voltage_slew_v_per_s * (end_s - start_s + TICK_S) + 1e-9


@given(st.lists(st.floats(0.0, 1e-4, allow_nan=False), min_size=50, max_size=50))
def test_calls_in_quick_succession_earn_one_tick_at_most(gaps_s):
    pace, claimed_s = RateBudget(), 0.0
    for gap_s in gaps_s:
        pace.earn(gap_s)
        claimed_s += pace.available_s
        pace.spend(pace.available_s, 1.0)
    assert claimed_s <= TICK_S + sum(gaps_s) + 1e-12


@pytest.mark.parametrize("gap_s", [0.004, 0.01, 0.02, 0.025, 0.033, 0.042])
def test_a_ramp_lasts_as_long_as_it_says_at_any_pace_of_loop_and_cell(gap_s):
    """A loop of 50 Hz with a cell of 30: two steps lie up to two ticks apart, and a stop took 5.5 s for 4."""
    pace, at_n, steps = RateBudget(), 0.0, round(2.0 / gap_s)
    for _ in range(steps):
        pace.earn(gap_s)
        at_n, before_n = ramp_limited(100.0, at_n, 10.0, pace.available_s), at_n
        pace.spend(at_n - before_n, 10.0)
    assert at_n == pytest.approx(10.0 * steps * gap_s, abs=10.0 * TICK_S)


def test_what_calls_in_quick_succession_leave_is_kept_up_to_a_tick():
    """Of a loop that is asked between two readings: a movement that waits for the second one may claim both."""
    budget = RateBudget()
    budget.spend(1.0, 1.0 / TICK_S)
    assert budget.available_s == 0.0
    for calls in range(1, 16):
        budget.earn(0.1 * TICK_S)
        assert budget.available_s == pytest.approx(min(0.1 * calls, 1.0) * TICK_S)


def test_of_two_limits_that_act_the_slew_is_told_until_the_range_alone_is_left():
    """On the way to a voltage that is out of range it is the pace that keeps it: `limited_by` says the strongest."""
    stage, told = VoltageLimiter(LIMITS), []
    for _ in range(400):
        stage.earn(0.01)
        told.append(stage.drive(LIMITS.voltage_max_v + 5.0))
    assert list(dict.fromkeys(told)) == [LimitedBy.VOLTAGE_SLEW, LimitedBy.VOLTAGE_RANGE]
    assert stage.voltage_v == LIMITS.voltage_max_v


def test_a_late_step_does_not_catch_up_in_one_jump():
    stage = VoltageLimiter(LIMITS)
    stage.earn(0.09)
    stage.drive(9.0)
    assert stage.voltage_v <= LIMITS.voltage_slew_v_per_s * 0.02 + 1e-9


@pytest.mark.parametrize("safe_v", [0.0, 5.0])
def test_the_safe_voltage_is_the_rigs_and_comes_at_once_from_either_side(safe_v):
    """A tool that drops at 0 V has another one."""
    stage = VoltageLimiter(replace(LIMITS, safe_voltage_v=safe_v))
    assert stage.voltage_v == safe_v
    stage.drive(0.0)
    stage.make_safe()
    assert stage.voltage_v == safe_v
    for _ in range(100):
        stage.earn(0.01)
        stage.drive(9.0)
    assert stage.voltage_v == 9.0
    stage.make_safe()
    assert stage.voltage_v == safe_v


@pytest.mark.parametrize(("own_n", "largest_n"), [(None, 50.0), ((2.0, 30.0), 30.0), ((2.0, 80.0), 50.0)])
def test_of_the_rigs_largest_force_and_a_calibrations_the_smaller_one_counts(own_n, largest_n):
    """The smallest one stays the rig's: a tool must come to its pre-contact force."""
    assert narrow_limits(LIMITS, own_n) == replace(LIMITS, force_max_n=largest_n)


def test_a_rig_that_states_no_slope_rises_by_100_volts_a_second() -> None:
    limiter = VoltageLimiter(Limits(force_max_n=50.0, over_force_n=60.0))
    assert limiter.drive(10.0) is LimitedBy.VOLTAGE_SLEW and limiter.voltage_v == pytest.approx(100.0 * TICK_S)
