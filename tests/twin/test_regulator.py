"""Laws of the regulator: steps, dead band, play, supply, delay, slew, lag."""

import math

import numpy as np
import pytest

from gateway.twin import Plant, Regulator, Twin
from gateway.twin.experiment import Floats
from gateway.twin.regulator import RegulatorState
from tests.twin.traces import trace

STEP_PA = 0.9e6 / 1023


def pressures(regulator: Regulator, voltages_v: list[float], each_s: float = 0.002) -> list[float]:
    twin, found = Twin(Plant(regulator=regulator), 1), []
    for voltage_v in voltages_v:
        twin.command(voltage_v)
        twin.advance(each_s)
        found.append(float(twin.pressure_pa))
    return found


def pressure_trace(regulator: Regulator, voltage_v: float, duration_s: float) -> Floats:
    twin = Twin(Plant(regulator=regulator), 1)
    twin.command(voltage_v)
    return trace(twin, duration_s, lambda running: running.pressure_pa)


def test_ten_bits_give_1024_pressures_and_none_beyond_full_scale() -> None:
    regulator = Regulator(command_step_v=10.0 / 1023)
    found = pressures(regulator, list(np.linspace(-0.5, 10.5, 5001)), 0.001)
    counts = np.unique(np.round(np.array(found) / STEP_PA, 6))
    np.testing.assert_array_equal(counts, np.arange(1024))


def test_a_command_that_is_a_step_already_is_not_moved() -> None:
    regulator = Regulator(command_step_v=0.009775171065493646)
    for count in range(1024):
        assert pressures(regulator, [count * 10.0 / 1023], 0.001)[0] == pytest.approx(count * STEP_PA, abs=1.0e-6)


def test_a_change_within_the_dead_band_is_not_noticed_and_a_ladder_is_followed_exactly() -> None:
    regulator = Regulator(dead_band_pa=1800.0)  # 0.02 V
    assert pressures(regulator, [5.0, 5.015, 4.985, 5.0]) == pytest.approx([4.5e5] * 4)
    ladder = [0.1 * i for i in (*range(1, 11), *range(9, -1, -1))]
    assert pressures(regulator, ladder) == pytest.approx([9.0e4 * v for v in ladder])


def test_play_lags_half_a_width_behind_in_either_direction() -> None:
    found = pressures(Regulator(hysteresis_pa=9000.0), [5.0, 5.05, 5.0, 4.0])
    assert found == pytest.approx([445500.0, 450000.0, 450000.0, 364500.0])


def test_what_the_dead_band_passes_over_is_a_change_of_what_was_asked_for_not_of_what_came_of_it() -> None:
    found = pressures(Regulator(hysteresis_pa=9000.0, dead_band_pa=1800.0), [5.0, 5.015, 5.025])
    assert found == pytest.approx([445500.0, 445500.0, 447750.0])


def test_the_supply_is_a_ceiling() -> None:
    assert pressures(Regulator(supply_pa=5.0e5), [4.0, 6.0, 10.0, 5.0]) == pytest.approx([3.6e5, 5.0e5, 5.0e5, 4.5e5])


@pytest.mark.parametrize("delay_s", [0.001, 0.0073, 0.08])
def test_a_delay_never_acts_early_and_ends_on_time(delay_s: float) -> None:
    found = pressure_trace(Regulator(delay_s=delay_s), 5.0, 0.1)
    prompt = pressure_trace(Regulator(), 5.0, 0.1)
    first = int(np.flatnonzero(found)[0]) - int(np.flatnonzero(prompt)[0])
    assert first == math.ceil(delay_s / 0.001 - 1.0e-9) - (delay_s == 0.0073)  # a fraction is interpolated
    assert found[math.ceil(delay_s / 0.001)] == pytest.approx(4.5e5)
    assert np.all(found[: math.floor(delay_s / 0.001 + 1.0e-9)] == 0.0)


def test_a_fractional_delay_shifts_the_centre_of_a_step_by_just_that() -> None:
    area_under = [
        pressure_trace(Regulator(delay_s=delay_s), 10.0, 0.05).sum() * 0.001 / 0.9e6 for delay_s in (0.0, 0.0073)
    ]
    assert area_under[0] - area_under[1] == pytest.approx(0.0073, abs=1.0e-9)


def test_a_step_in_which_a_command_arrives_has_the_mean_of_what_was_there() -> None:
    """Of a regulator without any lag, from one pressure to another: not the sum of both."""
    step_s = 0.001
    state = RegulatorState(Regulator(delay_s=1.25 * step_s), step_s)
    found = []
    for voltage_v in (4.0, 4.0, 4.0, 8.0, 8.0, 8.0, 8.0):
        state.command(voltage_v)
        found.append(state.step() / 0.9e6)
    assert found == pytest.approx([0.0, 0.3, 0.4, 0.4, 0.7, 0.8, 0.8])


def test_a_lag_is_exact_for_a_held_command() -> None:
    found = pressure_trace(Regulator(lag_s=0.06), 10.0, 0.3)
    time_s = 0.001 * np.arange(1, 301)
    np.testing.assert_allclose(found, 0.9e6 * (1.0 - np.exp(-time_s / 0.06)), rtol=1.0e-12)


def test_two_lags_never_overshoot() -> None:
    found = pressure_trace(Regulator(lag_s=0.05, second_lag_s=0.02), 10.0, 0.5)
    assert np.all(np.diff(found) > 0.0)
    assert found[-1] <= 0.9e6


def test_the_slew_limit_bounds_the_rate() -> None:
    found = pressure_trace(Regulator(slew_pa_per_s=1.0e6), 5.0, 0.6)
    assert np.abs(np.diff(found)).max() == pytest.approx(1000.0)
    assert found[-1] == pytest.approx(4.5e5)


def test_without_air_the_pressure_falls_with_the_lag_and_returns() -> None:
    twin = Twin(Plant(regulator=Regulator(lag_s=0.05)), 1)
    twin.command(5.0)
    twin.advance(1.0)
    twin.set_air(False)
    twin.advance(0.05)
    assert twin.pressure_pa == pytest.approx(4.5e5 / math.e, rel=1.0e-6)
    twin.set_air(True)
    twin.advance(1.0)
    assert twin.force_n == pytest.approx(45.0, rel=1.0e-6)


@pytest.mark.parametrize("voltage_v", [math.nan, math.inf, -math.inf])
def test_a_command_that_is_not_finite_is_refused(voltage_v: float) -> None:
    with pytest.raises(ValueError, match="not finite"):
        Twin(Plant(), 1).command(voltage_v)
