"""What the pictures of a diagnosis show is what was measured: no spike, gap or line is lost when rows are many."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.reports.diagnosis import peaks
from gateway.reports.diagnosis.series import (
    TraceResiduals,
    bin_means,
    dependence,
    direction,
    envelope,
    join_traces,
    most_improved_window,
    occupied_cells,
    spectrum,
)
from tests.reports.fake_diagnosis import trace


def test_a_spike_of_one_row_in_a_million_is_in_the_envelope() -> None:
    time_s = np.arange(1_000_000) / 1000.0
    force_n = np.zeros(time_s.size)
    force_n[654_321] = 9.0
    result = envelope(time_s, force_n, 260)
    assert result.high.max() == 9.0 and result.low.min() == 0.0
    assert result.x.size <= 260
    assert abs(result.x[np.argmax(result.high)] - 654.321) < 1000.0 / 260


def test_few_rows_are_drawn_as_they_are() -> None:
    result = envelope(np.arange(5.0), np.array([1.0, 3.0, 2.0, 5.0, 4.0]), 260)
    assert result.low.tolist() == result.high.tolist() == [1.0, 3.0, 2.0, 5.0, 4.0]


@pytest.mark.parametrize("rows", [100, 100_000])
def test_a_gap_is_not_drawn_over(rows: int) -> None:
    time_s = np.arange(rows) * (100.0 / rows)
    remaining = (time_s < 40.0) | (time_s > 60.0)
    result = envelope(time_s[remaining], np.ones(int(remaining.sum())), 260)
    assert len(result.pieces) == 2
    assert result.x[result.pieces[0]].max() <= 40.0 and result.x[result.pieces[1]].min() >= 60.0


def test_uneven_sampling_is_no_gap() -> None:
    rng = np.random.default_rng(1)
    time_s = np.cumsum(rng.uniform(0.004, 0.006, 20_000))
    assert len(envelope(time_s, np.ones(20_000), 260).pieces) == 1


def test_every_point_is_in_a_cell_that_is_drawn() -> None:
    rng = np.random.default_rng(2)
    x, y = rng.uniform(0, 10, 5000), rng.normal(size=5000)
    cells = {tuple(cell) for cell in occupied_cells(x, y, (50, 30), (0.0, 10.0, -5.0, 5.0)).tolist()}
    places = zip((x / 10 * 50).astype(int).tolist(), ((y + 5) / 10 * 30).astype(int).tolist(), strict=True)
    assert all(place in cells for place in places)


def test_noise_on_a_pressure_is_no_change_of_direction() -> None:
    rng = np.random.default_rng(3)
    up = np.linspace(0.0, 5e5, 3000)
    pressure_pa = np.concatenate([up, up[::-1]]) + rng.normal(0.0, 500.0, 6000)
    measurement = replace(trace(rows=6000).measurement, command_v=None, pressure_pa=pressure_pa)
    ways = direction(measurement)
    assert (ways[200:2900] == 1.0).all() and (ways[3300:] == -1.0).all()


def test_on_a_stair_the_direction_is_that_of_the_last_step() -> None:
    volts = np.repeat([0.0, 1.0, 2.0, 1.0], 100)
    ways = direction(replace(trace(rows=400).measurement, command_v=volts))
    assert ways[:100].tolist() == [0.0] * 100
    assert set(ways[100:300]) == {1.0} and set(ways[300:]) == {-1.0}


def test_a_measured_position_tells_the_direction_better_than_the_command() -> None:
    measurement = replace(trace(rows=400).measurement, position_m=np.linspace(0.01, 0.0, 400))
    assert set(direction(measurement)[20:]) == {-1.0}


def test_the_way_of_the_tool_along_the_workpiece_is_no_direction_of_the_slide() -> None:
    volts = 3.0 + np.sin(np.linspace(0.0, 12.0 * np.pi, 1200))
    plain = replace(trace(rows=1200).measurement, command_v=volts, position_m=None)
    along_m = np.sin(np.linspace(0.0, 7.0 * np.pi, 1200) + 0.4)
    assert np.array_equal(direction(replace(plain, position_m=along_m)), direction(plain))


def test_mains_hum_stands_at_its_frequency_though_rows_are_uneven_and_missing() -> None:
    rng = np.random.default_rng(4)
    time_s = np.cumsum(rng.uniform(0.0045, 0.0055, 12_000))
    remaining = (time_s < 20.0) | (time_s > 23.0)
    values = 0.3 * np.sin(2 * np.pi * 50.0 * time_s) + rng.normal(0.0, 0.1, time_s.size)
    hertz, density = spectrum(time_s[remaining], values[remaining])
    assert abs(hertz[np.argmax(density)] - 50.0) < 0.5
    assert density.max() > 5.0 * np.median(density)


def test_white_noise_has_the_density_that_its_power_says() -> None:
    values = np.random.default_rng(5).normal(0.0, 0.2, 40_000)
    hertz, density = spectrum(np.arange(values.size) / 200.0, values)
    assert np.median(density[hertz < 20.0]) == pytest.approx(0.2 / np.sqrt(100.0), rel=0.15)


def test_three_rows_have_no_spectrum() -> None:
    assert spectrum(np.arange(3.0), np.ones(3))[0].size == 0


def test_dependence_is_the_share_of_the_variance_that_the_means_carry() -> None:
    rng = np.random.default_rng(6)
    x = rng.uniform(-1, 1, 50_000)
    y = x + rng.normal(0.0, np.sqrt(1 / 3), x.size)
    assert dependence(x, y) == pytest.approx(0.5, abs=0.02)
    assert dependence(np.ones(x.size), y) == 0.0
    assert dependence(rng.normal(size=x.size), y) < 0.01


def test_means_over_bins_follow_the_shape() -> None:
    x = np.linspace(0.0, 1.0, 3000)
    result = bin_means(x, x**2)
    assert np.allclose(result.mean, result.x**2, atol=1e-3)


def test_residuals_are_measured_minus_simulated_of_judged_rows() -> None:
    one = trace(rows=400)
    rows = join_traces([one, one])
    usable = one.measurement.usable
    expected = (one.measurement.force_n - one.before_n)[usable]
    assert np.array_equal(rows.before_n, np.concatenate([expected, expected]))


def test_a_column_that_only_one_recording_has_is_nan_for_the_other() -> None:
    rows = join_traces([trace(rows=400, odd=np.ones(400)), trace(rows=400)])
    assert np.isfinite(rows.quantities["odd"]).sum() == trace(rows=400).measurement.usable.sum()


def test_the_closer_look_is_where_the_gain_is() -> None:
    time_s = np.arange(10_000) / 100.0
    before = np.where((time_s > 70.0) & (time_s < 75.0), 2.0, 0.1)
    start, end = most_improved_window(TraceResiduals(time_s, before, before, np.full(time_s.size, 0.1)))
    assert start <= 71.0 and end >= 74.0


def test_a_spectrum_s_peak_is_found_and_chance_is_none() -> None:
    hertz = np.geomspace(0.1, 100.0, 120)
    noise = 0.02 * np.exp(np.random.default_rng(5).normal(0.0, 0.15, 120))
    assert peaks.spectral_peak(hertz, noise) is None
    noise[90] = 0.07
    found = peaks.spectral_peak(hertz, noise)
    assert found is not None and found.x == hertz[90]
    assert peaks.spectral_peak(hertz[:8], noise[:8]) is None


def test_what_happens_at_a_moment_is_told_from_the_drive() -> None:
    time_s = np.arange(0.0, 20.0, 0.05)
    volts = np.interp(time_s, [0.0, 5.0, 10.0, 15.0, 20.0], [0.0, 4.0, 4.0, 1.0, 1.0])
    one = replace(trace(rows=time_s.size).measurement, time_s=time_s, command_v=volts)
    assert peaks.describe_moment(one, 3.0) == "while the command moves from 1.64 to 2.40 V"
    assert peaks.describe_moment(one, 8.0) == "with the command at rest at 4.00 V"
    assert peaks.describe_moment(one, 10.3) == "within a second after a reversal"
    assert peaks.describe_moment(replace(one, command_v=np.full(time_s.size, 2.0)), 8.0) == "with the command constant"
