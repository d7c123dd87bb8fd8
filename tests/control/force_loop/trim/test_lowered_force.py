"""A force that is lowered does not rise first, however much the trim has taken off it."""

from dataclasses import replace

import pytest

from gateway.bsfm.model import Response
from gateway.control import CalibrationInUse, Controller, Trim
from gateway.registers.words import StatusBit
from tests.control.bench import Bench, bsfm, settings

RESPONSE = Response(dead_time_s=0.025, lag_s=0.08, second_lag_s=0.015)


@pytest.mark.parametrize("gain_n_per_v", [8.5, 12.0])
@pytest.mark.parametrize("ramp_n_per_s", [5.0, 60.0])
def test_a_stronger_machine_presses_no_more_when_its_force_is_lowered(gain_n_per_v: float, ramp_n_per_s: float) -> None:
    """What had been learned was forgotten within a newton of the way back: 1.9 V of 30 N, and they became 45 N on the way to
    20 N."""
    control = replace(settings(), trim=Trim(gain_v_per_n_s=0.8, limit_v=3.0))
    bench = Bench(control, gain_n_per_v=gain_n_per_v)
    bench.controller = Controller(control, CalibrationInUse(bsfm(), 1, RESPONSE))
    bench.run(0.3)
    bench.enable(30.0, force_ramp_n_per_s=ramp_n_per_s)
    held = bench.run(9.0)
    assert held.status & StatusBit.IN_BAND and held.trim_v < -0.4
    held_n, first = bench.plant.force_n, len(bench.history)
    bench.force(20.0)
    bench.run(10.0 / ramp_n_per_s + 3.0)
    assert max(record.force_n for record in bench.history[first:]) < held_n + 0.3
    assert bench.last.force_measured_n == pytest.approx(20.0, abs=1.0)
