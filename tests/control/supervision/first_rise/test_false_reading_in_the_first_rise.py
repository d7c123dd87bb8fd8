"""One false reading of a slow cell in the first rise is neither a wrong sign nor a wrong gain; a wrong cell still is."""

import pytest

from gateway.codes.faults import FaultCode
from gateway.registers.words import State
from tests.control.bench import Bench, has_fault, settings
from tests.control.supervision.readings.test_leaping_readings import spoil


def pressing(force_n: float, seconds: float, every_ms: int = 100) -> Bench:
    bench = Bench(settings(sample_timeout_s=0.25))
    bench.sample_every_ms = every_ms
    bench.run(0.4)
    bench.enable(force_n)
    bench.run(seconds)
    return bench


@pytest.mark.sampled
@pytest.mark.parametrize("said_n", [-95.0, -50.0, 59.0, 95.0])
@pytest.mark.parametrize("seconds", [0.2, 0.35, 0.5, 2.0])
@pytest.mark.parametrize("force_n", [2.0, 5.0, 30.0])
def test_one_false_reading_is_no_fault(force_n: float, seconds: float, said_n: float) -> None:
    bench = pressing(force_n, seconds)
    spoil(bench, said_n)
    bench.run(2.5)
    assert bench.last.fault is FaultCode.NONE, bench.events
    assert bench.last.state is State.HOLDING


@pytest.mark.parametrize("every_ms", [10, 100])
def test_a_cell_whose_sign_turns_under_force_is_still_found_within_a_second(every_ms: int) -> None:
    bench = pressing(30.0, 2.0, every_ms)
    bench.plant.sign = -1.0
    assert bench.seconds_until(has_fault(FaultCode.SIGN_INVERTED), 2.0) < 1.0


@pytest.mark.parametrize(("unit", "force_n", "approach_n"), [(9.80665, 12.0, 2.0), (1.0 / 9.80665, 30.0, 8.0)])
@pytest.mark.parametrize("every_ms", [10, 100])
def test_a_wrong_unit_is_still_found_and_not_as_over_force(
    every_ms: int, unit: float, force_n: float, approach_n: float
) -> None:
    bench = Bench(settings(sample_timeout_s=0.25), unit=unit)
    bench.sample_every_ms = every_ms
    bench.run(0.4)
    bench.enable(force_n, precontact_force_n=approach_n)
    bench.run(3.0)
    assert bench.last.fault is FaultCode.GAIN_WRONG
