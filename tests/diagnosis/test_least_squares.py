"""The peer of the table of real cylinders: plain least squares of a force that it can say is left at its noise."""

import numpy as np
import pytest

from gateway.diagnosis import Measurement
from tests.diagnosis.machine import measurement, times_s
from tools.bench.cylinders import CylinderResult, columns_of, held_out_rms_n, table

TIME_S = times_s(20.0, 100.0)
NOISE_N = 0.05


def cylinder(*, by_place_n: float) -> Measurement:
    position_mm = 20.0 * np.sin(2.0 * np.pi * TIME_S / 4.0)
    pressure_kpa = 500.0 + 5.0 * np.sin(2.0 * np.pi * TIME_S / 1.3)
    out = np.sign(np.cos(2.0 * np.pi * TIME_S / 4.0))
    force_n = 0.05 * pressure_kpa - out * (2.0 + by_place_n * (position_mm / 40.0) ** 2)
    force_n = force_n + np.random.default_rng(2).normal(0.0, NOISE_N, TIME_S.size)
    return measurement(TIME_S, None, force_n, {"position_mm": position_mm, "pressure_kpa": pressure_kpa})


def test_friction_by_place_and_direction_is_left_at_its_noise() -> None:
    found = cylinder(by_place_n=3.0)
    moving = np.abs(np.cos(2.0 * np.pi * TIME_S / 4.0)) > 0.05
    columns, force_n = columns_of(found)[moving], found.force_n[moving]
    assert held_out_rms_n(columns, force_n) == pytest.approx(NOISE_N, rel=0.1)
    assert held_out_rms_n(columns[:, :3], force_n) > 3.0 * NOISE_N


def test_least_squares_needs_pressure_and_position() -> None:
    with pytest.raises(ValueError, match="needs pressure and position"):
        columns_of(measurement(TIME_S, None, np.zeros(TIME_S.size), {}))


def test_a_recording_in_which_nothing_is_found_says_so() -> None:
    result = CylinderResult("a", 5.04, 1234, 2.0, 1.0, 0.5, 0.4, (), 7.6)
    assert list(table([result]))[-1] == "| a | 5.0 | 1234 | 2.00 | 1.00 | 0.50 | 0.40 | nothing | 8 |"
