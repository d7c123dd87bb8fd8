"""Bounds of the measured rig's trim: what is hunting and what an offset, how slow samples are followed, what noise counts."""

from math import pi, sin
from random import Random

import pytest

from gateway.bsfm.response.second_order import SecondOrder
from gateway.control import Trim
from gateway.control.force_loop.measured_trim import HUNTS_S, MOST_TURNS, SLOWER, STOOD_S, MeasuredTrim
from gateway.control.settings import LoopTiming
from gateway.registers.words import LimitedBy
from tests.control.force_loop.trim.test_measured_trim import SAMPLE_S, SLOPE_N_PER_V, TIMING, held, hunt, trim


def test_a_hair_s_breadth_of_travel_changes_a_correction_by_no_more() -> None:
    """What both directions agree on is a part of what was learned, and counts once."""
    one, way = trim(), 1.0
    one.travel(20.0)
    for _ in range(5):
        one.travel(3.0 * way)
        held(one, 1.0 - one.value_n, 3.0)
        learned_n = one.value_n
        one.travel(0.001 * way)
        assert one.value_n == pytest.approx(learned_n, abs=0.002)
        way = -way


def test_samples_that_are_far_apart_are_followed_without_passing_the_error() -> None:
    one, left_n = trim(), []
    for _ in range(8):
        left_n.append(1.0 - one.value_n)
        one.integrate(left_n[-1], SLOPE_N_PER_V, 1.0)
    assert min(left_n) > -0.01 and left_n[-1] < 0.3


def swung(integral_per_s: float, stands_s: float) -> MeasuredTrim:
    """From limit to limit, so long at each."""
    timing = LoopTiming(dead_time_s=0.08, lags=SecondOrder(0.07, 0.07), landing_s=0.07, integral_per_s=integral_per_s)
    one, way = MeasuredTrim(Trim(gain_v_per_n_s=0.3, limit_v=0.1), timing), 1.0
    for _ in range(MOST_TURNS + 1):
        while not one.has_hunted and (one.limited_by is LimitedBy.NONE or one.value_n * way < 0.0):
            one.integrate(3.0 * way, SLOPE_N_PER_V, SAMPLE_S)
        for _ in range(round(stands_s / SAMPLE_S)):
            one.integrate(3.0 * way, SLOPE_N_PER_V, SAMPLE_S)
        way = -way
    return one


@pytest.mark.parametrize(
    ("integral_per_s", "stands_s", "is_hunting"),
    [(3.0, 0.5, True), (3.0, 0.8, False), (10.0, 0.35, True), (10.0, 0.6, False)],
)
def test_who_stands_at_its_limit_for_longer_than_a_swing_does_is_not_hunting(
    integral_per_s: float, stands_s: float, is_hunting: bool
) -> None:
    """Twice what the trim takes for a correction, and half a second at least."""
    assert swung(integral_per_s, stands_s).has_hunted is is_hunting


@pytest.mark.parametrize("period_s", [60.0, 600.0])
def test_what_comes_and_goes_slowly_is_followed_all_day(period_s: float) -> None:
    """Supply air goes round once a minute, warmth once a day: of five turns one after the other the trim stood still where it
    was wrong the most, 2.9 N beside a force that was disturbed by 1.5 N."""
    one, interval_s, worst_n = trim(), 0.1, 0.0
    for sample in range(round(20.0 * period_s / interval_s)):
        left_n = 1.5 * sin(2.0 * pi * sample * interval_s / period_s) - one.value_n
        one.integrate(left_n, SLOPE_N_PER_V, interval_s)
        worst_n = max(worst_n, abs(left_n))
    assert worst_n < 0.2 and not one.has_hunted


@pytest.mark.parametrize(("share", "is_hunting"), [(0.8, True), (1.2, False)])
def test_hunting_is_as_slow_as_the_trim_has_become(share: float, is_hunting: bool) -> None:
    one, way = trim(limit_v=50.0), 1.0
    for _ in range(MOST_TURNS + 1):
        turns_s = share * HUNTS_S / SLOWER**one._turns
        held(one, 2.0 * way, 1.0)
        for _ in range(round((turns_s - 1.0) / SAMPLE_S)):
            one.integrate(0.0, SLOPE_N_PER_V, SAMPLE_S)
        way = -way
    assert one.has_hunted is is_hunting


@pytest.mark.parametrize(("error_n", "is_corrected"), [(0.75, False), (1.1, True)])
def test_behind_the_hunting_an_error_counts_from_half_beyond_what_the_zone_has_become(
    error_n: float, is_corrected: bool
) -> None:
    """Five turns have made a zone of 0.57 N of one of 0.075 N."""
    one = hunt(trim())
    held(one, error_n, 4.0 * STOOD_S)
    assert one.has_hunted is not is_corrected


def test_an_offset_counts_from_where_its_sign_has_changed() -> None:
    """Also where nothing was seen in between."""
    one = hunt(trim())
    for _ in range(2000):  # the noise of its hunting is forgotten
        one.integrate(0.0, SLOPE_N_PER_V, SAMPLE_S)
    for way, share in ((1.0, 0.8), (-1.0, 1.4)):
        assert one.has_hunted
        one.rest()
        for _ in range(round(share * STOOD_S / SAMPLE_S)):
            one.integrate(3.0 * way, SLOPE_N_PER_V, SAMPLE_S)
    assert not one.has_hunted


def test_the_noise_of_a_cell_is_known_after_a_third_of_a_second() -> None:
    one, rng = trim(), Random(4)
    for _ in range(30):
        one.integrate(rng.gauss(0.0, 0.5), SLOPE_N_PER_V, SAMPLE_S)
    assert one.noise_n == pytest.approx(0.5, rel=0.3)


def test_a_trim_that_has_turned_leaves_an_error_within_its_wider_zone_as_it_is() -> None:
    one, way = trim(dead_zone_n=0.5), 1.0
    for _ in range(MOST_TURNS):
        for _ in range(80):
            one.integrate(2.4 * way, SLOPE_N_PER_V, SAMPLE_S)
        way = -way
    one.rest()
    stood_n = one.value_n
    held(one, 0.9 * way, 0.8 * STOOD_S)
    assert one.value_n == stood_n


def test_behind_a_rest_the_first_sample_is_neither_noise_nor_believed() -> None:
    """It belongs to another moment than those before it."""
    one = trim()
    held(one, 2.0, 0.2)
    noise_n, corrected_n = one.noise_n, one.value_n
    assert corrected_n > 0.0
    one.rest()
    one.integrate(7.0, SLOPE_N_PER_V, SAMPLE_S)
    assert (one.noise_n, one.value_n) == (noise_n, corrected_n)


def counted(one: MeasuredTrim) -> list[float]:
    return [one._turns, one._last_way, one._at_limit_s, one._stood_s, one._patience_s]


def test_of_what_was_at_another_target_nothing_is_counted() -> None:
    """Turns, their way, time at the limit, and how long an error has stood, or has to."""
    one = trim()
    one._turns, one._last_way, one._at_limit_s, one._stood_s, one._patience_s = 3, -1, 0.4, -1.5, 8.0
    one.travel(5.0)
    assert counted(one) == counted(trim())
    hunt(one)
    one.travel(0.1)
    assert one.has_hunted, "that is the same target"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_of_what_was_learned_in_both_directions_the_smaller_part_outlives_a_turn(sign: float) -> None:
    """And behind the turn no more is left than was learned."""
    one, way = trim(), 1.0
    one.travel(20.0)
    for _ in range(6):
        one.travel(3.0 * way)
        held(one, sign * (1.0 if way > 0.0 else 0.3) - one.value_n, 3.0)
        way = -way
    one.travel(1.1 * way)
    assert 0.15 < sign * one.value_n < 0.75
    one.travel(3.0 * way)
    assert 0.1 < sign * one.value_n < 0.4


def test_a_reset_counts_and_believes_from_the_beginning() -> None:
    one = hunt(trim())
    one.reset()
    assert counted(one) == counted(trim())
    one.integrate(2.0, SLOPE_N_PER_V, SAMPLE_S)
    assert one.value_n == 0.0


def test_it_stands_at_its_limit_by_volts_too_and_no_longer_than_at_that_target() -> None:
    one = trim()
    assert (one.take_volts(-0.7), one.limited_by) == (-0.5, LimitedBy.TRIM_RANGE)
    held(one, 9.0, 2.0)
    assert one.limited_by is LimitedBy.TRIM_RANGE
    one.travel(0.5)
    assert one.limited_by is LimitedBy.NONE


def test_newtons_at_their_limit_that_make_no_volts_limit_nothing() -> None:
    """Beyond the calibration's end: TRIM_RANGE was told of 0 V, and not CALIBRATION_RANGE."""
    one = trim()
    held(one, 9.0, 2.0)
    assert (one.take_volts(0.3), one.limited_by) == (0.3, LimitedBy.TRIM_RANGE)
    assert (one.take_volts(0.0), one.limited_by) == (0.0, LimitedBy.NONE)


def test_what_a_second_direction_agrees_on_is_not_added_to_what_the_first_had_learned() -> None:
    one = trim()
    one.travel(20.0)
    held(one, 1.0, 3.0)
    one.travel(-3.0)
    held(one, 1.0 - one.value_n, 3.0)
    one.travel(1.1)
    assert 0.7 < one.value_n < 1.05


def test_of_the_first_samples_behind_a_rest_the_mean_counts() -> None:
    one = trim()
    for error_n in (-1.0, 2.0, 2.0):
        one.integrate(error_n, SLOPE_N_PER_V, SAMPLE_S)
    assert one._smooth_n == pytest.approx(1.0)


def test_what_another_trim_has_learned_outlives_a_turn_like_its_own() -> None:
    one = trim()
    one.resume(1.0)
    one.travel(5.0)
    one.travel(-1.1)
    assert 0.5 < one.value_n < 0.8
    one.travel(-8.0)
    assert one.value_n < 0.1


def test_another_rig_s_memory_counts_from_then_on() -> None:
    one = trim(memory_n=20.0)
    one.retime(Trim(gain_v_per_n_s=0.3, limit_v=0.5, memory_n=1.0), TIMING)
    one.resume(1.0)
    one.travel(3.0)
    assert one.value_n < 0.1


def test_a_reset_forgets_volts_and_what_each_direction_had_learned() -> None:
    one, way = trim(), 1.0
    for _ in range(4):
        one.travel(3.0 * way)
        held(one, 1.0 - one.value_n, 3.0)
        way = -way
    one.take_volts(0.2)
    one.reset()
    assert (one.value_n, one.value_v) == (0.0, 0.0)
    one.travel(5.0)
    held(one, 1.0, 3.0)
    one.travel(-4.0)
    assert abs(one.value_n) < 0.1, "only one direction has learned since"


def test_another_rig_s_limit_and_zone_count_from_then_on() -> None:
    one = trim(limit_v=0.5, dead_zone_n=0.1)
    held(one, 3.0, 3.0)
    one.retime(Trim(gain_v_per_n_s=0.3, limit_v=0.1, dead_zone_n=3.0), TIMING)
    before_n = one.value_n
    assert one.take_volts(0.4) == 0.1
    one.rest()
    held(one, 1.0, 2.0)
    assert one.value_n == before_n, "within the zone of that one"
