"""The first rise of the force, as it is measured: from the force at rest, whenever the output was enabled."""

from dataclasses import replace
from math import exp, nan

import pytest

from gateway.codes.faults import FaultCode
from gateway.control import LeadSettings, LineStatus
from gateway.control.force_loop.force_loop import ForceLoop
from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.plausibility import ExpectedForce, RiseCheck
from gateway.registers.words import State
from tests.control.bench import Bench, bsfm, settings

RESTING = Reading(cell_n=1.0, interval_s=0.01, is_new=True, is_fresh=True, is_usable=True)


@pytest.mark.parametrize("before", [1, 2, 5, 50])
def test_a_force_that_stays_has_not_risen_however_soon_behind_the_start_it_is_enabled(before: int) -> None:
    check = RiseCheck(contact_threshold_n=2.0)
    for _ in range(before):
        check.smooth(RESTING)
    check.start()
    for _ in range(50):
        check.smooth(RESTING)
    assert check.measured_rise_n == pytest.approx(0.0)


def test_a_scale_that_was_right_is_looked_at_again_at_the_next_enable() -> None:
    bench = Bench(seed=3)
    bench.run(0.3)
    bench.enable(12.0)
    assert bench.run(2.0).state is State.HOLDING
    bench.disable()
    bench.run(1.0)
    bench.plant.unit = 9.80665
    bench.enable(12.0)
    bench.run(2.0)
    assert bench.last.fault is FaultCode.GAIN_WRONG


def test_an_overload_leaves_what_was_smoothed_and_no_nan() -> None:
    check = RiseCheck(0.5)
    check.smooth(Reading(5.0, 5.0, 0.0, 0.01, is_new=True, is_fresh=True, is_usable=True))
    check.smooth(Reading(nan, nan, 0.0, 0.01, is_new=True, is_fresh=True, overload=True))
    assert check.smooth_n == 5.0


def test_another_model_brings_its_own_force_at_rest() -> None:
    expected = ExpectedForce(bsfm(), 0.1, rest_v=1.0)
    expected.use(bsfm(1.5))
    assert expected.rise_n(1.0) == 0.0 and expected.kept_n == bsfm(1.5).force_n(1.0, 1.0)


def test_the_lags_are_driven_by_what_the_wire_has_taken() -> None:
    loop = ForceLoop(replace(settings(), lead=LeadSettings(lag_s=0.1)), bsfm())
    loop.elapse(0.1, LineStatus(sent_v=2.0))
    assert loop._lead.first_v == pytest.approx(2.0 * (1.0 - exp(-1.0)))
    loop.elapse(0.1, LineStatus())
    assert loop._lead.first_v == pytest.approx(2.0 * (1.0 - exp(-1.0)) * exp(-1.0))


@pytest.mark.parametrize("rate_n_per_s", [0.0, 3.0])
@pytest.mark.parametrize("offset_n", [-12.0, 12.0])
def test_behind_a_tare_a_force_that_rises_is_told_from_one_that_stays_as_before(
    offset_n: float, rate_n_per_s: float
) -> None:
    judged = []
    for off_n in (0.0, offset_n):
        check, expected = RiseCheck(contact_threshold_n=1.0), ExpectedForce(bsfm(), 0.01, rest_v=0.0)
        for _ in range(100):
            check.smooth(RESTING._replace(cell_n=off_n))
        check.shift(off_n)
        check.start()
        expected.advance(4.0, 10.0)
        course = []
        for k in range(100):
            check.smooth(RESTING._replace(cell_n=1.5 + rate_n_per_s * 0.01 * k))
            course.append(check.judge(expected, 1.0, touching=True, interval_s=0.01))
        judged.append(course)
    assert FaultCode.GAIN_WRONG in judged[0]
    assert judged[1] == judged[0]


def test_a_sign_that_was_right_in_this_enable_is_not_blamed_on_the_wires() -> None:
    """A tool of 2 kg that was tilted without a word of it."""
    for held_s in (0.0, 3.0):
        bench = Bench(seed=4)
        bench.run(0.3)
        bench.plant.sign = 1.0 if held_s else -1.0
        bench.enable(12.0)
        bench.run(held_s)
        bench.plant.sign = -1.0
        bench.run(1.0)
        (sentence,) = (event for event in bench.events if event.startswith("A302"))
        assert ("swap the cell's signal wires" in sentence) == (not held_s)
        assert ("it was right before in this enable: a tilt" in sentence) == bool(held_s)
