"""The rigs that scenes of runs are played on."""

from dataclasses import replace
from pathlib import Path
from random import Random

from gateway.control import ControlSettings, LeaseAction
from gateway.control.settings import Defaults, SafeDirection, SelfTestSettings, ValveControl
from tests.control.bench import settings
from tests.control.valve.valve_bench import SHARE
from tests.service.running_rig.runs.drawn.run_rig import RunRig

SLOW_TICKS = 4
"""A cell that speaks so seldom is thought frozen, with right, where no noise shows in what it says."""


def draw_rig(draw: Random, folder: Path, seed: int) -> RunRig:
    """A rig of any kind that has runs; one in three may be stronger than its calibration says, up to twice."""
    period_ticks = draw.choice((1, 1, 2, 4, 10))
    gain_n_per_v = draw.uniform(6.0, draw.choice((9.0, 9.0, 13.0)))
    friction_n, lag_s = draw.uniform(0.3, 2.2), draw.uniform(0.04, 0.12)
    plant = {"gain_n_per_v": gain_n_per_v, "friction_n": friction_n, "lag_s": lag_s}
    rig = RunRig(_draw_control(draw, period_ticks), folder, period_ticks, seed=seed, **plant)
    rig.plant.noise_n = rig.noise_n = 0.04 if period_ticks < SLOW_TICKS else 0.1
    rig.curve_per_v = 0.0 if rig.relay else draw.choice((0.0, draw.uniform(-0.03, 0.03)))
    return rig


def _draw_control(draw: Random, period_ticks: int) -> ControlSettings:
    timeout_s = max(0.05, 0.025 * period_ticks)
    control = settings(
        lease_s=draw.choice((None, 0.35)), lease_action=draw.choice(tuple(LeaseAction)), sample_timeout_s=timeout_s
    )
    valve = draw.choice((None, None, ValveControl(pull_area_share=SHARE, safe=draw.choice(tuple(SafeDirection)))))
    rest_v = 0.0 if valve else draw.choice((0.0, 0.0, 0.0, 0.5))
    limits = replace(
        control.limits,
        force_max_n=draw.choice((30.0, 40.0, 50.0)),
        voltage_slew_v_per_s=draw.choice((100.0, 100.0, 8.0)),
        safe_voltage_v=rest_v,
        voltage_min_v=rest_v,
    )
    return replace(
        control,
        limits=limits,
        defaults=Defaults(force_ramp_n_per_s=draw.choice((15.0, 60.0, 200.0))),
        self_test=SelfTestSettings(force_n=draw.choice((0.0, 8.0, 15.0, 25.0))),
        valve=valve,
    )
