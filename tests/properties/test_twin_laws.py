"""Laws that hold for any plant and any commands: stability, causality, passivity."""

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gateway.twin import Contact, Cylinder, Friction, LoadCell, Plant, Regulator, Twin
from gateway.twin.plant import with_value
from tests.gate.budgets import examples
from tests.twin.traces import trace

_QUIET = settings(
    max_examples=examples(40), deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)


def null_or(low: float, high: float) -> st.SearchStrategy[float]:
    return st.one_of(st.just(0.0), st.floats(low, high))


regulators = st.builds(
    Regulator,
    command_step_v=null_or(0.001, 0.5),
    dead_band_pa=null_or(1.0, 1.0e4),
    hysteresis_pa=null_or(1.0, 5.0e4),
    supply_pa=st.floats(1.0e5, 1.0e6),
    delay_s=null_or(1.0e-4, 0.1),
    lag_s=null_or(1.0e-6, 0.3),
    second_lag_s=null_or(1.0e-6, 0.3),
)
frictions = st.builds(
    Friction,
    coulomb_n=null_or(1.0e-6, 30.0),
    load_dependent_n_per_n=null_or(1.0e-4, 0.3),
    stribeck_n=null_or(1.0e-3, 10.0),
    stribeck_speed_m_per_s=st.floats(1.0e-6, 1.0),
    viscous_n_s_per_m=null_or(1.0e-3, 1.0e5),
    presliding_m=null_or(1.0e-9, 1.0e-2),
)
contacts = st.builds(
    Contact,
    pad_stiffness_n_per_m=st.floats(1.0e2, 1.0e8),
    pad_damping_n_s_per_m=null_or(1.0e-2, 1.0e5),
    gap_m=null_or(1.0e-6, 0.02),
    mass_kg=null_or(1.0e-3, 10.0),
    tilt_deg=st.floats(-180.0, 180.0),
)
plants = st.builds(
    Plant, regulator=regulators, cylinder=st.just(Cylinder(stroke_m=0.03)), friction=frictions, contact=contacts
)
commands_v = st.lists(st.floats(0.0, 10.0), min_size=1, max_size=6)


@_QUIET
@given(plants, commands_v)
def test_any_plant_stays_finite_between_its_stops_and_pushes_only(plant: Plant, voltages_v: list[float]) -> None:
    twin = Twin(plant, 1)
    for voltage_v in voltages_v:
        twin.command(voltage_v)
        result = trace(twin, 0.05, lambda running: (running.force_n, running.position_m, running.friction_n))
        assert np.all(np.isfinite(result))
        assert np.all(result[:, 0] >= 0.0)
        assert np.all((result[:, 1] >= -1.0e-12) & (result[:, 1] <= 0.03 + 1.0e-12))


@_QUIET
@given(plants, commands_v)
def test_the_slide_never_gives_more_work_than_it_was_given(plant: Plant, voltages_v: list[float]) -> None:
    """Work of thrust and weight >= kinetic energy + energy of the pad + work against friction, and friction takes."""
    plant = with_value(plant, "friction", "load_dependent_n_per_n", 0.0)  # a spring whose limit shrinks gives energy
    plant = with_value(plant, "friction", "stribeck_n", 0.0)
    twin, contact = Twin(plant, 1), plant.contact
    weight_n = contact.mass_kg * 9.80665 * np.cos(np.radians(contact.tilt_deg))
    rows = []
    for voltage_v in voltages_v:
        twin.command(voltage_v)
        rows.append(trace(twin, 0.05, lambda now: (now.position_m, now.speed_m_per_s, now.pressure_pa, now.friction_n)))
    position_m, speed, pressure_pa, friction_n = np.concatenate(rows).T
    travel_m = speed * 0.001
    given_j = np.cumsum((pressure_pa * plant.cylinder.area_m2 + weight_n) * travel_m)
    pressed_m = np.maximum(position_m - contact.gap_m, 0.0)
    kept_j = 0.5 * contact.mass_kg * speed**2 + 0.5 * contact.pad_stiffness_n_per_m * pressed_m**2
    taken_j = np.cumsum(friction_n * travel_m)
    scale = 1.0e-9 * (1.0 + np.abs(given_j).max())
    assert np.all(taken_j >= -scale)
    assert np.all(given_j - kept_j - taken_j >= -scale)


@_QUIET
@given(plants, st.floats(0.0, 10.0), st.floats(0.0, 10.0), st.integers(1, 60))
def test_the_future_does_not_change_the_past(plant: Plant, first_v: float, second_v: float, at_ms: int) -> None:
    delay_ms = int(plant.regulator.delay_s * 1000.0 + 1.0e-6)
    remaining, changed = Twin(plant, 1), Twin(plant, 1)
    for twin in (remaining, changed):
        twin.command(first_v)
        twin.advance(at_ms / 1000.0)
    changed.command(second_v)
    for _ in range(delay_ms):
        remaining.advance(0.001)
        changed.advance(0.001)
        assert remaining.force_n == changed.force_n


@_QUIET
@given(plants, commands_v, st.lists(st.integers(1, 40), min_size=1, max_size=8))
def test_cutting_the_time_elsewhere_changes_nothing(plant: Plant, voltages_v: list[float], cuts_ms: list[int]) -> None:
    noisy = with_value(plant, "cell", "noise_n", 0.1)
    whole, cut = Twin(noisy, 7), Twin(noisy, 7)
    for voltage_v in voltages_v:
        whole.command(voltage_v)
        cut.command(voltage_v)
        whole.advance(sum(cuts_ms) / 1000.0)
        for part_ms in cuts_ms:
            cut.advance(part_ms / 1000.0)
        assert whole.force_n == cut.force_n
        assert whole.read() == cut.read()


@_QUIET
@given(st.floats(-200.0, 200.0), st.floats(0.001, 1.0), st.floats(1.0, 100.0))
def test_a_reading_is_within_range_and_within_half_a_quantum(zero_n: float, quantum_n: float, range_n: float) -> None:
    twin = Twin(Plant(cell=LoadCell(zero_n=zero_n, quantum_n=quantum_n, range_n=range_n)), 1)
    assert abs(twin.read()) <= range_n
    assert abs(twin.read() - min(max(zero_n, -range_n), range_n)) <= 0.5 * quantum_n + 1.0e-9
