"""One settled point per dwell; what is on its way is none."""

import numpy as np
import pytest

from gateway.bsfm.ladder.settled_points import find_settled_points


@pytest.mark.parametrize("rate_hz", [10.0, 25.0, 100.0])
def test_the_one_reading_of_a_slew_is_no_point_however_slow_the_readings(rate_hz: float) -> None:
    """A stair goes up over a voltage that lasts one row, whose force is still the one of before."""
    volts, forces = [0.0] * 20, [0.0] * 20
    for stair in (2.0, 4.0):
        volts += [stair - 1.0, *[stair] * round(1.5 * rate_hz)]
        forces += [forces[-1], forces[-1], *np.full(round(1.5 * rate_hz) - 1, 10.0 * stair)]
    times = np.arange(len(volts)) / rate_hz
    points = find_settled_points(times, np.array(volts), np.array(forces))
    assert points.voltage_v.tolist() == [0.0, 2.0, 4.0]
    assert points.force_n.tolist() == pytest.approx([0.0, 20.0, 40.0])
