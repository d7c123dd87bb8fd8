"""The stages of a self-test: how long each takes, what voltage it puts out, what ends it, and what is found by then."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import pytest

from gateway.codes.faults import FaultCode
from gateway.control.inputs import LineStatus, WireCounts
from gateway.control.sample_conditioning import Reading
from gateway.control.self_test.items import FAILED, FORCE_ITEMS, NOT_TESTED, PASSED, Item, SelfTestPlan
from gateway.control.self_test.judgement import Known
from gateway.control.self_test.self_test_run import SelfTestRun
from gateway.control.self_test.stage_times import HOLD_S, REST_S, RISE_S
from gateway.control.settings import SelfTestSettings, ValveControl
from gateway.registers.words import CalibrationPhase
from tests.control.bench import bsfm, settings
from tests.control.self_test.test_levels import known

TICK_S = 0.01
SETTLING_S = 0.8  # at least, of a response of 120 ms


class Played:
    """A cell whose force follows the voltage at once: force_n of it, with noise that neighbours show."""

    def __init__(
        self, force_n: Callable[[float], float] | None = None, of: Known | None = None, noise_n: float = 0.02
    ) -> None:
        self.run, self.noise_n = SelfTestRun(SelfTestPlan(), of or known()), noise_n
        self.force_n = force_n or (lambda volts: bsfm().force_n(volts, 1.0))
        self.volts, self.at_s, self.course = 0.0, 0.0, list[tuple[float, float, float, float]]()

    def step(self) -> None:
        force_n = self.force_n(self.volts) + self.noise_n * (-1) ** len(self.course)
        step = self.run.step(self.at_s, Reading(force_n, force_n, 0.0, TICK_S, True, True, True))
        self.volts = step.voltage_v
        assert step.phase is CalibrationPhase.SELF_TEST
        self.course.append((self.at_s, step.voltage_v, step.progress, step.eta_s))
        self.at_s = round(self.at_s + TICK_S, 9)

    def to_the_end(self, longest_s: float = 30.0) -> "Played":
        while not self.run.is_done and self.at_s < longest_s:
            self.step()
        assert self.run.is_done
        return self

    def verdicts(self) -> dict[Item, object]:
        return {item: found.verdict for item, found in self.run.findings.items()}


def test_each_stage_takes_its_time_and_the_voltage_rises_evenly_to_the_first_level() -> None:
    course = Played().to_the_end().course
    rises_at = [at_s for (at_s, volts, *_), (_, later, *_) in pairwise(course) if later > volts]
    assert rises_at[0] == pytest.approx(REST_S, abs=0.02)
    first_v = next(volts for at_s, volts, *_ in course if at_s >= REST_S + RISE_S)
    half_v = next(volts for at_s, volts, *_ in course if at_s >= REST_S + 0.5 * RISE_S)
    assert half_v == pytest.approx(0.5 * first_v, rel=0.03)
    assert rises_at[-1] == pytest.approx(REST_S + RISE_S + SETTLING_S, abs=0.03)
    assert course[-1][0] == pytest.approx(REST_S + RISE_S + 2.0 * SETTLING_S + HOLD_S, abs=0.05)
    assert course[-1][1] == 0.0, "and down"


def test_progress_and_time_left_go_with_the_plan() -> None:
    planned_s = REST_S + RISE_S + 2.0 * SETTLING_S + HOLD_S
    course = Played().to_the_end().course
    for at_s, _, progress, left_s in course[:-1]:
        assert progress == pytest.approx(at_s / planned_s, abs=0.01)
        assert left_s == pytest.approx(planned_s - at_s, abs=0.05)
    assert course[-1][2:] == (1.0, 0.0)


def test_a_healthy_machine_passes_each_item_and_each_says_what_was_seen() -> None:
    played = Played().to_the_end()
    assert set(played.verdicts().values()) == {PASSED}
    assert set(FORCE_ITEMS) <= set(played.run.findings) and all(found.text for found in played.run.findings.values())
    assert " N at " in played.run.findings[Item.SIGN].text and "expected" in played.run.findings[Item.SIGN].text
    assert played.run.end_sentence == f"self-test done after {played.course[-1][0]:.1f} s"


def test_readings_count_from_when_they_were_taken_not_from_the_tick_that_saw_them() -> None:
    """Of 70 a second some wait for two ticks of 10 ms, and none comes late."""
    run, last = SelfTestRun(SelfTestPlan(), known()), -1
    for k in range(200):
        at_s, newest = TICK_S * k, int(70.0 * TICK_S * k + 1e-9)
        run.observe_line(LineStatus(cell_counts=WireCounts(0, newest + 1, 0)))
        age_s = at_s - newest / 70.0
        run.step(at_s, Reading(0.02 * (-1) ** newest, 0.0, age_s, 1.0 / 70.0, newest != last, True, True))
        last = newest
    (said,) = [one.text for one in run.report(1, FaultCode.NONE).findings if one.item is Item.CELL_LINE]
    assert "70 readings per second, 0 missing, 0 unreadable, longest gap 14 ms" in said


def test_a_rig_whose_self_test_moves_nothing_ends_behind_the_rest() -> None:
    still = Known(replace(settings(), self_test=SelfTestSettings(force_n=0.0)), bsfm())
    played = Played(of=still).to_the_end()
    assert played.course[-1][0] == pytest.approx(REST_S, abs=0.02) and {volts for _, volts, *_ in played.course} == {
        0.0
    }
    assert all(played.verdicts()[item] is NOT_TESTED for item in FORCE_ITEMS)
    assert played.run.findings[Item.SIGN].text == "self_test.force_n is 0: nothing moves"
    small = Known(replace(settings(), self_test=SelfTestSettings(force_n=0.9)), bsfm())
    assert "raise it" in Played(of=small).to_the_end().run.findings[Item.SIGN].text, "it wants a force, and has no room"
    with pytest.raises(ValueError, match="offers no self-test"):
        SelfTestRun(SelfTestPlan(), Known(settings(), bsfm()))


@pytest.mark.parametrize(
    ("force_n", "item", "words"),
    [
        (lambda volts: -bsfm().force_n(volts, 1.0), Item.SIGN, "turn load_cell.sign"),
        (lambda volts: 0.0, Item.SCALE, "no air, valve closed or no contact"),
        (lambda volts: 4.0 * bsfm().force_n(volts, 1.0), Item.SCALE, "span or unit of the amplifier"),
    ],
)
def test_what_is_wrong_with_the_force_ends_it_with_its_item_and_nothing_is_claimed_of_the_others(
    force_n: Callable[[float], float], item: Item, words: str
) -> None:
    played = Played(force_n).to_the_end()
    verdicts = played.verdicts()
    assert verdicts[item] is FAILED and words in played.run.findings[item].text
    assert all(verdicts[other] is not FAILED for other in FORCE_ITEMS if other is not item)
    assert verdicts[Item.LEAK] is NOT_TESTED and played.course[-1][0] < REST_S + RISE_S + 2.0 * SETTLING_S + 0.1


def test_by_a_cell_whose_sign_is_wrong_no_zero_is_passed() -> None:
    played = Played(lambda volts: -bsfm().force_n(volts, 1.0)).to_the_end()
    assert played.verdicts()[Item.ZERO] is NOT_TESTED
    assert "the wrong sign" in played.run.findings[Item.ZERO].text


@pytest.mark.parametrize(("at_rest_n", "pressed_n", "is_gone"), [(1.0, 0.0, True), (-1.0, -1.8, False)])
def test_a_force_at_rest_that_goes_away_may_have_lost_its_workpiece(
    at_rest_n: float, pressed_n: float, is_gone: bool
) -> None:
    found = Played(lambda volts: pressed_n if volts > 0.5 else at_rest_n).to_the_end().run.findings[Item.SIGN]
    assert found.verdict is FAILED and "turn load_cell.sign" in found.text
    assert ("what it pressed on at rest was taken away" in found.text) is is_gone


def test_a_pressure_that_falls_while_the_force_holds_is_a_leak_and_one_before_the_hold_is_not() -> None:
    for leaks, verdict in ((True, FAILED), (False, PASSED)):
        played = Played()
        while not played.run.is_done:
            held_s = max(0.0, played.at_s - REST_S - RISE_S - 2.0 * SETTLING_S)
            pressure_pa = 1e5 * (1.0 - 0.1 * held_s) if leaks else 1e5 * min(1.0, played.volts)
            played.run.observe_line(LineStatus(pressure_pa=pressure_pa))
            played.step()
        assert played.verdicts()[Item.LEAK] is verdict
        assert "pressure" in played.run.findings[Item.LEAK].text


def test_the_report_judges_both_lines_by_what_they_counted_during_the_test() -> None:
    played = Played()
    played.run.observe_line(LineStatus(output_counts=WireCounts(1000, 500, 0), cell_counts=WireCounts(0, 10, 900)))
    played.to_the_end()
    played.run.observe_line(LineStatus(output_counts=WireCounts(1100, 600, 0), cell_counts=WireCounts(0, 1010, 900)))
    found = {one.item: one for one in played.run.report(7, FaultCode.NONE).findings}
    assert found[Item.OUTPUT_LINE].verdict is PASSED and found[Item.OUTPUT_LINE].text.startswith("0 of 100 questions")
    assert found[Item.CELL_LINE].verdict is PASSED and "0 unreadable" in found[Item.CELL_LINE].text
    assert played.run.report(7, FaultCode.NONE).number == 7


@pytest.mark.parametrize(
    ("stated_n", "noise_n", "pushed_n", "least", "most"), [(20.0, 0.02, 5.0, 2, 4), (3.0, 0.2, 0.9, 4, 8)]
)
def test_who_is_pushed_near_the_stated_force_ends_after_as_few_readings_as_the_noise_allows(
    stated_n: float, noise_n: float, pushed_n: float, least: int, most: int
) -> None:
    rig = replace(settings(), self_test=SelfTestSettings(force_n=stated_n))
    played = Played(of=Known(rig, bsfm()), noise_n=noise_n)
    while played.at_s < REST_S + RISE_S + 2.0 * SETTLING_S + 1.0:
        played.step()
    assert not played.run.is_done
    pushed_at, played.force_n = len(played.course), lambda volts: bsfm().force_n(volts, 1.0) + pushed_n
    played.to_the_end()
    assert least <= len(played.course) - pushed_at <= most


@pytest.mark.parametrize(("noise_n", "words"), [(0.0, "the cell repeats itself"), (0.7, "counts are too coarse")])
def test_a_cell_that_tells_no_force_apart_is_pressed_with_none_and_is_told_why(noise_n: float, words: str) -> None:
    noisy_once = replace(known(), noise_n=0.1)
    found = Played(of=noisy_once, noise_n=noise_n).to_the_end().run.findings
    assert found[Item.RESOLUTION].verdict is FAILED
    assert all(found[item].verdict is NOT_TESTED and words in found[item].text for item in FORCE_ITEMS)


@pytest.mark.parametrize("has_valve", [False, True])
def test_a_valve_that_stands_at_pull_is_thought_of_before_the_cell_is_turned_round(has_valve: bool) -> None:
    of = known()
    valve = ValveControl(pull_area_share=0.75) if has_valve else None
    of = replace(of, settings=replace(of.settings, valve=valve))
    found = Played(lambda volts: -bsfm().force_n(volts, 1.0), of).to_the_end().run.findings[Item.SIGN]
    assert found.verdict is FAILED and "turn load_cell.sign" in found.text
    assert ("or the valve stands at pull, whatever its relay reads back" in found.text) is has_valve
