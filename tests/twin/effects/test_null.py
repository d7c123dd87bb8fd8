"""Off equals absent: each effect at its null value leaves no trace, and each effect that is on leaves one."""

import numpy as np
import pytest

from gateway.twin import UNLIMITED, Contact, Friction, LoadCell, Plant, Regulator, Surroundings, Twin
from gateway.twin.experiment import Floats
from gateway.twin.plant import values, with_value
from tests.twin.traces import trace

DIMENSIONS = {
    ("regulator", "full_scale_v"),
    ("regulator", "full_scale_pa"),
    ("cylinder", "area_m2"),
    ("contact", "pad_stiffness_n_per_m"),
    ("friction", "stribeck_speed_m_per_s"),
    ("friction", "dwell_stiction_s"),
    ("regulator", "droop_reference_pa"),
    ("regulator", "hunting_hz"),
    ("regulator", "hunting_phase_rad"),
    ("contact", "creep_s"),
    ("contact", "tilt_zero_deg"),
    ("contact", "spindle_order"),
    ("contact", "spindle_phase_rad"),
    ("contact", "ripple_pitch_mm"),
    ("contact", "ripple_phase_rad"),
    ("contact", "stop_mm"),
    ("cell", "reference_c"),
    ("cell", "warm_up_s"),
    ("cell", "hum_hz"),
    ("cell", "hum_phase_rad"),
    ("cell", "outlier_n"),
}
"""A machine has these in any case, or they shape an effect that another field switches on; they have no null value."""

ON = {
    ("regulator", "command_step_v"): 0.3,
    ("regulator", "dead_band_pa"): 2.0e4,
    ("regulator", "hysteresis_pa"): 2.0e4,
    ("regulator", "supply_pa"): 3.0e5,
    ("regulator", "delay_s"): 0.0125,
    ("regulator", "slew_pa_per_s"): 1.0e6,
    ("regulator", "lag_s"): 0.02,
    ("regulator", "second_lag_s"): 0.03,
    ("cylinder", "stroke_m"): 5.0e-4,
    ("cylinder", "chamber_lag_s"): 0.03,
    ("friction", "coulomb_n"): 2.0,
    ("friction", "load_dependent_n_per_n"): 0.05,
    ("friction", "stribeck_n"): 1.5,
    ("friction", "viscous_n_s_per_m"): 300.0,
    ("friction", "presliding_m"): 2.0e-4,
    ("contact", "pad_damping_n_s_per_m"): 200.0,
    ("contact", "gap_m"): 1.0e-4,
    ("contact", "mass_kg"): 0.6,
    ("contact", "tilt_deg"): 40.0,
    ("regulator", "command_bow"): 0.05,
    ("regulator", "command_s"): 0.05,
    ("regulator", "ceiling_pa"): 3.0e5,
    ("regulator", "leak_per_s"): 0.5,
    ("regulator", "leak_flow_pa"): 2.0e4,
    ("regulator", "droop_pa_per_pa"): 0.1,
    ("regulator", "droop_share_per_pa"): 1.0e-6,
    ("regulator", "fill_slowdown"): 0.5,
    ("regulator", "hunting_pa"): 5.0e3,
    ("friction", "asymmetry_n"): 0.5,
    ("friction", "asymmetry_n_s_per_m"): 300.0,
    ("friction", "dwell_stiction_n"): 5.0,
    ("friction", "side_load_n_s_per_mm"): 0.02,
    ("friction", "side_load_n_per_n"): 0.05,
    ("friction", "side_load_tilt_n"): 1.0,
    ("friction", "side_load_n_per_mm"): 0.05,
    ("friction", "place_n_per_mm"): 0.05,
    ("friction", "place_n_per_mm2"): 0.02,
    ("friction", "place_asymmetry_n_per_mm"): 0.05,
    ("friction", "place_asymmetry_n_per_mm2"): 0.02,
    ("contact", "backlash_n"): 0.5,
    ("contact", "lost_n"): 1.0,
    ("contact", "creep_share"): 0.1,
    ("contact", "hardening"): 0.05,
    ("contact", "wear_per_m"): 0.1,
    ("contact", "wear_n_per_m"): 1.0,
    ("contact", "tilt_n"): 2.0,
    ("contact", "feed_drag_n_s_per_mm"): 0.02,
    ("contact", "feed_drag_n"): 0.5,
    ("contact", "feed_drag_abs_n_s_per_mm"): 0.02,
    ("contact", "spindle_n"): 0.5,
    ("contact", "spindle_n_per_krpm2"): 0.1,
    ("contact", "position_n_per_mm"): 0.05,
    ("contact", "position_n_per_mm2"): 0.01,
    ("contact", "ripple_n"): 0.5,
    ("contact", "stop_stiffness_n_per_mm"): 0.2,
    ("cell", "zero_n_per_k"): 0.1,
    ("cell", "span_per_k"): 0.01,
    ("cell", "warm_up_n"): 1.0,
    ("cell", "drift_n_per_s"): 0.5,
    ("cell", "quadratic_per_n"): 1.0e-3,
    ("cell", "cubic_per_n2"): 1.0e-4,
    ("cell", "hum_n"): 0.5,
    ("cell", "crosstalk_n_per_v"): 0.1,
    ("cell", "clock_offset_s"): 0.0125,
    ("cell", "clock_skew"): 0.01,
    ("cell", "sign_lost"): 1.0,
    ("cell", "repeated_share"): 0.3,
    ("cell", "outlier_share"): 0.3,
    ("cell", "filter_s"): 0.01,
    ("cell", "noise_n"): 0.2,
    ("cell", "quantum_n"): 0.5,
    ("cell", "range_n"): 20.0,
    ("cell", "zero_n"): 1.0,
}
BASE = Plant(
    regulator=Regulator(lag_s=0.01),
    friction=Friction(coulomb_n=1.0, viscous_n_s_per_m=40.0),
    contact=Contact(mass_kg=0.3, stop_mm=4.0),
    cell=LoadCell(outlier_n=3.0, zero_n=-10.0),
)
COMMANDS_V = [3.0, 3.1, 5.05, 4.0, 4.6, 1.5, 2.2, 0.0, 2.0]


def around(place: float) -> Surroundings:
    return Surroundings(
        temperature_c=20.0 + place,
        supply_kpa=650.0,
        spindle_rpm=3000.0,
        feed_mm_s=20.0 - 5.0 * place,
        tilt_deg=10.0 * place,
        position_mm=place,
        distance_m=0.1 * place,
    )


def excited(plant: Plant) -> Floats:
    """Readings every 5 ms while the command goes up and down, by large and small steps, and all around it moves."""
    twin, rows = Twin(plant, 5), []
    for place, voltage_v in enumerate(COMMANDS_V):
        twin.set_surroundings(around(float(place)))
        twin.command(voltage_v)
        rows.append(trace(twin, 0.06, lambda running: running.read(), 0.005))
    return np.concatenate(rows)


def test_every_field_is_a_dimension_or_an_effect_tested_here() -> None:
    assert {(section, name) for section, name, _ in values(Plant())} == DIMENSIONS | set(ON)


def test_the_default_of_every_effect_is_null() -> None:
    found = {(section, name): value for section, name, value in values(Plant()) if (section, name) in ON}
    assert set(found.values()) <= {0.0, UNLIMITED}


def test_without_effects_force_is_area_times_pressure_at_once() -> None:
    twin = Twin(Plant(), 1)
    for voltage_v in (0.0, 5.0, 10.0, 2.5, 0.001):
        twin.command(voltage_v)
        twin.advance(0.001)
        assert twin.force_n == pytest.approx(voltage_v / 10.0 * 0.9e6 * 1.0e-4, abs=1.0e-12)
        assert twin.measured_n == twin.force_n


@pytest.mark.sampled
@pytest.mark.parametrize(("section", "name"), sorted(ON))
def test_an_effect_that_fades_away_comes_to_nothing_and_one_switched_on_does_not(section: str, name: str) -> None:
    """Its code runs with almost the null value, and leaves what the plant without it gives."""
    null = {(s, n): v for s, n, v in values(Plant())}[section, name]
    absent = excited(with_value(BASE, section, name, null))
    faded = 0.1 * UNLIMITED if null == UNLIMITED else 1.0e-9 * ON[section, name]
    np.testing.assert_allclose(excited(with_value(BASE, section, name, faded)), absent, rtol=0.0, atol=1.0e-4)
    assert np.abs(excited(with_value(BASE, section, name, ON[section, name])) - absent).max() > 0.01


def test_the_stribeck_speed_alone_does_nothing() -> None:
    np.testing.assert_array_equal(excited(with_value(BASE, "friction", "stribeck_speed_m_per_s", 0.5)), excited(BASE))


def test_what_is_around_changes_nothing_where_no_effect_looks_at_it() -> None:
    told, plain = Twin(BASE, 5), Twin(BASE, 5)
    for place, voltage_v in enumerate(COMMANDS_V):
        told.set_surroundings(around(float(place)))
        for twin in (told, plain):
            twin.command(voltage_v)
            twin.advance(0.05)
        assert (told.read(), told.force_n, told.pressure_pa) == (plain.read(), plain.force_n, plain.pressure_pa)


def test_an_effect_whose_column_nobody_knows_is_off() -> None:
    needy = [
        ("regulator", "droop_pa_per_pa"),
        ("friction", "side_load_n_s_per_mm"),
        ("friction", "side_load_n_per_n"),
        ("friction", "place_n_per_mm"),
        ("friction", "place_asymmetry_n_per_mm2"),
        ("contact", "tilt_n"),
        ("contact", "spindle_n"),
        ("cell", "zero_n_per_k"),
    ]
    for section, name in needy:
        twin, plain = Twin(with_value(BASE, section, name, ON[section, name]), 5), Twin(BASE, 5)
        for running in (twin, plain):
            running.command(4.0)
            running.advance(0.1)
        assert twin.read() == plain.read()
