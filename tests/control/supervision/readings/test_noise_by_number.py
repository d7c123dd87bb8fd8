"""How large a noise is by windows of samples, and how seldom it repeats itself, against numbers worked out by hand."""

from math import cos, erf, exp, inf, log, nan, pi, sqrt, tau
from random import Random
from types import SimpleNamespace

import pytest

from gateway.control.supervision import repeated_readings
from gateway.control.supervision.noise_spread import (
    WINDOW,
    Pool,
    SampleWindow,
    Spread,
    expected_spread,
    quietest,
    spread_of,
    spread_within_two,
)
from gateway.control.supervision.repeat_law import (
    FALSE_ALARM_S,
    Runs,
    careful_counts,
    counts_found_within,
    equal_samples,
    seconds_to_find,
    stays,
)
from gateway.control.supervision.repeated_readings import RepeatedReadings


def test_a_calibration_s_noise_is_told_without_what_rounding_adds() -> None:
    assert expected_spread(1.0, 2.0).counts == pytest.approx(sqrt(0.25 - 1.0 / 12.0))
    assert expected_spread(0.1, 1.0) == Spread(0.0, 0.1, 0.0, 0.0)


@pytest.mark.parametrize(
    ("changes", "share"), [(50.0, 0.5), (90.0, 0.9), (97.0, 0.97), (99.0, 1.0), (120.0, 1.0), (0.0, 0.0)]
)
def test_samples_are_fewer_than_they_seem_only_where_chance_does_not_explain_it(changes: float, share: float) -> None:
    assert Spread(1.0, 0.1, changes, 100.0).independent == share
    assert Spread(1.0, 0.1, changes, 0.0).independent == 1.0


def test_the_quietest_pools_that_are_alike_count_together_by_how_sure_they_are() -> None:
    loud = Spread(3.0, 0.1, 500.0, 500.0)
    together = quietest([loud, Spread(1.0, 0.1, 10.0, 20.0), Spread(1.2, 0.2, 30.0, 40.0)])
    assert together == pytest.approx((130.0 / 125.0, 1.0 / sqrt(125.0), 40.0, 60.0))
    assert quietest([loud, Spread(1.0, 0.1, 10.0, 20.0), Spread(1.41, 0.1, 30.0, 40.0)])[2] == 10.0
    assert quietest([loud, Spread(1.0, 0.1, 10.0, 20.0), Spread(1.39, 0.1, 30.0, 40.0)])[2] == 40.0


@pytest.mark.parametrize("counts", [0.25, 0.3, 0.4, 1.0, 2.0])
@pytest.mark.parametrize("centred", [-1.0, 0.0, 1.0])
def test_a_spread_is_found_again_from_the_variance_that_it_makes(counts: float, centred: float) -> None:
    harmonic = (4.0 * counts**2 + 1.0 / pi**2) * exp(-2.0 * pi**2 * counts**2)
    variance = counts**2 + 1.0 / 12.0 - centred * harmonic
    assert spread_of(variance, centred) == pytest.approx(counts * (1.0 - 0.3 * exp(-2.0 * pi**2 * counts**2)), rel=1e-6)


@pytest.mark.parametrize("counts", [0.5, 1.0, 3.0])
def test_what_two_counts_hold_says_how_wide_a_noise_is(counts: float) -> None:
    assert spread_within_two(erf(1.0 / (sqrt(2.0) * counts))) == pytest.approx(counts)


def test_a_window_takes_what_there_is_room_for() -> None:
    window = SampleWindow()
    assert (window.add(5, 20), window.is_full, window.add(6, 20), window.is_full) == (20, False, 12, True)
    assert window.add(7, 3) == 0
    assert (window.size, window.in_two, window.expected_changes) == (WINDOW, 32, 32.0 - (400.0 + 144.0) / 32.0)
    assert window.deviations == pytest.approx(20 * 25 + 12 * 36 - 172**2 / 32)
    assert window.centring == pytest.approx(cos(tau * 172 / 32))


def test_the_two_fullest_neighbours_are_neighbours() -> None:
    window = SampleWindow()
    for level, count in ((1, 10), (3, 9), (4, 8), (6, 5)):
        window.add(level, count)
    assert window.in_two == 17


@pytest.mark.parametrize(
    ("later", "travel", "is_still"), [(8, 0, True), (9, 0, False), (12, 24, True), (12, 23, False)]
)
def test_a_force_stood_still_where_the_halves_differ_by_half_a_count_or_by_what_noise_makes(
    later: int, travel: int, is_still: bool
) -> None:
    window = SampleWindow()
    window.add(5, 32 - later)
    window.add(6, later)
    window.change(travel)
    assert window.is_still is is_still
    assert (window.changes, window.travel, window.squares) == (1, travel, travel**2)


def test_a_pool_knows_the_noise_of_its_windows_and_how_well() -> None:
    pool, levels, before = Pool(), [7 * k % 32 for k in range(WINDOW)], 0
    for _ in range(2):
        window = SampleWindow()
        for level in levels:
            window.add(level, 1)
            window.change(abs(level - before))
            before = level
        pool.add(window)
    variance = 2.0 * 32.0 * (32.0**2 - 1.0) / 12.0 / 62.0
    error = sqrt(2.0 / 62.0)
    counts, careful = sqrt(variance - 1.0 / 12.0), sqrt(variance * (1.0 - error) - 1.0 / 12.0)
    assert pool.windows == 2
    assert pool.spread == pytest.approx((counts, (counts - careful) / counts, 64.0, 62.0), rel=1e-6)


def test_a_window_in_which_the_force_moved_is_left_out() -> None:
    pool, window = Pool(), SampleWindow()
    window.add(5, 16)
    window.add(9, 16)
    pool.add(window)
    assert pool.windows == 0


@pytest.mark.parametrize(("counts", "rate_hz"), [(0.3, 100.0), (0.4, 10.0), (0.5, 100.0), (1.0, 25.0)])
def test_so_many_equal_samples_are_one_false_alarm_in_the_time_that_is_allowed(counts: float, rate_hz: float) -> None:
    stay, samples = stays(counts), equal_samples(counts, rate_hz)
    assert stay == pytest.approx(erf(0.5 / (sqrt(2.0) * counts)))
    assert rate_hz * (1.0 - stay) * stay**samples * FALSE_ALARM_S == pytest.approx(1.0)
    assert equal_samples(counts, rate_hz, 0.5) == pytest.approx(2.0 * samples)


def test_a_noise_that_shows_too_seldom_proves_nothing_and_ten_samples_are_the_fewest() -> None:
    assert [equal_samples(counts, 10.0) for counts in (0.279, 0.0, nan)] == [inf] * 3
    assert equal_samples(1.0, 10.0, 0.0) == inf and equal_samples(0.28, 100.0) < inf
    assert equal_samples(0.3, 25.0) == inf and equal_samples(0.32, 25.0) < inf
    assert equal_samples(40.0, 10.0) == 10.0 and stays(0.0) == 1.0


@pytest.mark.parametrize(
    ("counts", "rate_hz", "seconds"),
    [(0.3, 80, 2.1), (0.5, 10, 4.2), (1.0, 10, 1.7), (0.4, 25, 2.8), (0.7, 25, 1.1), (0.4, 80, 0.94), (3.0, 100, 0.5)],
)
def test_the_table_of_the_law_is_what_the_law_gives(counts: float, rate_hz: float, seconds: float) -> None:
    assert seconds_to_find(counts, rate_hz, 0.5) == pytest.approx(seconds, rel=0.05)
    assert seconds_to_find(0.2, rate_hz, 0.5) == inf


def test_the_least_noise_that_is_found_in_time_is_one_that_is_and_less_is_not() -> None:
    for rate_hz in (10.0, 80.0):
        counts = counts_found_within(2.0, rate_hz)
        assert (
            seconds_to_find(counts, rate_hz, 0.0) <= 2.0 - 1.0 / rate_hz < seconds_to_find(0.98 * counts, rate_hz, 0.0)
        )
    assert counts_found_within(0.5, 10.0) == inf


def test_a_noise_that_is_known_badly_is_reckoned_with_as_less() -> None:
    assert careful_counts(0.5, 0.0, 100.0) == 0.5 and careful_counts(0.2, 0.5, 100.0) == 0.2
    slope = (log(-log(stays(0.505))) - log(-log(stays(0.495)))) / log(0.505 / 0.495)
    by_law = 0.5 * (1.0 - 0.5 * log(FALSE_ALARM_S * 100.0) * slope * 0.1**2)
    assert careful_counts(0.5, 0.1, 100.0) == pytest.approx(by_law, rel=1e-3)
    assert careful_counts(0.5, 10.0, 100.0) == 0.0


def runs_of(**lengths: int) -> Runs:
    """By their lengths: `_5=60` are sixty of five samples."""
    runs = Runs()
    for name, count in lengths.items():
        for _ in range(count):
            runs.add(int(name[1:]))
    return runs


def test_of_a_tail_that_is_longer_than_the_law_s_the_tail_itself_is_believed() -> None:
    runs = runs_of(_1=1000, _5=60, _10=50)
    by_hand = 5.0 + log(FALSE_ALARM_S * 100.0 * 110.0 / 1800.0) / -log(250.0 / 360.0)
    assert runs.longest == 10 and runs.equal_samples(100.0, 0.1) == pytest.approx(by_hand)
    assert runs.equal_samples(100.0, 0.9) == 0.0, "no longer than the law's"
    assert runs_of(_1=1000, _5=49, _10=50).equal_samples(100.0, 0.1) > 0.0
    assert runs_of(_1=99).equal_samples(100.0, 0.1) == runs_of(_5=500).equal_samples(100.0, 0.1) == 0.0


def test_a_run_that_chance_explains_is_no_sign_of_another_kind_of_noise() -> None:
    runs = runs_of(_1=976, _12=2)  # of 1000 samples, each repeated once in two
    expected = 1000.0 * 0.5 * 0.5**12
    assert 1.0 - exp(-expected) * (1.0 + expected) > 1e-4 and runs.is_explained(12, 0.5)
    assert runs.longest_unexplained(0.5) == 0 and runs.longest_unexplained(0.1) == 12
    assert not runs_of(_1=970, _30=1).is_explained(30, 0.5)
    assert Runs().longest == 0 and Runs().longest_unexplained(0.5) == 0


def test_runs_are_forgotten_a_generation_later() -> None:
    runs = runs_of(_40000=1, _20=1, _30000=1, _3=1)
    assert runs.longest == 40000
    runs.add(65536)
    assert (runs.longest, runs._samples) == (65536, [0, 65539]) and {*runs._before, *runs._now} == {3, 65536}


@pytest.mark.parametrize(
    ("windows", "counts", "is_taken"),
    [(8, 0.5, True), (7, 0.5, False), (8, 0.75, False), (8, 1.0, False), (8, 1.3, False), (31, 0.7, True)],
)
def test_only_a_pool_that_is_clearly_quieter_takes_the_place_of_what_is_known(
    windows: int, counts: float, is_taken: bool
) -> None:
    """Four standard errors of 0.07: of a louder one equal readings would be the rarer, and a dead cell the later found."""
    readings, now = RepeatedReadings(), Spread(counts, 0.07, 40.0, 40.0)
    readings._known = known = Spread(1.0, 0.02, 400.0, 400.0)
    readings._pool = SimpleNamespace(windows=windows, spread=now)  # type: ignore[assignment]
    assert readings._quieter_now() is (now if is_taken else known)


def test_a_cell_that_lives_again_is_learned_from_again_and_not_what_it_has_repeated() -> None:
    readings = RepeatedReadings()
    for value_n in (*(float(k % 2) for k in range(20)), *[1.0] * 30):
        readings.observe(value_n, 0.01, under_force=True)
    readings.forget_run()
    readings.observe(0.0, 0.01, under_force=True)
    assert readings.longest == 1
    for value_n in (*[0.0] * 6, 1.0):
        readings.observe(value_n, 0.01, under_force=True)
    assert readings.longest == 7


def test_however_long_a_spindle_shakes_the_cell_its_quiet_at_rest_is_remembered(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With one memory for both the spindle's stop was a dead cell."""
    monkeypatch.setattr(repeated_readings, "POOLS", 2)
    monkeypatch.setattr(repeated_readings, "POOL_WINDOWS", 4)
    readings, rng = RepeatedReadings(), Random(5)
    for spread, under_force in ((1.0, False), (5.0, True)):
        for _ in range(800):
            readings.observe(float(round(rng.gauss(0.0, spread))), 0.01, under_force)
    assert 0.5 < readings.counts < 1.5
