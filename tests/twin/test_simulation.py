"""Time and chance: the same physics, however it is run."""

import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from gateway.twin import Contact, Cylinder, Friction, LoadCell, Plant, Regulator, Twin
from gateway.twin.experiment import Floats
from gateway.twin.plant import values, with_value
from tests.twin.traces import trace

RICH = Plant(
    regulator=Regulator(
        command_step_v=10.0 / 1023,
        dead_band_pa=500.0,
        hysteresis_pa=2000.0,
        supply_pa=7.0e5,
        delay_s=0.0123,
        slew_pa_per_s=5.0e6,
        lag_s=0.03,
        second_lag_s=0.02,
    ),
    cylinder=Cylinder(area_m2=95.0e-6, stroke_m=0.03),
    friction=Friction(
        coulomb_n=1.0,
        load_dependent_n_per_n=0.03,
        stribeck_n=0.5,
        stribeck_speed_m_per_s=0.002,
        viscous_n_s_per_m=50.0,
        presliding_m=2.0e-4,
    ),
    contact=Contact(pad_damping_n_s_per_m=40.0, gap_m=1.0e-4, mass_kg=0.6, tilt_deg=70.0),
    cell=LoadCell(filter_s=0.004, noise_n=0.1, quantum_n=0.001, range_n=60.0, zero_n=0.1),
)
COMMANDS_V = [3.0, 4.0, 3.7, 7.9, 1.0, 1.1, 0.0, 2.0]


def run(plant: Plant, seed: int = 3, part_s: float = 0.01) -> Floats:
    twin, rows = Twin(plant, seed), []
    for voltage_v in COMMANDS_V:
        twin.command(voltage_v)
        rows.append(trace(twin, 0.2, lambda running: (running.force_n, running.read(), running.pressure_pa), part_s))
    return np.concatenate(rows)


def test_whole_numbers_and_numpy_scalars_are_taken_for_floats() -> None:
    odd = with_value(with_value(RICH, "contact", "mass_kg", 1), "regulator", "lag_s", np.float64(0.03))
    np.testing.assert_array_equal(run(odd), run(with_value(RICH, "contact", "mass_kg", 1.0)))


def test_splitting_the_time_changes_nothing() -> None:
    whole, parts, odd = (Twin(RICH, 1) for _ in range(3))
    for voltage_v in COMMANDS_V:
        for twin in (whole, parts, odd):
            twin.command(voltage_v)
        whole.advance(0.09)
        for _ in range(90):
            parts.advance(0.001)
        for _ in range(300):
            odd.advance(0.0003)
        assert whole.force_n == parts.force_n == odd.force_n
        assert whole.measured_n == parts.measured_n == odd.measured_n
    assert whole.time_s == pytest.approx(0.72)
    assert odd.time_s == pytest.approx(0.72)


def test_time_shorter_than_a_step_is_kept() -> None:
    twin = Twin(Plant(), 1)
    twin.command(1.0)
    twin.advance(0.0009)
    assert twin.force_n == 0.0
    assert twin.time_s == pytest.approx(0.0009)
    twin.advance(0.0001)
    assert twin.force_n > 0.0


@pytest.mark.parametrize("dt_s", [-0.001, math.nan, math.inf])
def test_time_does_not_run_back_or_away(dt_s: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        Twin(Plant(), 1).advance(dt_s)


def test_the_seed_decides_the_noise_and_nothing_else() -> None:
    first, again, other = run(RICH, 3), run(RICH, 3), run(RICH, 4)
    np.testing.assert_array_equal(first, again)
    np.testing.assert_array_equal(first[:, [0, 2]], other[:, [0, 2]])
    assert np.any(first[:, 1] != other[:, 1])


def test_reset_starts_the_same_life_again() -> None:
    twin = Twin(RICH, 3)
    lives = []
    for _ in range(2):
        twin.command(4.0)
        twin.set_sign(-1)
        lives.append(trace(twin, 0.3, lambda running: (running.force_n, running.read())))
        twin.set_air(False)
        twin.set_contact(False)
        twin.reset()
        assert (twin.time_s, twin.force_n, twin.pressure_pa) == (0.0, 0.0, 0.0)
    np.testing.assert_array_equal(lives[0], lives[1])


def test_the_shipped_plant_names_every_field_once_with_source_and_range() -> None:
    file = Path(__file__).parents[2] / "profiles" / "plants" / "paper-slide.yaml"
    document = yaml.safe_load(file.read_text(encoding="utf-8"))
    known = {(section, name) for section, name, _ in values(Plant())}
    for section in ("regulator", "cylinder", "friction", "contact", "cell"):
        for name, leaf in document[section].items():
            assert (section, name) in known
            assert leaf["source"].split(":")[0].split()[0] in {"paper", "computed", "fitted", "assumed"}
            low, high = leaf.get("range", (leaf["value"], leaf["value"]))
            assert low <= leaf["value"] <= high
