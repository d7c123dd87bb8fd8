"""JSON Schema of a register map file. Written out, for the registers room reads maps by hand; a test compares the keys."""

from collections.abc import Iterable
from typing import Any, Final

from gateway.registers.map.value_names import BIT_NAMES, VALUE_NAMES
from gateway.registers.values import TYPES

_ADDRESS: Final[dict[str, Any]] = {"type": "integer", "minimum": 0, "maximum": 65535}
_NAMES: Final[dict[str, Any]] = {
    "type": "object",
    "additionalProperties": {"type": "string", "pattern": "^[a-z][a-z0-9_]*$"},
}


def _names_or_enumeration(own: Iterable[str]) -> dict[str, Any]:
    return {"anyOf": [_NAMES, {"enum": list(own)}]}


_ORDER: Final[dict[str, Any]] = {"enum": ["abcd", "cdab"], "description": "which word of a 32-bit value comes first"}

_REGISTER: Final[dict[str, Any]] = {
    "type": "object",
    "description": "One value of the map.",
    "properties": {
        "name": {"type": "string", "pattern": "^[a-z][a-z0-9_]*$", "description": "unique in its block"},
        "address": _ADDRESS | {"description": "0-based, of the first word"},
        "type": {"enum": list(TYPES)},
        "scale": {"enum": [1, 0.1, 0.01, 0.001], "default": 1, "description": "unit per count"},
        "unit": {"type": "string", "description": "engineering unit of the value"},
        "access": {"enum": ["R", "RW"], "default": "R"},
        "min": {"type": "number", "description": "least value, in the unit; else what the type carries"},
        "max": {"type": "number", "description": "largest value, in the unit; else what the type carries"},
        "text": {"type": "string", "description": "what it means, for the register table"},
        "values": _names_or_enumeration(VALUE_NAMES)
        | {"description": "names of an enumeration's numbers, or one of the program's own"},
        "bits": _names_or_enumeration(BIT_NAMES)
        | {"description": "names of a word's bits, or one of the program's own"},
        "constant": {"type": "number", "description": "what a proof register always reads"},
        "word_order": _ORDER,
        "count": {"type": "integer", "minimum": 1, "maximum": 256, "description": "makes NAME_0, NAME_1, ..."},
    },
    "required": ["name", "address", "type", "text"],
    "additionalProperties": False,
}

_BLOCK: Final[dict[str, Any]] = {
    "type": "object",
    "description": "A contiguous range of addresses.",
    "properties": {
        "first": _ADDRESS,
        "last": _ADDRESS,
        "text": {"type": "string"},
        "word_order": _ORDER,
        "repeats": {
            "type": "object",
            "additionalProperties": _ADDRESS,
            "description": "{block: base address}: shown again here as float32",
        },
        "registers": {"type": "array", "items": {"$ref": "#/$defs/Register"}},
    },
    "required": ["first", "last"],
    "oneOf": [{"required": ["registers"]}, {"required": ["repeats"]}],
    "additionalProperties": False,
}


def register_map_schema() -> dict[str, Any]:
    """Return the schema of profiles/registers/*.yaml, without its head."""
    return {
        "description": "A Modbus map: blocks of registers, the single source of server, documentation and client stubs.",
        "type": "object",
        "properties": {
            "name": {"type": "string"},
            "version": {
                "type": "integer",
                "minimum": 1,
                "maximum": 65535,
                "description": "numbers are frozen within one",
            },
            "text": {"type": "string"},
            "blocks": {"type": "object", "additionalProperties": {"$ref": "#/$defs/Block"}},
        },
        "required": ["name", "version", "blocks"],
        "additionalProperties": False,
        "$defs": {"Block": _BLOCK, "Register": _REGISTER},
    }
