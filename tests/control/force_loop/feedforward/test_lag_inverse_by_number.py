"""The inverse of the lags by its formulas: what its pulses, its horizon and its linear law are, whatever plant follows."""

from dataclasses import replace
from math import exp, nan

import pytest

from gateway.bsfm import Branches, Bsfm, LinearBlend, RationalBezier
from gateway.bsfm.drive_map import DriveMap
from gateway.bsfm.response.second_order import SecondOrder
from gateway.control import Limits
from gateway.control.force_loop.lag_inverse import LagInverse, LinearizedLagInverse, _move, _pulses, _sort_lags
from gateway.control.limits import TICK_S

LIMITS = Limits(force_max_n=50.0, over_force_n=60.0, voltage_max_v=8.5)
SLOW, FAST, ONE, RINGING = (
    SecondOrder(0.15, 0.05),
    SecondOrder(0.03, 0.02),
    SecondOrder(0.25, 0.0),
    SecondOrder(0.06, 0.06, 0.6),
)


@pytest.mark.parametrize("lags", [SLOW, FAST, RINGING])
@pytest.mark.parametrize("state", [(-1.0, -1.0), (0.5, -2.0), (1.0, 0.0)])
def test_two_pulses_bring_the_model_to_rest_at_the_wish(lags: SecondOrder, state: tuple[float, float]) -> None:
    sorted_lags = _sort_lags(lags)
    pulses = _pulses(sorted_lags, 0.04)
    first_v, second_v = state
    for pulse_v in (pulses.a1 * first_v + pulses.a2 * second_v, pulses.b1 * first_v + pulses.b2 * second_v):
        moved = _move(sorted_lags.after(pulses.horizon_s), state[0] - pulse_v, state[1] - pulse_v)
        state = moved[0] + pulse_v, moved[1] + pulse_v
    assert state == pytest.approx((0.0, 0.0), abs=1e-9)


def test_the_order_of_two_lags_does_not_count_and_equal_ones_stay_as_long_in_sum() -> None:
    assert _sort_lags(SecondOrder(0.05, 0.15)) == _sort_lags(SLOW) == SLOW
    equal = _sort_lags(SecondOrder(0.1, 0.1))
    assert equal.lag_s > equal.second_lag_s and equal.lag_s + equal.second_lag_s == pytest.approx(0.2)
    assert equal.lag_s == pytest.approx(0.1, rel=1e-3)


@pytest.mark.parametrize(
    ("lags", "wire_s", "step", "damping"),
    [
        (SLOW, 0.03, 4, 0.9),  # longer than one setting and what a decision is late: 35 ms
        (SLOW, 0.0, 1, 0.9),  # 0.12 of the sum of the lags: 24 ms
        (SecondOrder(0.3, 0.3), 0.03, 8, 0.9),  # 72 ms
        (SLOW, 0.5, 10, 0.9),  # a wire of 100 ms and no more
        (FAST, 0.03, 1, 1.0),  # 0.7 of the wire
        (FAST, 0.0, 0, 0.9),
    ],
)
def test_the_shortest_horizon_is_one_that_lags_and_wire_allow(
    lags: SecondOrder, wire_s: float, step: int, damping: float
) -> None:
    inverse = LagInverse(lags, LIMITS)
    inverse.set_wire_time(wire_s)
    assert inverse.horizon_s == pytest.approx(0.02 * 1.2**step)
    assert inverse.landing_s == pytest.approx(2.0 * damping * inverse.horizon_s)


def test_one_lag_lands_a_horizon_later_that_outlasts_a_setting() -> None:
    inverse = LagInverse(ONE, LIMITS)
    assert inverse.landing_s == inverse.horizon_s >= 0.03 + 0.005 + TICK_S > inverse.horizon_s / 1.2


def test_a_wire_time_that_is_not_known_or_nearly_the_same_changes_nothing() -> None:
    inverse = LagInverse(SLOW, LIMITS)
    before_s = inverse.horizon_s
    for wire_s in (nan, 0.0349, 0.0251):
        inverse.set_wire_time(wire_s)
        assert inverse.horizon_s == before_s
    inverse.set_wire_time(0.0601)
    assert inverse.horizon_s > before_s


def test_a_held_voltage_is_followed_as_lags_follow_it_in_one_step_or_many() -> None:
    for lags in (SLOW, ONE, RINGING):
        once, often = LagInverse(lags, LIMITS), LagInverse(lags, LIMITS)
        once.advance(4.0, 0.1)
        for _ in range(100):
            often.advance(4.0, 0.001)
        assert (once.first_v, once.second_v) == pytest.approx((often.first_v, often.second_v))
    one = LagInverse(ONE, LIMITS)
    one.advance(4.0, 0.1)
    assert one.first_v == one.second_v == pytest.approx(4.0 * (1.0 - exp(-0.4)))
    slow = LagInverse(SLOW, LIMITS)
    slow.advance(4.0, 0.1)
    assert slow.first_v == pytest.approx(4.0 * (1.0 - exp(-0.1 / 0.15)))
    assert slow.second_v == pytest.approx(4.0 * (1.0 - (0.15 * exp(-0.1 / 0.15) - 0.05 * exp(-0.1 / 0.05)) / 0.1))


def test_a_model_that_moves_past_the_voltage_goes_on_moving() -> None:
    inverse = LagInverse(SLOW, LIMITS)
    inverse.first_v, inverse.second_v = 5.0, 4.0
    inverse.advance(4.0, 0.01)
    assert 4.0 < inverse.second_v < inverse.first_v < 5.0


def test_where_the_command_map_bends_all_is_reckoned_in_linearized_volts() -> None:
    rising = RationalBezier(0.0, 8.0, (1.0, 12.0, 46.0), (1.0, 1.0, 1.0))
    falling = RationalBezier(0.0, 8.0, (1.0, 16.0, 50.0), (1.0, 1.0, 1.0))
    bent = Bsfm(Branches(rising, falling), LinearBlend(6.0))
    limits, linear = replace(LIMITS, voltage_min_v=0.5, safe_voltage_v=1.0), DriveMap(bent).linear_v
    ends = {name: linear(getattr(limits, name)) for name in ("voltage_min_v", "voltage_max_v", "safe_voltage_v")}
    inverse, straight = LinearizedLagInverse(SLOW, limits, bent), LagInverse(SLOW, replace(limits, **ends))
    assert inverse.first_v == pytest.approx(1.0)
    for held_v, wanted_v in ((6.0, 3.0), (0.5, 2.0), (4.0, 0.7), (1.0, 8.0), (2.0, 9.5)):
        inverse.advance(held_v, 0.05)
        straight.advance(linear(held_v), 0.05)
        assert linear(inverse.second_v) == pytest.approx(straight.second_v)
        for standing_v in (0.5, 3.0, 6.0):
            asked_v = straight.compensated_v(linear(wanted_v), linear(standing_v))
            assert linear(inverse.compensated_v(wanted_v, standing_v)) == pytest.approx(asked_v)
    inverse.go_on_from(1.4, 5.1)
    straight.first_v, straight.second_v = linear(1.4), linear(5.1)
    asked_v = straight.compensated_v(linear(3.9), linear(2.7))  # what stands bounds this push
    assert linear(inverse.compensated_v(3.9, 2.7)) == pytest.approx(asked_v)


def test_one_lag_is_at_the_wish_a_horizon_later() -> None:
    inverse = LagInverse(ONE, LIMITS)
    inverse.first_v = inverse.second_v = 3.0
    inverse.advance(inverse.compensated_v(3.2, 3.0), inverse.horizon_s)
    assert inverse.first_v == pytest.approx(3.2)


@pytest.mark.parametrize(("lags", "damping"), [(FAST, 1.0), (SLOW, 0.9)])
@pytest.mark.parametrize("state", [(-0.1, -0.15), (-0.05, -0.12), (-0.15, -0.1)])
def test_near_the_wish_the_model_moves_as_a_second_order_system_of_the_horizon(
    lags: SecondOrder, damping: float, state: tuple[float, float]
) -> None:
    inverse = LagInverse(lags, LIMITS)
    inverse.first_v, inverse.second_v = 3.0 + state[0], 3.0 + state[1]
    asked_v = inverse.compensated_v(3.0, 3.0)
    speed = (state[0] - state[1]) / lags.second_lag_s
    bend = (asked_v - inverse.second_v - lags.delay_s * speed) / lags.bend_s2
    h_s = inverse.horizon_s
    assert bend == pytest.approx(-(state[1] / h_s + 2.0 * damping * speed) / h_s)


@pytest.mark.parametrize("lags", [SLOW, FAST, ONE, RINGING])
def test_what_is_asked_for_stays_within_the_range_and_what_an_output_cannot_resolve_is_the_wish(
    lags: SecondOrder,
) -> None:
    inverse = LagInverse(lags, LIMITS)
    assert inverse.compensated_v(0.0, 0.0) == 0.0
    assert 4.0 < inverse.compensated_v(4.0, 0.0) <= 8.5
    inverse.first_v = inverse.second_v = 4.0
    assert inverse.compensated_v(4.00001, 4.0) == 4.00001
    assert 0.0 <= inverse.compensated_v(0.5, 4.0) < 0.5
    raised = LagInverse(lags, replace(LIMITS, voltage_min_v=1.0))
    raised.first_v = raised.second_v = 4.0
    assert raised.compensated_v(0.5, 4.0) == 0.5, "a wish below the range passes"


@pytest.mark.parametrize(
    ("lags", "wire_s", "damping"),
    [
        (FAST, 0.03, 1.0),  # it lets go by itself, down as up
        (SLOW, 0.03, 0.9),  # the shorter lag outlasts a setting
        (SecondOrder(0.15, 0.02), 0.03, 1.4 - 0.5 * 0.02 / 0.03),
        (SecondOrder(0.3, 0.01), 0.03, 1.2),
    ],
)
def test_far_above_the_wish_a_way_down_is_damped_by_what_the_shorter_lag_lets_go(
    lags: SecondOrder, wire_s: float, damping: float
) -> None:
    inverse = LagInverse(lags, LIMITS)
    inverse.set_wire_time(wire_s)
    speed, h_s = (0.5 - 0.7) / lags.second_lag_s, inverse.horizon_s
    linear = inverse._linear(0.5, 0.7)
    bend = (linear - 0.7 - lags.delay_s * speed) / lags.bend_s2
    assert bend == pytest.approx(-(0.7 / h_s + 2.0 * damping * speed) / h_s)


def test_half_as_far_above_the_wish_half_of_the_difference_counts() -> None:
    lags = SecondOrder(0.3, 0.01)
    inverse = LagInverse(lags, LIMITS)
    speed, h_s = (0.2 - 0.3) / lags.second_lag_s, inverse.horizon_s
    bend = (inverse._linear(0.2, 0.3) - 0.3 - lags.delay_s * speed) / lags.bend_s2
    assert bend == pytest.approx(-(0.3 / h_s + 2.0 * 0.5 * (0.9 + 1.2) * speed) / h_s)


@pytest.mark.parametrize("lags", [SLOW, SecondOrder(0.3, 0.2), RINGING])
def test_a_push_that_is_not_along_a_limit_can_be_braked_within_the_range(lags: SecondOrder) -> None:
    pushed = 0
    for from_v in (0.0, 1.0, 2.0, 4.0, 6.0, 8.0):
        for to_v in (0.5, 1.5, 3.0, 5.0, 7.0):
            for moving_v in (-0.5, 0.0, 0.5):
                inverse = LagInverse(lags, LIMITS)
                inverse.first_v, inverse.second_v = from_v + moving_v, from_v
                asked_v = inverse.compensated_v(to_v, from_v)
                first_v, second_v = from_v + moving_v - to_v, from_v - to_v
                for pulses in inverse._pulses:
                    if asked_v == pytest.approx(to_v + pulses.a1 * first_v + pulses.a2 * second_v, abs=1e-9):
                        brake_v = to_v + pulses.b1 * first_v + pulses.b2 * second_v
                        assert -1e-9 <= brake_v <= LIMITS.voltage_max_v + 1e-9
                        pushed += asked_v != to_v
    assert pushed
