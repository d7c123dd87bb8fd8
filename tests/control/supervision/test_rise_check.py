"""The first rise of the force, as it is measured: from the force at rest, whenever the output was enabled."""

import pytest

from gateway.codes.faults import FaultCode
from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.plausibility import RiseCheck
from gateway.registers.words import State
from tests.control.bench import Bench

RESTING = Reading(cell_n=1.0, interval_s=0.01, is_new=True, is_fresh=True, is_usable=True)


@pytest.mark.parametrize("before", [1, 2, 5, 50])
def test_a_force_that_stays_has_not_risen_however_soon_behind_the_start_it_is_enabled(before: int) -> None:
    check = RiseCheck(contact_threshold_n=2.0)
    for _ in range(before):
        check.smooth(RESTING)
    check.start()
    for _ in range(50):
        check.smooth(RESTING)
    assert check.measured_rise_n == pytest.approx(0.0)


def test_a_scale_that_was_right_is_looked_at_again_at_the_next_enable() -> None:
    bench = Bench(seed=3)
    bench.run(0.3)
    bench.enable(12.0)
    assert bench.run(2.0).state is State.HOLDING
    bench.disable()
    bench.run(1.0)
    bench.plant.unit = 9.80665
    bench.enable(12.0)
    bench.run(2.0)
    assert bench.last.fault is FaultCode.GAIN_WRONG
