"""What is written as a plant file is read back as the same plant, with every source and range."""

from dataclasses import fields, replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from gateway.profiles import Origin, PlantProfile, list_shipped, load_plant
from gateway.profiles.kinds.plant_writer import UNSTATED, plant_text, with_origins
from gateway.profiles.kinds.plants import read_plant
from gateway.profiles.strict_yaml.text import parse
from gateway.twin import Plant
from gateway.twin.plant import values, with_value
from tests.gate.budgets import examples


def again(profile: PlantProfile, comment: str = "") -> PlantProfile | None:
    read, faults = read_plant(parse(plant_text(profile, comment).encode(), "again.yaml"))
    assert not faults
    return read


@pytest.mark.parametrize("name", list_shipped("plant"))
def test_a_shipped_plant_is_written_and_read_back_whole(name: str) -> None:
    assert again(load_plant(name), "by another hand\nin two lines") == load_plant(name)


def test_what_is_off_is_not_written() -> None:
    text = plant_text(PlantProfile(name="ideal", description="", plant=Plant(), origins={}))
    assert set(yaml.safe_load(text)) == {"name", "description"}


def test_a_number_without_origin_is_written_as_one() -> None:
    plant = with_value(Plant(), "friction", "coulomb_n", 1.5)
    read = again(PlantProfile(name="a", description="", plant=plant, origins={}))
    assert read is not None and read.origins == {"friction.coulomb_n": Origin(1.5, UNSTATED)}


def test_other_readers_of_yaml_see_the_same_numbers() -> None:
    plant = with_value(Plant(), "cell", "quantum_n", 1e-5)
    text = plant_text(PlantProfile(name="no", description="1e3", plant=plant, origins={}))
    document = yaml.safe_load(text)
    assert document["cell"]["quantum_n"]["value"] == 1e-5 and document["name"] == "no"


def test_a_new_value_takes_its_source_and_widens_its_range() -> None:
    start = load_plant("paper-slide")
    plant = with_value(start.plant, "friction", "coulomb_n", 7.0)
    extended = with_origins(start, plant, {"friction.coulomb_n": "diagnosed from a.csv"})
    assert extended.origins["friction.coulomb_n"] == Origin(7.0, "diagnosed from a.csv", (0.0, 7.0))
    others = {path: origin for path, origin in extended.origins.items() if path != "friction.coulomb_n"}
    assert others == {path: start.origins[path] for path in others}
    assert again(extended) == extended


def test_a_value_that_changed_without_a_source_does_not_keep_the_old_one() -> None:
    start = load_plant("paper-slide")
    changed = with_origins(start, with_value(start.plant, "friction", "coulomb_n", 2.0), {})
    assert changed.origins["friction.coulomb_n"].source == UNSTATED


@pytest.mark.parametrize("value", [float("inf"), float("nan")])
def test_what_no_file_can_hold_is_refused(value: float) -> None:
    plant = with_value(Plant(), "cell", "zero_n", value)
    with pytest.raises(ValueError, match="not a number that a plant file can hold"):
        plant_text(PlantProfile(name="a", description="", plant=plant, origins={}))


FIELDS = [(section, name) for section, name, _ in values(Plant())]
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
TEXTS = st.text(min_size=1, max_size=40).filter(str.strip)


@cache
def adapter(section: str) -> TypeAdapter[Any]:
    """Made once: pydantic takes longer for it than a plant takes to be written and read."""
    kind = next(field.type for field in fields(Plant) if field.name == section)
    assert isinstance(kind, type)
    return TypeAdapter(kind)


def allowed(section: str, name: str, value: float) -> bool:
    """Within the bounds of the field itself."""
    try:
        adapter(section).validate_python({name: value}, strict=True)
    except ValidationError:
        return False
    return True


@st.composite
def profiles(draw: Any) -> PlantProfile:
    plant, origins = Plant(), {}
    for section, name in draw(st.lists(st.sampled_from(FIELDS), unique=True, max_size=6)):
        value = draw(st.one_of(st.floats(0.0, 1.0), NUMBERS))
        if not allowed(section, name, value):
            continue
        bounds = draw(st.none() | st.tuples(NUMBERS, NUMBERS))
        held = (min(*bounds, value), max(*bounds, value)) if bounds else None
        plant = with_value(plant, section, name, value)
        origins[f"{section}.{name}"] = Origin(value, draw(TEXTS), held)
    return PlantProfile(
        name=draw(st.text(max_size=20)), description=draw(st.text(max_size=40)), plant=plant, origins=origins
    )


@settings(max_examples=examples(150), deadline=None)
@given(profiles())
def test_any_plant_is_read_back_to_the_last_bit(profile: PlantProfile) -> None:
    assert again(profile) == replace(profile)


def test_a_written_file_is_found_by_its_path(tmp_path: Path) -> None:
    path = tmp_path / "extended.yaml"
    path.write_text(plant_text(load_plant("paper-slide")), encoding="utf-8")
    assert load_plant(path) == load_plant("paper-slide")
