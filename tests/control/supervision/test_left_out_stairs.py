"""A stair that would press more than the rig allows is not put out for a moment either, however seldom the load cell speaks."""

from dataclasses import replace

import pytest

from gateway.control.runs.ladder_run import LadderRun
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.registers.words import CalibrationPhase
from tests.control.bench import Bench, settings

SHORT = CalibrationPlan(step_v=1.0, groups=1, minor_points=0)
MOST_N = 40.0


@pytest.mark.parametrize("every_ms", [10, 40, 100])
@pytest.mark.parametrize("gain_n_per_v", [9.0, 11.0])
def test_what_is_left_out_is_not_put_out_until_the_next_reading(every_ms: int, gain_n_per_v: float) -> None:
    """Between two readings control decides at its ticks: the stair that had just been left out went out there, and pressed
    until the next one came."""
    control = settings(sample_timeout_s=0.25)
    bench = Bench(replace(control, limits=replace(control.limits, force_max_n=MOST_N)), gain_n_per_v=gain_n_per_v)
    bench.sample_every_ms = every_ms
    bench.run(1.0)
    bench.controller.active_run.ask(SHORT)
    bench.run(12.0)
    assert [event for event in bench.events if event.startswith("A350")], "a stair was left out"
    assert max(record.force_n for record in bench.history) <= MOST_N
    highest_v = (MOST_N + 2.0) / gain_n_per_v  # friction keeps up to 2 N
    assert max(volts for _, volts in bench.voltages()) <= highest_v


@pytest.mark.parametrize("gain_n_per_v", [12.0, 12.7, 13.0])
def test_a_partial_reversal_is_judged_by_the_highest_stairs_of_the_ladder_before_it(gain_n_per_v: float) -> None:
    """Behind a way down nothing was known, and the walk climbed at once to what was never tried: 53 N pressed of 50."""
    bench = Bench(gain_n_per_v=gain_n_per_v, friction_n=1.15, lag_s=0.046)
    bench.run(1.0)
    bench.controller.active_run.ask(replace(SHORT, step_v=1.2, minor_points=13, response_steps=2))
    bench.seconds_until(lambda output: output.calibration_phase == CalibrationPhase.FITTING, 40.0)
    assert max(record.force_n for record in bench.history) <= bench.settings.limits.force_max_n
    assert bench.last.calibration_phase == CalibrationPhase.FITTING, bench.events


def test_what_was_a_way_down_is_not_climbed_to_where_its_top_is_left_out() -> None:
    """Measured there, it would be on the wrong branch; of the walk behind a ladder it was the next stair but one."""
    bench = Bench(gain_n_per_v=12.7, friction_n=1.15, lag_s=0.046)
    bench.run(1.0)
    bench.controller.active_run.ask(replace(SHORT, step_v=1.2, minor_points=13, response_steps=2))
    bench.run(0.1)
    run, volts = bench.controller.active_run.run, [0.0]
    assert isinstance(run, LadderRun)
    while bench.controller.active_run.running:
        bench.run(0.1)
    for stair in run.stairs:
        volts.append(stair.voltage_v)
        assert stair.direction > 0 or volts[-1] < volts[-2], f"{volts[-2]:.2f} V down to {volts[-1]:.2f} V"


def test_what_follows_a_stair_that_is_left_out_is_judged_as_well() -> None:
    """Nobody looked at the next one of the walk, which went out at once: 32 N pressed of 30."""
    control = settings(response_lag_s=0.25)
    bench = Bench(
        replace(control, limits=replace(control.limits, force_max_n=30.0)),
        gain_n_per_v=11.43,
        friction_n=2.1,
        lag_s=0.032,
    )
    bench.run(1.0)
    bench.controller.active_run.ask(replace(SHORT, step_v=0.9, minor_points=13))
    bench.seconds_until(lambda output: output.calibration_phase == CalibrationPhase.FITTING, 40.0)
    assert max(record.force_n for record in bench.history) <= 30.0
    assert bench.last.calibration_phase == CalibrationPhase.FITTING, bench.events
