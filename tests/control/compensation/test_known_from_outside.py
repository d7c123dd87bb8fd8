"""A force that is known to come from outside (the tool's weight by its tilt) is no wrong reading of the load cell."""

from dataclasses import replace

import pytest

from gateway.codes.faults import FaultCode
from gateway.control import CalibrationInUse, Compensation, Controller, OutsideForce, Supervision
from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.plausibility import ExpectedForce
from gateway.control.supervision.stuck_sensor import StuckSensorCheck
from gateway.devices.messages import ForceSample
from gateway.registers.words import State
from tests.control.bench import Bench, bsfm, settings
from tests.control.runs.test_ladder_run import SHORT

STEEP = (8.0, 12.0, -12.0)


class WeightBench(Bench):
    """A tool that comes down on the workpiece, and whose weight presses there, or lifts it, besides."""

    def __init__(self, weight_n: float, *, unit: float = 1.0, has_weight: bool = True) -> None:
        super().__init__(settings(), seed=1)
        outside = Compensation(outside=OutsideForce(tilt_n=weight_n))
        self.controller = Controller(self.settings, CalibrationInUse(bsfm(), 1), compensation=outside)
        self._pressed_n, self._unit = weight_n if has_weight else 0.0, unit
        self.alter_sample = self._with_weight
        self.plant.contact = False

    def _with_weight(self, sample: ForceSample) -> ForceSample:
        force_n = sample.force_n + (self._pressed_n if self.plant.contact else 0.0)
        return replace(sample, force_n=self._unit * max(0.0, force_n))

    def come_down(self, force_n: float) -> None:
        self.run(0.3)
        self.enable(force_n)
        self.run(0.5)
        self.plant.contact = True
        self.run(4.0)


@pytest.mark.sampled
@pytest.mark.parametrize("weight_n", STEEP)
@pytest.mark.parametrize("has_weight", [True, False], ids=["there", "taken for zero, or not there"])
def test_the_first_rise_is_judged_with_what_presses_besides(weight_n: float, has_weight: bool) -> None:
    """9 N of a tool that weighs 8 N were A303, kgf and N mixed up: it could not be enabled in this tilt at all."""
    bench = WeightBench(weight_n, has_weight=has_weight)
    bench.come_down(15.0)
    assert bench.last.fault is FaultCode.NONE
    if has_weight:
        assert bench.last.state is State.HOLDING


@pytest.mark.parametrize("weight_n", [0.0, 8.0, 12.0])
def test_newtons_read_as_kilograms_are_found_all_the_same(weight_n: float) -> None:
    bench = WeightBench(weight_n, unit=9.81)
    bench.come_down(15.0)
    assert bench.last.fault in (FaultCode.GAIN_WRONG, FaultCode.OVER_FORCE)
    assert max(record.force_n for record in bench.history) < 5.0, "of the thrust"
    assert any("kgf" in event or "saturated" in event for event in bench.events)


@pytest.mark.parametrize("is_told", [True, False])
def test_a_force_that_stands_while_tool_and_weight_change_places_is_no_dead_cell(is_told: bool) -> None:
    """The tool turns over: what its weight gives no more, the air gives."""
    check, response = StuckSensorCheck(Supervision()), ExpectedForce(bsfm(), 0.02, 0.0)
    reading = Reading(20.0, 20.0, 0.0, 0.01, True, True, True, False, 20.0)
    for k in range(300):
        volts = 1.0 + 0.01 * k
        response.advance(volts, 0.01)
        response.outside_n = 20.0 - bsfm().force_n(volts, 0.0) if is_told else 0.0
        check.observe(reading, response, touching=True)
    assert bool(check.words) is not is_told


def after_a_run(weight_n: float) -> list[float]:
    """Voltages right behind the end of a run that was stopped on a stair."""
    bench = Bench()
    outside = Compensation(outside=OutsideForce(tilt_n=weight_n))
    bench.controller = Controller(bench.settings, CalibrationInUse(bsfm(), 1), compensation=outside)
    bench.run(0.3)
    bench.controller.active_run.ask(SHORT)
    bench.seconds_until(lambda output: output.voltage_v >= 2.0, 60.0)
    bench.run(0.5)
    bench.controller.active_run.ask_stop("stopped")
    return [bench.run(0.01).voltage_v for _ in range(3)]


@pytest.mark.parametrize("weight_n", [5.0, -5.0])
def test_the_way_down_behind_a_run_is_that_of_the_slide_whatever_presses_besides(weight_n: float) -> None:
    assert after_a_run(weight_n) == pytest.approx(after_a_run(0.0), abs=1e-6)
