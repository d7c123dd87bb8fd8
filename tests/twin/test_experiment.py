"""The experiments wait long enough and tell when the force has come to stay."""

import math

import numpy as np
import pytest

from gateway.twin import LoadCell, Plant, Regulator, Twin
from gateway.twin.experiment import Dwell, settling_time_s, staircase
from tests.twin.traces import step_response, trace


@pytest.mark.parametrize("lag_s", [0.0, 0.05, 0.2])
@pytest.mark.parametrize("delay_s", [0.0, 0.15])
def test_a_stair_is_read_when_the_force_has_settled_whatever_the_lag(lag_s: float, delay_s: float) -> None:
    plant = Plant(regulator=Regulator(lag_s=lag_s, delay_s=delay_s))
    found = staircase(Twin(plant, 1), [0.0, 2.0, 4.0, 1.0], Dwell())
    np.testing.assert_allclose(found, [0.0, 18.0, 36.0, 9.0], atol=0.03)


def test_readings_of_a_stair_are_averaged() -> None:
    twin = Twin(Plant(cell=LoadCell(noise_n=1.0)), 1)
    single = staircase(twin, [1.0] * 60, Dwell(readings=1))
    averaged = staircase(twin, [1.0] * 60, Dwell(readings=16))
    assert averaged.std() == pytest.approx(single.std() / 4.0, rel=0.35)


def test_a_trace_looks_once_per_interval() -> None:
    times_s = trace(Twin(Plant(), 1), 0.1, lambda running: running.time_s, 0.01)
    np.testing.assert_allclose(times_s, 0.01 * np.arange(1, 11))


def test_settling_is_the_moment_after_which_the_force_stays_within_the_band() -> None:
    lag = Plant(regulator=Regulator(lag_s=0.1))
    found = settling_time_s(step_response(Twin(lag, 1), 5.0), 45.0, 2.0)
    assert found == pytest.approx(0.1 * math.log(45.0 / 2.0), abs=0.002)


def test_a_force_that_leaves_the_band_again_settles_later_or_never() -> None:
    assert settling_time_s(np.array([0.0, 10.0, 13.0, 10.0, 10.0]), 10.0, 1.0) == pytest.approx(0.003)
    assert math.isnan(settling_time_s(np.array([0.0, 10.0, 10.0, 13.0]), 10.0, 1.0))
    assert settling_time_s(np.array([10.0, 10.5]), 10.0, 1.0) == 0.0
