"""The payload's weight changes while the tool presses, by another payload or by a tilt: the slide makes room for it."""

from dataclasses import replace
from math import cos, radians

import pytest

from gateway.registers.words import ControlBit, State
from gateway.units import STANDARD_GRAVITY_M_PER_S2
from tests.control.bench import Bench, enabled, settings

HELD_N = 30.0
MOST_BEYOND_N = 1.0


def held(payload_kg: float, every_ms: int) -> Bench:
    """A bench without a measured response that has held a force for long."""
    bench = enabled(settings(sample_timeout_s=0.25))
    bench.sample_every_ms = every_ms
    bench.write(control_word=ControlBit.ENABLE, force_setpoint_n=HELD_N, payload_kg=payload_kg)
    assert bench.run(4.0).state is State.HOLDING
    return bench


def beyond_n(bench: Bench, seen: int, slide_n: float) -> float:
    """By how much the slide's true force has gone further than to what it has to give, N."""
    way = 1.0 if slide_n > bench.history[seen].force_n else -1.0
    return max(way * (record.force_n - slide_n) for record in bench.history[seen:])


@pytest.mark.sampled
@pytest.mark.parametrize("every_ms", [10, 100])
@pytest.mark.parametrize(("before_kg", "after_kg"), [(1.0, 0.01), (0.5, 0.01), (0.01, 1.0)])
def test_another_payload_is_no_error_of_the_force(before_kg: float, after_kg: float, every_ms: int) -> None:
    """The trim took for one what was on its way: 3.4 N too much, for half a second."""
    bench = held(before_kg, every_ms)
    seen = len(bench.history)
    bench.write(payload_kg=after_kg)
    bench.run(3.0)
    slide_n = HELD_N - after_kg * STANDARD_GRAVITY_M_PER_S2
    assert beyond_n(bench, seen, slide_n) < MOST_BEYOND_N
    assert bench.plant.force_n == pytest.approx(slide_n, abs=0.5)


@pytest.mark.parametrize("tilt_deg", [60.0, 120.0])
def test_a_tool_that_tilts_goes_no_further_than_its_weight_asks_for(tilt_deg: float) -> None:
    bench = held(1.0, 10)
    seen = len(bench.history)
    for k in range(1, 51):
        bench.write(tilt_angle_rad=radians(tilt_deg) * k / 50)
        bench.run(0.02)
    bench.run(2.0)
    slide_n = HELD_N - STANDARD_GRAVITY_M_PER_S2 * cos(radians(tilt_deg))
    assert beyond_n(bench, seen, slide_n) < MOST_BEYOND_N
    assert bench.plant.force_n == pytest.approx(slide_n, abs=0.5)


def test_a_weight_that_comes_in_free_air_turns_no_friction_round() -> None:
    volts = []
    for course_kg in ((0.3,), (0.01, 0.3)):
        bench = enabled(contact=False)
        bench.alter_sample = lambda sample, bench=bench: replace(
            sample, force_n=sample.force_n - bench.command.payload_kg * STANDARD_GRAVITY_M_PER_S2
        )
        for payload_kg in course_kg:
            bench.write(
                control_word=ControlBit.ENABLE, force_setpoint_n=HELD_N, payload_kg=payload_kg, precontact_force_n=10.0
            )
            bench.run(0.25)  # what the cell says of the weight alone is soon called a wrong sign
        volts.append(bench.last.voltage_v)
    assert volts[1] == pytest.approx(volts[0], abs=1e-3) and volts[0] > 0.5
