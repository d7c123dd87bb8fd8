"""One reading that is false, by a disturbed digit or a spike, moves no force that is held, and blames nobody."""

from dataclasses import replace

import pytest

from gateway.codes.faults import FaultCode
from gateway.control.supervision.leaping_readings import LEAP_N, LeapLimit
from gateway.devices.messages import ForceSample
from gateway.registers.words import State
from tests.control.bench import Bench, enabled, settings

HELD_N = 30.0
MOST_MOVED_N = 1.0


def spoil_one(bench: Bench, force_n: float) -> None:
    """The next reading alone says this."""

    def spoil(sample: ForceSample) -> ForceSample:
        bench.alter_sample = lambda whole: whole
        return replace(sample, raw=force_n, force_n=force_n)

    bench.alter_sample = spoil


@pytest.mark.parametrize("said_n", [58.0, 3.0, -20.0])
@pytest.mark.parametrize("every_ms", [10, 50, 100])
def test_one_false_reading_does_not_move_a_held_force(said_n: float, every_ms: int) -> None:
    bench = enabled(settings(sample_timeout_s=0.25))
    bench.sample_every_ms = every_ms
    bench.force(HELD_N)
    bench.run(3.0)
    held_n, seen = bench.plant.force_n, len(bench.history)
    spoil_one(bench, said_n)
    bench.run(1.5)
    assert any(record.sample and record.sample.force_n == said_n for record in bench.history[seen:])
    moved_n = max(abs(record.force_n - held_n) for record in bench.history[seen:])
    assert moved_n < MOST_MOVED_N


@pytest.mark.parametrize("said_n", [-40.0, -20.0, 40.0])
def test_one_false_reading_right_before_an_enable_is_no_wrong_gain(said_n: float) -> None:
    """It was the force at rest that the first rise was judged from: a fault A303, at the machine that had none."""
    bench = Bench(settings(sample_timeout_s=0.25), seed=2)
    bench.sample_every_ms = 100
    bench.run(2.05)
    spoil_one(bench, said_n)
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
