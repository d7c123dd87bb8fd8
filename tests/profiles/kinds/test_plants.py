"""Numbers have origins: a plant's leaf carries its value, its source and its range."""

from pathlib import Path

import pytest

from gateway.profiles import PlantProfile, ProfileError, load_plant
from gateway.twin import Plant

SHIPPED = Path(__file__).parents[3] / "profiles" / "plants" / "paper-slide.yaml"


def load(folder: Path, text: str) -> PlantProfile:
    path = folder / "plant.yaml"
    path.write_text(text, encoding="utf-8")
    return load_plant(path)


def told(folder: Path, text: str) -> list[str]:
    with pytest.raises(ProfileError) as caught:
        load(folder, text)
    return [str(fault).split("plant.yaml:")[1] for fault in caught.value.faults]


def test_the_twin_gets_bare_floats_and_the_origins_stay_beside_them(tmp_path: Path) -> None:
    profile = load(
        tmp_path, "contact:\n  pad_stiffness_n_per_m: {value: 4.1e4, source: assumed, range: [1.0e4, 100000]}\n"
    )
    assert profile.plant.contact.pad_stiffness_n_per_m == 41000.0
    origin = profile.origins["contact.pad_stiffness_n_per_m"]
    assert (origin.value, origin.source, origin.range) == (41000.0, "assumed", (1.0e4, 1.0e5))


def test_an_effect_that_a_plant_does_not_name_has_its_null_value(tmp_path: Path) -> None:
    assert load(tmp_path, "name: ideal\n").plant == Plant()


def test_every_number_of_the_shipped_plant_has_an_origin_that_holds_it() -> None:
    profile = load_plant("paper-slide")
    assert profile.name == "paper-slide" and len(profile.origins) > 20
    assert all(origin.source for origin in profile.origins.values())
    assert all(o.range[0] <= o.value <= o.range[1] for o in profile.origins.values() if o.range)


@pytest.mark.parametrize(
    ("leaf", "sentence"),
    [
        ("{value: 0.8, source: a, range: [0, 0.15]}",
         "2:20 regulator.delay_s.value: 0.8 s is outside its range 0 .. 0.15 s"),
        ("{value: 0.1, range: [0, 1]}",
         "2:3 regulator.delay_s.source: is missing: a manual's page, a measurement, or `assumed`"),
        ("{value: 0.1, source: ''}",
         "2:33 regulator.delay_s.source: is missing: a manual's page, a measurement, or `assumed`"),
        ("{value: 0.1, source: a, range: [1, 0]}",
         "2:43 regulator.delay_s.range: must be [low, high], two rising numbers"),
        ("{value: 0.1, source: a, range: 5}", "2:43 regulator.delay_s.range: must be [low, high], two rising numbers"),
        ("{value: 0.1, source: a, rnage: [0, 1]}", "2:36 regulator.delay_s.rnage: is not a known key; did you mean range?"),
        ("{value: -1, source: a}", "2:20 regulator.delay_s: -1 s is below 0 s, the least allowed"),
        ("{value: 3, source: a}", "2:20 regulator.delay_s: 3 s is above 2 s, the most allowed"),
        ("{value: '0.1', source: a}", '2:20 regulator.delay_s: "0.1" is not a number: write 0.1 (take the quotes away)'),
        ("0.1", "2:12 regulator.delay_s: 0.1 has no origin: write {value: ..., source: ..., range: [low, high]}"),
    ],
)  # fmt: skip
def test_a_wrong_leaf_is_told_at_its_number(tmp_path: Path, leaf: str, sentence: str) -> None:
    assert told(tmp_path, f"regulator:\n  delay_s: {leaf}\n") == [sentence]


def test_unknown_sections_and_fields_are_told_with_what_was_meant(tmp_path: Path) -> None:
    text = "contacts: {}\nregulator:\n  delay_ms: {value: 80, source: a}\n  lag: {value: 1, source: a}\n"
    assert told(tmp_path, text) == [
        "1:1 contacts: is not a known key; did you mean contact?",
        "3:3 regulator.delay_ms: is not a known key; this quantity is given as delay_s: 0.08",
        "4:3 regulator.lag: is not a known key; did you mean lag_s? (a key ends with its unit)",
    ]
    assert told(tmp_path, "name: 5\ncell: 3\n") == [
        "1:7 name: 5 is not text",
        "2:7 cell: 3 is not a group of keys: filter_s, noise_n, quantum_n, range_n, zero_n, zero_n_per_k ...",
    ]
