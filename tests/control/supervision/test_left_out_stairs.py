"""A stair that would press more than the rig allows is not put out for a moment either, however seldom the load cell speaks."""

from dataclasses import replace

import pytest

from gateway.control.runs.ladder_stairs import CalibrationPlan
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
