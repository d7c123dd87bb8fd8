"""What readings say as numbers, against numbers worked out by hand."""

from math import exp, sqrt

import pytest

from gateway.control.self_test.measurements import (
    Intervals,
    Trace,
    count_n,
    fit_slope,
    intervals_of,
    is_constant,
    last,
    noise_n,
    rate_n_per_s,
    readings_to_know,
    still_rises,
    time_to_share_s,
)


def at_8_hz(*forces_n: float) -> Trace:
    return [(0.125 * k, force_n) for k, force_n in enumerate(forces_n)]


def ramp(n_per_s: float, seconds: float = 1.0, from_n: float = 0.0) -> Trace:
    """64 readings a second."""
    return [(k / 64.0, from_n + n_per_s * k / 64.0) for k in range(round(64 * seconds) + 1)]


def test_noise_is_what_neighbours_differ_by() -> None:
    assert noise_n(at_8_hz(0.0, 1.0, 0.0)) == pytest.approx(sqrt(0.5))
    assert noise_n(at_8_hz(0.0, 3.0)) == pytest.approx(3.0 / sqrt(2.0))
    assert noise_n(at_8_hz(5.0)) == noise_n([]) == 0.0


def test_a_count_is_the_smallest_step_between_unlike_readings() -> None:
    assert count_n(at_8_hz(1.0, 0.25, 0.25, 2.0)) == 0.75
    assert count_n(at_8_hz(1.0, 1.0 + 1e-12)) == 0.0 and is_constant(at_8_hz(1.0, 1.0))
    assert not is_constant(at_8_hz(1.0, 1.0, 1.1))


def test_the_last_readings_are_those_after_the_time_and_not_at_it() -> None:
    trace = at_8_hz(0.0, 1.0, 2.0, 3.0)
    assert last(trace, 0.25) == trace[2:] and last(trace, 0.3) == trace[1:]
    assert last(trace, 9.0) == trace and last([], 1.0) == []


def test_a_slope_is_that_of_least_squares_with_its_standard_error() -> None:
    slope = fit_slope([(0.0, 0.0), (1.0, 3.0), (2.0, 0.0)])
    assert (slope.n_per_s, slope.error_n_per_s) == pytest.approx((0.0, sqrt(6.0 / 1.0 / 2.0)))
    slope = fit_slope([(1.0, 1.0), (2.0, 3.0), (4.0, 7.0), (5.0, 9.0)])
    assert (slope.n_per_s, slope.error_n_per_s) == pytest.approx((2.0, 0.0))
    slope = fit_slope([(0.0, 1.0), (1.0, -1.0), (2.0, -1.0), (3.0, 1.0)])
    assert (slope.n_per_s, slope.error_n_per_s) == pytest.approx((0.0, sqrt(4.0 / 2.0 / 5.0)))
    assert fit_slope([(0.0, 0.0), (1.0, 3.0)]) == (0.0, 0.0)


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("from_n", [0.0, 20.0])
@pytest.mark.parametrize(
    ("share", "sigma_n", "seconds"),
    [(0.5, 0.0, 4.5), (0.9, 0.0, 5.7), (0.9, 1.7, 5.7), (0.9, 1.9, 6.1), (0.9, 2.2, 6.5), (0.5, 9.0, 10.0)],
)
def test_the_time_to_a_share_of_the_way_is_that_of_the_middle_of_as_many_readings_as_noise_asks_for(
    way: float, from_n: float, share: float, sigma_n: float, seconds: float
) -> None:
    """Three, (noise / a tenth of the way) squared of them: four from 1.74 N on, five from 2 N on, and 30 at the most."""
    trace = [(float(k), from_n + way * 10.0 * (k >= 5)) for k in range(11)]
    assert time_to_share_s(trace, from_n, from_n + 10.0 * way, share, sigma_n) == pytest.approx(seconds)


def test_a_share_that_is_never_reached_took_as_long_as_was_looked() -> None:
    assert time_to_share_s(at_8_hz(0.0, 1.0, 2.0, 3.0), 0.0, 10.0, 0.9, 0.0) == 0.375
    assert time_to_share_s([], 0.0, 10.0, 0.9, 0.0) == 0.0
    long = [(0.125 * k, 10.0 * (k >= 5)) for k in range(81)]
    assert time_to_share_s(long, 0.0, 10.0, 0.9, 1e3) == pytest.approx(16.5 * 0.125), "the mean of 30"


@pytest.mark.parametrize("rate_hz", [5.0, 8.0, 10.0, 20.0, 100.0, 500.0])
def test_a_slow_cell_makes_no_slow_machine(rate_hz: float) -> None:
    """Wherever its readings lie beside the step: at 5 Hz half of the places had made 400 ms and more of these 239."""
    for place in range(10):
        times_s = [(k + 0.1 * place) / rate_hz for k in range(round(3.0 * rate_hz))]
        trace = [(at_s, 10.0 * (1.0 - exp(-max(0.0, at_s - 0.08) / 0.16))) for at_s in times_s]
        assert 0.239 - 0.06 < time_to_share_s(trace, 0.0, 10.0, 0.63, 0.1) < 0.239 * 1.4 + 0.05


@pytest.mark.parametrize(
    ("n_per_s", "sigma_n", "rises"),
    [(0.0, 0.0, False), (0.14, 0.0, False), (0.2, 0.0, True), (-1.0, 0.0, False), (1.0, 0.2, True), (1.0, 0.4, False)],
)
def test_a_force_rises_where_the_last_third_of_a_second_is_above_the_one_before_by_more_than_noise(
    n_per_s: float, sigma_n: float, rises: bool
) -> None:
    assert still_rises(ramp(n_per_s), sigma_n) is rises


def test_nothing_is_known_of_a_rise_without_a_window_before() -> None:
    assert not still_rises(ramp(5.0, 0.2), 0.0) and not still_rises([], 0.0)
    assert rate_n_per_s(ramp(5.0, 0.05)) == rate_n_per_s([]) == 0.0


def test_a_rate_is_that_of_the_last_two_tenths_of_a_second_and_never_below_0() -> None:
    assert rate_n_per_s(ramp(5.0)) == pytest.approx(5.0, rel=0.1)
    assert rate_n_per_s(ramp(-5.0)) == 0.0
    stands = [*ramp(5.0), *((1.0 + k / 64.0, 5.0) for k in range(1, 20))]
    assert rate_n_per_s(stands) == 0.0


@pytest.mark.parametrize(
    ("sigma_n", "within_n", "count"),
    [(0.0, 1.0, 3), (1.0, 1.0, 9), (1.0, 2.0, 3), (0.5, 0.5, 9), (1.0, 0.8, 15), (9.0, 1.0, 30)],
)
def test_as_many_readings_are_taken_as_three_standard_errors_ask_for(
    sigma_n: float, within_n: float, count: int
) -> None:
    assert readings_to_know(sigma_n, within_n) == count


def test_a_gap_of_two_intervals_is_one_that_is_missing_and_a_late_one_is_none() -> None:
    assert intervals_of([0.0, 1.0, 2.0, 4.0, 5.0, 8.0, 9.0]) == Intervals(1.0, 3.0, 3)
    assert intervals_of([0.0, 1.0, 2.0, 3.75, 4.75]) == Intervals(1.0, 1.75, 0)
    assert intervals_of([0.0, 1.0, 2.0, 6.0, 7.0], [0, 0, 0, 3, 0]) == Intervals(1.0, 1.0, 0), (
        "four at once, none missing"
    )
    assert intervals_of([0.0, 1.0, 2.0, 6.0, 7.0], [0, 0, 0, 1, 0]) == Intervals(1.0, 3.0, 2)
    assert intervals_of([0.0, 2.0, 4.0, 6.0, 7.0], [0, 1, 1, 1, 0]) == Intervals(1.0, 1.0, 0), (
        "most have brought another"
    )
    assert intervals_of([0.0, 1.0, 2.0, 3.9, 4.0, 5.0]).missing == 0, "late, with the next one close behind"
    assert intervals_of([0.0, 1.0, 2.0, 4.6, 4.8, 5.0, 6.0, 8.0, 9.0]).missing == 1, (
        "two late, and later one that never came"
    )
    assert intervals_of([0.0, 0.1, 1.0, 2.0, 4.0, 5.0]).missing == 1, "what was close before a gap does not fill it"
    assert intervals_of([1.0]) == intervals_of([]) == Intervals(0.0, 0.0, 0)
    assert intervals_of([1.0, 1.0, 1.0]) == Intervals(0.0, 0.0, 0)
