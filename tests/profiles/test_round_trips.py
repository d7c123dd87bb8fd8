"""What was read can be written and read again, and is the same: no value is changed on the way, not by one bit."""

import json
from pathlib import Path
from typing import Any

import pytest

from gateway.bsfm import Calibration
from gateway.devices import DeviceProfile
from gateway.profiles import find, list_shipped, load_plant
from gateway.profiles.kinds.plants import read_plant
from gateway.profiles.rigs.rig_file import RigFile
from gateway.profiles.strict_yaml.text import Document, parse
from gateway.profiles.strict_yaml.typed import adapter, build
from gateway.registers.map.map_reader import read_map

KINDS: dict[str, type] = {"rig": RigFile, "device": DeviceProfile, "calibration": Calibration}


def document(kind: str, name: str) -> Document:
    path: Path = find.locate(kind, name)
    return parse(path.read_bytes(), path.name)


def again(value: Any) -> Document:
    """JSON is YAML: what was read, written by another hand."""
    return parse(json.dumps(value).encode(), "again.yaml")


@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind in KINDS for name in list_shipped(kind)])
def test_a_shipped_file_survives_writing_and_reading(kind: str, name: str) -> None:
    first, faults = build(KINDS[kind], document(kind, name))
    assert not faults
    written = adapter(KINDS[kind]).dump_python(first, mode="json")
    assert build(KINDS[kind], again(written)) == (first, [])


@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind in KINDS for name in list_shipped(kind)])
def test_a_shipped_file_is_called_as_it_says(kind: str, name: str) -> None:
    assert document(kind, name).value["name"] == name


@pytest.mark.parametrize("name", list_shipped("plant"))
def test_a_plant_survives_writing_and_reading(name: str) -> None:
    value = document("plant", name).value
    assert read_plant(again(value))[0] == load_plant(name)


@pytest.mark.parametrize("name", list_shipped("registers"))
def test_a_register_map_survives_json_whose_keys_are_all_text(name: str) -> None:
    value = document("registers", name).value
    as_text = json.loads(json.dumps(value))
    assert read_map(as_text).map_hash == read_map(value).map_hash
