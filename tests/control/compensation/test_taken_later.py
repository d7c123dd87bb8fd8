"""A compensation that is taken while the output is off is one that was there from the start, and never taken under force."""

import pytest

from gateway.control import (
    NO_COMPENSATION,
    CalibrationInUse,
    CellMap,
    Compensation,
    Controller,
    OutsideForce,
    TimingCompensation,
)
from gateway.registers.words import ControlBit
from tests.control.bench import Bench, bsfm

PARTS = {
    "nothing": NO_COMPENSATION,
    "cell": Compensation(cell=CellMap(quadratic_per_n=2.0e-3, zero_n=0.4)),
    "outside": Compensation(outside=OutsideForce(tilt_n=2.0)),
    "timing": Compensation(timing=TimingCompensation(delay_s=0.03, lags_s=0.2, more_s=0.08, more_lag_s=0.05)),
}
IN_USE = CalibrationInUse(bsfm(), 1)


def course(begins: Compensation, *later: Compensation) -> list[float]:
    """Voltages and measured forces of a rig that takes compensations one after the other, and is tared before the last."""
    bench = Bench(seed=3)
    bench.controller = Controller(bench.settings, IN_USE, compensation=begins)
    for compensation in later:
        bench.run(0.3)
        bench.write(control_word=ControlBit.TARE)
        assert bench.refused is None
        bench.controller.compensate(bench.settings, compensation, IN_USE)
    bench.run(0.3)
    bench.history.clear()
    bench.enable()
    for force_n in (20.0, 35.0, 10.0):
        bench.force(force_n)
        bench.run(0.3)
    return [number for one in bench.history for number in (one.output.voltage_v, one.output.force_measured_n)]


@pytest.mark.parametrize("name", PARTS)
def test_a_compensation_taken_later_is_as_one_from_the_start(name: str) -> None:
    own, other = PARTS[name], PARTS["outside" if name == "cell" else "cell"]
    assert course(NO_COMPENSATION, other, own) == pytest.approx(course(own, own, own), abs=0.06)


def test_under_force_none_is_taken() -> None:
    bench = Bench()
    bench.run(0.3)
    bench.enable(20.0)
    bench.run(0.6)
    with pytest.raises(ValueError, match="only while the output is disabled"):
        bench.controller.compensate(bench.settings, PARTS["cell"], IN_USE)


def test_readings_straightened_otherwise_are_no_zero() -> None:
    bench = Bench()
    bench.run(0.3)
    bench.controller.compensate(bench.settings, PARTS["cell"], IN_USE)
    bench.write(control_word=ControlBit.TARE)
    assert bench.refused and "usable samples" in bench.refused.text


@pytest.mark.parametrize("name", PARTS)
def test_a_compensation_of_one_part_is_one(name: str) -> None:
    assert PARTS[name].is_null is (name == "nothing")
