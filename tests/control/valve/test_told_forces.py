"""What the log says of a force while the tool pulls has the sign that registers and recordings show."""

import re
from collections.abc import Callable
from dataclasses import replace

import pytest

from gateway.codes.faults import FaultCode
from gateway.control.settings import SafeDirection
from gateway.devices.messages import ForceSample
from tests.control.valve.valve_bench import PULL, ValveBench


def pressed_with(force_n: float) -> Callable[[ForceSample], ForceSample]:
    return lambda sample: replace(sample, raw=sample.raw + force_n, force_n=sample.force_n + force_n)


def first_fault(bench: ValveBench, within_s: float = 4.0) -> tuple[str, float]:
    """The sentence of the first fault, and what the registers showed in that step."""
    at = len(bench.history)
    bench.run(within_s)
    output = next(one.output for one in bench.history[at:] if one.output.fault)
    return output.events[0], output.force_measured_n


@pytest.mark.parametrize("pressed_n", [75.0, -50.0])
def test_an_over_force_is_told_as_it_is_shown_and_what_was_expected_as_a_pull(pressed_n: float) -> None:
    """A push of 63 N on a tool that pulls was -63 N in the log and +63 N everywhere else."""
    bench = ValveBench().pulling()
    bench.alter_sample = pressed_with(pressed_n)
    sentence, shown_n = first_fault(bench)
    assert shown_n * pressed_n > 0.0
    assert sentence.startswith(f"A313 {shown_n:.1f} N measured, allowed 60.0 N, -1"), sentence


@pytest.mark.parametrize("pressed_n", [20.0, -20.0])
def test_a_force_that_is_stuck_is_told_as_it_is_shown(pressed_n: float) -> None:
    bench = ValveBench(stands=PULL, safe=SafeDirection.PULL)
    bench.run(1.0)
    bench.alter_sample = pressed_with(pressed_n)
    bench.run(2.0)
    bench.enable(5.0)
    (event,) = (one for one in bench.events if one.startswith("W304"))
    assert f"W304 {pressed_n:.0f}." in event and bench.refused
    assert f"W304 {bench.last.force_measured_n:.1f} N measured" in bench.refused.text


def test_a_frozen_reading_is_told_as_it_is_shown() -> None:
    bench = ValveBench().pulling()
    bench.cell_frozen = True
    bench.force(30.0)
    sentence, shown_n = first_fault(bench)
    assert sentence.startswith(f"A312 {shown_n:.2f} N repeated") and shown_n < -10.0


def test_a_pull_that_is_missing_is_told_as_it_is_shown() -> None:
    bench = ValveBench().pulling()
    bench.plant.gain_n_per_v = 3.0
    bench.run(4.0)
    (event,) = (one for one in bench.events if one.startswith("A301"))
    said = re.match(r"A301 .* V out, (\S+) N measured, (\S+) expected", event)
    assert said and float(said[1]) < -2.0 and float(said[2]) < float(said[1])


def test_a_force_that_goes_the_wrong_way_is_told_as_it_goes() -> None:
    bench = ValveBench().pulling()
    bench.plant.sign = 1.0
    bench.force(30.0)
    sentence, _ = first_fault(bench)
    assert sentence.startswith(FaultCode.SIGN_INVERTED.code)
    assert re.match(r"A302 force went \+\S+ N where -\S+ N were expected", sentence), sentence
