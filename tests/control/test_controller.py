"""What the controller tells its parts, and says of itself, beside what the force does."""

from dataclasses import replace

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.control import CalibrationInUse, Controller, Defaults
from gateway.control.compensation.compensation import Compensation, OutsideForce
from gateway.registers.words import State
from tests.control.bench import Bench, bsfm, enabled, settings


def test_what_nobody_has_asked_to_stop_has_not_stopped() -> None:
    bench = Bench()
    bench.run(0.1)
    assert bench.last.state is State.OFF and not bench.controller.has_stopped
    bench.controller.stop()
    assert bench.controller.has_stopped


def test_from_the_moment_of_a_stop_on_nothing_else_is_taken() -> None:
    """Also before its first step."""
    bench = enabled()
    bench.force(12.0)
    bench.run(1.0)
    bench.controller.stop()
    bench.force(20.0)
    assert bench.refused and bench.refused.reason is RefusalReason.STOPPING


def test_behind_a_stop_nothing_is_enabled_any_more() -> None:
    """While the valve of a rig goes to where it rests, or a guardian has not ended it yet."""
    bench = Bench()
    bench.run(0.5)
    bench.controller.stop()
    bench.step()
    assert bench.last.enable_block is RefusalReason.NOT_READY
    bench.enable(10.0)
    assert bench.refused and bench.refused.reason is RefusalReason.NOT_READY
    assert bench.last.state is State.OFF


def test_each_calibration_that_is_used_brings_the_noise_that_it_has_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[float] = []
    bench = Bench()
    monkeypatch.setattr(bench.controller._faults, "expect_noise", told.append)
    bench.controller.use(CalibrationInUse(bsfm(), 2, noise_n=0.07))
    assert told == [0.07] and bench.controller.calibration_id == 2


def test_a_force_that_is_missed_is_told_with_the_weight_that_presses() -> None:
    bench = enabled(air=False)
    bench.write(force_setpoint_n=30.0, payload_kg=0.5)
    bench.run(5.0)
    (told,) = (event for event in bench.events if event.startswith("A301"))
    assert "4.9 N measured" in told


@pytest.mark.parametrize(("direction", "outside_n"), [(1.0, 5.0), (-1.0, -5.0)])
def test_what_presses_from_outside_is_against_a_pull(direction: float, outside_n: float) -> None:
    known = Compensation(outside=OutsideForce(tilt_n=5.0))
    controller = Controller(settings(), CalibrationInUse(bsfm(), 1), compensation=known)
    controller._conditioner.direction = direction
    assert controller._outside_n == outside_n and controller._given_n == outside_n


def test_a_payload_that_presses_alone_is_no_residual_of_the_model() -> None:
    bench = enabled(air=False)
    bench.write(payload_kg=0.5)
    bench.run(1.0)
    assert bench.last.force_measured_n == pytest.approx(4.9, abs=0.2)
    assert bench.last.model_residual_n == pytest.approx(0.0, abs=0.2)


def test_a_stop_is_over_before_the_guardian_would_end_it_however_slow_the_rigs_ramp_is() -> None:
    slow = replace(settings(), defaults=Defaults(force_ramp_n_per_s=1.0))
    bench = enabled(slow)
    bench.write(force_setpoint_n=45.0, force_ramp_n_per_s=400.0)
    bench.run(1.0)
    bench.controller.stop()
    assert bench.seconds_until(lambda output: bench.controller.has_stopped, 6.0) < 4.1
