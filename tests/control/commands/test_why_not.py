"""Where a check turns from yes to no, and the numbers that its sentence names."""

from dataclasses import replace

import pytest

from gateway.control.messages import hunting_sentence
from gateway.control.sample_conditioning import Reading
from gateway.control.settings import Supervision
from gateway.control.supervision.fault_detection import FaultDetector
from gateway.control.tare import Zero
from tests.control.bench import settings


def zero_of(*forces_n: float) -> Zero:
    zero = Zero(Supervision())
    for force_n in forces_n:
        zero.observe(force_n)
    return zero


def test_a_zero_needs_five_steady_samples_within_half_the_range() -> None:
    assert zero_of(*(0.1,) * 4).unsteady(0.0) == "4 usable samples, at least 5 are needed"
    assert zero_of(*(0.1,) * 5).unsteady(0.0) == ""
    assert zero_of(0.0, 0.0, 0.0, 0.0, 0.5).unsteady(0.0) == ""
    assert zero_of(0.0, 0.0, 0.0, 0.0, 0.51).unsteady(0.0) == "force not steady: 0.51 N between samples, allowed 0.50 N"
    assert zero_of(*(49.0,) * 5).unsteady(0.0) == ""
    assert zero_of(*(49.1,) * 5).unsteady(0.0) == "49.1 N at rest, allowed 49 N: stuck in contact or wrong cell"
    assert zero_of(*(-49.1,) * 5).unsteady(0.0) == "-49.1 N at rest, allowed 49 N: stuck in contact or wrong cell"
    assert zero_of(*(45.0,) * 5).unsteady(4.5) == "45.0 N at rest, allowed 49 N: stuck in contact or wrong cell"
    assert zero_of(*(51.0,) * 5).unsteady(-4.5) == ""


def test_a_zero_forgets_and_tells_how_far_it_moved() -> None:
    zero = zero_of(*(2.0,) * 25)
    assert zero.take(0.5) == pytest.approx(2.5) and zero.zero_n == pytest.approx(2.5)
    for _ in range(20):
        zero.observe(1.0)
    assert zero.take(0.0) == pytest.approx(-1.5)
    zero.forget()
    assert zero.unsteady(0.0).startswith("0 usable samples")


def over_force(contact_n: float, expected_n: float, *, overload: bool = False) -> str:
    detector = FaultDetector(settings())
    reading = Reading(cell_n=contact_n, contact_n=contact_n, overload=overload)
    return detector._over_words(reading, expected_n)


def test_an_over_force_far_from_the_model_is_blamed_on_the_cell() -> None:
    assert (
        over_force(61.0, 20.0)
        == "61.0 N measured, allowed 60.0 N, 20.0 N expected: kgf and N mixed up, or a wrong span?"
    )
    assert over_force(61.0, 21.0) == "61.0 N measured, allowed 60.0 N, 21.0 N expected: a jam, or the tool was pushed"
    assert over_force(-61.0, -21.0).endswith("a jam, or the tool was pushed")
    rig = settings()
    near = FaultDetector(replace(rig, limits=replace(rig.limits, over_force_n=51.0)))
    words = near._over_words(Reading(cell_n=51.0, contact_n=51.0), 47.0)
    assert words.endswith("a jam, or the tool was pushed, or over_force_n is too near above force_max_n (1 N)")
    assert over_force(61.0, 20.0, overload=True).startswith("cell saturated (98 N is 98 % of its range)")


def test_a_hunting_loop_says_how_often_it_turned_and_all_that_ends_its_rest() -> None:
    """The trim goes on at an offset, too, and a second correction beside "until there is another setpoint" was a riddle."""
    sentence = hunting_sentence(12.0, 7)
    assert sentence.startswith("W360 at 12.0 N the trim has turned round 7 times: ")
    assert sentence.endswith("stands still until there is another setpoint, or a large error that stays on one side")
