"""Words for what stands out: where it is, which way, and what the drive does there; and shares that are told in words."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.diagnosis.result import Baseline, Extended, FloorSource, Gain
from gateway.reports.diagnosis import wording as words
from gateway.reports.diagnosis.peaks import Peak, describe_moment, largest
from tests.reports.fake_diagnosis import FRICTION, diagnosis, trace


def test_what_stands_out_most_may_be_below_zero() -> None:
    x, y = np.array([1.0, 2.0, 3.0, 4.0]), np.array([0.5, -2.0, 1.0, np.nan])
    assert largest(x, y) == Peak(2.0, -2.0)
    assert largest(x, np.full(4, np.nan)) is None


@pytest.mark.parametrize(
    ("time_s", "told"),
    [
        (5.0, "with the command at rest at 2.25 V"),
        (10.5, "while the command moves from 2.48 to 4.00 V"),
        (15.5, "within a second after a reversal"),
    ],
)
def test_a_moment_is_told_by_what_the_drive_does_there(time_s: float, told: str) -> None:
    """2 V, to 4 V at 10 s, on to 6 V at 15 s and back to 5 V at once; at rest it creeps by a hundredth of its way."""
    times_s = np.arange(4000) / 200.0
    volts = np.where(times_s < 10.0, 2.0 + 0.05 * times_s, np.where(times_s < 15.0, 4.0, 6.0))
    volts = np.where(times_s >= 15.2, 5.0, volts)
    measurement = replace(trace(rows=4000).measurement, time_s=times_s, command_v=volts, position_m=None)
    assert describe_moment(measurement, time_s) == told


def test_the_share_that_is_explained_is_of_the_squared_error_above_the_noise() -> None:
    cause = replace(FRICTION, gain=Gain(2.0, 1.0, (0.0, 0.0), 0.1))
    answer = diagnosis(causes=(cause,), baseline=Baseline(2.0, 0.5, 100, 10.0), extended=Extended(1.5, False))
    assert words.explained_share(answer) == pytest.approx((4.0 - 2.25) / (4.0 - 0.25))


@pytest.mark.parametrize(
    ("source", "told"),
    [
        (FloorSource.GIVEN, "as given"),
        (FloorSource.REPLICATES, "from repeated cycles"),
        (FloorSource.RESTS, "from rests"),
        (FloorSource.CALIBRATION, "from the calibration"),
        (FloorSource.SEARCH, "estimated"),
    ],
)
def test_the_origin_of_the_noise_floor_is_told(source: FloorSource, told: str) -> None:
    assert words.floor_source(diagnosis(baseline=Baseline(2.0, 0.5, 100, 10.0, source))) == told
