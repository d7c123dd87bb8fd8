"""The force loop by itself: what its trim may learn from and how long it keeps it; what a swapped calibration changes."""

from dataclasses import replace

import pytest

from gateway.control import CalibrationInUse, Controller
from gateway.control.compensation.compensation import TimingCompensation
from gateway.control.force_loop.force_loop import ForceLoop
from gateway.control.sample_conditioning import Reading
from gateway.registers.words import LimitedBy
from tests.control.bench import Bench, bsfm, settings
from tests.control.force_loop.test_force_loop import LINE, inputs, loop_of, pressed, wish
from tests.control.test_rest_forgets import RESPONSE


def step(loop: ForceLoop, force_n: float, contact_n: float, ticks: int = 1, **changes: object) -> ForceLoop:
    for _ in range(ticks):
        loop.elapse(0.01, LINE)
        loop.step(wish(force_n, ramp_n_per_s=1e3), inputs(contact_n, **changes))
    return loop


def test_while_the_output_still_climbs_no_error_is_learned() -> None:
    """The force is behind because the voltage is: learned, it would be beyond the target for as long."""
    rig = settings()
    loop = loop_of(replace(rig, limits=replace(rig.limits, voltage_slew_v_per_s=0.5)))
    step(loop, 20.0, 5.0, 200)
    assert loop.limited_by is LimitedBy.VOLTAGE_SLEW and loop.feedforward.reference_n == pytest.approx(20.0, abs=0.1)
    assert loop.trim_v == 0.0


@pytest.mark.parametrize(("contact_n", "learns"), [(21.5, True), (26.0, False)])
def test_a_reading_that_leaps_alone_teaches_nothing(contact_n: float, learns: bool) -> None:
    loop = pressed(loop_of(), 20.0)
    before_v = loop.trim_v
    step(loop, 20.0, contact_n, reading=Reading(contact_n, contact_n, 0.0, 0.01, True, True, True, False, contact_n))
    assert (loop.trim_v != before_v) is learns


def test_what_was_learned_at_one_force_fades_on_the_way_to_another() -> None:
    loop = step(pressed(loop_of(), 10.0), 10.0, 6.0, 20)
    learned_v = loop.trim_v
    assert learned_v > 0.05
    pressed(loop, 40.0, 200)
    assert 0.0 <= loop.trim_v < 0.3 * learned_v


def test_a_setpoint_beyond_the_rig_s_largest_force_is_told_as_limited() -> None:
    loop = pressed(loop_of(), 80.0)
    assert (loop.applied_n, loop.limited_by) == (50.0, LimitedBy.FORCE_RANGE)


def test_the_force_that_is_expected_is_the_new_calibration_s_at_once() -> None:
    loop = pressed(loop_of(), 20.0)
    assert loop.expected_n == pytest.approx(20.0, abs=0.5)
    loop.use(bsfm(2.0), 0.0, settings())
    assert loop.expected_n == pytest.approx(40.0, abs=1.0)


@pytest.mark.parametrize(("unreachable_s", "is_missed"), [(1.0, True), (9.0, False)])
def test_how_long_a_target_may_be_missed_comes_with_the_calibration(unreachable_s: float, is_missed: bool) -> None:
    loop = pressed(loop_of(settings(unreachable_s=3.0)), 20.0)
    loop.use(bsfm(1.1), 0.0, settings(unreachable_s=unreachable_s))
    for tick in range(250):
        step(loop, 20.0, 12.0, now_s=10.0 + 0.01 * tick)
    assert loop.unreachable is is_missed


def test_an_equal_calibration_leaves_the_course_of_the_force_alone() -> None:
    """A course that begins anew on a ramp would be an error for the trim."""
    used, left = loop_of(), loop_of()
    for loop in (used, left):
        loop.take_timing(TimingCompensation(delay_s=0.3, lags_s=0.2))
        loop.use(bsfm(), 0.0, settings())
        step(loop, 20.0, 5.0, 10)
    for _ in range(20):
        used.use(bsfm(), 0.0, settings())
        for loop in (used, left):
            step(loop, 40.0, 5.0)
    assert used.feedforward.reference_n == left.feedforward.reference_n


def held(bench: Bench) -> float:
    """20 N behind a turn, with a trim that has to learn; the voltage."""
    bench.run(0.1)
    bench.enable(30.0)
    bench.run(2.0)
    bench.force(19.0)
    bench.run(0.3)
    bench.force(20.0)
    return bench.run(2.0).voltage_v


@pytest.mark.parametrize("scale", [0.9, 1.1])
def test_a_trim_at_its_limit_makes_no_bump_of_a_swap(scale: float) -> None:
    """What it asks for beyond its limit is not on the output."""
    control = settings()
    bench = Bench(replace(control, trim=replace(control.trim, limit_v=0.3)), gain_n_per_v=6.4)
    bench.controller = Controller(bench.settings, CalibrationInUse(bsfm(), 1, RESPONSE))
    before_v = held(bench)
    assert bench.last.limited_by is LimitedBy.TRIM_RANGE
    bench.controller.use(CalibrationInUse(bsfm(scale), 2, RESPONSE))
    assert bench.step().voltage_v == pytest.approx(before_v, abs=0.02)


@pytest.mark.parametrize("gain", [8.0, 8.2])
def test_the_first_measured_response_takes_over_the_volts_of_the_trim_before(gain: float) -> None:
    """In newtons the same correction asks for other volts behind a turn, and the inverse of the lags for a multiple of them."""
    bench = Bench(gain_n_per_v=gain)
    before_v = held(bench)
    assert abs(bench.last.trim_v) > 0.1
    bench.controller.use(CalibrationInUse(bsfm(), 2, RESPONSE))
    assert bench.step().voltage_v == pytest.approx(before_v, abs=0.02)
