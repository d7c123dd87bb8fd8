"""At which number a verdict changes, and the bounds that it names to people."""

from dataclasses import replace

import pytest

from gateway.bsfm import Branches, Bsfm, LinearBlend, RationalBezier
from gateway.codes.faults import FaultCode
from gateway.control.inputs import LineStatus, WireCounts
from gateway.control.self_test.items import (
    FAILED,
    FORCE_ITEMS,
    NOT_TESTED,
    PASSED,
    WARNED,
    Finding,
    Item,
    RunEnding,
    report_of,
)
from gateway.control.self_test.judgement import (
    Known,
    judge_leak,
    judge_noise,
    judge_output_line,
    judge_resolution,
    judge_response,
    judge_scale,
    judge_zero,
)
from gateway.control.self_test.line_watch import LineWatch
from gateway.control.self_test.measurements import Slope, intervals_of
from gateway.control.self_test.rest import judge_rest, why_no_force
from gateway.control.settings import SelfTestSettings
from gateway.registers.words import SelfTestResult, SelfTestVerdict
from tests.control.bench import bsfm, settings

CURVE = RationalBezier(0.0, 8.0, [0.0, 26.0, 57.0], [1.0, 1.0, 1.0])
RIG = Known(replace(settings(), self_test=SelfTestSettings()), bsfm())
MEASURED = replace(RIG, noise_n=0.05)
BOUNDS = {
    "zero": (lambda x: judge_zero(x, RIG), 0.5, 1.0, "allowed 0.50 N, fails above 1.00 N"),
    "zero below": (lambda x: judge_zero(-x, RIG), 0.5, 1.0, "allowed 0.50 N, fails above 1.00 N"),
    "noise": (lambda x: judge_noise(x, RIG), 0.25, 0.5, "allowed 0.250 N, fails above 0.500 N (in_band_tolerance_n 1 N)"),
    "noise, calibrated": (lambda x: judge_noise(x, MEASURED), 0.1, 0.2,
                          "allowed 0.100 N, fails above 0.200 N (0.050 N when it was calibrated)"),
    "noise, calibrated as none": (lambda x: judge_noise(x, replace(RIG, noise_n=0.001)), 1.0 / 20.0, 1.0 / 6.0,
                                  "allowed 0.050 N, fails above 0.167 N (0.001 N when it was calibrated)"),
    "resolution": (lambda x: judge_resolution(x, 200, RIG), 0.2, 0.5, "allowed 0.200 N, fails above 0.500 N"),
    "response": (lambda x: judge_response(x, RIG), 0.29, 0.53,
                 "allowed 290 ms, fails above 530 ms (120 ms supervision.response_lag_s)"),
    "leak": (lambda x: judge_leak(Slope(-x, 0.0), 10.0, 4.0), 0.1, 0.4, "over 4 s, allowed 0.100 N/s, fails above 0.400 N/s"),
    "leak, unsure": (lambda x: judge_leak(Slope(-x, 0.01), 10.0, 4.0), 0.13, 0.43, "allowed 0.130 N/s, fails above 0.430 N/s"),
    "pressure": (lambda x: judge_leak(Slope(0.0, 0.0), 10.0, 4.0, x), 0.013, 0.043, "lost, allowed 1.3 %, fails above 4.3 %"),
    "slow answers": (lambda x: judge_output_line(WireCounts(100, 100, 0), x, RIG), 0.05, 0.1,
                     "of 100 ms, allowed 2 % lost, fails above 10 %"),
}  # fmt: skip


@pytest.mark.parametrize("name", BOUNDS)
def test_a_verdict_changes_at_its_bound_and_nowhere_else(name: str) -> None:
    judge, warns, fails, words = BOUNDS[name]
    found = [judge(share) for share in (0.1 * warns, 0.99 * warns, 1.01 * warns, 0.99 * fails, 1.01 * fails)]
    assert [one.verdict for one in found] == [PASSED, PASSED, WARNED, WARNED, FAILED]
    assert all(words in one.text for one in found)


def test_what_was_measured_is_told_in_the_units_that_it_says() -> None:
    assert judge_response(0.25, RIG).text.startswith("250 ms to 63 % of a step, ")
    assert judge_leak(Slope(-0.05, 0.0), 10.0, 4.0, 0.01).text.startswith("+0.050 N/s lost at 10.0 N over 4 s, ")
    assert "; pressure +1.0 % per second lost, " in judge_leak(Slope(0.0, 0.0), 10.0, 4.0, 0.01).text
    slow = judge_output_line(WireCounts(100, 97, 1), 0.02, RIG).text
    assert slow.startswith(
        "2 of 100 questions without an answer, 1 answers unreadable, the slowest within 20 ms of 100 ms"
    )


def test_the_longest_gap_is_the_longest_wherever_it_was() -> None:
    found = intervals_of([0.0, 0.01, 0.02, 0.06, 0.07, 0.08])
    assert (found.median_s, found.longest_s, found.missing) == (pytest.approx(0.01), pytest.approx(0.04), 3)


def test_readings_of_one_moment_miss_none_between_them() -> None:
    assert intervals_of([1.0, 1.0, 1.0]) == (0.0, 0.0, 0)


@pytest.mark.parametrize(
    ("readings", "words"), [(19, "all of 19 readings are the same: too few to tell"), (20, "too quiet")]
)
def test_a_cell_that_repeats_itself_has_no_noise_to_judge_and_of_few_readings_nothing_is_claimed(
    readings: int, words: str
) -> None:
    noise, resolution, zero = judge_rest([(0.01 * k, 0.1) for k in range(readings)], RIG)
    assert noise == Finding(Item.NOISE, NOT_TESTED, "all readings are the same")
    assert (resolution.item, resolution.verdict, zero.verdict) == (Item.RESOLUTION, NOT_TESTED, PASSED)
    assert words in resolution.text


def test_the_slowest_exchange_is_the_slowest_wherever_it_was() -> None:
    watch = LineWatch()
    for asked, wire_s in enumerate((0.01, 0.08, 0.01), start=1):
        watch.observe(LineStatus(wire_s=wire_s, output_counts=WireCounts(asked, asked, 0)))
    assert "the slowest within 80 ms of 100 ms" in watch.findings(RIG, 1.0)[0].text


def test_a_reading_that_waited_behind_another_is_counted_beside_it_and_no_reading_beside_itself() -> None:
    """Of 100 readings a second one tick has taken two."""
    watch, heard = LineWatch(), 0
    for k in range(60):
        heard += 2 if k == 30 else 1
        watch.observe(LineStatus(cell_counts=WireCounts(0, heard, 0)))
        watch.note_reading(0.01 * heard)
    assert "100 readings per second, 0 missing, 0 unreadable, longest gap 10 ms" in watch.findings(RIG, 1.0)[1].text


@pytest.mark.parametrize(("weight_n", "rest_n"), [(5.0, 1.5), (-5.0, -1.5)])
def test_a_payload_excuses_a_force_at_rest_on_the_side_to_which_it_hangs_and_on_no_other(weight_n, rest_n) -> None:
    assert judge_zero(rest_n, RIG, weight_n).verdict is FAILED
    assert judge_zero(-rest_n, RIG, weight_n).verdict is PASSED


@pytest.mark.parametrize(("rest_n", "why"), [(2.0, "the zero is off: tare first"), (-2.0, ""), (0.0, "")])
def test_a_force_is_tried_behind_a_zero_that_is_off_below_nothing_for_it_may_be_the_sign(
    rest_n: float, why: str
) -> None:
    rest = [(0.01 * k, rest_n + 0.05 * (-1) ** k) for k in range(100)]
    found = {one.item: one for one in judge_rest(rest, MEASURED)}
    assert (found[Item.ZERO].verdict is FAILED) is (rest_n != 0.0)
    assert why_no_force(found, rest, MEASURED) == why


@pytest.mark.parametrize("verdict", [PASSED, WARNED, FAILED])
@pytest.mark.parametrize("item", Item)
def test_a_self_test_is_as_good_as_its_worst_item(item: Item, verdict: SelfTestVerdict) -> None:
    findings = {one: Finding(one, verdict if one is item else PASSED, "") for one in Item}
    report = report_of(1, findings, RunEnding(FaultCode.NONE, is_done=True, wants_force=True))
    assert report.result.name == verdict.name


@pytest.mark.parametrize("item", Item)
def test_a_force_that_was_not_tried_deserves_a_look(item: Item) -> None:
    findings = {one: Finding(one, NOT_TESTED if one is item else PASSED, "") for one in Item}
    wanted, unwanted = (
        report_of(1, findings, RunEnding(FaultCode.NONE, is_done=True, wants_force=wants_force)).result
        for wants_force in (True, False)
    )
    assert wanted is (SelfTestResult.WARNED if item in FORCE_ITEMS else SelfTestResult.PASSED)
    assert unwanted is SelfTestResult.PASSED


def test_what_is_pressed_at_rest_is_told_with_a_cure() -> None:
    assert judge_zero(0.49, RIG).text == "+0.49 N at rest, allowed 0.50 N, fails above 1.00 N"
    assert judge_zero(-0.51, RIG).text.endswith(
        "-0.51 N at rest, allowed 0.50 N, fails above 1.00 N; lift the tool and tare"
    )


@pytest.mark.parametrize(
    ("change_n", "verdict", "words"),
    [
        (10.0, PASSED, "100% of the change that the calibration expects (10.0 N), allowed 80% .. 120%, fails outside 30%"),
        (8.05, PASSED, "80% of"),
        (7.95, WARNED, "; calibrate again"),
        (12.05, WARNED, "; calibrate again"),
        (3.05, WARNED, "; calibrate again"),
        (2.95, FAILED, ": span or unit of the amplifier, or another slide than was calibrated"),
        (29.5, WARNED, "; calibrate again"),
        (30.5, FAILED, ": span or unit of the amplifier, or another slide than was calibrated"),
    ],
)  # fmt: skip
def test_the_scale_is_judged_by_its_share(change_n: float, verdict: object, words: str) -> None:
    found = judge_scale(change_n, 10.0, 0.0, 0.0)
    assert found.verdict is verdict and words in found.text
    assert ("calibrate again" in found.text) == (verdict is WARNED)


def test_where_friction_leaves_no_room_the_scale_is_not_judged() -> None:
    found = judge_scale(1.0, 1.0, 0.0, 4.0)
    assert found.verdict is NOT_TESTED
    assert found.text.endswith("; a friction of 4.0 N leaves too little room: raise self_test.force_n")
    assert judge_scale(0.2, 1.0, 0.0, 4.0).verdict is NOT_TESTED, "nor is a fifth of it known to be wrong then"
    assert judge_scale(10.0, 10.0, 0.5, 1.0).text.endswith("allowed 63% .. 137%, fails outside 30% .. 300%")


@pytest.mark.parametrize(
    ("counts", "verdict", "words"),
    [
        (None, NOT_TESTED, "no exchange was counted"),
        (WireCounts(0, 0, 0), NOT_TESTED, "no exchange was counted"),
        (
            WireCounts(100, 99, 0),
            PASSED,
            "0 of 100 questions without an answer, 0 answers unreadable",
        ),
        (WireCounts(100, 96, 0), WARNED, "3 of 100 questions"),
        (WireCounts(100, 100, 3), WARNED, "0 of 100 questions without an answer, 3 answers unreadable"),
        (WireCounts(100, 85, 0), FAILED, "14 of 100 questions"),
    ],
)
def test_lost_answers_are_counted(counts: WireCounts | None, verdict: object, words: str) -> None:
    found = judge_output_line(counts, 0.02, RIG)
    assert found.verdict is verdict and found.text.startswith(words)


def test_counts_are_taken_from_each_other() -> None:
    assert WireCounts(10, 8, 3).since(WireCounts(4, 5, 1)) == WireCounts(6, 3, 2)


def test_counts_that_the_rig_file_allows_do_not_fail_in_a_narrow_band() -> None:
    supervision = replace(RIG.settings.supervision, sample_quantum_n=0.5)
    coarse = replace(RIG, settings=replace(RIG.settings, supervision=supervision))
    assert judge_resolution(0.9, 200, coarse).verdict is PASSED
    assert judge_resolution(1.1, 200, coarse).verdict is FAILED


def test_what_an_item_has_failed_by_is_not_overwritten_by_the_fault_that_followed() -> None:
    found = {Item.SCALE: Finding(Item.SCALE, FAILED, "its own words")}
    report = report_of(1, found, RunEnding(FaultCode.OVER_FORCE, is_done=False, wants_force=True))
    assert next(one for one in report.findings if one.item is Item.SCALE).text == "its own words"
    stopped = report_of(1, {}, RunEnding(FaultCode.OVER_FORCE, is_done=False, wants_force=True))
    assert next(one for one in stopped.findings if one.item is Item.SCALE).verdict is FAILED


def test_bounds_that_follow_the_band_grow_with_it() -> None:
    wide = replace(
        RIG, settings=replace(RIG.settings, defaults=replace(RIG.settings.defaults, in_band_tolerance_n=2.0))
    )
    words = "allowed 0.500 N, fails above 1.000 N (in_band_tolerance_n 2 N)"
    assert words in judge_noise(0.1, wide).text and judge_noise(0.49, wide).verdict is PASSED


def test_what_friction_may_keep_at_rest_is_told_beside_the_bound_of_a_zero() -> None:
    keeping = Bsfm(Branches(CURVE, RationalBezier(0.0, 8.0, [4.0, 34.0, 57.0], [1.0, 1.0, 1.0])), LinearBlend(6.0))
    assert ", both beyond the 5.2 N that friction may keep" in judge_zero(0.1, replace(RIG, model=keeping)).text
    assert "friction" not in judge_zero(0.1, RIG).text


def test_what_the_safe_voltage_presses_is_not_told_as_friction_alone() -> None:
    limits = replace(RIG.settings.limits, safe_voltage_v=2.0)
    pressing = replace(RIG, settings=replace(RIG.settings, limits=limits))
    assert "N that the safe voltage and friction may keep" in judge_zero(14.0, pressing).text
