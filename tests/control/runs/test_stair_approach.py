"""How stairs are approached: at once where nothing rings, along a ramp that a plant of any damping does not overshoot."""

from random import Random

import numpy as np
import pytest

from gateway.bsfm.ladder.labels import Labels
from gateway.bsfm.ladder.plan import RESPONSE_GROUP
from gateway.control import CalibrationInUse, Controller
from gateway.control.runs.ladder_run import LadderRow, LadderRun
from gateway.control.runs.ladder_stairs import QUICK, stairs_of
from gateway.control.runs.stair_approach import StairApproach
from gateway.profiles import load_rig
from gateway.registers.words import CalibrationPhase
from tests.control.foreign.machine import Machine
from tests.control.foreign.stand import Stand, settings

STEP_S = 0.001


def response(damping: float, command: np.ndarray, natural_s: float) -> np.ndarray:
    """Of a second-order plant to a command of every STEP_S."""
    speed, at, passed = 0.0, 0.0, []
    for wanted in command:
        speed += STEP_S * ((wanted - at) / natural_s - 2.0 * damping * speed) / natural_s
        at += STEP_S * speed
        passed.append(at)
    return np.array(passed)


def observed(damping: float, natural_s: float, noise_n: float) -> StairApproach:
    """After three stairs of 10 N at once, seen 100 times a second, 70 ms late."""
    rng, approach = Random(4), StairApproach()
    came_n = 10.0 * response(damping, np.ones(2000), natural_s)
    for _ in range(3):
        late_n = np.concatenate([np.zeros(70), came_n])[::10]
        trace = [(0.01 * k, float(force_n) + rng.gauss(0.0, noise_n)) for k, force_n in enumerate(late_n)]
        approach.observe(trace, 0.0, 10.0, noise_n)
    return approach


@pytest.mark.parametrize("damping", [0.2, 0.3, 0.4, 0.5, 0.6])
@pytest.mark.parametrize("natural_s", [0.03, 0.1])
def test_behind_the_ramp_the_plant_passes_the_stair_by_a_thirtieth_at_most(damping, natural_s):
    approach = observed(damping, natural_s, noise_n=0.03)
    assert approach.ramp_s > 0.0
    command = np.array([approach.share(STEP_S * k) for k in range(2500)])
    assert response(damping, np.ones(2500), natural_s).max() > 1.09
    assert response(damping, command, natural_s).max() < 1.033


def test_a_plant_that_rang_in_fewer_than_half_of_its_stairs_does_not_ring():
    """Somebody may have knocked at the tool."""
    approach = observed(0.3, 0.05, noise_n=0.03)
    assert approach.ramp_s > 0.0
    for _ in range(3):
        approach.observe([(0.01 * k, min(10.0, 0.5 * k)) for k in range(100)], 0.0, 10.0, 0.03)
    assert approach.ramp_s == 0.0


def test_no_way_to_a_stair_takes_longer_than_two_seconds() -> None:
    """Of a plant so slow that its peak comes after a second the whole ladder would be ways."""
    assert observed(0.3, 0.1, noise_n=0.03).ramp_s < 2.0
    assert observed(0.3, 0.35, noise_n=0.03).ramp_s == 2.0


@pytest.mark.parametrize("damping", [0.9, 1.0, 2.0])
def test_a_plant_that_does_not_ring_is_stepped_at_once(damping):
    assert observed(damping, 0.05, noise_n=0.1).ramp_s == 0.0


def test_stairs_of_a_plant_that_rings_show_its_thrust_less_its_friction():
    """Stepped at once a stair reads 0.5 to 0.8 N too high on the way up, because friction keeps a part of the overshoot."""
    machine = Machine(damping=0.4, lag_s=0.06, second_lag_s=0.06, coulomb_n=3.0)
    stand = Stand(machine, Controller(settings(), CalibrationInUse(load_rig("demo").calibration.model(), 1)))
    stand.run(0.3)
    active = stand.controller.active_run
    active.ask(QUICK)
    rows: list[LadderRow] = []
    while not rows or rows[-1].stair.voltage_v < 4.0 or rows[-1].stair.phase is CalibrationPhase.CHECK:
        stand.run(0.05)
        rows += [active.last_row] if active.last_row and active.last_row not in rows[-1:] else []
    assert isinstance(active.run, LadderRun)
    for row in rows:
        if row.stair.phase is CalibrationPhase.LADDER and row.stair.voltage_v >= 2.0:
            thrust_n = machine.drive_n(row.stair.voltage_v)
            assert row.force_n == pytest.approx(thrust_n * (1.0 - machine.load_share) - machine.coulomb_n, abs=0.4)
    planned = stairs_of(QUICK, settings().limits, active.run.model)
    groups = [RESPONSE_GROUP if stair.is_step else stair.group for stair in planned]
    assert [stair.group for stair in active.run.stairs] == groups


def test_steps_for_the_response_alone_are_no_points_of_the_walk():
    group = np.array([-1, -1, -1, RESPONSE_GROUP, RESPONSE_GROUP, -1])
    labels = Labels(np.array([4, 4, 4, 4, 4, 5]), group, np.arange(6))
    assert labels.has_walk
    assert labels.walk_stairs.tolist() == [0, 1, 2]
