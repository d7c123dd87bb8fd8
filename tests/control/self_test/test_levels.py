"""How hard a self-test may press, whatever the machine does with its voltages, and what ends it before it presses at all."""

from dataclasses import replace

import pytest

from gateway.bsfm import Branches, Bsfm, LinearBlend, RationalBezier
from gateway.codes.faults import FaultCode
from gateway.control.sample_conditioning import Reading
from gateway.control.self_test.items import FAILED, NOT_TESTED, Item, RunEnding, SelfTestPlan, report_of
from gateway.control.self_test.judgement import Known
from gateway.control.self_test.levels import FORCE_SHARE, NEAR_SHARE, Levels
from gateway.control.self_test.self_test_run import SelfTestRun
from gateway.control.settings import SelfTestSettings
from gateway.registers.words import SelfTestResult
from tests.control.bench import bsfm, settings

FORCE_N = 20.0
TOP_N = FORCE_SHARE * FORCE_N


def known(model: Bsfm | None = None, **limits: float) -> Known:
    control = replace(settings(), self_test=SelfTestSettings(force_n=FORCE_N))
    return Known(replace(control, limits=replace(control.limits, **limits)), model or bsfm())


def pressed_n(levels: Levels, voltage_v: float, strength: float) -> float:
    """By a machine so much stronger than its calibration says, from what friction has kept."""
    return levels.base_n + strength * (levels.expected_n(voltage_v) - levels.base_n)


@pytest.mark.parametrize("rest_n", [0.0, 4.0, 8.0])
def test_the_first_level_leaves_room_for_a_machine_twice_as_strong(rest_n: float) -> None:
    levels = Levels(known(), FORCE_N, rest_n)
    assert pressed_n(levels, levels.first_v, 2.0) < TOP_N


@pytest.mark.parametrize("strength", [0.7, 1.0, 1.3, 1.8])
def test_the_second_level_is_set_by_what_the_first_one_has_shown(strength: float) -> None:
    levels = Levels(known(), FORCE_N, 0.0)
    assert levels.set_second(pressed_n(levels, levels.first_v, strength))
    assert levels.second_v > levels.first_v
    assert pressed_n(levels, levels.second_v, strength) <= TOP_N + 1.0e-3


def test_friction_that_is_shaken_loose_does_not_pass_the_stated_force() -> None:
    """A spindle that starts: the slide then presses with what lies between the branches."""
    rising = RationalBezier(0.0, 8.0, [0.0, 26.0, 57.0], [1.0, 1.0, 1.0])
    falling = RationalBezier(0.0, 8.0, [0.0, 50.0, 57.0], [1.0, 1.0, 1.0])
    levels = Levels(known(Bsfm(Branches(rising, falling), LinearBlend(6.0))), FORCE_N, 0.0)
    assert levels.set_second(levels.expected_n(levels.first_v))
    most_n = (1.0 - NEAR_SHARE) * FORCE_N
    assert 0.5 * sum(curve.value(levels.second_v) for curve in (rising, falling)) <= most_n


@pytest.mark.parametrize(
    ("rest_n", "middle_n", "has_room"),
    [
        (0.0, 26.2, True),
        (14.4, 26.2, True),  # 1.6 N below what is meant to be reached
        (14.6, 26.2, False),  # 1.4 N: less than what is friction's
        (0.0, 50.0, True),
        (8.0, 50.0, False),  # the first level, shaken loose whole, would pass it
    ],
)
def test_there_are_levels_where_span_and_friction_leave_room_for_both(
    rest_n: float, middle_n: float, has_room: bool
) -> None:
    """middle_n: of the falling branch, 26 N of the rising one."""
    branches = (RationalBezier(0.0, 8.0, [0.0, control_n, 57.0], [1.0, 1.0, 1.0]) for control_n in (26.0, middle_n))
    levels = Levels(known(Bsfm(Branches(*branches), LinearBlend(6.0))), FORCE_N, rest_n)
    assert (levels.why_no_room == "") is has_room
    kept = f"{rest_n:.1f} N at rest and a friction of {levels.friction_n(levels.first_v):.1f} N leave no room"
    assert has_room or levels.why_no_room == f"{kept} below self_test.force_n = 20 N: raise it"


def test_a_machine_that_presses_at_rest_by_its_calibration_is_pressed_beyond_that() -> None:
    """Right behind a tare it reads 0 there: two fifths of the way from 0 were less than it has without a volt."""
    lifted = (RationalBezier(0.0, 8.0, [8.0, *ends], [1.0, 1.0, 1.0]) for ends in ((26.0, 57.0), (34.0, 57.0)))
    levels = Levels(known(Bsfm(Branches(*lifted), LinearBlend(6.0))), FORCE_N, 0.0)
    assert levels.base_n == 8.0 and levels.expected_n(levels.first_v) > 8.0 + 1.0


def test_between_the_levels_there_is_a_step_that_a_slope_can_be_told_from_or_there_is_no_second() -> None:
    steps_n = []
    for k in range(400):
        levels = Levels(known(), FORCE_N, 0.0)
        if levels.set_second(0.05 * k):
            steps_n.append(levels.span_n)
    assert 100 < len(steps_n) < 350 and min(steps_n) > 0.59


def test_no_level_is_beyond_the_rigs_largest_voltage() -> None:
    levels = Levels(known(voltage_max_v=0.5), FORCE_N, 0.0)
    assert levels.first_v == 0.5
    levels.set_second(levels.expected_n(0.5))
    assert levels.second_v == 0.5


def highest_v(force_n: float, noise_n: float) -> float:
    """Asked for of a machine whose cell says this, whatever is pressed."""
    run, highest_v = SelfTestRun(SelfTestPlan(), replace(known(), noise_n=0.2)), 0.0
    for k in range(3000):
        reading = Reading(force_n + noise_n * (-1) ** k, force_n, 0.0, 0.01, True, True, True)
        highest_v = max(highest_v, run.step(0.01 * k, reading).voltage_v)
        if run.is_done:
            break
    return highest_v


def test_a_cell_that_repeats_itself_at_rest_is_not_pressed() -> None:
    assert highest_v(0.0, 0.0) == 0.0
    assert highest_v(0.0, 0.05) > 0.0


@pytest.mark.parametrize("rest_n", [3.0, 8.0])
def test_behind_a_zero_that_is_too_high_nothing_is_pressed(rest_n: float) -> None:
    """A tool that presses already, or a tare that was forgotten: the stated force would be that much nearer than it seems."""
    assert highest_v(rest_n, 0.05) == 0.0


def test_a_force_that_creeps_up_at_a_held_voltage_ends_it_before_the_stated_one() -> None:
    """Whatever pushes from outside, or leaks into the regulator: the guard looks at every reading, to the end of the hold."""
    run = SelfTestRun(SelfTestPlan(), known())
    volts, creep_n, most_n = 0.0, 0.0, 0.0
    for k in range(3000):
        creep_n += 0.05 if volts > 0.0 else 0.0
        force_n = run.model.force_n(volts, 1.0) + creep_n + 0.05 * (-1) ** k
        most_n = max(most_n, force_n)
        volts = run.step(0.01 * k, Reading(force_n, force_n, 0.0, 0.01, True, True, True)).voltage_v
        if run.is_done:
            break
    assert run.is_done and TOP_N < most_n < FORCE_N


@pytest.mark.parametrize(
    ("fault", "item"),
    [
        (FaultCode.OVER_FORCE, Item.SCALE),
        (FaultCode.GAIN_WRONG, Item.SCALE),
        (FaultCode.SIGN_INVERTED, Item.SIGN),
        (FaultCode.SAMPLE_FROZEN, Item.RESOLUTION),
        (FaultCode.CELL_LOST, Item.CELL_LINE),
        (FaultCode.NOT_FINITE, Item.CELL_LINE),
        (FaultCode.OUTPUT_SILENT, Item.OUTPUT_LINE),
        (FaultCode.OUTPUT_ALTERED, Item.OUTPUT_LINE),
    ],
)
def test_a_fault_of_the_supervision_fails_the_item_that_it_is_about(fault: FaultCode, item: Item) -> None:
    report = report_of(1, {}, RunEnding(fault, is_done=False, wants_force=True))
    assert [found.item for found in report.findings if found.verdict is FAILED] == [item]


def test_a_master_that_is_lost_has_stopped_the_test_and_failed_no_item() -> None:
    """Whether its loss is a fault or a way to 0 N is the rig's choice, and says nothing of the machine."""
    report = report_of(1, {}, RunEnding(FaultCode.MASTER_LOST, is_done=False, wants_force=True))
    assert report.result is SelfTestResult.STOPPED
    assert {found.verdict for found in report.findings} == {NOT_TESTED}


def test_a_cell_that_says_nothing_usable_fails_its_line_and_nothing_is_pressed() -> None:
    run, volts = SelfTestRun(SelfTestPlan(), known()), set()
    for k in range(400):
        volts.add(run.step(0.01 * k, Reading(is_new=True)).voltage_v)
    assert run.is_done and volts == {0.0}
    assert run.findings[Item.CELL_LINE].verdict is FAILED and "no reading" in run.findings[Item.CELL_LINE].text


def test_a_fault_that_belongs_to_no_item_is_named_by_the_whole_and_by_what_was_not_tested() -> None:
    """`self-test 1 failed: 9 not tested` said not a word of why."""
    report = report_of(1, {}, RunEnding(FaultCode.MACHINE_BUSY, is_done=False, wants_force=True))
    assert report.result is SelfTestResult.FAILED
    title = FaultCode.MACHINE_BUSY.explanation.title
    assert report.sentences[-1] == f"self-test 1 failed: 9 not tested; ended by A403 {title}"
    assert {found.text for found in report.findings} == {f"A403 {title} ended the test before"}
