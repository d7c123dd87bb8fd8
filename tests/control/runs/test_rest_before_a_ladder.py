"""What a ladder takes for rest and noise: readings of a force that has come to rest, however few they are."""

from collections.abc import Iterable
from math import exp
from statistics import stdev

import pytest

from gateway.control.runs.ladder_run import FEWEST_READINGS, LadderRun
from gateway.control.sample_conditioning import Reading
from tests.control.bench import bsfm, settings
from tests.control.runs.test_ladder_run import SHORT


def at_rest(forces_n: Iterable[float], period_s: float) -> LadderRun:
    """A run that has seen these readings, until it knows rest and noise."""
    run = LadderRun(SHORT, settings(), bsfm())
    for k, force_n in enumerate(forces_n):
        run.step(period_s * k, Reading(force_n, force_n, 0.0, period_s, True, True, True))
        if not run.is_waiting:
            return run
    raise AssertionError("it waits for ever")


def test_the_noise_of_a_slow_cell_is_no_smaller_for_its_few_readings() -> None:
    forces_n = [0.1, -0.1, 0.1, -0.1, 0.1, -0.1, 0.1, -0.1]
    run = at_rest(forces_n, 0.1)
    assert run.noise_n == pytest.approx(stdev(forces_n[:FEWEST_READINGS]))


def test_a_force_that_is_still_leaving_is_neither_rest_nor_noise() -> None:
    """The run before has let go of 10 N: half a second later a quarter of it is still there."""
    run = at_rest((10.0 * exp(-0.01 * k / 0.4) + 0.05 * (-1) ** k for k in range(1000)), 0.01)
    assert run.rest_n == pytest.approx(0.0, abs=0.2)
    assert run.noise_n == pytest.approx(0.05, abs=0.02)
