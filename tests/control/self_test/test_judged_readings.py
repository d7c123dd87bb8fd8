"""From readings of a step, a hold and a line to their verdicts."""

from dataclasses import replace
from math import nan, sqrt

import pytest

from gateway.bsfm import Branches, Bsfm, LinearBlend, RationalBezier
from gateway.bsfm.response.second_order import SecondOrder
from gateway.control.inputs import WireCounts
from gateway.control.self_test.items import FAILED, NOT_TESTED, PASSED, WARNED, Item
from gateway.control.self_test.judgement import (
    friction_slack_n,
    judge_cell_line,
    judge_hold,
    judge_leak,
    judge_output_line,
    judge_response,
    judge_step,
    judge_zero,
    mean_error_n,
    still_rising,
)
from gateway.control.self_test.measurements import Intervals, Slope
from gateway.control.self_test.rest import judge_rest
from gateway.control.settings import LoopTiming
from gateway.registers.words import SelfTestVerdict
from tests.control.self_test.test_verdicts import RIG

REGULAR = Intervals(0.01, 0.012, 0)


@pytest.mark.parametrize(
    ("intervals", "counts", "verdict"),
    [
        (REGULAR, None, PASSED),
        (REGULAR._replace(missing=2), None, PASSED),  # one burst on the wire breaks two
        (REGULAR._replace(missing=3), None, WARNED),  # of the 100 of a second
        (REGULAR._replace(missing=11), None, FAILED),
        (REGULAR._replace(missing=3), WireCounts(0, 150, 0), PASSED),  # of the 150 that were heard: 2 %
        (REGULAR._replace(missing=3), WireCounts(0, 140, 0), WARNED),
        (REGULAR, WireCounts(0, 147, 3), PASSED),
        (REGULAR, WireCounts(0, 146, 4), WARNED),
        (REGULAR, WireCounts(0, 85, 15), FAILED),
        (REGULAR._replace(missing=3), WireCounts(0, 0, 0), WARNED),
        (REGULAR._replace(longest_s=0.0449), None, PASSED),  # half of 50 ms, and an interval beside the usual one
        (REGULAR._replace(longest_s=0.0451), None, WARNED),
        (REGULAR._replace(longest_s=0.0601), None, FAILED),
        (REGULAR._replace(missing=70), WireCounts(1000, 999, 0), PASSED),  # asked a tick later: nothing was lost
        (REGULAR, WireCounts(100, 97, 0), PASSED),  # one may be out
        (REGULAR, WireCounts(100, 96, 0), WARNED),
        (REGULAR, WireCounts(100, 88, 0), FAILED),
        (REGULAR, WireCounts(100, 99, 11), FAILED),
        (Intervals(0.0, 0.0, 0), None, FAILED),
        (Intervals(3.0, 3.0, 3), None, FAILED),
    ],
)
def test_a_cell_line_is_as_good_as_what_it_lost_and_its_longest_gap(
    intervals: Intervals, counts: WireCounts | None, verdict: SelfTestVerdict
) -> None:
    found = judge_cell_line(intervals, counts, RIG, 1.0)
    assert (found.item, found.verdict) == (Item.CELL_LINE, verdict)


def test_a_cell_line_is_told_in_readings_per_second_and_milliseconds() -> None:
    alone = judge_cell_line(Intervals(0.01, 0.03, 2), None, RIG, 1.0).text
    assert "2 missing, 0 unreadable" in alone, "where nobody counts the wire's messages"
    text = judge_cell_line(Intervals(0.01, 0.03, 2), WireCounts(0, 300, 1), RIG, 1.0).text
    assert text.startswith(
        "100 readings per second, 2 missing, 1 unreadable, longest gap 30 ms of 50 ms, allowed 2 % lost"
    )
    bound_s = RIG.settings.supervision.sample_timeout_s
    silent, short = (
        judge_cell_line(Intervals(0.0, 0.0, 0), None, RIG, 1.0 * wait_s) for wait_s in (1.01 * bound_s, bound_s)
    )
    assert (silent.verdict, silent.text) == (FAILED, "no reading came")
    assert short.verdict is NOT_TESTED, "whoever stops it before one is due learns nothing of the cell"


def test_an_answer_that_was_never_timed_is_not_told_as_one_of_0_ms() -> None:
    assert "slowest" not in judge_output_line(WireCounts(100, 100, 0), 0.0, RIG).text


def falling(n_per_s: float, from_n: float = 10.0, readings: int = 41) -> list[tuple[float, float]]:
    return [(0.1 * k, from_n + n_per_s * 0.1 * k) for k in range(readings)]


@pytest.mark.parametrize(
    ("held", "pressures", "verdict", "words"),
    [
        (falling(0.0), [], PASSED, "+0.000 N/s lost at 10.0 N over 4 s"),
        (falling(-0.2), [], WARNED, "+0.200 N/s lost at 9.6 N over 4 s"),
        (falling(-0.5), [], FAILED, "+0.500 N/s lost at 9.0 N"),
        (falling(0.5), [], PASSED, "-0.500 N/s lost"),
        (falling(0.0, 0.1), [], PASSED, "lost at 0.5 N"),  # below it a share of the force means nothing
        (
            falling(0.0),
            falling(-2e3, 1e5),
            WARNED,
            "; pressure +2.0 % per second lost, allowed 1.3 %, fails above 4.3 %",
        ),
        (falling(0.0), falling(-5e3, 1e5), FAILED, "; pressure +5.0 %"),
        (falling(-0.5), falling(0.0, 1e5), FAILED, "; pressure +0.0 %"),  # of the force alone
        (falling(0.0), falling(-5e3, 1e5, 29), PASSED, "N/s"),  # too few to tell
        (falling(0.0), falling(-5e3, 1e5, 30), FAILED, "; pressure +5.0 %"),
    ],
)
def test_a_hold_loses_what_force_or_pressure_lose(
    held: list[tuple[float, float]], pressures: list[tuple[float, float]], verdict: SelfTestVerdict, words: str
) -> None:
    found = judge_hold(held, pressures)
    assert (found.item, found.verdict) == (Item.LEAK, verdict) and words in found.text
    assert ("pressure" in found.text) == (len(pressures) >= 30)


def test_a_pressure_that_is_not_measured_says_nothing() -> None:
    assert judge_leak(Slope(0.0, 0.0), 10.0, 4.0, nan) == judge_leak(Slope(0.0, 0.0), 10.0, 4.0)


def test_a_step_is_timed_where_it_stands_out_of_the_noise() -> None:
    trace = [(0.01 * k, min(8.0, 4.0 + 0.1 * k)) for k in range(200)]
    assert judge_step(trace, 4.0, 8.0, 0.0, RIG).text.startswith("252 ms to 63 % of a step")
    assert judge_step(trace, 4.0, 8.0, 1.99, RIG).verdict is not NOT_TESTED
    small = judge_step(trace, 4.0, 8.0, 2.01, RIG)
    assert (small.item, small.verdict) == (Item.RESPONSE, NOT_TESTED)
    assert small.text == "a step of 4.0 N does not stand out of a noise of 2.01 N"


def test_a_response_that_was_measured_leaves_less_room_than_a_guess() -> None:
    timing = LoopTiming(dead_time_s=0.02, lags=SecondOrder(0.08, 0.02), landing_s=0.05, integral_per_s=5.0)
    measured = replace(RIG, settings=replace(RIG.settings, timing=timing))
    verdicts = [judge_response(time_s, measured).verdict for time_s in (0.217, 0.219, 0.289, 0.291)]
    assert verdicts == [PASSED, WARNED, WARNED, FAILED]
    assert judge_response(0.1, measured).text.endswith("(120 ms measured by the calibration)")


def test_a_force_that_does_not_settle_fails_the_response() -> None:
    found = still_rising(3.0)
    assert (found.item, found.verdict) == (Item.RESPONSE, FAILED) and "still rises 3 s after" in found.text


def test_what_friction_explains_is_its_width_and_a_newton_and_never_less() -> None:
    assert friction_slack_n(10.0, 14.0) == pytest.approx(6.2)
    assert friction_slack_n(14.0, 10.0) == friction_slack_n(5.0, 5.0) == 1.0


def test_the_error_of_a_difference_of_means_is_that_of_both() -> None:
    assert mean_error_n(0.6, 9, 4) == pytest.approx(0.6 * sqrt(1.0 / 9.0 + 1.0 / 4.0))
    assert mean_error_n(0.6, 0) == mean_error_n(0.6, 1) == 0.6


@pytest.mark.parametrize(
    ("rest_n", "verdict"), [(-2.0, PASSED), (-2.51, WARNED), (-3.01, FAILED), (5.7, PASSED), (6.3, FAILED)]
)
def test_a_zero_may_lie_anywhere_between_what_both_branches_keep_at_rest(
    rest_n: float, verdict: SelfTestVerdict
) -> None:
    """Friction that has stood holds 1.3 times as much as in a ladder."""
    rising, falling_ = (RationalBezier(0.0, 8.0, [at_n, 26.0, 57.0], [1.0, 1.0, 1.0]) for at_n in (-2.0, 4.0))
    known = replace(RIG, model=Bsfm(Branches(rising, falling_), LinearBlend(6.0)))
    assert judge_zero(rest_n, known).verdict is verdict


def test_a_zero_that_moves_is_told_by_how_much_and_what_may_move_it() -> None:
    *_, zero = judge_rest([(0.01 * k, 0.1 + 0.05 * k + 0.001 * (k % 2)) for k in range(100)], RIG)
    assert zero.verdict is FAILED and "it moves by +5.00 N/s" in zero.text
    assert zero.text.endswith(": cell or amplifier drifts, or something still moves the tool")


def test_a_zero_that_is_off_stays_a_failure_where_it_moves_a_little_too() -> None:
    *_, zero = judge_rest([(0.01 * k, -4.0 + 0.001 * k + 0.001 * (k % 2)) for k in range(100)], RIG)
    assert zero.verdict is FAILED and "it moves by +0.10 N/s" in zero.text
    *_, still = judge_rest([(0.01 * k, 0.001 * k + 0.001 * (k % 2)) for k in range(100)], RIG)
    assert still.verdict is WARNED and "it moves by +0.10 N/s" in still.text
