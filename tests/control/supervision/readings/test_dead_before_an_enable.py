"""A load cell that died while the output was off: what was seen of it then counts at the next enable."""

from dataclasses import replace

import pytest

from gateway.codes.faults import FaultCode
from gateway.devices.messages import ForceSample
from gateway.registers.words import State
from tests.control.bench import Bench, settings

SLOW_MS = 100  # of a cell whose death shows late: half a count of noise at 10 samples/s


def held_and_off() -> Bench:
    bench = Bench(settings(sample_timeout_s=0.25), noise_n=0.5 * 0.098)
    bench.sample_every_ms = SLOW_MS
    bench.run(1.0)
    bench.enable(20.0)
    bench.run(60.0)
    assert bench.last.state is State.HOLDING
    bench.disable()
    bench.run(5.0)
    return bench


def freeze(bench: Bench) -> None:
    last = bench.sample
    assert last is not None

    def frozen(sample: ForceSample) -> ForceSample:
        return replace(sample, raw=last.raw, force_n=last.force_n)

    bench.alter_sample = frozen


def test_a_cell_that_has_been_dead_for_long_is_found_two_seconds_behind_the_enable() -> None:
    """It was judged from nothing, and pressed upon for four and a half seconds more."""
    bench = held_and_off()
    freeze(bench)
    bench.run(30.0)
    bench.enable(20.0)
    took_s = bench.seconds_until(lambda output: output.state is State.FAULT, 5.0)
    assert bench.last.fault is FaultCode.SAMPLE_FROZEN
    assert 1.9 <= took_s <= 2.2
    (told,) = (event for event in bench.events if event.startswith("A312"))
    assert "repeated for 32 s, since before the enable" in told


def test_a_short_enable_between_takes_nothing_away_of_what_was_seen_before_it() -> None:
    bench = held_and_off()
    freeze(bench)
    bench.run(30.0)
    bench.enable(20.0)
    bench.run(0.5)
    bench.disable()
    bench.run(0.5)
    bench.enable(20.0)
    took_s = bench.seconds_until(lambda output: output.state is State.FAULT, 5.0)
    assert bench.last.fault is FaultCode.SAMPLE_FROZEN
    assert 1.9 <= took_s <= 2.2


@pytest.mark.parametrize("force_n", [0.0, 20.0])
def test_a_cell_that_has_only_been_quiet_is_given_the_time_to_show_that_it_lives(force_n: float) -> None:
    bench = held_and_off()
    freeze(bench)
    bench.run(30.0)
    bench.enable(force_n)
    bench.run(1.5)
    bench.alter_sample = lambda sample: sample
    bench.run(5.0)
    assert bench.last.fault is FaultCode.NONE
