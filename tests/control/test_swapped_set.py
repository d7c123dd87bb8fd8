"""A calibration that is swapped while a force is held, and what is left of it when the output goes off."""

import pytest

from gateway.control import CalibrationInUse
from tests.control.bench import bsfm
from tests.control.test_settling import enabled


def test_what_a_swap_carries_over_ends_with_the_output():
    """Volts of the set before, added to the next enable's."""
    swapped, fresh = enabled(), enabled()
    swapped.force(20.0)
    swapped.run(1.0)
    swapped.controller.use(CalibrationInUse(bsfm(scale=1.2), 2))
    fresh.controller.use(CalibrationInUse(bsfm(scale=1.2), 2))
    fed_v = []
    for bench in (swapped, fresh):
        bench.disable()
        bench.run(1.0)
        bench.enable(20.0)
        bench.seconds_until(lambda output: output.force_applied_n >= 20.0, 3.0)
        fed_v.append(bench.last.feedforward_v)
    assert fed_v[0] == pytest.approx(fed_v[1], abs=0.01)
