"""An output that went off has forgotten what it did: the next force goes as it would behind a start."""

from collections.abc import Callable
from dataclasses import replace
from random import Random

import pytest

from gateway.bsfm import Bsfm
from gateway.bsfm.model import Response
from gateway.codes.faults import FaultCode
from gateway.control import CalibrationInUse, Controller
from gateway.registers.words import ControlBit, LimitedBy, Mode, State, StatusBit
from tests.control.bench import Bench, SmallPlant, bsfm, settings
from tests.control.runs.test_ladder_run import SHORT
from tests.control.test_slip import slip

RESPONSE = Response(dead_time_s=0.02, lag_s=0.08)
TWO_BRANCHES = bsfm()


def _hold_where_the_model_is_off(bench: Bench) -> None:
    bench.plant.gain_n_per_v = 6.6
    bench.enable(30.0)
    bench.run(1.5)
    assert bench.last.trim_v > 0.05


def _follow_a_path(bench: Bench) -> None:
    bench.enable(20.0)
    bench.run(0.6)
    for k in range(12):
        bench.force(20.0 + k)
        bench.run(0.03)


def _ramp(bench: Bench) -> None:
    bench.enable(45.0)
    bench.run(0.2)


def _drive_a_voltage(bench: Bench) -> None:
    bench.voltage(4.0)
    bench.run(0.4)


def _lose_contact(bench: Bench) -> None:
    bench.enable(30.0)
    bench.run(0.6)
    bench.plant.contact = False
    bench.run(0.3)


def _swap(bench: Bench) -> None:
    in_use = bench.controller._calibration
    bench.enable(25.0)
    bench.run(0.6)
    bench.controller.use(replace(in_use, model=bsfm(1.3), number=2))
    bench.run(0.1)
    bench.controller.use(in_use)
    bench.run(0.05)


def _run(bench: Bench) -> None:
    bench.controller.active_run.ask(SHORT)
    bench.run(6.0)
    assert bench.last.state is State.CALIBRATING
    bench.controller.active_run.ask_stop("calibration stopped by a person")
    bench.run(1.0)


def _fail(bench: Bench) -> None:
    _hold_where_the_model_is_off(bench)
    bench.line = bench.line._replace(fault=FaultCode.OUTPUT_LOST)
    bench.run(0.05)
    bench.line = bench.line._replace(fault=FaultCode.NONE)
    bench.reset()


LIVES: tuple[Callable[[Bench], None], ...] = (
    _hold_where_the_model_is_off, _follow_a_path, _ramp, _drive_a_voltage, _lose_contact, _swap, _run, _fail,
)  # fmt: skip


def course(response: Response | None, life: Callable[[Bench], None] | None, model: Bsfm = TWO_BRANCHES) -> list[float]:
    bench = Bench(noise_n=0.0)
    bench.controller = Controller(bench.settings, CalibrationInUse(model, 1, response))
    bench.run(0.5)
    if life:
        life(bench)
        bench.write(control_word=ControlBit(0), mode=Mode.FORCE)
        bench.run(1.0)
    bench.plant = SmallPlant(Random(7), noise_n=0.0)
    bench.run(1.0)
    assert bench.last.state is State.OFF
    bench.history.clear()
    bench.enable(20.0, mode=Mode.FORCE)
    bench.run(0.5)
    bench.force(35.0)
    bench.run(0.3)
    assert bench.last.fault is FaultCode.NONE
    return [number for one in bench.history for number in (one.output.voltage_v, float(one.output.limited_by))]


@pytest.mark.sampled
@pytest.mark.parametrize("life", LIVES, ids=lambda life: life.__name__.strip("_"))
def test_behind_whatever_was_before_an_enable_begins_as_behind_a_start(life: Callable[[Bench], None]) -> None:
    assert course(None, life) == pytest.approx(course(None, None), abs=1.0e-6)


@pytest.mark.sampled
@pytest.mark.parametrize("life", LIVES, ids=lambda life: life.__name__.strip("_"))
def test_where_a_vented_tool_starts_apart_from_one_that_lost_its_contact_it_does_so_too(
    life: Callable[[Bench], None],
) -> None:
    """Who was in contact before the output went off has lost none while it was off."""
    assert course(None, life, slip()) == pytest.approx(course(None, None, slip()), abs=1.0e-6)


@pytest.mark.parametrize("life", [_ramp, _drive_a_voltage], ids=lambda life: life.__name__.strip("_"))
def test_it_does_so_by_a_measured_response_where_the_trim_has_learned_no_noise(life: Callable[[Bench], None]) -> None:
    assert course(RESPONSE, life) == pytest.approx(course(RESPONSE, None), abs=5.0e-3)


def test_an_enable_right_behind_a_disable_begins_its_contact_ramp_anew() -> None:
    """The tool is in contact still: what began with the contact of before is over."""
    bench = Bench()
    bench.run(0.5)
    bench.enable(30.0, contact_ramp_s=1.0)
    bench.run(2.0)
    bench.disable()
    bench.run(0.05)
    bench.enable(30.0)
    assert bench.last.status & StatusBit.CONTACT
    bench.run(0.5)
    assert 12.0 < bench.last.force_applied_n < 18.0


def test_what_limited_the_voltage_limits_nothing_behind_a_disable() -> None:
    bench = Bench()
    bench.run(0.5)
    bench.voltage(9.0)
    assert bench.last.limited_by is LimitedBy.VOLTAGE_SLEW
    output = bench.disable()
    assert output.limited_by is LimitedBy.NONE and not output.status & StatusBit.LIMITED


def test_equal_readings_before_an_enable_are_no_frozen_cell_behind_it() -> None:
    """A quiet cell in free air rightly repeats itself, also where the rig says how often is too often."""
    bench = Bench(settings(frozen_equal_samples=20), noise_n=0.0)
    bench.run(1.0)
    bench.enable(20.0)
    assert bench.run(0.1).fault is FaultCode.NONE


def test_an_overload_before_an_enable_keeps_it_back_and_does_not_count_behind_it() -> None:
    bench = Bench()
    bench.run(0.5)
    bench.alter_sample = lambda sample: replace(sample, force_n=70.0)
    bench.run(0.025)
    bench.enable(0.0)
    assert bench.refused is not None and bench.last.state is State.OFF
    bench.alter_sample = lambda sample: sample
    bench.run(0.01)
    bench.enable(0.0)
    assert bench.refused is None
    bench.alter_sample = lambda sample: replace(sample, force_n=70.0)
    bench.run(0.01)
    assert bench.last.fault is FaultCode.NONE
    assert bench.run(0.05).fault is FaultCode.OVER_FORCE


def test_what_is_off_is_neither_in_band_nor_unreachable() -> None:
    bench = Bench()
    bench.run(0.5)
    for contact, bit in ((True, StatusBit.IN_BAND), (False, StatusBit.TARGET_UNREACHABLE)):
        bench.plant.contact = contact
        bench.enable(30.0)
        assert bench.run(4.0).status & bit
        assert not bench.disable().status & (StatusBit.IN_BAND | StatusBit.TARGET_UNREACHABLE)
        bench.run(1.0)


def test_a_force_that_was_pressed_from_outside_before_an_enable_is_not_stuck_behind_it() -> None:
    """What stays is measured from the moment at which the output goes off, and not from before it went on."""
    bench = Bench(settings(response_lag_s=0.2), lag_s=0.2)
    bench.run(0.5)
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + 20.0)
    bench.run(0.95)
    bench.alter_sample = lambda sample: sample
    bench.enable(40.0)
    assert bench.refused is None
    bench.run(2.0)
    bench.disable()
    output = bench.run(0.25)
    assert output.force_measured_n > bench.settings.supervision.stuck_n, "it is on its way to 0"
    assert not output.enable_block and not any("stuck" in sentence for sentence in bench.events)
