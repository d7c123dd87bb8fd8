"""Moving, waiting or settled: by how long the force has been in band, and what begins the wait anew."""

import pytest

from gateway.control.demand import Demand, demand_of
from gateway.control.inputs import LoopInputs
from gateway.control.sample_conditioning import Reading
from gateway.control.state_table import StateEvent
from gateway.control.supervision.in_band import InBandTimer, SettlingCheck
from gateway.registers.command import Command
from tests.control.bench import settings

WAIT, MOVE, SETTLE = StateEvent.WAIT, StateEvent.MOVE, StateEvent.SETTLE
UNREACHABLE_S = 2.0


def demand(force_n: float = 10.0, voltage_v: float = 3.0, **manner: float) -> Demand:
    asked = demand_of(Command(force_setpoint_n=force_n), settings())
    return asked._replace(
        voltage_v=voltage_v, manner=asked.manner._replace(**{"tolerance_n": 1.0, "in_band_time_s": 0.25} | manner)
    )


def at(now_s: float, contact_n: float = 10.0, *, touching: bool = True, expected_n: float = 10.0) -> LoopInputs:
    return LoopInputs(now_s, 0.01, Reading(contact_n=contact_n), touching, expected_n)


def test_both_times_are_kept_to_the_step_and_begin_anew_with_each_change() -> None:
    timer = InBandTimer(0.5)
    seen = []
    for k, is_inside in enumerate([True] * 3 + [False] * 5 + [True] * 3):
        timer.update(0.125 * k, is_inside, 0.25)
        seen.append((timer.in_band, timer.unreachable))
    neither, inside, out = (False, False), (True, False), (False, True)
    assert seen == [neither, neither, inside, *[neither] * 4, out, neither, neither, inside]


@pytest.mark.parametrize("contact_n", [9.0, 11.0])
def test_a_force_at_its_tolerance_settles_and_beyond_it_does_not(contact_n: float) -> None:
    for off_n, event in ((contact_n, SETTLE), (2.0 * contact_n - 10.0, MOVE)):
        check = SettlingCheck(UNREACHABLE_S)
        check.judge_force(demand(), at(0.0, off_n), 10.0, 10.0)
        assert check.judge_force(demand(), at(0.25, off_n), 10.0, 10.0) is event


@pytest.mark.parametrize(
    ("inputs", "goal_n", "applied_n"),
    [
        (at(0.0, touching=False), 10.0, 10.0),
        (at(0.0), 10.0, 8.5),
        (at(0.0), 8.0, 8.0),  # held back: the target is not at the setpoint
        (at(0.0, 8.0), 10.0, 10.0),
    ],
)
def test_what_is_not_at_its_setpoint_in_contact_begins_the_wait_anew(
    inputs: LoopInputs, goal_n: float, applied_n: float
) -> None:
    check = SettlingCheck(UNREACHABLE_S)
    check.judge_force(demand(), at(0.0), 10.0, 10.0)
    assert check.judge_force(demand(), at(0.25), 10.0, 10.0) is SETTLE
    assert check.judge_force(demand(), inputs._replace(now_s=0.5), goal_n, applied_n) is not SETTLE
    assert check.judge_force(demand(), at(0.625), 10.0, 10.0) is MOVE and not check.in_band


@pytest.mark.parametrize(
    ("force_n", "touching", "goal_n", "applied_n", "event"),
    [
        (0.0, True, 0.0, 0.0, WAIT),
        (0.0, True, 0.0, 0.5, MOVE),
        (10.0, False, 2.0, 2.0, WAIT),
        (10.0, False, 2.0, 1.5, MOVE),
        (10.0, True, 10.0, 10.0, MOVE),
    ],
)
def test_only_what_has_nothing_more_to_do_by_itself_waits(
    force_n: float, touching: bool, goal_n: float, applied_n: float, event: StateEvent
) -> None:
    check = SettlingCheck(UNREACHABLE_S)
    assert check.judge_force(demand(force_n), at(0.0, 0.0, touching=touching), goal_n, applied_n) is event


def test_no_setpoint_and_a_target_on_its_way_are_not_unreachable() -> None:
    for force_n, applied_n in ((0.0, 0.0), (10.0, 5.0)):
        check = SettlingCheck(UNREACHABLE_S)
        check.judge_force(demand(), at(0.0, 0.0), 10.0, 10.0)
        check.judge_force(demand(force_n), at(1.0, 0.0), force_n, applied_n)
        check.judge_force(demand(), at(1.5, 0.0), 10.0, 10.0)
        check.judge_force(demand(), at(3.0, 0.0), 10.0, 10.0)
        assert not check.unreachable
        check.judge_force(demand(), at(3.5, 0.0), 10.0, 10.0)
        assert check.unreachable


@pytest.mark.parametrize(
    ("contact_n", "touching", "is_unreachable"), [(2.0, True, True), (4.0, True, False), (0.0, False, False)]
)
def test_a_force_that_does_not_go_along_with_a_long_ramp_is_unreachable_before_its_end(
    contact_n: float, touching: bool, is_unreachable: bool
) -> None:
    """Air failed on a ramp of 1 N/s: 30 N short at its end, half a minute later, and nothing was told."""
    check, slow = SettlingCheck(UNREACHABLE_S), demand(40.0, ramp_n_per_s=1.0)
    for now_s, applied_n in ((0.0, 5.0), (UNREACHABLE_S, 6.0)):
        check.judge_force(slow, at(now_s, contact_n, touching=touching), 40.0, applied_n)
    assert check.unreachable is is_unreachable


@pytest.mark.parametrize(
    ("readings_n", "is_unreachable"), [((7.0, 9.5), True), ((8.0, 12.0), False), ((7.5, 9.9), True)]
)
def test_noise_does_not_hide_a_force_that_is_off_and_makes_none_of_one_that_is_not(
    readings_n: tuple[float, float], is_unreachable: bool
) -> None:
    """A cell of 1 N rms: 2.9 N were missing for good, the band was 1 N, and nothing was told."""
    check = SettlingCheck(UNREACHABLE_S)
    for k in range(400):
        reading = Reading(contact_n=readings_n[k % 2], interval_s=0.01, is_new=True, is_usable=True)
        check.judge_force(demand(), at(0.01 * k)._replace(reading=reading), 10.0, 10.0)
    assert (check.unreachable, check.in_band) == (is_unreachable, False)


@pytest.mark.parametrize("in_band_time_s", [0.0, 0.02])
def test_a_reading_now_and_then_that_is_in_the_band_hides_no_force_that_is_off(in_band_time_s: float) -> None:
    """2.2 N too much, and every few dozen readings one within the band of 1.5 N: in_band was said, and nothing told."""
    check, seen = SettlingCheck(UNREACHABLE_S), []
    for k in range(1000):
        contact_n = 10.9 if k % 50 > 46 else 12.0
        reading = Reading(contact_n=contact_n, interval_s=0.01, is_new=True, is_usable=True)
        check.judge_force(demand(in_band_time_s=in_band_time_s), at(0.01 * k)._replace(reading=reading), 10.0, 10.0)
        seen.append((check.in_band, check.unreachable))
    assert (True, False) in seen[:200], "a reading within the band is in it as long as the target is not given up"
    assert set(seen[201:]) == {(False, True)}


@pytest.mark.parametrize("in_band_time_s", [0.0, 0.1])
def test_a_force_that_comes_back_is_in_band_before_its_mean_is(in_band_time_s: float) -> None:
    check = SettlingCheck(UNREACHABLE_S)
    for k in range(330):
        reading = Reading(contact_n=10.0 if k >= 300 else 0.0, interval_s=0.01, is_new=True, is_usable=True)
        check.judge_force(demand(in_band_time_s=in_band_time_s), at(0.01 * k)._replace(reading=reading), 10.0, 10.0)
        assert not (check.in_band and check.unreachable)
    assert check.unreachable
    for k in (330, 331):
        check.judge_force(demand(in_band_time_s=in_band_time_s), at(0.01 * k), 10.0, 10.0)
    assert check.in_band and not check.unreachable


@pytest.mark.parametrize(("held_back_n", "is_unreachable"), [(0.0, False), (2.0, True)])
def test_a_target_that_is_taken_back_again_and_again_is_missed(held_back_n: float, is_unreachable: bool) -> None:
    """Of a machine 2.4 times as strong behind a cell of 5 Hz: each rise was held back, for good, and nothing told."""
    check = SettlingCheck(UNREACHABLE_S)
    for k in range(1000):
        applied_n = 4.0 + 0.01 * (k % 50) if held_back_n else 4.0 + 0.01 * k
        goal_n = held_back_n if held_back_n and k % 50 > 25 else 40.0
        check.judge_force(demand(40.0, ramp_n_per_s=1.0), at(0.01 * k, applied_n), goal_n, applied_n)
    assert check.unreachable is is_unreachable


def test_what_has_gone_along_with_a_ramp_still_has_to_be_held_at_its_end() -> None:
    check, slow = SettlingCheck(UNREACHABLE_S), demand(ramp_n_per_s=1.0)
    for now_s in (0.0, 1.0):
        assert check.judge_force(slow, at(now_s, 7.0), 10.0, 7.0) is MOVE
    assert check.judge_force(slow, at(2.0), 10.0, 10.0) is MOVE and not check.in_band
    assert check.judge_force(slow, at(2.25), 10.0, 10.0) is SETTLE


@pytest.mark.parametrize(
    ("expected_n", "touching", "is_slewing", "is_unreachable"),
    [(2.0, False, False, True), (1.9, False, False, False), (9.0, True, False, False), (9.0, False, True, False)],
)
def test_a_voltage_is_unanswered_where_a_force_is_expected_and_nothing_is_felt(
    expected_n: float, touching: bool, is_slewing: bool, is_unreachable: bool
) -> None:
    check = SettlingCheck(UNREACHABLE_S)
    for now_s in (0.0, UNREACHABLE_S):
        check.judge_voltage(demand(), at(now_s, touching=touching, expected_n=expected_n), is_slewing=is_slewing)
    assert check.unreachable is is_unreachable
    check.judge_force(demand(0.0), at(UNREACHABLE_S), 0.0, 0.0)
    assert not check.unreachable, "in force mode the voltage is not what is asked for"


@pytest.mark.parametrize(("contact_n", "is_unreachable"), [(6.1, True), (6.3, False), (24.0, False)])
def test_a_voltage_is_unanswered_where_friction_alone_keeps_the_tool_in_contact(
    contact_n: float, is_unreachable: bool
) -> None:
    check = SettlingCheck(UNREACHABLE_S)
    for now_s in (0.0, UNREACHABLE_S):
        check.judge_voltage(demand(), at(now_s, contact_n, expected_n=24.0), is_slewing=False)
    assert check.unreachable is is_unreachable
    assert check.in_band and not check.holds_force


def test_a_restart_forgets_both_waits() -> None:
    check = SettlingCheck(UNREACHABLE_S)
    for now_s in (0.0, UNREACHABLE_S):
        check.judge_voltage(demand(), at(now_s, touching=False), is_slewing=False)
    assert check.unreachable and check.in_band
    check.restart()
    assert not check.unreachable and not check.in_band


def test_a_voltage_settles_where_it_is_out_and_not_on_its_way_or_at_none() -> None:
    check, asked = SettlingCheck(UNREACHABLE_S), demand()
    off = demand(voltage_v=0.0)
    assert check.judge_voltage(asked, at(0.0), is_slewing=True) is MOVE
    assert check.judge_voltage(asked, at(0.25), is_slewing=False) is MOVE
    assert check.judge_voltage(asked, at(0.5), is_slewing=False) is SETTLE
    assert check.judge_voltage(off, at(0.75), is_slewing=False) is WAIT
    assert check.judge_voltage(off, at(0.8), is_slewing=True) is MOVE
    assert check.judge_voltage(asked, at(0.875), is_slewing=False) is MOVE


def test_a_lower_voltage_which_is_out_at_once_settles_anew() -> None:
    check = SettlingCheck(UNREACHABLE_S)
    asked = [(0.0, 3.0), (0.25, 3.0), (0.5, 2.0), (0.625, 2.0), (0.75, 2.0)]
    told = [check.judge_voltage(demand(voltage_v=volts), at(now_s), is_slewing=False) for now_s, volts in asked]
    assert told == [MOVE, SETTLE, MOVE, MOVE, SETTLE]


@pytest.mark.parametrize(
    ("swing_n", "in_band_time_s", "is_noisy"),
    [(1.5, 0.25, True), (0.9, 0.25, False), (0.9, 20.0, False), (8.0, 0.25, True)],
)
def test_a_force_whose_single_readings_leave_the_band_is_noisy_and_one_that_must_stay_in_it_for_long_is_not(
    swing_n: float, in_band_time_s: float, is_noisy: bool
) -> None:
    check, asked = SettlingCheck(UNREACHABLE_S), demand(in_band_time_s=in_band_time_s)
    seen = []
    for k in range(700):
        reading = Reading(contact_n=10.0 + (-1) ** k * swing_n, is_new=True, is_usable=True, interval_s=0.01)
        check.judge_force(asked, at(0.01 * k)._replace(reading=reading), 10.0, 10.0)
        seen.append(check.is_noisy)
    assert (any(seen[:500]), seen[-1]) == (False, is_noisy)
    check.judge_force(asked._replace(force_n=30.0), at(7.0), 30.0, 10.0)
    check.judge_force(asked._replace(force_n=30.0), at(7.5, 30.0), 30.0, 30.0)
    assert not check.is_noisy, "another setpoint waits anew"
    check.restart()
    assert not check.is_noisy


@pytest.mark.parametrize(("inside", "of", "is_noisy"), [(4, 20, True), (16, 20, True), (198, 200, False)])
def test_moments_in_the_band_do_not_hide_that_the_force_keeps_leaving_it(inside: int, of: int, is_noisy: bool) -> None:
    """A cell of 0.7 N rms and a band of 1 N: in_band came and went four times a second, and nothing was told for good."""
    check, seen = SettlingCheck(UNREACHABLE_S), []
    for k in range(2000):
        off_n = 0.0 if k % of < inside else 1.5 * (-1) ** (k // of)
        reading = Reading(contact_n=10.0 + off_n, is_new=True, is_usable=True, interval_s=0.01)
        check.judge_force(demand(in_band_time_s=0.02), at(0.01 * k)._replace(reading=reading), 10.0, 10.0)
        seen.append((check.in_band, check.is_noisy))
    assert (True, is_noisy) in seen[1000:] and {noisy for _, noisy in seen[1000:]} == {is_noisy}


def test_a_restart_forgets_how_long_single_readings_have_left_the_band() -> None:
    check = SettlingCheck(UNREACHABLE_S)
    for k in range(700):
        reading = Reading(contact_n=10.0 + (-1) ** k * 1.5, is_new=True, is_usable=True, interval_s=0.01)
        check.judge_force(demand(), at(0.01 * k)._replace(reading=reading), 10.0, 10.0)
    assert check.is_noisy
    check.restart()
    check.judge_force(demand(), at(7.0), 10.0, 10.0)
    assert not check.is_noisy


def test_at_a_new_setpoint_the_force_of_the_one_before_counts_for_nothing() -> None:
    """Behind a low-pass it went on for 0.9 s: a noisy force that had arrived at once was called missed."""
    check, swing_n = SettlingCheck(0.5), 1.5
    for k in range(300):
        target_n = 10.0 if k < 200 else 30.0
        reading = Reading(contact_n=target_n + (-1) ** k * swing_n, is_new=True, is_usable=True, interval_s=0.01)
        inputs = at(0.01 * k)._replace(reading=reading)
        check.judge_force(demand(target_n), inputs, target_n, 20.0 if k == 200 else target_n)
        assert not check.unreachable


@pytest.mark.parametrize(
    ("is_new", "is_usable", "is_missed"), [(True, True, True), (False, True, False), (True, False, False)]
)
def test_only_a_new_and_usable_reading_says_that_the_force_is_off(
    is_new: bool, is_usable: bool, is_missed: bool
) -> None:
    check, right = SettlingCheck(0.5), Reading(contact_n=10.0, is_new=True, is_usable=True, interval_s=0.01)
    check.judge_force(demand(), at(0.0)._replace(reading=right), 10.0, 10.0)
    for k in range(1, 150):
        off = Reading(contact_n=5.0, is_new=is_new, is_usable=is_usable, interval_s=0.01)
        check.judge_force(demand(), at(0.01 * k)._replace(reading=off), 10.0, 10.0)
    assert check.unreachable is is_missed


def test_a_force_that_is_off_in_the_mean_is_called_unsteady_no_more() -> None:
    """One cause at a time: whoever looks for noise does not look for air."""
    check = SettlingCheck(UNREACHABLE_S)
    for k in range(1100):
        force_n = 10.0 + (-1) ** k * 1.5 if k < 700 else 2.0
        reading = Reading(contact_n=force_n, is_new=True, is_usable=True, interval_s=0.01)
        check.judge_force(demand(), at(0.01 * k)._replace(reading=reading), 10.0, 10.0)
        assert not (check.is_noisy and check.unreachable)
    assert check.unreachable
