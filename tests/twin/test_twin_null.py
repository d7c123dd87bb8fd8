"""Off equals absent: each effect at its null value leaves no trace, and each effect that is on leaves one."""

import numpy as np
import pytest

from gateway.twin import UNLIMITED, Contact, Friction, Plant, Regulator, Twin, stack
from gateway.twin.experiment import Floats, trace
from gateway.twin.plant import values, with_value

DIMENSIONS = {
    ("regulator", "full_scale_v"),
    ("regulator", "full_scale_pa"),
    ("cylinder", "area_m2"),
    ("contact", "pad_stiffness_n_per_m"),
    ("friction", "stribeck_speed_m_per_s"),
}
"""A machine has these in any case; they have no null value."""

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
    ("friction", "coulomb_n"): 2.0,
    ("friction", "load_dependent_n_per_n"): 0.05,
    ("friction", "stribeck_n"): 1.5,
    ("friction", "viscous_n_s_per_m"): 300.0,
    ("friction", "presliding_m"): 2.0e-4,
    ("contact", "pad_damping_n_s_per_m"): 200.0,
    ("contact", "gap_m"): 1.0e-4,
    ("contact", "mass_kg"): 0.6,
    ("contact", "tilt_deg"): 40.0,
    ("cell", "filter_s"): 0.01,
    ("cell", "noise_n"): 0.2,
    ("cell", "quantum_n"): 0.5,
    ("cell", "range_n"): 20.0,
    ("cell", "zero_n"): 1.0,
}
BASE = Plant(
    regulator=Regulator(lag_s=0.01),
    friction=Friction(coulomb_n=1.0, viscous_n_s_per_m=40.0),
    contact=Contact(mass_kg=0.3),
)
COMMANDS_V = [3.0, 3.1, 5.05, 4.0, 4.6, 1.5, 2.2, 0.0, 2.0]


def excited(plant: Plant) -> Floats:
    """Readings every 5 ms while the command goes up and down, by large and small steps."""
    twin, rows = Twin(plant, 5), []
    for voltage_v in COMMANDS_V:
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


@pytest.mark.parametrize(("section", "name"), sorted(ON))
def test_an_effect_switched_off_equals_absent_and_switched_on_does_not(section: str, name: str) -> None:
    """Beside a lane that has the effect, the term is computed for the null lane too: it must come to nothing."""
    null = {(s, n): v for s, n, v in values(Plant())}[section, name]
    off = with_value(BASE, section, name, null)
    lanes = excited(stack([off, with_value(BASE, section, name, ON[section, name])]))
    absent = excited(off)
    np.testing.assert_allclose(lanes[:, 0], absent, rtol=0.0, atol=1.0e-9)
    assert np.abs(lanes[:, 1] - absent).max() > 0.01


def test_the_stribeck_speed_alone_does_nothing() -> None:
    np.testing.assert_array_equal(excited(with_value(BASE, "friction", "stribeck_speed_m_per_s", 0.5)), excited(BASE))
