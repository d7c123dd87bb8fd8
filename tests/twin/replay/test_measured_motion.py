"""Replay with a measured motion: friction follows the position."""

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

from gateway.twin import Contact, Cylinder, Drive, Friction, Plant, Replay
from gateway.twin.experiment import Floats

ROWS = 2000
TIME_S = np.arange(ROWS) * 0.005
POSITION_M = 0.01 + 0.005 * np.sin(2.0 * np.pi * TIME_S / 2.5)
SPEED = 0.005 * (2.0 * np.pi / 2.5) * np.cos(2.0 * np.pi * TIME_S / 2.5)
PRESSURE_PA = np.full(ROWS, 1.0e5)
MOVING = (np.abs(SPEED) > 0.002) & (TIME_S > 0.0)  # before the first row nobody knows where it came from


def force(
    friction: Friction, motion: Literal["measured", "measured-reversed"] = "measured", noise_m: float = 0.0
) -> Floats:
    position_m = POSITION_M + noise_m * np.random.default_rng(1).standard_normal(ROWS)
    drive = Drive(
        time_s=TIME_S, pressure_pa=PRESSURE_PA, position_m=position_m, motion=motion, position_noise_m=noise_m
    )
    plant = Plant(cylinder=Cylinder(area_m2=1.0e-3), friction=friction)
    return Replay(drive).run([plant]).force_n[0]


def test_friction_takes_from_the_thrust_moving_out_and_adds_moving_in() -> None:
    found = force(Friction(coulomb_n=2.0))
    np.testing.assert_allclose(found[MOVING], 100.0 - 2.0 * np.sign(SPEED[MOVING]), atol=1.0e-6)
    other = force(Friction(coulomb_n=2.0), "measured-reversed")
    np.testing.assert_allclose(other[MOVING], 100.0 + 2.0 * np.sign(SPEED[MOVING]), atol=1.0e-6)


def test_asymmetry_load_and_speed_enter_by_their_own_terms() -> None:
    found = force(
        Friction(
            coulomb_n=2.0,
            asymmetry_n=0.5,
            load_dependent_n_per_n=0.01,
            viscous_n_s_per_m=100.0,
            asymmetry_n_s_per_m=40.0,
            stribeck_n=1.0,
            stribeck_speed_m_per_s=0.01,
        )
    )
    limit = 2.0 + 0.01 * 100.0 + 1.0 / (1.0 + (SPEED / 0.01) ** 2)
    expected = 100.0 - 0.5 - limit * np.sign(SPEED) - np.where(SPEED > 0.0, 140.0, 60.0) * SPEED
    np.testing.assert_allclose(found[MOVING], expected[MOVING], atol=0.01)


def test_presliding_rounds_the_reversals_by_its_travel() -> None:
    rigid, soft = force(Friction(coulomb_n=2.0)), force(Friction(coulomb_n=2.0, presliding_m=1.0e-3))
    top = int(np.argmax(POSITION_M))
    back_m = POSITION_M[top] - POSITION_M[top : top + 100]
    np.testing.assert_allclose(soft[top : top + 100][back_m > 2.0e-3], rigid[top : top + 100][back_m > 2.0e-3])
    within = (back_m > 1.0e-4) & (back_m < 1.0e-3)
    assert np.all(soft[top : top + 100][within] < rigid[top : top + 100][within] - 0.1)


def test_noise_of_the_position_does_not_turn_the_friction_over() -> None:
    found = force(Friction(coulomb_n=2.0), noise_m=2.0e-6)
    quick = (np.abs(SPEED) > 0.006) & (TIME_S > 0.0)
    np.testing.assert_allclose(found[quick], 100.0 - 2.0 * np.sign(SPEED[quick]), atol=0.2)


def test_stiction_after_a_rest_shows_when_motion_begins_and_is_gone_after_it() -> None:
    position_m = np.concatenate([np.zeros(1000), 1.0e-6 * np.arange(1000)])
    drive = Drive(time_s=TIME_S, pressure_pa=PRESSURE_PA, position_m=position_m, motion="measured")
    base = Plant(cylinder=Cylinder(area_m2=1.0e-3), friction=Friction(coulomb_n=2.0))
    sticky = replace(base, friction=Friction(coulomb_n=2.0, dwell_stiction_n=1.5, dwell_stiction_s=1.0))
    plain, found = Replay(drive).run([base, sticky]).force_n
    assert plain[1005] - found[1005] == pytest.approx(1.5 * (1.0 - np.exp(-5.0)) * np.exp(-5.0 / 20.0), rel=0.05)
    assert plain[1200] - found[1200] < 0.15  # 0.2 mm/s are slow: some stiction grows again on the way
    assert plain[500] == found[500] == 100.0


def test_the_pad_is_left_out() -> None:
    drive = Drive(time_s=TIME_S, pressure_pa=PRESSURE_PA, position_m=POSITION_M, motion="measured")
    plant = Plant(friction=Friction(coulomb_n=1.0, viscous_n_s_per_m=50.0))
    other = replace(plant, contact=Contact(pad_stiffness_n_per_m=1.0e3, gap_m=0.001))
    found = Replay(drive).run([plant, other]).force_n
    np.testing.assert_array_equal(found[0], found[1])
