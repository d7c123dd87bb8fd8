"""The force loop by itself where contact comes and goes: what it may go for, what it forgets, and what a rest leaves of it."""

from dataclasses import replace

import pytest

from gateway.bsfm.model import Response
from gateway.control.force_loop.force_loop import ForceLoop
from gateway.control.force_loop.response_timing import timing_of
from gateway.control.inputs import LineStatus
from gateway.control.sample_conditioning import Reading
from gateway.control.settings import LeadSettings, Trim
from gateway.registers.words import LimitedBy
from tests.control.bench import settings
from tests.control.force_loop.test_force_loop import LINE, inputs, loop_of, pressed, wish


def step(loop: ForceLoop, force_n: float, contact_n: float, ticks: int = 1, **changes: object) -> ForceLoop:
    for _ in range(ticks):
        loop.elapse(0.01, LINE)
        loop.step(wish(force_n, ramp_n_per_s=100.0), inputs(contact_n, **changes))
    return loop


def test_a_first_rise_that_is_too_high_is_held_at_the_pre_contact_force() -> None:
    held = step(loop_of(), 40.0, 5.0, 200, held_back=True)
    most_n = held.feedforward.approaching_n(wish(40.0).manner.precontact_n)
    assert held.applied_n == pytest.approx(most_n) and most_n < 10.0
    assert step(held, 40.0, 5.0, 200).applied_n == 40.0, "and goes on where it was none"


@pytest.mark.parametrize("outside_n", [-3.0, 4.0])
def test_a_force_from_outside_is_not_asked_of_the_slide(outside_n: float) -> None:
    alone = pressed(loop_of(), 20.0)
    helped = pressed(loop_of(), 20.0, outside_n=outside_n)
    weighed = loop_of()
    for _ in range(300):
        weighed.elapse(0.01, LINE)
        weighed.step(wish(20.0, gravity_n=outside_n), inputs(weighed.feedforward.reference_n))
    assert helped.voltage_v == pytest.approx(weighed.voltage_v) and helped.voltage_v != pytest.approx(alone.voltage_v)
    assert (helped.voltage_v < alone.voltage_v) is (outside_n > 0.0)


def test_a_contact_that_is_lost_takes_target_and_trim_with_it_at_once() -> None:
    loop = step(pressed(loop_of(), 30.0), 30.0, 25.0, 20)
    before_v = loop.voltage_v
    assert loop.trim_v > 0.0
    step(loop, 30.0, 0.0, touching=False)
    approach_n = loop.feedforward.approaching_n(wish(30.0).manner.precontact_n)
    assert (loop.applied_n, loop.trim_v) == (pytest.approx(approach_n), 0.0)
    assert loop.voltage_v < 0.5 * before_v, "a free tool must not shoot out"


def test_a_contact_ramp_begins_anew_behind_a_rest_though_the_tool_touches_still() -> None:
    def applied_n(loop: ForceLoop, ticks: int) -> float:
        for tick in range(ticks):
            loop.elapse(0.01, LINE)
            slowly = wish(30.0, ramp_n_per_s=100.0, contact_ramp_s=2.0)
            loop.step(slowly, inputs(2.0, now_s=10.0 + 0.01 * tick))
        return loop.applied_n

    fresh = applied_n(loop_of(), 20)
    assert 2.0 < fresh < 4.0, "0.2 s of 2"
    again = loop_of()
    again.step(wish(30.0), inputs(2.0, now_s=1.0))
    again.rest()
    assert applied_n(again, 20) == pytest.approx(fresh)


def test_what_a_cell_of_two_values_has_said_is_forgotten_with_a_rest() -> None:
    loop = pressed(loop_of(), 20.0)
    for k in range(8):
        contact_n = 30.0 if k % 2 else 10.0
        step(
            loop, 20.0, contact_n, reading=Reading(contact_n, contact_n, 0.0, 0.01, True, True, True, False, contact_n)
        )
    assert loop.leaps.two_values
    loop.rest()
    assert not loop.leaps.two_values


def test_below_the_smallest_force_nothing_of_the_trim_goes_out() -> None:
    loop = step(pressed(loop_of(), 20.0), 20.0, 15.0, 20)
    assert loop.trim_v > 0.0
    step(loop, 0.5 * settings().limits.smallest_force_n, 15.0, 400)
    assert (loop.voltage_v, loop.limited_by) == (0.0, LimitedBy.SMALLEST_FORCE)


def test_a_force_that_was_in_band_is_not_once_the_output_rests() -> None:
    loop = loop_of()
    for tick in range(300):
        step(loop, 20.0, loop.feedforward.reference_n, now_s=0.01 * tick)
    assert loop.in_band
    loop.rest()
    assert not loop.in_band


@pytest.mark.parametrize(("sent_v", "is_pushed"), [(None, False), (0.0, True)])
def test_what_the_wire_has_not_taken_yet_is_pushed_for_on(sent_v: float | None, is_pushed: bool) -> None:
    """By the wish alone the model of the lags would be there before the regulator has heard of it."""
    loop = loop_of(replace(settings(), trim=Trim(), lead=LeadSettings(lag_s=0.1)))
    for _ in range(100):
        loop.elapse(0.01, LineStatus(sent_v=sent_v))
        loop.step(wish(20.0, ramp_n_per_s=1e3), inputs(loop.feedforward.reference_n))
    settled_v = pressed(loop_of(replace(settings(), trim=Trim())), 20.0).voltage_v
    assert (loop.voltage_v > 1.5 * settled_v) is is_pushed


@pytest.mark.parametrize("wires_s", [(0.0, 0.015), (0.015, 0.04)])
def test_what_keeps_the_wire_for_longer_is_braked_for_sooner(wires_s: tuple[float, float]) -> None:
    """A setting that waits behind the push lets it go on: told nothing of it, the loop would push beyond the wish."""
    measured = timing_of(Response(dead_time_s=0.02, lag_s=0.1, second_lag_s=0.08), settings())
    pushes = []
    for wire_s in wires_s:
        loop, volts = loop_of(measured), list[float]()
        for _ in range(40):
            loop.elapse(0.01, LineStatus(wire_s=wire_s))
            loop.step(wish(20.0, ramp_n_per_s=200.0), inputs(loop.feedforward.reference_n))
            volts.append(loop.voltage_v)
        pushes.append(sum(voltage_v > 8.0 for voltage_v in volts))
    assert pushes[0] > pushes[1] > 0
