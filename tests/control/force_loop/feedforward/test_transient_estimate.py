"""What goes away by itself is told from what stays: by its pace, by how far the movement went, and not by noise."""

from math import exp
from random import Random

import pytest

from gateway.control.force_loop.transient_estimate import TransientEstimate

LAG_S, SAMPLE_S = 0.2, 0.01


def watched(stays_n: float, goes_n: float, pushed_n: float, seconds: float, noise_n: float = 0.0) -> TransientEstimate:
    """Behind a movement of pushed_n: an error that stays, and one that falls with the lag."""
    one, rng = TransientEstimate(), Random(4)
    one.lag_s = LAG_S
    one.push(pushed_n)
    for k in range(round(seconds / SAMPLE_S)):
        error_n = stays_n + goes_n * exp(-k * SAMPLE_S / LAG_S) + rng.gauss(0.0, noise_n)
        one.observe(error_n, noise_n, SAMPLE_S)
    return one


@pytest.mark.parametrize("noise_n", [0.02, 0.1])
def test_what_falls_at_the_lags_pace_is_not_taken_for_what_stays(noise_n):
    left_n = 0.8 * exp(-1.0)
    assert watched(0.0, 0.8, 12.0, LAG_S, noise_n).transient_n == pytest.approx(left_n, abs=0.12)
    assert watched(0.8, 0.0, 12.0, LAG_S, noise_n).transient_n == pytest.approx(0.0, abs=0.12)
    assert watched(0.4, -0.8, 12.0, LAG_S, noise_n).transient_n == pytest.approx(-left_n, abs=0.12)


def test_behind_a_small_movement_an_error_is_one_that_stays():
    assert abs(watched(0.8, 0.0, 1.0, 0.05).transient_n) < 0.05
    assert abs(watched(0.8, 0.0, 12.0, 0.05).transient_n) > 0.2, "behind a large one nobody knows yet"


def test_what_is_left_of_a_movement_makes_it_no_smaller():
    """It is noted again and again, while it arrives."""
    whole, noted = TransientEstimate(), TransientEstimate()
    for one, pushes_n in ((whole, (12.0,)), (noted, (-12.0, 6.0, 0.5))):
        one.lag_s = LAG_S
        for push_n in pushes_n:
            one.push(push_n)
        one.observe(0.8, 0.02, SAMPLE_S)
    assert noted.transient_n == whole.transient_n > 0.2


def test_what_was_left_of_a_movement_is_over_a_few_lags_later():
    assert abs(watched(0.5, 0.5, 12.0, 8.0 * LAG_S, 0.1).transient_n) < 0.01


def test_what_the_trim_takes_is_no_error_that_falls_by_itself():
    left_n, one = 0.8, TransientEstimate()
    one.lag_s = LAG_S
    one.push(12.0)
    for _ in range(60):
        one.observe(left_n, 0.02, SAMPLE_S)
        one.correct(0.05 * left_n)
        left_n *= 0.95
    assert abs(one.transient_n) < 0.03
