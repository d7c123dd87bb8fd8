"""The force loop by itself: what a run leaves behind, which way a descent goes, when the trim may learn, and from what."""

from dataclasses import replace

import pytest

from gateway.bsfm import Branches, Bsfm, LinearBlend, RationalBezier
from gateway.bsfm.model import Response
from gateway.codes.faults import FaultCode
from gateway.control import CalibrationInUse, Controller
from gateway.control.compensation.compensation import TimingCompensation
from gateway.control.demand import Demand, demand_of
from gateway.control.force_loop.force_loop import ForceLoop
from gateway.control.inputs import LineStatus, LoopInputs
from gateway.control.limits import TICK_S
from gateway.control.sample_conditioning import Reading
from gateway.control.settings import ControlSettings, LeadSettings, Trim
from gateway.control.state_table import StateEvent
from gateway.control.supervision.fault_detection import StopCause
from gateway.registers.command import Command
from gateway.registers.words import LimitedBy, Mode, State
from tests.control.bench import Bench, bsfm, enabled, settings

LINE = LineStatus()
RESPONSES = (None, Response(dead_time_s=0.05, lag_s=0.08))
KINDS = ("rig file", "measured")
"""Of a calibration's response: which trim corrects."""


def loop_of(rig: ControlSettings | None = None, timing: TimingCompensation | None = None) -> ForceLoop:
    return ForceLoop(rig or settings(), bsfm(), timing)


def wish(force_n: float, **changes: float) -> Demand:
    asked = demand_of(Command(force_setpoint_n=force_n), settings())
    return asked._replace(manner=asked.manner._replace(**changes))


def inputs(contact_n: float, **changes: object) -> LoopInputs:
    reading = Reading(contact_n, contact_n, 0.0, 0.01, True, True, True)
    return LoopInputs(1.0, 0.01, reading, True, contact_n)._replace(**changes)  # type: ignore[arg-type]


def pressed(loop: ForceLoop, force_n: float, ticks: int = 300, **changes: object) -> ForceLoop:
    """The force is where it is expected: the trim has nothing to learn."""
    for _ in range(ticks):
        loop.elapse(0.01, LINE)
        loop.step(wish(force_n), inputs(loop.feedforward.reference_n, **changes))
    return loop


def test_a_run_s_voltage_goes_out_within_the_limits_and_its_force_is_what_the_model_expects() -> None:
    loop = pressed(loop_of(), 20.0)
    loop.drive_run(9.5, 1.0)
    assert loop.voltage_v <= 9.0 and loop.feedforward_v == 9.5 and loop.limited_by is not LimitedBy.NONE
    assert loop.applied_n == pytest.approx(loop.expected.force_n(1.0)) and loop.branch_share == 1.0
    loop.drive_run(1.0, -1.0)
    assert (loop.voltage_v, loop.branch_share, loop.limited_by) == (1.0, -1.0, LimitedBy.NONE)


@pytest.mark.parametrize(("towards_n", "given_n", "applied_n"), [(5.0, 0.0, 5.0), (5.0, 2.0, 7.0), (99.0, 2.0, 22.0)])
def test_behind_a_run_the_force_goes_on_from_what_is_reached_and_no_higher_than_where_its_voltage_leads(
    towards_n: float, given_n: float, applied_n: float
) -> None:
    loop = loop_of()
    reached_v = bsfm().branches.falling.inverse(20.0)[0]
    for _ in range(1000):
        loop.elapse(0.01, LINE)
        loop.drive_run(reached_v, -1.0)
    loop.leave_run(towards_n, -1.0, given_n)
    assert loop.applied_n == pytest.approx(applied_n, abs=0.01) and loop.branch_share == -1.0


def test_what_still_leaves_is_told_by_the_calibration_in_use_and_its_pace() -> None:
    loop = pressed(loop_of(), 20.0)
    loop.use(bsfm(2.0), 0.0, settings(response_lag_s=10.0))
    assert loop.left.rise_n == pytest.approx(40.0, abs=2.0)
    loop.drive_run(0.0, 1.0)
    for _ in range(100):
        loop.elapse(0.01, LINE)
    assert loop.left.rise_n > 30.0, "of 10 s one has passed"


def test_a_descent_never_goes_up_and_ends_at_0() -> None:
    loop = pressed(loop_of(), 20.0)
    loop.drive_run(1.0, 1.0)
    loop.leave_run(99.0, 1.0, 0.0)
    volts, forces = [loop.voltage_v], [loop.applied_n]
    for _ in range(200):
        loop.elapse(0.01, LINE)
        assert loop.descend(wish(0.0, ramp_n_per_s=20.0), 0.01, 0.0) is StateEvent.MOVE
        volts.append(loop.voltage_v)
        forces.append(loop.applied_n)
    assert volts == sorted(volts, reverse=True) and forces == sorted(forces, reverse=True)
    assert (volts[-1], forces[-1], loop.trim_v) == (0.0, 0.0, 0.0)
    assert forces[0] - forces[10] == pytest.approx(2.0, abs=0.3), "along the ramp"


@pytest.mark.parametrize(
    ("changes", "learns"),
    [
        ({}, True),
        ({"touching": False}, False),
        ({"reading": Reading(19.0, 19.0, 0.0, 0.01, False, True, True)}, False),
        ({"reading": Reading(19.0, 19.0, 0.0, 0.01, True, True, False)}, False),
    ],
)
def test_the_trim_learns_in_contact_from_new_usable_readings_alone(changes: dict[str, object], learns: bool) -> None:
    loop = pressed(loop_of(), 20.0)
    before_v = loop.trim_v
    loop.elapse(0.01, LINE)
    loop.step(wish(20.0), inputs(19.0, **changes))
    assert (loop.trim_v > before_v) is learns


def test_the_trim_does_not_learn_while_the_target_runs_ahead_or_another_limit_acts() -> None:
    for force_n, ticks in ((40.0, 1), (0.1, 200)):
        loop = pressed(loop_of(), 20.0)
        pressed(loop, force_n, ticks)
        before_v = loop.trim_v
        loop.elapse(0.01, LINE)
        loop.step(wish(force_n), inputs(5.0))
        assert loop.trim_v == pytest.approx(before_v, abs=1e-3)


def test_a_voltage_goes_out_as_it_is_and_leaves_no_trim() -> None:
    loop = pressed(loop_of(), 20.0)
    loop.step(wish(20.0), inputs(15.0))
    assert loop.trim_v > 0.0
    asked = wish(0.0)._replace(mode=Mode.VOLTAGE, voltage_v=2.0)
    assert loop.step(asked, inputs(12.0)) is StateEvent.MOVE
    assert (loop.voltage_v, loop.feedforward_v, loop.trim_v, loop.applied_n) == (2.0, 2.0, 0.0, 12.0)
    loop.step(asked._replace(manner=asked.manner._replace(gravity_n=1.5)), inputs(12.0, outside_n=2.0))
    assert loop.feedforward._given_n == 3.5, "weight, and what comes from outside, is not the slide's to give"


def test_what_cannot_be_calculated_is_a_fault_and_names_its_kind() -> None:
    class Broken(Bsfm):
        def voltage_v(self, *_: object, **__: object) -> tuple[float, object]:  # type: ignore[override]
            raise ValueError("no such force")

    loop = ForceLoop(settings(), Broken(bsfm().branches, bsfm().reversal))
    causes = [loop.step(wish(20.0), inputs(10.0)), loop.descend(wish(0.0), 0.01, 0.0)]
    assert isinstance(causes[0], StopCause) and causes[0].fault is FaultCode.MODEL_INVALID
    assert "no such force" in causes[0].sentence
    not_finite = pressed(loop_of(), 20.0).step(wish(20.0)._replace(force_n=float("nan")), inputs(10.0))
    assert isinstance(not_finite, StopCause) and not_finite.fault is FaultCode.NOT_FINITE


def test_a_released_force_goes_down_in_volts_along_its_ramp_without_a_push() -> None:
    rig = replace(settings(), trim=Trim())
    led = pressed(loop_of(replace(rig, lead=LeadSettings(lag_s=0.1))), 20.0)
    plain = pressed(loop_of(rig), 20.0)
    for _ in range(5):
        for loop in (led, plain):
            loop.elapse(0.01, LINE)
            loop.step(wish(0.0, ramp_n_per_s=20.0), inputs(19.0))
    assert led.voltage_v == pytest.approx(plain.voltage_v, abs=1e-6)


@pytest.mark.parametrize(
    ("rig", "timing", "course"),
    [
        (settings(), None, (0.12, 0.0, 0.0)),
        (settings(), TimingCompensation(delay_s=0.05, lags_s=0.3), (0.3, 0.05, 0.0)),
        (settings(response_lag_s=0.001), None, (TICK_S, 0.0, 0.0)),
        (replace(settings(), lead=LeadSettings(lag_s=0.1)), None, (0.12 - 0.065, 0.0, 0.0)),
    ],
)
def test_the_force_follows_as_the_rig_says_less_what_the_lead_gains(
    rig: ControlSettings, timing: TimingCompensation | None, course: tuple[float, float, float]
) -> None:
    assert loop_of(rig, timing)._course(rig) == pytest.approx(course)


def test_a_trim_that_has_reached_its_limit_is_told_so_until_it_is_well_below() -> None:
    """Noise, and a target that moves, take it off by a hair: a warning that comes and goes is no warning."""
    loop = pressed(loop_of(), 20.0)
    told = []
    for measured_n in (*[15.0] * 60, *[22.0] * 12):
        loop.elapse(0.01, LINE)
        loop.step(wish(20.0), inputs(measured_n))
        told.append((loop.trim_v / 0.6, loop.is_trim_at_limit))
    reached = [share for share, _ in told].index(1.0)
    assert not any(is_told for _, is_told in told[:reached]) and max(share for share, _ in told[:reached]) > 0.9
    assert all(is_told is (share > 0.8) for share, is_told in told[reached:]) and not told[-1][1]


def test_a_rest_forgets_everything_that_the_output_did() -> None:
    loop = pressed(loop_of(), 20.0)
    loop.step(wish(20.0), inputs(15.0))
    loop.rest()
    assert (loop.voltage_v, loop.applied_n, loop.trim_v, loop.feedforward_v) == (0.0, 0.0, 0.0, 0.0)
    assert loop.limited_by is LimitedBy.NONE and not loop.in_band and not loop.unreachable and not loop.is_trim_at_limit


@pytest.mark.parametrize("rests", [True, False])
def test_what_is_left_of_the_force_before_is_no_error_for_the_trim(rests: bool) -> None:
    """Behind a disable and an enable in the same tenth of a second 40 N still go: learned as an error of 35 N they would take
    the new force away."""
    loop = pressed(loop_of(), 40.0)
    if rests:
        loop.rest()
    left_n, trims_v = 40.0, []
    for _ in range(60):
        left_n += (5.0 - left_n) * 0.1
        loop.elapse(0.01, LINE)
        loop.step(wish(5.0, ramp_n_per_s=1e3), inputs(left_n))
        trims_v.append(loop.trim_v)
    assert min(trims_v) > -0.1


def test_out_of_contact_the_course_begins_at_nothing() -> None:
    loop = loop_of()
    loop.step(wish(5.0, ramp_n_per_s=1e3), inputs(3.0, touching=False))
    assert loop.feedforward.reference_n < 1.0
    again = loop_of()
    again.step(wish(5.0, ramp_n_per_s=1e3), inputs(-3.0))
    assert again.feedforward.reference_n == 0.0


def test_the_trim_comes_back_from_the_lowest_voltage():
    """Something pressed for a while on a tool that was to press little; then 0.7 N stayed where 3 were wanted, for good."""
    bench = enabled(settings())
    bench.force(3.0)
    assert bench.run(3.0).state is State.HOLDING
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + 4.0)
    bench.run(6.0)
    assert (bench.last.voltage_v, bench.last.limited_by) == (0.0, LimitedBy.VOLTAGE_RANGE)
    bench.alter_sample = lambda sample: replace(
        sample, force_n=sample.force_n + 1.0
    )  # as friction keeps of a tool at 0 V
    assert bench.run(4.0).state is State.HOLDING
    assert bench.last.force_measured_n == pytest.approx(3.0, abs=0.5)


def test_the_trim_comes_back_from_the_highest_voltage():
    rig = settings()
    bench = enabled(replace(rig, limits=replace(rig.limits, voltage_max_v=4.4)))
    bench.force(30.0)
    bench.plant.gain_n_per_v = 6.0
    bench.run(6.0)
    assert (bench.last.voltage_v, bench.last.limited_by) == (4.4, LimitedBy.VOLTAGE_RANGE)
    bench.plant.gain_n_per_v = 7.6
    assert bench.run(4.0).state is State.HOLDING
    assert bench.plant.force_n == pytest.approx(30.0, abs=1.0)


@pytest.mark.parametrize("response", RESPONSES, ids=KINDS)
def test_the_trim_goes_no_further_than_to_the_end_of_the_range(response):
    """Beyond it, it would have to come back before the force does."""
    rig = settings()
    bench = Bench(replace(rig, limits=replace(rig.limits, voltage_max_v=4.0)), gain_n_per_v=6.8)
    bench.controller = Controller(bench.settings, CalibrationInUse(bsfm(), 1, response))
    bench.run(0.3)
    bench.enable(26.0)
    output = bench.run(3.0)
    assert output.limited_by is LimitedBy.VOLTAGE_RANGE
    assert output.feedforward_v + output.trim_v == pytest.approx(4.0, abs=0.02)


@pytest.mark.parametrize("way", [1, -1])
def test_the_trim_learns_nothing_more_at_an_end_of_the_range(way):
    """What it learned there would have to be forgotten first, and until then the force stays beyond the target."""
    rig = settings()
    bench = enabled(replace(rig, limits=replace(rig.limits, voltage_max_v=4.0)))
    bench.force(30.0 if way > 0 else 3.0)
    if way < 0:
        bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + 6.0)
    bench.seconds_until(lambda output: output.limited_by is LimitedBy.VOLTAGE_RANGE, 9.0)
    reached_v = bench.last.trim_v
    bench.run(6.0)
    assert bench.last.limited_by is LimitedBy.VOLTAGE_RANGE
    assert bench.last.trim_v == pytest.approx(reached_v, abs=0.02)


@pytest.mark.parametrize("response", RESPONSES, ids=KINDS)
def test_a_machine_with_less_friction_than_its_calibration_is_pressed_below_that_ones_range(response):
    """6 N were the least by the calibration; what the machine lacked of 4 N, nobody made good, and air was called missing."""
    lifted = Branches(
        *(RationalBezier(0.0, 8.0, [6.0, *ends], [1.0, 1.0, 1.0]) for ends in ((26.0, 57.0), (34.0, 57.0)))
    )
    rig = settings()
    bench = Bench(replace(rig, trim=replace(rig.trim, limit_v=1.0)), seed=2)
    bench.controller = Controller(bench.settings, CalibrationInUse(Bsfm(lifted, LinearBlend(6.0)), 1, response))
    bench.run(0.3)
    bench.enable(20.0)
    bench.run(2.0)
    bench.force(4.0)
    assert bench.run(6.0).state is State.HOLDING
    assert bench.plant.force_n == pytest.approx(4.0, abs=0.8)
    bench.plant.gain_n_per_v = 14.0  # and what was made good is taken back
    assert bench.run(6.0).state is State.HOLDING
    assert bench.plant.force_n == pytest.approx(4.0, abs=0.8)
