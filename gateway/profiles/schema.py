"""JSON Schema (draft 2020-12) of every kind of profile, for editors: made from the same dataclasses that read the files.

Help texts come from where a programmer keeps them: docstrings of the dataclasses, and the comment behind each field. The
committed profiles/schemas/*.json are what `schema()` returns; a test compares.
"""

import inspect
import io
import json
import tokenize
from collections.abc import Callable
from dataclasses import is_dataclass
from functools import cache
from typing import Any, Final

from gateway.bsfm.model import Calibration
from gateway.control.runs.experiment_plan import ExperimentPlan
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.devices import DeviceProfile
from gateway.profiles.kinds.plants import ABOUT
from gateway.profiles.kinds.registers_schema import register_map_schema
from gateway.profiles.rigs.rig_file import RigFile
from gateway.profiles.strict_yaml.fault_sentences import unit_of, without_unit
from gateway.profiles.strict_yaml.typed import adapter, groups
from gateway.twin import Plant

DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"

_ORIGIN: Final[dict[str, Any]] = {
    "Source": {"type": "string", "minLength": 1, "description": "a manual's page, a measurement, or `assumed`"},
    "Range": {
        "type": "array",
        "items": {"type": "number"},
        "minItems": 2,
        "maxItems": 2,
        "description": "[low, high]: how far the value may be off",
    },
}


@cache
def field_comments(kind: type) -> dict[str, str]:
    """Return field name -> the comment behind it in the source; fields without one are left out."""
    try:
        source = inspect.getsource(kind)
    except (OSError, TypeError):  # no source at hand: a help text less
        return {}
    comments: dict[str, str] = {}
    name, depth = "", 0
    for token in tokenize.generate_tokens(io.StringIO(inspect.cleandoc(source) + "\n").readline):
        if token.type == tokenize.NAME and token.start[1] == 4 and depth == 0:
            name = token.string
        elif token.type == tokenize.COMMENT and name and token.start[1] > 4:
            comments.setdefault(name, token.string.lstrip("# "))
        depth += {"(": 1, "[": 1, "{": 1, ")": -1, "]": -1, "}": -1}.get(token.string, 0)
    return comments


def schema(kind: str) -> dict[str, Any]:
    """Return the JSON schema of a kind of profile: rig, device, plant, calibration, registers or plan. KeyError for any
    other."""
    head = {"$schema": DIALECT, "title": f"force-gateway {kind}"}
    return head | _MAKERS[kind]() | {"title": head["title"]}


def dataclass_schema(kind: type) -> dict[str, Any]:
    """Return the schema of one tree of dataclasses, with its help texts."""
    schema: dict[str, Any] = adapter(kind).json_schema()
    definitions: dict[str, Any] = schema.get("$defs", {})
    _describe(schema, kind)
    for inner in _tree(kind):
        if inner.__name__ in definitions:
            _describe(definitions[inner.__name__], inner)
    return schema


def _tree(kind: type) -> list[type]:
    """Return every dataclass below one, each once."""
    kinds: list[type] = []
    for _, inner in groups(kind):
        if inner not in kinds:
            kinds += [inner, *(deeper for deeper in _tree(inner) if deeper not in kinds)]
    return kinds


def _describe(schema: dict[str, Any], kind: type) -> None:
    if not is_dataclass(kind):
        return
    document = inspect.getdoc(kind) or ""
    if document and not document.startswith(f"{kind.__name__}("):
        schema["description"] = document
    comments = field_comments(kind)
    for name, described in schema.get("properties", {}).items():
        described["title"] = _title(name)
        if name in comments:
            described["description"] = comments[name]


def _title(key: str) -> str:
    """Return `force_ramp_n_per_s` -> `force ramp, N/s`."""
    unit = unit_of(key)
    return f"{without_unit(key).replace('_', ' ')},{unit}" if unit else key.replace("_", " ")


def plant_schema() -> dict[str, Any]:
    """Return the schema of a plant file: the twin's fields, each number with its origin."""
    schema = dataclass_schema(Plant)
    sections = schema.setdefault("$defs", {})
    for section in list(sections.values()):
        for name, leaf in section.get("properties", {}).items():
            section["properties"][name] = _with_origin(leaf)
    sections |= _ORIGIN
    schema["properties"] = {name: {"type": "string"} for name in ABOUT} | schema["properties"]
    return schema


def _with_origin(leaf: dict[str, Any]) -> dict[str, Any]:
    """Return `4.1e4` -> `{value: 4.1e4, source: ..., range: [..]}`; x-null-value: what it is when the plant leaves it out."""
    number = {key: leaf[key] for key in leaf if key not in ("title", "description", "default")}
    about = {key: leaf[key] for key in ("title", "description") if key in leaf}
    null = {"x-null-value": leaf["default"]} if "default" in leaf else {}
    properties = {"value": number, "source": {"$ref": "#/$defs/Source"}, "range": {"$ref": "#/$defs/Range"}}
    form = {"type": "object", "properties": properties, "required": ["value", "source"], "additionalProperties": False}
    return about | form | {"x-source": True} | null


def plan_schema() -> dict[str, Any]:
    """Return the schema of a plan file: an experiment, or a ladder."""
    experiment, ladder = dataclass_schema(ExperimentPlan), dataclass_schema(CalibrationPlan)
    definitions = experiment.pop("$defs", {}) | ladder.pop("$defs", {})
    return {"anyOf": [experiment, ladder], "$defs": definitions}


_MAKERS: Final[dict[str, Callable[[], dict[str, Any]]]] = {
    "rig": lambda: dataclass_schema(RigFile),
    "device": lambda: dataclass_schema(DeviceProfile),
    "plant": plant_schema,
    "calibration": lambda: dataclass_schema(Calibration),
    "registers": register_map_schema,
    "plan": plan_schema,
}


def schema_text(kind: str) -> str:
    """Return the schema as a file holds it."""
    return json.dumps(schema(kind), indent=2, ensure_ascii=False) + "\n"
