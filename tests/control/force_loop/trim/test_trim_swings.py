"""A gain that is too large for the rig makes the force swing for good; the trim goes slower, and noise is no swing."""

from random import Random

import pytest

from gateway.control.force_loop.measured_trim import NEW_TARGET_N
from gateway.control.force_loop.trim import (
    CALM_S,
    FREE_SWINGS,
    LEAST_PACE,
    SEEN_S,
    SEEN_SAMPLES,
    SWING_N,
    TrimIntegral,
)
from gateway.control.settings import Trim

SAMPLE_S = 0.01


def trim(gain_v_per_n_s: float = 1.0) -> TrimIntegral:
    return TrimIntegral(Trim(gain_v_per_n_s=gain_v_per_n_s, limit_v=3.0, dead_zone_n=0.15))


def see(one: TrimIntegral, error_n: float, duration_s: float = 2.0 * SEEN_S) -> None:
    for _ in range(round(duration_s / SAMPLE_S)):
        one.integrate(error_n, SAMPLE_S)


def swing(one: TrimIntegral, times: int, error_n: float = 2.0) -> TrimIntegral:
    for number in range(times + 1):
        see(one, error_n * (-1.0) ** number)
    return one


def pace_of(one: TrimIntegral) -> float:
    """How much of the rig file's gain acts, by one sample."""
    before_v = one.value_v
    one.integrate(0.65, SAMPLE_S)
    return (one.value_v - before_v) / (0.5 * SAMPLE_S)


@pytest.mark.parametrize("gain_v_per_n_s", [0.3, 1.0, 5.0, 30.0])
def test_on_a_plant_with_two_lags_any_gain_comes_to_rest(gain_v_per_n_s: float) -> None:
    """9 N per volt behind two lags of 72 ms and 30 ms of wire: from 1.5 on it swings for good without."""
    one, wire, first_n, force_n = trim(gain_v_per_n_s), [0.0] * 3, 0.0, 15.0
    errors = []
    for _ in range(1500):
        errors.append(20.0 - force_n)
        one.integrate(errors[-1], SAMPLE_S)
        wire = [*wire[1:], one.value_v]
        first_n += (15.0 + 9.0 * wire[0] - first_n) * SAMPLE_S / 0.072
        force_n += (first_n - force_n) * SAMPLE_S / 0.072
    assert max(map(abs, errors[-300:])) < SWING_N
    assert one.has_hunted == (gain_v_per_n_s > 1.0)


def test_a_few_swings_are_free_and_each_further_one_makes_it_slower() -> None:
    assert not swing(trim(), FREE_SWINGS).has_hunted
    one = swing(trim(), FREE_SWINGS + 2)
    assert one.swings == FREE_SWINGS + 2 and pace_of(one) == pytest.approx(0.36)
    assert pace_of(swing(trim(), 60)) == pytest.approx(LEAST_PACE)


def test_noise_is_no_swing() -> None:
    chance, one = Random(1), trim()
    for _ in range(20_000):
        one.integrate(chance.gauss(0.0, 0.6), SAMPLE_S)
    assert one.swings == 0


@pytest.mark.parametrize(
    ("error_n", "duration_s"),
    [(0.9 * SWING_N, 1.0), (5.0, SEEN_S - SAMPLE_S), (5.0, 1.1 * CALM_S)],
    ids=["small", "short", "slow"],
)
def test_what_is_small_short_or_slow_is_no_swing(error_n: float, duration_s: float) -> None:
    one = trim()
    for number in range(20):
        see(one, error_n * (-1.0) ** number, duration_s)
    assert one.swings == 0


def test_of_a_slow_cell_one_sample_is_no_swing() -> None:
    one = trim()
    for number in range(20):
        one.integrate(5.0 * (-1.0) ** (number // (SEEN_SAMPLES - 1)), 2.0 * SEEN_S)
    assert one.swings == 0


def test_another_target_counts_anew_at_the_pace_that_was_found_and_a_rest_forgets_it() -> None:
    one = swing(trim(), FREE_SWINGS + 1)
    one.travel(0.6 * NEW_TARGET_N)
    assert one.swings
    one.travel(0.6 * NEW_TARGET_N)
    assert one.swings == 0 and one.has_hunted
    swing(one, FREE_SWINGS)
    assert pace_of(one) == pytest.approx(0.6)
    one.reset()
    assert not one.has_hunted and pace_of(one) == pytest.approx(1.0)


def test_a_contact_that_is_lost_takes_the_correction_and_not_the_pace_that_was_found() -> None:
    """A tool that swings off its workpiece each time would else swing at the full gain for good."""
    one = swing(trim(), FREE_SWINGS + 3)
    slow = pace_of(one)
    one.forget()
    assert (one.value_v, one.has_hunted) == (0.0, True)
    assert pace_of(one) == pytest.approx(slow) and slow < 1.0
