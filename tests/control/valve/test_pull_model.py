"""What a tool that pulls is calculated with: its own model or the share of the area; weights count the other way."""

from dataclasses import replace

import pytest

from gateway.bsfm import LinearBlend
from gateway.control import Controller
from gateway.control.compensation.compensation import Compensation, OutsideForce
from gateway.control.inputs import CalibrationInUse
from gateway.control.valve.pull_model import scale_forces
from gateway.registers.words import ControlBit, LimitedBy, State
from gateway.units import STANDARD_GRAVITY_M_PER_S2
from tests.control.bench import bsfm, settings
from tests.control.valve.valve_bench import BIT_4, ENABLE, PULL, SHARE, ValveBench


def test_the_payloads_weight_counts_the_other_way() -> None:
    """A tool that points down with 0.5 kg presses with 4.9 N: pulling 10 N up, the slide gives 14.9 N."""
    bench = ValveBench()
    bench.run(1.0)
    bench.write(control_word=ENABLE | BIT_4, force_setpoint_n=10.0, payload_kg=0.5)
    bench.run(4.0)
    assert bench.last.state is State.HOLDING
    assert bench.plant.force_n == pytest.approx(14.9, abs=1.0)
    assert bench.last.force_measured_n == pytest.approx(-10.0, abs=1.0)


def test_a_compensated_force_from_outside_counts_against_a_pull() -> None:
    """5 N that press at this tilt: to pull with 10 N the slide gives 15 N, and the cell feels no more than it is told to."""
    bench = ValveBench()
    outside = Compensation(outside=OutsideForce(tilt_n=5.0))
    bench.controller = Controller(bench.settings, CalibrationInUse(bsfm(), 1), compensation=outside)
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + 5.0)
    bench.pulling(10.0)
    assert bench.last.state is State.HOLDING
    assert bench.plant.force_n == pytest.approx(15.0, abs=1.0)
    assert bench.last.model_residual_n == pytest.approx(0.0, abs=2.5)


def test_a_tare_while_the_tool_pulls_takes_the_same_zero_as_one_while_it_pushes() -> None:
    """The zero is the cell's: 0.5 kg that hang on it weigh the same whichever way the tool acts. It is 1.3 N off."""
    bench = ValveBench()
    bench.alter_sample = lambda sample: replace(sample, force_n=1.3 + min(sample.force_n, -4.9))
    bench.run(1.0)
    bench.write(control_word=ENABLE | BIT_4, payload_kg=0.5)
    bench.run(2.0)
    bench.write(control_word=ENABLE | BIT_4 | ControlBit.TARE)
    bench.run(0.2)
    assert bench.refused is None and bench.stands is PULL
    assert bench.last.force_measured_n == pytest.approx(0.0, abs=0.2)
    assert bench.controller.zero_n == pytest.approx(1.3, abs=0.1)
    bench.write(control_word=ENABLE | BIT_4, force_setpoint_n=10.0)
    bench.run(3.0)
    assert bench.last.state is State.HOLDING and bench.plant.force_n == pytest.approx(14.9, abs=1.0)


def test_a_heavy_tool_is_no_reason_against_a_tare_while_it_pulls() -> None:
    """Weighed the wrong way round its weight counts twice, and was a force that stays."""
    bench, weight_n = ValveBench(), 0.35 * settings().supervision.saturation_n
    bench.alter_sample = lambda sample: replace(sample, force_n=min(sample.force_n, -weight_n))
    payload_kg = weight_n / STANDARD_GRAVITY_M_PER_S2
    bench.write(payload_kg=payload_kg)
    bench.run(1.0)
    bench.write(control_word=ENABLE | BIT_4, payload_kg=payload_kg)
    bench.run(2.0)
    bench.write(control_word=ENABLE | BIT_4 | ControlBit.TARE, payload_kg=payload_kg)
    assert bench.refused is None and bench.stands is PULL
    assert bench.controller.zero_n == pytest.approx(0.0, abs=0.2)


def test_a_measured_model_of_pulling_counts_in_place_of_the_derived_one_whichever_set_it_came_with() -> None:
    measured = [scale_forces(bsfm(), share) for share in (0.5, 0.6)]
    bench = ValveBench()
    bench.controller = Controller(bench.settings, CalibrationInUse(bsfm(), 1, pull_model=measured[0]))
    bench.pulling(12.0)
    assert bench.last.feedforward_v == pytest.approx(measured[0].voltage_v(12.0, 1.0)[0], abs=0.05)
    bench.controller.use(CalibrationInUse(bsfm(), 2, pull_model=measured[1]))
    bench.run(2.0)
    assert bench.last.feedforward_v == pytest.approx(measured[1].voltage_v(12.0, 1.0)[0], abs=0.05)


def test_the_derived_model_is_that_of_pushing_by_the_share_of_the_area() -> None:
    model, pull = bsfm(), scale_forces(bsfm(), SHARE)
    for share in (-1.0, 0.0, 1.0):
        assert pull.force_n(4.0, share) == pytest.approx(SHARE * model.force_n(4.0, share))
    assert pull.force_range_n[1] == pytest.approx(SHARE * model.force_range_n[1])


def test_what_happens_when_a_pull_turns_round_is_that_of_pushing_by_the_share_of_the_area() -> None:
    """A span in newtons and limits of the set's own are forces like any other."""
    model = replace(bsfm(span_n=6.0), limits_n=(2.0, 40.0))
    pull = scale_forces(model, SHARE)
    assert isinstance(pull.reversal, LinearBlend)
    assert pull.reversal.span_n == pytest.approx(SHARE * 6.0)
    assert pull.limits_n == pytest.approx((SHARE * 2.0, SHARE * 40.0))


def test_a_pull_that_a_calibration_has_lowered_is_trimmed_as_any_other() -> None:
    """Nobody asks less of the voltage than what the calibration says: only the setpoint is bounded."""
    bench = ValveBench().pulling(15.0)
    bench.controller.use(CalibrationInUse(replace(bsfm(), limits_n=(0.0, 14.0)), 2))
    bench.run(3.0)
    assert bench.last.limited_by is LimitedBy.FORCE_RANGE and bench.last.force_accepted_n == SHARE * 14.0
    assert bench.plant.force_n == pytest.approx(SHARE * 14.0, abs=0.5)
    assert bench.last.state is State.HOLDING
