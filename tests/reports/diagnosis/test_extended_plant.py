"""The extended model as a file: it is the extended plant, and each number says where it comes from."""

from dataclasses import replace
from pathlib import Path

from gateway.diagnosis.result import Estimate
from gateway.profiles import load_plant
from gateway.profiles.kinds.plant_writer import plant_text
from gateway.reports.diagnosis.extended_plant import extended_plant
from gateway.twin.plant import with_value
from tests.reports.fake_diagnosis import diagnosis

START = load_plant("paper-slide")


def test_the_file_reads_back_as_the_extended_plant(tmp_path: Path) -> None:
    profile = extended_plant(diagnosis(), START, "press-07.csv", "2026-11-21")
    path = tmp_path / "extended.yaml"
    path.write_text(plant_text(profile), encoding="utf-8")
    assert load_plant(path).plant == diagnosis().plant
    assert load_plant(path) == profile


def test_found_refitted_and_known_numbers_are_told_apart() -> None:
    origins = extended_plant(diagnosis(), START, "press-07.csv", "2026-11-21").origins
    result = "diagnosed from press-07.csv, 2026-11-21, ci95 [0.0482, 0.0511]"
    assert origins["friction.load_dependent_n_per_n"].source == result
    assert origins["friction.load_dependent_n_per_n"].range == (0.0, 0.2)
    assert origins["cylinder.area_m2"].source == "refitted to press-07.csv, 2026-11-21"
    assert origins["cell.zero_n"].source.startswith("refitted to press-07.csv")
    assert origins["contact.mass_kg"] == START.origins["contact.mass_kg"]


def test_a_number_that_moved_unasked_does_not_keep_its_old_source() -> None:
    moved = replace(diagnosis(), plant=with_value(diagnosis().plant, "regulator", "delay_s", 0.05))
    origins = extended_plant(moved, START, "a.csv", "2026-11-21").origins
    assert origins["regulator.delay_s"].source == "refitted to a.csv, 2026-11-21"


def test_only_what_was_found_is_written() -> None:
    """One force of a demo gave an area of 7.7e-5 m2 and no friction: it determines neither."""
    vague = {
        "area_m2": Estimate("cylinder", 7.7e-5, "m2", (2.0e-5, 9.0e-5)),
        "lag_s": Estimate("regulator", 0.071, "s", (0.069, 0.073)),
        "coulomb_n": Estimate("friction", 1.4, "N", (1.35, 1.45)),
        "clock_offset_s": Estimate("cell", 0.011, "s", (0.0105, 0.0115)),
    }
    plant = START.plant
    for name, result in vague.items():
        plant = with_value(plant, result.section, name, result.value)
    profile = extended_plant(diagnosis(causes=(), plant=plant, base_parameters=vague), START, "a.csv", "2026-11-22")
    assert profile.plant == with_value(START.plant, "friction", "coulomb_n", 1.4)
    assert profile.origins["cylinder.area_m2"] == START.origins["cylinder.area_m2"]
    assert profile.origins["friction.coulomb_n"].source == "refitted to a.csv, 2026-11-22"


def test_the_description_says_what_was_added_and_to_what() -> None:
    profile = extended_plant(diagnosis(), START, "press-07.csv", "2026-11-21")
    assert profile.description.startswith("paper-slide, extended by load-dependent-friction from press-07.csv: SMC")
    plain = extended_plant(diagnosis(causes=()), START, "press-07.csv", "2026-11-21")
    assert plain.description.startswith("paper-slide, refitted to press-07.csv")


def test_the_noise_that_no_diagnosis_simulates_is_not_lost() -> None:
    silent = replace(diagnosis(), plant=with_value(diagnosis().plant, "cell", "noise_n", 0.0))
    profile = extended_plant(silent, START, "a.csv", "2026-11-21")
    assert profile.plant.cell.noise_n == START.plant.cell.noise_n > 0.0
    assert profile.origins["cell.noise_n"] == START.origins["cell.noise_n"]
