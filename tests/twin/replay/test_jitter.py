"""Rows at uneven times: a command's corner falls between them, and each still shows what a fine grid shows there."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gateway.twin import Contact, Cylinder, Drive, Friction, LoadCell, Plant, Regulator, Replay
from gateway.twin.experiment import Floats
from gateway.twin.plant import with_value

ROWS, FINE_S = 1200, 1.0e-4
RANDOM = np.random.default_rng(5)
_WANDERED = np.arange(ROWS) * 0.005 + RANDOM.uniform(-0.0015, 0.0015, ROWS)
JITTERED_S = _WANDERED - _WANDERED[0]
EVEN_S = np.arange(ROWS) * 0.005
GAPS_S = np.delete(JITTERED_S, np.concatenate([np.arange(230, 290), np.arange(700, 703)]))
RIGID = Plant(regulator=Regulator(lag_s=0.045), friction=Friction(coulomb_n=1.0, load_dependent_n_per_n=0.03))
SOFT = with_value(RIGID, "friction", "presliding_m", 2.0e-4)


def drive(time_s: Floats, **changes: Any) -> Drive:
    """Steps of 5 V, every 1.2 s."""
    columns = {"time_s": time_s, "command_v": np.where(time_s % 2.4 < 1.2, 6.0, 1.0)}
    return Drive(**(columns | changes))


def worst_n(plant: Plant, time_s: Floats, **changes: Any) -> float:
    """Largest difference of the readings from those in fine steps."""
    found, fine = (Replay(drive(time_s, **changes), step_s).run([plant]).reading_n[0] for step_s in (None, FINE_S))
    return float(np.abs(found - fine).max())


@pytest.mark.parametrize("delay_s", [0.0, 0.0071, 0.0233])
@pytest.mark.parametrize("lag_s", [0.03, 0.12])
def test_a_step_between_uneven_rows_makes_no_outliers(lag_s: float, delay_s: float) -> None:
    for plant in (RIGID, SOFT, replace(RIGID, friction=Friction())):
        moved = replace(plant, regulator=Regulator(lag_s=lag_s, delay_s=delay_s))
        assert worst_n(moved, JITTERED_S) < 0.001


@pytest.mark.parametrize(
    ("regulator", "most_n"),
    [
        (Regulator(lag_s=0.05, second_lag_s=0.03, delay_s=0.0123), 0.001),
        (Regulator(lag_s=0.05, second_lag_s=0.05, delay_s=0.0123), 0.001),
        (Regulator(second_lag_s=0.04, delay_s=0.0123), 0.001),
        (Regulator(lag_s=0.05, second_lag_s=0.02, fill_slowdown=0.5, delay_s=0.0123), 0.05),
        (Regulator(slew_pa_per_s=2.0e6, delay_s=0.0123), 0.001),
        (Regulator(lag_s=0.03, slew_pa_per_s=2.0e6, delay_s=0.0123), 0.1),  # where the slope falls below the limit
        (Regulator(lag_s=0.03, ceiling_pa=4.0e5, leak_flow_pa=2.0e4, delay_s=0.0123), 0.001),
    ],
)
def test_every_lag_and_limit_is_exact_whatever_the_rows(regulator: Regulator, most_n: float) -> None:
    for time_s in (JITTERED_S, EVEN_S):
        assert worst_n(replace(RIGID, regulator=regulator), time_s) < most_n


@pytest.mark.parametrize("delay_s", [0.0, 0.0049, 0.05, 0.0512, 5.0, 100.0])
@pytest.mark.parametrize("lags_s", [(0.045, 0.0), (0.0, 0.03), (0.05, 0.05), (0.05, 0.01)])
def test_the_filter_of_even_rows_is_the_recursion_of_uneven_ones(lags_s: tuple[float, float], delay_s: float) -> None:
    plant = Plant(regulator=Regulator(lag_s=lags_s[0], second_lag_s=lags_s[1], delay_s=delay_s))
    bent_s = np.concatenate([EVEN_S[:-1], EVEN_S[-1:] + 1.0e-6])  # the last row makes the rows uneven
    even, uneven = (Replay(drive(time_s)).run([plant]).pressure_pa[0] for time_s in (EVEN_S, bent_s))
    np.testing.assert_allclose(even[:-1], uneven[:-1], rtol=0.0, atol=0.01)


def test_rows_far_apart_have_points_between_them() -> None:
    grid = Replay(drive(GAPS_S)).grid
    assert np.isin(GAPS_S, grid.time_s).all()
    assert np.diff(grid.time_s).max() < 1.5 * grid.step_s
    np.testing.assert_array_equal(grid.at_rows(grid.time_s), GAPS_S)
    assert worst_n(RIGID, GAPS_S) < 0.001


@pytest.mark.parametrize(
    ("section", "change", "most_n"),
    [
        ("friction", {"viscous_n_s_per_m": 10.0}, 0.3),
        ("friction", {"stribeck_n": 0.2}, 0.3),
        ("friction", {"stribeck_n": 0.2, "stribeck_speed_m_per_s": 10.0}, 0.01),  # as good as none: a constant
        ("friction", {"dwell_stiction_n": 1.0, "dwell_stiction_s": 0.5, "presliding_m": 2.0e-4}, 0.1),
        ("contact", {"creep_share": 0.1, "creep_s": 0.5}, 0.01),
        ("contact", {"gap_m": 1.0e-4}, 0.001),
        ("cell", {"filter_s": 0.01}, 0.25),  # sees lines between the rows, and the corner lies between two
    ],
)
def test_what_lives_in_time_takes_the_length_of_each_step(
    section: str, change: dict[str, float], most_n: float
) -> None:
    plant = replace(RIGID, **{section: replace(getattr(RIGID, section), **change)})
    assert worst_n(plant, JITTERED_S) < most_n


def test_steady_drag_does_not_feel_the_jitter() -> None:
    """On a ramp the speed is the same in steps of any length."""
    ramp_v = np.minimum(1.0 + JITTERED_S, 6.0)
    plant = Plant(cylinder=Cylinder(area_m2=1.0e-3), contact=Contact(pad_stiffness_n_per_m=1.0e4))
    for friction in (
        Friction(viscous_n_s_per_m=300.0),
        Friction(viscous_n_s_per_m=300.0, presliding_m=1.0e-4, coulomb_n=1.0),
        Friction(viscous_n_s_per_m=300.0, coulomb_n=1.0, stribeck_n=0.3),
    ):
        given = Drive(time_s=JITTERED_S, pressure_pa=1.0e5 * ramp_v, before_v=None)
        dragging = replace(plant, friction=friction)
        free = replace(plant, friction=replace(friction, viscous_n_s_per_m=0.0))
        slow, prompt = Replay(given).run([dragging, free]).force_n
        sliding = (JITTERED_S > 1.0) & (JITTERED_S < 4.5)
        np.testing.assert_allclose(prompt[sliding] - slow[sliding], 300.0 * 0.01, atol=0.01)


@pytest.mark.parametrize("count", [2, 9, 40])
def test_plants_at_uneven_rows_are_single_runs(count: int) -> None:
    drags = [Friction(coulomb_n=1.0, viscous_n_s_per_m=50.0)]
    drags += [replace(drags[0], presliding_m=2.0e-4), replace(drags[0], stribeck_n=0.5, dwell_stiction_n=0.5)]
    for friction in drags:
        base = replace(RIGID, friction=friction, cell=LoadCell(filter_s=0.005), contact=Contact(creep_share=0.02))
        plants = [with_value(base, "friction", "coulomb_n", 1.0 + 0.02 * lane) for lane in range(count)]
        together = Replay(drive(GAPS_S)).run(plants).reading_n
        for lane in (0, count // 2, count - 1):
            alone = Replay(drive(GAPS_S)).run([plants[lane]]).reading_n[0]
            np.testing.assert_allclose(together[lane], alone, rtol=0.0, atol=1.0e-7)


def test_a_delay_acts_smoothly_at_uneven_rows() -> None:
    plants = [replace(RIGID, regulator=Regulator(lag_s=0.05, delay_s=0.02 + 0.0005 * k)) for k in range(31)]
    change = np.diff(Replay(drive(JITTERED_S)).run(plants).pressure_pa, axis=0)
    size = np.sqrt(np.mean(change**2, axis=1))
    assert size.max() / size.min() < 1.1  # which rows lie in the corners changes
