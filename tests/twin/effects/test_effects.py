"""Size and sign of each effect of the running twin, where a formula says it. Off equals absent: test_twin_null.py."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gateway.twin import Contact, Friction, LoadCell, Plant, Regulator, Surroundings, Twin
from gateway.twin.effects.regulator import apply_leak
from gateway.twin.experiment import Floats
from tests.twin.traces import trace

AROUND = Surroundings(
    temperature_c=30.0,
    supply_kpa=650.0,
    spindle_rpm=6000.0,
    feed_mm_s=-20.0,
    tilt_deg=60.0,
    position_mm=12.0,
    distance_m=5.0,
)
THRUST_N = 36.0  # 4 V


def pressed(plant: Plant, voltage_v: float = 4.0, seconds: float = 1.0, around: Surroundings = AROUND) -> Twin:
    twin = Twin(plant, 1)
    twin.set_surroundings(around)
    twin.command(voltage_v)
    twin.advance(seconds)
    return twin


STATIC: list[tuple[Any, float]] = [
    (Regulator(command_bow=0.05), 45.0 * 2.0 * 0.05 * 4.0 * 0.4 * 0.6),
    (Regulator(command_s=0.05), -90.0 * 0.05 * 8.0 * 0.4 * 0.6 * 0.2),
    (Regulator(droop_pa_per_pa=0.1), 0.1 * 5.0e4 * 1.0e-4),
    (Regulator(droop_share_per_pa=1.0e-6), 0.05 * THRUST_N),
    (Regulator(leak_per_s=0.5), THRUST_N * (math.exp(-0.5 * 0.9995) - 1.0)),
    (Regulator(leak_flow_pa=2.0e4), -2.0 * (3.6e5 + 1.0e5) / 4.0e5),  # choked: in proportion to the absolute pressure
    (Friction(coulomb_n=1.0, asymmetry_n=0.4), -1.4),
    (Friction(coulomb_n=1.0, asymmetry_n=-3.0), 0.0),  # never below 0
    (Friction(side_load_n_s_per_mm=0.05), -1.0),
    (Friction(side_load_n_per_n=0.05), -0.05 * THRUST_N),
    (Friction(side_load_tilt_n=2.0), -2.0 * math.sin(math.radians(60.0))),
    (Friction(side_load_n_per_mm=0.1), -1.2),
    (Friction(coulomb_n=2.0, place_n_per_mm=0.05), -2.6),
    (Friction(coulomb_n=2.0, place_n_per_mm=-0.5), 0.0),  # never below 0
    (Friction(coulomb_n=2.0, place_n_per_mm2=0.005), -2.72),
    (Friction(coulomb_n=2.0, place_asymmetry_n_per_mm=0.05, place_asymmetry_n_per_mm2=-0.005), -1.88),
    (Contact(backlash_n=1.0), -0.5),
    (Contact(hardening=0.05), 0.05 * THRUST_N * math.sqrt(3.6)),
    (Contact(wear_per_m=0.02), -0.1 * THRUST_N),
    (Contact(wear_n_per_m=0.3), 1.5),
    (Contact(tilt_n=2.0, tilt_zero_deg=30.0), 2.0 * math.cos(math.radians(30.0))),
    (Contact(feed_drag_n_s_per_mm=0.05), -1.0),
    (Contact(feed_drag_n=0.7), -0.7),
    (Contact(feed_drag_abs_n_s_per_mm=0.05), 1.0),
    (Contact(position_n_per_mm=0.1), 1.2),
    (Contact(position_n_per_mm2=0.01), 1.44),
    (Contact(ripple_n=0.8, ripple_phase_rad=0.3), 0.8 * math.sin(2.0 * math.pi * 12.0 / 5.0 + 0.3)),
    (Contact(stop_stiffness_n_per_mm=0.5, stop_mm=10.0), 1.0),
    (Contact(stop_stiffness_n_per_mm=0.5, stop_mm=15.0), 0.0),
    (LoadCell(zero_n_per_k=0.1), 1.0),
    (LoadCell(span_per_k=0.01, reference_c=25.0), 0.05 * THRUST_N),
    (LoadCell(warm_up_n=2.0, warm_up_s=0.5), 2.0 * math.exp(-2.0)),
    (LoadCell(drift_n_per_s=0.3), 0.3),
    (LoadCell(quadratic_per_n=1.0e-3), 1.0e-3 * THRUST_N**2),
    (LoadCell(cubic_per_n2=1.0e-5), 1.0e-5 * THRUST_N**3),
    (LoadCell(crosstalk_n_per_v=0.2), 0.8),
    (LoadCell(hum_n=0.4, hum_hz=50.25, hum_phase_rad=0.0), 0.4 * math.sin(2.0 * math.pi * 0.25)),
    (LoadCell(zero_n=-46.0, sign_lost=0.5), -36.0),  # -10 N reads 0: half of it has lost its sign
]
SECTION = {Regulator: "regulator", Friction: "friction", Contact: "contact", LoadCell: "cell"}


@pytest.mark.parametrize(("section", "change_n"), STATIC, ids=[f"{n}" for n in range(len(STATIC))])
def test_the_effect_has_the_size_and_sign_of_its_formula(section: Any, change_n: float) -> None:
    part: dict[str, Any] = {SECTION[type(section)]: section}
    assert pressed(replace(Plant(), **part)).read() - THRUST_N == pytest.approx(change_n, abs=2.0e-3)


def forces(plant: Plant, seconds: float, voltage_v: float = 4.0, every_s: float = 0.001) -> Floats:
    twin = Twin(plant, 1)
    twin.set_surroundings(AROUND)
    twin.command(voltage_v)
    return trace(twin, seconds, lambda running: running.force_n, every_s)


def test_creep_adds_its_share_with_its_time_constant() -> None:
    found = forces(Plant(contact=Contact(creep_share=0.1, creep_s=0.5)), 3.0)
    time_s = (
        0.001 * np.arange(1, 3001) - 0.0005
    )  # the jump of the force is taken for a slope over its first millisecond
    np.testing.assert_allclose(found, THRUST_N * (1.0 + 0.1 * (1.0 - np.exp(-time_s / 0.5))), rtol=1.0e-6)


def test_hunting_is_a_sine_of_its_amplitude_while_there_is_pressure() -> None:
    hunting = Plant(regulator=Regulator(hunting_pa=1.0e4, hunting_hz=10.0, hunting_phase_rad=0.5))
    time_s = 0.001 * np.arange(1, 501)
    np.testing.assert_allclose(forces(hunting, 0.5), THRUST_N + np.sin(2.0 * np.pi * 10.0 * time_s + 0.5), atol=1.0e-9)
    assert not np.any(forces(hunting, 0.5, 0.0))


def test_the_spindle_turns_n_times_as_fast_with_an_unbalance_that_grows_with_the_square() -> None:
    shaking = Plant(contact=Contact(spindle_n=0.5, spindle_n_per_krpm2=0.01, spindle_order=2.0, spindle_phase_rad=0.2))
    time_s = 0.001 * np.arange(1, 201)
    expected = (0.5 + 0.36) * np.sin(2.0 * 2.0 * np.pi * 100.0 * time_s + 0.2)
    np.testing.assert_allclose(forces(shaking, 0.2) - THRUST_N, expected, atol=1.0e-9)


def test_filling_is_slower_than_emptying_by_its_share() -> None:
    leaking = Plant(regulator=Regulator(lag_s=0.1, fill_slowdown=0.5))
    twin = Twin(leaking, 1)
    twin.command(4.0)
    twin.advance(0.15)
    assert twin.force_n == pytest.approx(THRUST_N * (1.0 - math.exp(-1.0)), rel=1.0e-9)
    twin.advance(5.0)
    twin.command(0.0)
    twin.advance(0.1)
    assert twin.force_n == pytest.approx(THRUST_N * math.exp(-1.0), rel=1.0e-9)


@pytest.mark.parametrize(
    ("pressure_pa", "flow"),
    [(3.0e5, 1.0), (2.0e5, 0.75), (0.95e5, 0.4875), (5.0e4, 0.375 * math.sqrt(1.0 - ((1 / 1.5 - 0.528) / 0.472) ** 2))],
)
def test_a_hole_is_choked_down_to_nearly_twice_the_atmosphere(pressure_pa: float, flow: float) -> None:
    """ISO 6358: below a ratio of 0.528 nothing but the pressure before it counts."""
    assert apply_leak(Regulator(leak_flow_pa=1.0e4), pressure_pa) == pytest.approx(pressure_pa - 1.0e4 * flow, rel=1e-9)


def test_a_leak_starts_anew_with_a_command_that_is_noticed_only() -> None:
    plant = Plant(regulator=Regulator(leak_per_s=1.0, dead_band_pa=1.0e4))
    twin = pressed(plant)
    leaked_n = twin.force_n
    twin.command(4.05)  # within the dead band: the valve stays shut
    twin.advance(0.01)
    assert twin.force_n == pytest.approx(leaked_n * math.exp(-0.01), rel=1.0e-3)
    twin.command(4.5)
    twin.advance(0.001)
    assert twin.force_n == pytest.approx(40.5, rel=1.0e-3)


def test_a_rest_must_be_broken_first_and_is_forgotten_then() -> None:
    """Small steps after a rest: the first ones are held, and later the slide is where it would have been."""
    held = {"dwell_stiction_n": 2.0, "dwell_stiction_s": 0.5}
    for presliding_m in (0.0, 5.0e-5):
        found = []
        for more in ({}, held):
            twin = Twin(Plant(friction=Friction(coulomb_n=1.0, presliding_m=presliding_m, **more)), 1)
            twin.command(3.0)
            twin.advance(3.0)
            for step in range(1, 101):
                twin.command(3.0 + 0.02 * step)
                twin.advance(0.002)
                found.append(twin.force_n)
        plain, sticky = np.split(np.array(found), 2)
        assert 1.0 < (plain - sticky)[5:20].max() <= 2.0
        assert np.abs(plain - sticky)[-1] < 0.1


def test_a_late_clock_shows_the_past_and_one_ahead_the_present() -> None:
    lagging = Plant(regulator=Regulator(lag_s=0.1))
    both = LoadCell(clock_offset_s=0.05, clock_skew=0.2)  # of what is late by the offset a share is lost
    for cell, past_s in (
        (LoadCell(clock_offset_s=0.02), 0.02),
        (LoadCell(clock_skew=0.1), 0.1 * 0.15),
        (both, 0.05 + 0.2 * 0.1),
    ):
        late = replace(lagging, cell=cell)
        assert pressed(late, seconds=0.15).read() == pytest.approx(pressed(lagging, seconds=0.15 - past_s).read())
    ahead = replace(lagging, cell=LoadCell(clock_offset_s=-0.02))
    assert pressed(ahead, seconds=0.15).read() == pressed(lagging, seconds=0.15).read()


def test_a_clock_that_is_read_for_long_keeps_no_more_of_the_past_than_it_shows() -> None:
    twin = Twin(Plant(regulator=Regulator(lag_s=0.1), cell=LoadCell(clock_offset_s=0.02)), 1)
    twin.command(4.0)
    readings = trace(twin, 12.0, lambda running: running.read(), 0.5)
    assert readings[-1] == pytest.approx(THRUST_N)
    assert readings[0] == pytest.approx(THRUST_N * (1.0 - math.exp(-4.8)), rel=1.0e-6)


def test_repeats_and_spikes_come_as_often_as_their_share_says() -> None:
    twin = pressed(Plant(cell=LoadCell(noise_n=0.1, repeated_share=0.2)))
    readings = np.array([twin.read() for _ in range(4000)])
    assert np.mean(np.diff(readings) == 0.0) == pytest.approx(0.2, abs=0.03)
    twin = pressed(Plant(cell=LoadCell(outlier_share=0.05, outlier_n=10.0)))
    readings = np.array([twin.read() for _ in range(4000)])
    assert set(np.round(readings - THRUST_N, 9)) == {0.0, 10.0}
    assert np.mean(readings > 40.0) == pytest.approx(0.05, abs=0.015)


def test_surroundings_that_are_not_finite_are_refused() -> None:
    with pytest.raises(ValueError, match="tilt_deg nan is not finite"):
        Twin(Plant(), 1).set_surroundings(Surroundings(tilt_deg=math.nan))
