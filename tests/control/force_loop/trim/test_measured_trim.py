"""The trim of a measured rig: rests within its zone, finishes what it began, remembers by direction, stops hunting."""

from random import Random

import pytest

from gateway.bsfm.response.second_order import SecondOrder
from gateway.control import Trim
from gateway.control.force_loop.measured_trim import (
    LEAST_SEEN_S,
    LONGEST_PATIENCE_S,
    MOST_TURNS,
    NEW_TARGET_N,
    STOOD_S,
    MeasuredTrim,
)
from gateway.control.settings import LoopTiming
from gateway.registers.words import LimitedBy

TIMING = LoopTiming(dead_time_s=0.08, lags=SecondOrder(0.07, 0.07), landing_s=0.07, integral_per_s=3.0)
SLOPE_N_PER_V = 8.0
SAMPLE_S = 0.01


def trim(**settings: float) -> MeasuredTrim:
    return MeasuredTrim(Trim(**{"gain_v_per_n_s": 0.3, "limit_v": 0.5, **settings}), TIMING)


def held(one: MeasuredTrim, error_n: float, seconds: float, noise_n: float = 0.0, seed: int = 1) -> float:
    """A plant that answers at once to what the trim adds; returns the error at the end."""
    rng, start_n = Random(seed), one.value_n
    left_n = error_n
    for _ in range(round(seconds / SAMPLE_S)):
        left_n = error_n - (one.value_n - start_n)
        one.integrate(left_n + rng.gauss(0.0, noise_n), SLOPE_N_PER_V, SAMPLE_S)
    return left_n


def test_an_error_is_corrected_beyond_the_edge_of_the_zone():
    assert abs(held(trim(), 1.0, 3.0)) < 0.07


def test_a_correction_that_has_begun_goes_on_to_a_third_of_the_zone():
    """Left at its edge, every error would stay as large as the zone is wide."""
    assert abs(held(trim(dead_zone_n=2.0), 1.2, 5.0)) < 0.45


def test_an_error_is_believed_once_it_has_been_seen_for_a_while():
    """One sample that is off is the cell's."""
    one = trim()
    held(one, 1.0, LEAST_SEEN_S - SAMPLE_S)
    assert one.value_n == 0.0
    held(one, 1.0, 2.0 * SAMPLE_S)
    assert one.value_n > 0.0


def test_errors_within_the_zone_are_left_to_stiction():
    one = trim()
    held(one, 0.07, 5.0)
    assert one.value_n == 0.0


@pytest.mark.parametrize("noise_n", [0.02, 0.1, 0.3])
def test_noise_alone_moves_nothing(noise_n):
    one = trim()
    held(one, 0.0, 30.0, noise_n)
    assert abs(one.value_n) < 0.06


def test_what_was_learned_stays_for_chatter_fades_on_the_way_and_is_not_turned_over():
    one = trim()
    one.travel(20.0)
    held(one, 1.0, 3.0)
    learned_n = one.value_n
    for _ in range(200):
        one.travel(0.05)
        one.travel(-0.05)
    assert one.value_n == pytest.approx(learned_n, abs=1.0e-9)
    one.travel(-3.0)
    assert abs(one.value_n) < 0.06 * learned_n
    one.travel(3.0)
    assert one.value_n == pytest.approx(learned_n, abs=0.06 * learned_n)
    one.travel(10.0)
    assert one.value_n < 0.4 * learned_n


def test_what_both_directions_agree_on_outlives_a_turn():
    one, way = trim(), 1.0
    one.travel(20.0)
    for _ in range(4):
        one.travel(3.0 * way)
        held(one, 1.0 - one.value_n, 3.0)
        way = -way
    one.travel(1.5 * way)
    assert one.value_n > 0.6
    one.travel(40.0 * way)
    assert abs(one.value_n) < 0.05


def test_what_the_directions_do_not_agree_on_does_not_outlive_a_turn():
    one, way = trim(), 1.0
    one.travel(20.0)
    for _ in range(4):
        one.travel(3.0 * way)
        held(one, way - one.value_n, 3.0)
        way = -way
    one.travel(1.5 * way)
    assert abs(one.value_n) < 0.3


def test_what_another_trim_has_learned_fades_on_the_way_too():
    one = trim()
    one.resume(1.0)
    one.travel(0.0)
    assert one.value_n == 1.0
    one.travel(40.0)
    assert abs(one.value_n) < 0.05


def hunt(one: MeasuredTrim) -> MeasuredTrim:
    """A stuck slide that gives way again and again: within the trim's limit, so that the trim comes to turn round."""
    way = 1.0
    for _ in range(MOST_TURNS + 1):
        for _ in range(80):
            one.integrate(1.4 * way, SLOPE_N_PER_V, SAMPLE_S)
        way = -way
    assert one.has_hunted
    return one


def test_hunting_slows_it_down_and_stops_it_until_there_is_a_new_target():
    one = hunt(trim())
    stood_n = one.value_n
    held(one, 2.0, 1.0)
    assert one.value_n == stood_n
    one.travel(NEW_TARGET_N + 0.1)
    assert not one.has_hunted


def test_where_it_stands_wrong_behind_the_hunting_it_corrects_again():
    """It stands where it turned, which is the furthest from where it should be."""
    assert abs(held(hunt(trim()), 2.0, 6.0)) < 0.2


def test_each_further_standstill_at_one_target_takes_twice_as_long():
    one, stood_s = trim(limit_v=5.0), []
    for _ in range(3):
        hunt(one)
        samples = 0
        while one.has_hunted and samples < 2000:
            one.integrate(2.0, SLOPE_N_PER_V, SAMPLE_S)
            samples += 1
        stood_s.append(samples * SAMPLE_S)
    assert stood_s == pytest.approx([STOOD_S, 2.0 * STOOD_S, 4.0 * STOOD_S], abs=0.7)


def test_behind_the_hunting_an_error_to_and_fro_is_left_alone():
    one, way = hunt(trim()), 1.0
    for _ in range(10):
        for _ in range(round(0.8 * STOOD_S / SAMPLE_S)):
            one.integrate(3.0 * way, SLOPE_N_PER_V, SAMPLE_S)
        way = -way
    assert one.has_hunted


def test_a_few_disturbances_keep_no_error_from_being_corrected_for_long():
    """Each makes the zone wider for as long as the target stands: 1 N was left behind four of them."""
    one, way = trim(dead_zone_n=0.5), 1.0
    for _ in range(MOST_TURNS):
        for _ in range(80):
            one.integrate(2.4 * way, SLOPE_N_PER_V, SAMPLE_S)
        way = -way
    assert not one.has_hunted
    assert abs(held(one, 1.0 * way, 0.8 * STOOD_S)) > 0.5, "it may have been friction's"
    assert abs(held(one, 1.0 * way, 2.0 * STOOD_S)) < 0.3


def test_many_disturbances_in_a_day_keep_no_error_from_being_corrected_for_longer_than_half_a_minute():
    """A constant force is one target for hours. Behind forty effects of `sim set` it stood 0.7 N off, its in_band flickering
    with the noise of the cell, and the wait had doubled to hours."""
    one, way = trim(limit_v=5.0), 1.0
    for _ in range(20 * MOST_TURNS):
        for _ in range(80):
            one.integrate(2.4 * way, SLOPE_N_PER_V, SAMPLE_S)
        if one._turns == MOST_TURNS - 1:
            held(one, 2.4 * way, 2.0 * LONGEST_PATIENCE_S)
        way = -way
    assert abs(held(one, 2.4 * way, LONGEST_PATIENCE_S + 2.0)) < 0.3


def test_a_swing_from_limit_to_limit_is_hunting():
    """A plant that answers later than was measured may keep it going: it must become slower, and come to an end."""
    one, way, waited_s = trim(), 1.0, []
    while not one.has_hunted and len(waited_s) < 2 * MOST_TURNS:
        samples = 0
        while not one.has_hunted and (one.limited_by is LimitedBy.NONE or one.value_n * way < 0.0):
            one.integrate(3.0 * way, SLOPE_N_PER_V, SAMPLE_S)
            samples += 1
        for _ in range(20):
            one.integrate(3.0 * way, SLOPE_N_PER_V, SAMPLE_S)
        waited_s.append(samples * SAMPLE_S)
        way = -way
    assert len(waited_s) == MOST_TURNS + 1
    assert waited_s[-2] > 2.0 * waited_s[1]


def test_failures_that_bring_it_to_its_limit_are_no_hunting():
    """Air that fails ten times at one setpoint, and comes back: it has stood still at its limit, 4 N beside the setpoint."""
    one = trim()
    for _ in range(2 * MOST_TURNS):
        for _ in range(100):
            one.integrate(11.0, SLOPE_N_PER_V, SAMPLE_S)
        assert one.limited_by is LimitedBy.TRIM_RANGE
        assert abs(held(one, -one.value_n, 1.5)) < 0.3
    assert not one.has_hunted


@pytest.mark.parametrize("burst_n", [5.0, 50.0])
def test_a_burst_of_noise_keeps_no_error_from_being_corrected_for_long(burst_n):
    one = trim()
    held(one, 0.0, 3.0, noise_n=burst_n)
    assert abs(held(one, 1.4, 2.0, noise_n=0.1, seed=2)) < 1.0


def test_a_cell_that_is_always_noisy_is_known_as_that():
    one, rng = trim(), Random(3)
    for sample in range(6000):
        one.integrate(rng.gauss(0.0, 2.0), SLOPE_N_PER_V, SAMPLE_S)
        assert sample < 100 or one.noise_n > 1.0


def test_it_stays_within_its_limit_and_says_so():
    one = trim(limit_v=0.2)
    held(one, 10.0, 2.0)
    assert one.value_n == pytest.approx(0.2 * SLOPE_N_PER_V)
    assert one.take_volts(0.3) == 0.2
    assert one.limited_by is LimitedBy.TRIM_RANGE


def test_what_was_learned_either_way_and_its_limit_are_forgotten_by_a_reset():
    one, way = trim(limit_v=0.1), 1.0
    for _ in range(4):
        one.travel(3.0 * way)
        held(one, 3.0 - one.value_n, 3.0)
        way = -way
    one.travel(1.5 * way)
    assert one.value_n > 0.5
    held(one, 3.0, 1.0)
    assert one.limited_by is LimitedBy.TRIM_RANGE
    one.reset()
    assert one.limited_by is LimitedBy.NONE
    one.travel(2.0)
    assert one.value_n == 0.0
