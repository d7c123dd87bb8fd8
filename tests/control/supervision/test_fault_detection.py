"""Each bound of the fault detection to the sample: one earlier is a false alarm, one later is a force too long."""

from dataclasses import replace

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.control import LineStatus
from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.fault_detection import FaultDetector
from gateway.control.supervision.plausibility import ExpectedForce, RiseCheck
from gateway.devices.messages import ForceSample
from gateway.registers.words import State
from tests.control.bench import Bench, bsfm, has_fault, settings
from tests.faults.test_control_reactions import pressing


@pytest.mark.parametrize("force_n", [70.0, -70.0])
def test_the_third_sample_over_the_force_stops_it_and_the_second_does_not(force_n: float) -> None:
    """Either way: what is pulled as hard breaks as much."""
    bench = pressing(12.0)
    assert bench.settings.limits.over_force_samples == 3
    heard: list[FaultCode] = []

    def over(sample: ForceSample) -> ForceSample:
        heard.append(bench.last.fault)
        return replace(sample, force_n=force_n)

    bench.alter_sample = over
    bench.run(0.1)
    assert heard[:3] == [FaultCode.NONE] * 3, "before the third arrives"
    assert heard[3] is FaultCode.OVER_FORCE, "before the fourth does"


def test_an_enable_is_kept_back_while_a_force_stays_at_the_safe_voltage_and_not_longer() -> None:
    bench = Bench()
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + 30.0)
    bench.run(5.0)
    bench.enable(12.0)
    assert bench.refused is not None and bench.refused.reason is RefusalReason.NOT_READY
    bench.alter_sample = lambda sample: sample
    bench.run(0.1)
    bench.enable(12.0)
    assert bench.refused is None and bench.run(1.5).state is State.HOLDING


def test_a_cell_that_repeats_itself_while_the_force_must_move_is_found_however_many_repeats_the_rig_allows() -> None:
    bench = pressing(10.0, settings(frozen_equal_samples=100_000))
    bench.cell_frozen = True
    bench.force(35.0)
    bench.run(2.0)
    assert bench.last.fault is FaultCode.SAMPLE_FROZEN
    assert any("while the force must have changed" in event for event in bench.events)


def test_what_the_loop_has_told_as_frozen_teaches_nothing_however_long_it_went_on() -> None:
    bench = Bench(seed=3, noise_n=0.12)
    bench.run(1.0)
    for _ in range(2):
        bench.enable(12.0)
        bench.run(6.0)
        bench.cell_frozen = True
        assert bench.seconds_until(has_fault(FaultCode.SAMPLE_FROZEN), 3.0) <= 2.0
        bench.run(20.0)
        bench.cell_frozen = False
        bench.run(1.0)
        bench.reset()
        assert bench.last.state is State.OFF


def test_an_enable_begins_without_what_was_found_before_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also in the step of the enable itself, which may come with no new sample."""
    monkeypatch.setattr(RiseCheck, "judge", lambda *_: FaultCode.GAIN_WRONG)
    detector, reading = FaultDetector(settings()), Reading(50.0, 70.0, 0.0, 0.01, True, True, True)
    response = ExpectedForce(bsfm(), 0.1, 0.0)
    for _ in range(3):
        detector.observe(reading, response, 1.0, True)
    line = LineStatus(acknowledged_v=0.0)

    def first_fault() -> FaultCode:
        cause = detector.first_cause(1.0, reading, line, lambda: 10.0)
        return cause.fault if cause else FaultCode.NONE

    assert first_fault() is FaultCode.OVER_FORCE
    lost = detector.first_cause(1.0, reading, line._replace(cell_lost=True), lambda: 10.0)
    assert lost and lost.fault is FaultCode.CELL_LOST, "what makes others follow comes first"
    detector.observe(reading._replace(contact_n=5.0), response, 1.0, True)
    assert first_fault() is FaultCode.GAIN_WRONG
    detector.start()
    assert first_fault() is FaultCode.NONE
