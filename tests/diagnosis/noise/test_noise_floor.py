"""The floor that rests prove: right under white noise, never too high under slow noise, and nothing where nobody rests."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.diagnosis import Options, diagnose
from gateway.diagnosis.bench.bench import Bench, bench_of
from gateway.diagnosis.noise import noise_floor
from gateway.diagnosis.noise.noise_floor import find_floor, find_rests, replicate_floor_n, rest_floor
from gateway.diagnosis.result import FloorSource
from tests.diagnosis.begun_anywhere import coloured
from tests.diagnosis.machine import Floats, measurement

ROW_S = 0.005
TIME_S = np.arange(12_000) * ROW_S
STEPPING_V = np.round(3.0 + 2.0 * np.sin(np.floor(TIME_S / 4.0) * 1.7), 3)  # another command every 4 s
MOVING_V = np.round(3.0 + 2.0 * np.sin(1.7 * TIME_S), 3)


def bench_with(volts: Floats, left_n: Floats) -> Bench:
    return bench_of([measurement(TIME_S, volts, 8.5 * volts + left_n, {})])


def white(seed: int) -> Floats:
    return np.random.default_rng(seed).normal(0.0, 0.1, TIME_S.size)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_rests_show_white_noise_as_it_is(seed: int) -> None:
    found = rest_floor(bench_with(STEPPING_V, white(seed)), white(seed))
    assert found is not None and found.source is FloorSource.RESTS
    assert found.value_n == pytest.approx(0.1, rel=0.03)
    assert 0.0 < found.error_share < 0.01


@pytest.mark.sampled
@pytest.mark.parametrize("corner_hz", [0.1, 0.5, 2.0])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_slow_noise_makes_the_floor_no_higher_than_it_is(seed: int, corner_hz: float) -> None:
    """Half of the variance is slow: what a rest cannot resolve is missing, so the floor is between the white part and all."""
    left_n = 0.1 * coloured(np.random.default_rng(seed), TIME_S.size, corner_hz, ROW_S)
    found = rest_floor(bench_with(STEPPING_V, left_n), left_n)
    if found is not None:
        assert 0.065 < found.value_n < 0.1 * (1.05 + 2.0 * found.error_share)
        assert corner_hz < 2.0 or found.value_n > 0.09


def test_a_command_that_moves_all_the_time_has_no_floor_of_its_own() -> None:
    """A calibration may know it; the search's own guess is none."""
    bench = bench_with(MOVING_V, white(4))
    assert rest_floor(bench, white(4)) is None
    assert find_floor(bench, white(4), None) is None
    known = find_floor(bench, white(4), 0.08)
    assert known is not None and (known.value_n, known.source) == (0.08, FloorSource.CALIBRATION)


def test_the_answer_says_that_the_calibration_knows_the_floor() -> None:
    rows = slice(0, 2400, 4)
    one = measurement(TIME_S[rows], MOVING_V[rows], 8.5 * MOVING_V[rows] + white(8)[rows], {})
    found = diagnose([one], None, Options(calibration_noise_n=0.08)).baseline
    assert (found.noise_floor_n, found.noise_floor_source) == (0.08, FloorSource.CALIBRATION)


def test_a_line_that_hums_in_the_rests_is_a_cause_and_no_floor() -> None:
    left_n = white(5) + 0.15 * np.sin(2.0 * np.pi * 50.3 * TIME_S)
    found = rest_floor(bench_with(STEPPING_V, left_n), left_n)
    assert found is not None and found.value_n < 0.12 < float(np.std(left_n))


def test_a_rest_begins_when_lags_have_passed_and_ends_with_the_command() -> None:
    one = measurement(TIME_S, STEPPING_V, 8.5 * STEPPING_V + white(6), {})
    rests = list(find_rests(one, one.usable))
    assert len(rests) == 15
    assert all(np.ptp(STEPPING_V[rest]) == 0.0 for rest in rests)
    assert all(TIME_S[rest][0] % 4.0 == pytest.approx(1.0, abs=0.01) for rest in rests)


def test_replicates_come_before_rests() -> None:
    volts = np.round(3.0 + np.floor(TIME_S % 20.0 / 4.0) * 0.5, 3)
    bench = bench_with(volts, white(7))
    assert replicate_floor_n(bench.measurements[0]) == pytest.approx(0.1, rel=0.05)
    found = find_floor(bench, white(7), None)
    assert found is not None and found.source is FloorSource.REPLICATES


@pytest.mark.parametrize("cycle", [0, 1, 2])
def test_rows_that_are_no_witness_are_in_no_pair_of_replicates(cycle: int) -> None:
    volts = np.round(3.0 + np.floor(TIME_S % 20.0 / 4.0) * 0.5, 3)
    given = measurement(TIME_S, volts, 8.5 * volts + white(7), {})
    spoilt = (20.0 * cycle + 3.0 <= TIME_S) & (20.0 * cycle + 6.0 > TIME_S)
    broken = replace(given, force_n=np.where(spoilt, 0.0, given.force_n), usable=given.usable & ~spoilt)
    assert replicate_floor_n(broken) == pytest.approx(0.1, rel=0.05)


@pytest.mark.parametrize(("known_n", "floor_n"), [((0.1, 0.3), 0.3), ((0.3, 0.1), 0.3), ((0.1, None), None)])
def test_replicates_prove_a_floor_for_all_recordings_only_where_each_of_them_has_some(
    known_n: tuple[float | None, ...], floor_n: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And that of the noisiest: below it what the quieter ones leave open would be called a cause."""
    moved = measurement(TIME_S, MOVING_V, 8.5 * MOVING_V + white(1), {})
    bench, told = bench_of([moved, moved]), iter(known_n)
    monkeypatch.setattr(noise_floor, "replicate_floor_n", lambda _: next(told))
    found = find_floor(bench, np.concatenate([white(1), white(1)]), 0.7)
    assert found is not None
    expected = (floor_n, FloorSource.REPLICATES) if floor_n else (0.7, FloorSource.CALIBRATION)
    assert (found.value_n, found.source) == expected
