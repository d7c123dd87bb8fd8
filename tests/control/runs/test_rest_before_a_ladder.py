"""What a ladder takes for rest and noise: readings of a force that has come to rest, however few they are."""

from collections.abc import Iterable
from dataclasses import replace
from math import exp
from statistics import stdev

import pytest

from gateway.codes.faults import FaultCode
from gateway.control.runs.ladder_run import FEWEST_READINGS, LONGEST_REST_S, MOST_DWELL_S, LadderRun
from gateway.control.sample_conditioning import Reading
from gateway.registers.words import State
from tests.control.bench import Bench, bsfm, settings
from tests.control.runs.test_ladder_run import SHORT, begun


def at_rest(
    forces_n: Iterable[float], period_s: float, lag_s: float = 0.12, said: list[str] | None = None
) -> LadderRun:
    """A run that has seen these readings, until it knows rest and noise. lag_s: of the rig; said: what it says meanwhile."""
    run = LadderRun(SHORT, settings(response_lag_s=lag_s), bsfm())
    for k, force_n in enumerate(forces_n):
        step = run.step(period_s * k, Reading(force_n, force_n, 0.0, period_s, True, True, True))
        if said is not None and step.said:
            said.append(f"{period_s * k:.1f} s: {step.said}")
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


@pytest.mark.parametrize("lag_s", [0.7, 1.0, 1.5, 2.0])
def test_a_slow_machine_is_waited_for_as_its_lag_demands(lag_s: float) -> None:
    """40 N of before: with a lag of 1.5 s 6 N of it were the rest, and the check's first stair seemed to pull (A302)."""
    said: list[str] = []
    run = at_rest((40.0 * exp(-0.01 * k / lag_s) + 0.05 * (-1) ** k for k in range(3000)), 0.01, lag_s, said)
    assert run.rest_n == pytest.approx(0.0, abs=0.5)
    assert run.noise_n == pytest.approx(0.05, abs=0.05)
    assert said == []


@pytest.mark.parametrize(("lag_s", "given_up_s"), [(0.12, MOST_DWELL_S), (1.0, 8.0), (30.0, LONGEST_REST_S)])
def test_a_cell_that_never_rests_is_not_waited_for_for_ever_and_that_is_said(lag_s: float, given_up_s: float) -> None:
    said: list[str] = []
    run = at_rest((0.01 * k for k in range(3000)), 0.01, lag_s, said)
    assert not run.is_waiting
    assert [sentence.partition(" N, moved by")[0] for sentence in said] == [
        f"{given_up_s:.1f} s: the load cell has not come to rest in {given_up_s:.1f} s: {given_up_s - 0.3:.1f}"
    ]


def test_what_a_run_says_of_its_rest_reaches_the_log_once() -> None:
    bench = Bench(seed=14)
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + 0.3 * bench.now_s)
    begun(bench).run(5.0)
    assert sum(event.startswith("the load cell has not come to rest in 3.5 s: ") for event in bench.events) == 1


@pytest.mark.parametrize("runs_before", [0, 1])
def test_what_comes_back_before_a_run_rises_is_no_rise_of_it_however_many_were_before(runs_before: int) -> None:
    """The tool was lifted as it began, and 12 N of the cell come back while it waits for rest."""
    bench = Bench(settings(stuck_n=30.0), seed=14)
    for _ in range(runs_before):
        begun(bench).run(4.0)
        assert bench.last.voltage_v > 0.0
        bench.controller.active_run.ask_stop("calibration stopped by a person")
        bench.run(3.0)
        assert bench.last.state is State.OFF
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n - 12.0)
    begun(bench)
    bench.alter_sample = lambda sample: sample
    bench.history.clear()
    bench.run(6.0)
    assert (bench.last.state, bench.last.fault) == (State.CALIBRATING, FaultCode.NONE), bench.events[-1]
    assert max(volts for _, volts in bench.voltages()) > 1.0
