"""A gateway that holds 12 N, as control tells it, for tests of what is published."""

from dataclasses import replace

from gateway.live import live_state as live
from gateway.live.live_state import LiveState
from gateway.telemetry.series import GatewayReading

HEALTH = {"ticks": 500, "missed_ticks": 3, "loop_time_us": 250.0, "late_p50_us": 64, "late_p99_us": 1024}


def holding() -> LiveState:
    return LiveState(
        rig="demo",
        simulated=True,
        version="1",
        time_unix_s=1000.0,
        state="holding",
        force=live.LiveForce(requested_n=13.0, accepted_n=12.5, applied_n=12.0, measured_n=11.5, pressure_kpa=200.0),
        calibration=live.LiveCalibration(number=3, name="ladder", age_s=60.0),
        output=live.LiveLine(port="/dev/a", asked=20, heard=19, garbled=1, age_s=0.01),
        load_cell=live.LiveLine(port="/dev/b", heard=80, age_s=0.02),
        refusals=2,
        warnings=(live.LiveAlarm(code="W301", title='a "quoted" title', cure="look", since_unix_s=990.0),),
    )


def at(force_n: float) -> LiveState:
    """The same, with another measured force."""
    state = holding()
    return replace(state, force=replace(state.force, measured_n=force_n))


def reading() -> GatewayReading:
    return GatewayReading(holding(), HEALTH | {"residual": {"cause": 0, "name": "none", "looks": 4}})


def without_sample() -> GatewayReading:
    state = holding()
    return GatewayReading(replace(state, force=replace(state.force, measured_n=None)), HEALTH)
