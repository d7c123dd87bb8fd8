"""One reading that is false, by a disturbed digit or a spike, moves no force that is held, and blames nobody."""

import itertools
from dataclasses import replace

import pytest

from gateway.bsfm.model import Response
from gateway.codes.faults import FaultCode
from gateway.control import CalibrationInUse
from gateway.control.supervision.leaping_readings import CALM_READINGS, LEAP_N, LeapCheck, LeapLimit
from gateway.devices.messages import ForceSample
from gateway.registers.words import State
from tests.control.bench import Bench, bsfm, enabled, settings

HELD_N = 30.0
MOST_MOVED_N = 1.0


def spoil(bench: Bench, *forces_n: float) -> None:
    """The next readings say this, and no others."""
    left_n = list(forces_n)

    def spoil_one(sample: ForceSample) -> ForceSample:
        force_n = left_n.pop(0) if left_n else sample.force_n
        return replace(sample, raw=force_n, force_n=force_n)

    bench.alter_sample = spoil_one


def held(every_ms: int, response: Response | None = None) -> Bench:
    """A bench that has held a force for long; response: as measured by its calibration."""
    bench = enabled(settings(sample_timeout_s=0.25))
    bench.controller.use(CalibrationInUse(bsfm(), 1, response))
    bench.sample_every_ms = every_ms
    bench.force(HELD_N)
    bench.run(3.0)
    return bench


def moved_n(bench: Bench, *said_n: float) -> float:
    """By how much the true force has left what was held, at most, behind these readings."""
    held_n, seen = bench.plant.force_n, len(bench.history)
    spoil(bench, *said_n)
    bench.run(1.5)
    heard_n = {record.sample.force_n for record in bench.history[seen:] if record.sample}
    assert heard_n.issuperset(said_n)
    return max(abs(record.force_n - held_n) for record in bench.history[seen:])


@pytest.mark.sampled
@pytest.mark.parametrize("said_n", [58.0, 3.0, -20.0])
@pytest.mark.parametrize("every_ms", [10, 50, 100])
def test_one_false_reading_does_not_move_a_held_force(said_n: float, every_ms: int) -> None:
    bench = held(every_ms)
    assert moved_n(bench, said_n) < MOST_MOVED_N


@pytest.mark.sampled
@pytest.mark.parametrize("said_n", [(3.0, 15.0), (58.0, -20.0), (-20.0, 10.0), (58.0, 45.0), (12.0, 22.0)])
@pytest.mark.parametrize("every_ms", [10, 50, 100])
@pytest.mark.parametrize("response", [None, Response(dead_time_s=0.03, lag_s=0.08)], ids=["fixed", "measured"])
def test_two_false_readings_in_a_row_do_not_move_a_held_force(
    said_n: tuple[float, float], every_ms: int, response: Response | None
) -> None:
    bench = held(every_ms, response)
    assert moved_n(bench, *said_n) < MOST_MOVED_N
    bench.plant.gain_n_per_v *= 0.9
    bench.run(3.0)
    assert bench.last.state is State.HOLDING, "the trim goes on learning behind them"


@pytest.mark.parametrize("said_n", [-40.0, -20.0, 40.0])
def test_one_false_reading_right_before_an_enable_is_no_wrong_gain(said_n: float) -> None:
    """It was the force at rest that the first rise was judged from: a fault A303, at the machine that had none."""
    bench = Bench(settings(sample_timeout_s=0.25), seed=2)
    bench.sample_every_ms = 100
    bench.run(2.05)
    spoil(bench, said_n)
    bench.run(0.1)
    bench.enable(HELD_N)
    bench.run(0.1)  # with the reading behind it
    bench.enable(HELD_N)
    assert bench.run(3.0).state is State.HOLDING and bench.last.fault is FaultCode.NONE


def test_a_leap_is_believed_as_soon_as_a_second_reading_says_so() -> None:
    limit = LeapLimit()
    assert [limit.take(force_n) for force_n in (20.0, 20.1, 60.0, 60.0, 59.0)] == [
        20.0,
        20.1,
        20.1 + LEAP_N,
        60.0,
        59.0,
    ]


def test_what_follows_a_leap_that_was_alone_is_believed_whole() -> None:
    limit = LeapLimit()
    assert [limit.take(force_n) for force_n in (20.0, -40.0, 19.9, 20.1)] == [20.0, 20.0 - LEAP_N, 19.9, 20.1]


def test_behind_a_rest_the_first_reading_is_believed_whatever_was_before() -> None:
    limit = LeapLimit()
    limit.take(50.0)
    limit.forget()
    assert limit.take(0.0) == 0.0
    check = LeapCheck(0.1)
    assert not check.passes_over(50.0, 50.0)
    check.forget()
    assert not check.passes_over(0.0, 0.0)


def passed_over(*forces_n: float) -> list[bool]:
    check = LeapCheck(0.1)
    return [check.passes_over(force_n, force_n) for force_n in (20.0, *forces_n)][1:]


def test_a_second_leap_that_agrees_with_nothing_is_passed_over_and_the_third_is_believed() -> None:
    assert passed_over(60.0, 45.0, 45.5) == [True, True, False]
    assert passed_over(60.0, 58.0) == [True, False]


def test_of_a_force_that_shakes_no_second_leap_is_passed_over() -> None:
    shaken = passed_over(60.0, 20.0, 60.0, 45.0)
    assert shaken == [True, False, True, False]
    calm_again = passed_over(60.0, 20.0, *[20.0] * CALM_READINGS, 60.0, 45.0)
    assert calm_again[-2:] == [True, True]


@pytest.mark.parametrize(
    ("said_n", "every_ms", "code"),
    [
        ((28.2, 31.8), 10, "W361"),
        ((24.0, 28.0), 10, "A301"),
        ((31.0, 35.0), 10, "A301"),
        ((25.0, 35.0), 100, "W361"),
        ((26.4, 30.0), 100, "A301"),
    ],
)
def test_readings_of_two_values_by_turns_are_told_and_not_followed(
    said_n: tuple[float, float], every_ms: int, code: str
) -> None:
    """A defective amplifier: supply pressure, calibration, span or noise were named, and of some the trim went to its limit."""
    bench = held(every_ms)
    by_turns = itertools.cycle(said_n)
    bench.alter_sample = lambda sample: replace(sample, raw=(force_n := next(by_turns)), force_n=force_n)
    before_n = bench.plant.force_n
    bench.run(15.0)
    (told,) = (event for event in bench.events if event.startswith(code))
    assert f"nothing but {said_n[0]:.2f} N and {said_n[1]:.2f} N by turns" in told
    assert "amplifier or its cable is defective" in told and "supply" not in told
    assert abs(bench.plant.force_n - before_n) < MOST_MOVED_N


@pytest.mark.parametrize(
    ("said_n", "quantum_n"), [((29.9, 30.0), 0.1), ((30.0,) * 30 + (20.0,), 0.1), ((995.0, 1000.0), 5.0)]
)
def test_two_neighbouring_counts_and_a_force_that_falls_once_are_no_defect(
    said_n: tuple[float, ...], quantum_n: float
) -> None:
    check = LeapCheck(quantum_n)
    for _ in range(3):
        for force_n in said_n:
            check.passes_over(force_n, force_n)
    assert check.two_values == ""


def test_two_values_of_before_are_none_of_now() -> None:
    check = LeapCheck(0.1)
    for force_n in (0.0, 20.0) * 4:
        check.passes_over(force_n, force_n)
    assert check.two_values
    check.forget()
    assert check.two_values == "" and not check.passes_over(20.0, 20.0)
