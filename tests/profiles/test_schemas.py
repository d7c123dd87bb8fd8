"""The JSON schemas for editors: made from the same types as the reader, committed, and true of the shipped files."""

import json
from pathlib import Path

import jsonschema
import pytest

from gateway.profiles import find, list_shipped
from gateway.profiles.schema import schema, schema_text
from gateway.profiles.strict_yaml.text import parse
from gateway.registers.map import map_reader

ROOT = Path(__file__).parents[2] / "profiles"
SHIPPED = [(kind, name) for kind in find.FOLDERS for name in list_shipped(kind)]


def as_json(path: Path) -> object:
    """A shipped file as an editor's schema checker sees it: keys are text."""
    return json.loads(json.dumps(parse(path.read_bytes(), path.name).value))


@pytest.mark.parametrize("kind", find.FOLDERS)
def test_the_committed_schema_is_what_the_types_say(kind: str) -> None:
    committed = (ROOT / "schemas" / f"{kind}.json").read_text(encoding="utf-8")
    assert committed == schema_text(kind), "refresh: python tools/write_schemas"


@pytest.mark.parametrize("kind", find.FOLDERS)
def test_a_schema_is_a_schema_of_the_dialect_that_it_names(kind: str) -> None:
    assert schema(kind)["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    jsonschema.Draft202012Validator.check_schema(schema(kind))


@pytest.mark.parametrize(("kind", "name"), SHIPPED)
def test_shipped_files_are_valid_and_tell_editors_their_schema(kind: str, name: str) -> None:
    path = ROOT / find.FOLDERS[kind] / f"{name}.yaml"
    jsonschema.Draft202012Validator(schema(kind)).validate(as_json(path))
    first_line = path.read_text(encoding="utf-8").splitlines()[0]
    assert first_line == f"# yaml-language-server: $schema=../schemas/{kind}.json"


@pytest.mark.parametrize(("kind", "name"), SHIPPED)
def test_a_key_that_the_reader_refuses_the_schema_refuses_too(kind: str, name: str) -> None:
    document = as_json(ROOT / find.FOLDERS[kind] / f"{name}.yaml")
    assert isinstance(document, dict)
    assert not jsonschema.Draft202012Validator(schema(kind)).is_valid(document | {"no_such_key": 1})


def test_the_schemas_help_with_units_docstrings_and_comments() -> None:
    rig = schema("rig")
    limits = rig["$defs"]["Limits"]
    assert limits["description"] == "Bounds that no command passes."
    assert limits["properties"]["force_max_n"]["title"] == "force max, N"
    assert "largest accepted setpoint" in limits["properties"]["force_max_n"]["description"]
    assert rig["properties"]["loop_hz"]["maximum"] == 250


def test_a_plant_schema_asks_for_the_origin_of_each_number() -> None:
    leaf = schema("plant")["$defs"]["Contact"]["properties"]["pad_stiffness_n_per_m"]
    assert leaf["x-source"] is True and leaf["required"] == ["value", "source"]
    assert leaf["properties"]["value"]["exclusiveMinimum"] == 0


def test_the_register_schema_has_the_keys_of_the_reader() -> None:
    registers = schema("registers")
    assert set(registers["properties"]) == set(map_reader._MAP_KEYS)
    assert set(registers["$defs"]["Block"]["properties"]) == set(map_reader._BLOCK_KEYS)
    assert set(registers["$defs"]["Register"]["properties"]) == set(map_reader._REGISTER_KEYS)
