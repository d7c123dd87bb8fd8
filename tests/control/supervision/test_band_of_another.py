"""What is in band, out of it or noisy is so of what is pursued now: not of a voltage, a bound or an enable before."""

from math import nan

import pytest

from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.in_band import InBandTimer, SettlingCheck
from tests.control.supervision.test_in_band import MOVE, SETTLE, UNREACHABLE_S, at, demand

STEP_S = 0.01


def test_a_force_is_not_in_band_because_the_voltage_before_was() -> None:
    """A robot that goes on when the bit rises would go on before the force was held for its time."""
    check = SettlingCheck(UNREACHABLE_S)
    for now_s in (0.0, 0.25):
        check.judge_voltage(demand(), at(now_s), is_slewing=False)
    assert check.in_band and not check.holds_force
    assert check.judge_force(demand(), at(0.26), 10.0, 10.0) is MOVE and not check.in_band
    assert check.judge_force(demand(), at(0.51), 10.0, 10.0) is SETTLE and check.holds_force


def test_what_is_in_band_is_not_unreachable_whatever_its_mean_was() -> None:
    """Both bits at once would say that the force is right and cannot be reached."""
    timer = InBandTimer(UNREACHABLE_S)
    for k in range(400):
        timer.update(STEP_S * k, True, 0.25, is_out=True)
    assert (timer.in_band, timer.unreachable) == (True, False)


def test_a_force_that_begins_with_a_reading_that_is_none_can_be_found_unreachable() -> None:
    """One overload at the touch is no fault; nothing is off what is no number, for as long as that is remembered."""
    check = SettlingCheck(UNREACHABLE_S)
    check.judge_force(demand(), at(0.0, nan), 10.0, 10.0)
    for k in range(1, 250):
        check.judge_force(demand(), at(STEP_S * k, 5.0), 10.0, 10.0)
    assert check.unreachable


@pytest.mark.parametrize("is_voltage", [False, True])
def test_another_response_bounds_a_force_and_the_answer_to_a_voltage_alike(is_voltage: bool) -> None:
    """A slower machine is waited for, by either mode, and a quick one is told of as soon as it is late."""
    for bound_s in (0.5 * UNREACHABLE_S, 2.0 * UNREACHABLE_S):
        check, late_s = SettlingCheck(UNREACHABLE_S), None
        check.retime(bound_s)
        for k in range(500):
            inputs = at(STEP_S * k, 0.0)
            if is_voltage:
                check.judge_voltage(demand(), inputs, is_slewing=False)
            else:
                check.judge_force(demand(), inputs, 10.0, 10.0)
            late_s = STEP_S * k if check.unreachable and late_s is None else late_s
        assert late_s == pytest.approx(bound_s, abs=2.0 * STEP_S)


def noisy() -> SettlingCheck:
    """One whose single readings keep leaving the band."""
    check = SettlingCheck(UNREACHABLE_S)
    for k in range(700):
        reading = Reading(contact_n=10.0 + 1.5 * (-1.0) ** k, is_new=True, is_usable=True, interval_s=STEP_S)
        check.judge_force(demand(), at(STEP_S * k)._replace(reading=reading), 10.0, 10.0)
    assert check.is_noisy
    return check


def test_behind_a_restart_nothing_is_noisy_until_it_is_seen_again() -> None:
    """Else the first ramp of each further enable began with the sentence that single readings leave the band."""
    check = noisy()
    check.restart()
    assert not check.is_noisy
    check.judge_force(demand(), at(7.0, 1.0), 10.0, 1.0)
    assert not check.is_noisy


def test_what_was_a_noisy_force_is_none_while_a_voltage_is_driven() -> None:
    check = noisy()
    check.judge_voltage(demand(), at(7.0, 10.0), is_slewing=False)
    assert not check.is_noisy
