"""Plants: numbers with origins. Each leaf of a plant file is `{value: 4.1e4, source: assumed, range: [1.0e4, 1.0e5]}`.

The twin sees bare floats, in its own frozen dataclasses; the origins are kept beside them, for diagnosis needs the ranges and
a reader needs to know which numbers were measured. A leaf may leave `range` out where there is nothing to vary (a constant
of nature); `source` is never left out. An effect that a plant does not name has its null value: off equals absent.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from gateway.profiles.find import display, locate
from gateway.profiles.strict_yaml.fault_sentences import number, quote_value, unit_of, unknown_key
from gateway.profiles.strict_yaml.faults import Path, ProfileError, ProfileFault, path_text
from gateway.profiles.strict_yaml.text import Document, Mark, parse
from gateway.profiles.strict_yaml.typed import build, kind_at, names
from gateway.twin import Plant

_LEAF_KEYS: Final = ("value", "source", "range")
_FORM: Final = "{value: ..., source: ..., range: [low, high]}"
ABOUT: Final = ("name", "description")
"""Keys of a plant file that are words, not physics."""


@dataclass(frozen=True, slots=True)
class Origin:
    """Where one number of a plant comes from, and how far it may be off; range None: nothing to vary."""

    value: float
    source: str
    range: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PlantProfile:
    """A plant as its file has it. origins: by path, such as `contact.pad_stiffness_n_per_m`."""

    name: str
    description: str
    plant: Plant
    origins: Mapping[str, Origin]


def read_plant(document: Document) -> tuple[PlantProfile | None, list[ProfileFault]]:
    """Return the plant of a file, or None and every fault."""
    reader = _PlantReader(document)
    values = reader.group((), Plant)
    about = {field: values.pop(field, "") for field in ABOUT}
    faults = [
        document.fault((key,), f"{quote_value(text)} is not text")
        for key, text in about.items()
        if not isinstance(text, str)
    ]
    plant, more_faults = build(Plant, Document(document.file, values, document.marks | reader.marks))
    faults += reader.faults + [fault for fault in more_faults if fault.path not in reader.refused]
    if faults or plant is None:
        return None, sorted(faults)
    return PlantProfile(plant=plant, origins=reader.origins, **about), []


def load_shipped_plant(name: str) -> PlantProfile:
    """Return a shipped plant by its name. It is known to be one: what tells the kinds of files apart is not loaded."""
    file = locate("plant", name)
    plant, faults = read_plant(parse(file.read_bytes(), display(file)))
    if plant is None:
        raise ProfileError(faults)
    return plant


class _PlantReader:
    """Walks the file along the twin's dataclasses and takes the leaves apart."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.faults: list[ProfileFault] = []
        self.origins: dict[str, Origin] = {}
        self.marks: dict[Path, Mark] = {}  # of the bare numbers: a leaf stands where its value does
        self.refused: set[str] = set()  # paths with a fault of their own: pydantic need not tell a second one

    def group(self, path: Path, kind: type) -> dict[str, Any]:
        content = self.document.at(*path)
        values: dict[str, Any] = {}
        for key, value in content.items() if isinstance(content, dict) else ():
            place = (*path, key)
            inner = kind_at(kind, (key,))
            if inner is not None and isinstance(value, dict):
                values[key] = self.group(place, inner)
            elif key in names(kind) and inner is None:
                values[key] = self._leaf(place, value)
            else:  # unknown: told by its type, with the number that it would have had
                values[key] = value["value"] if isinstance(value, dict) and "value" in value else value
        return values

    def _leaf(self, path: Path, leaf: Any) -> Any:
        if not isinstance(leaf, dict) or "value" not in leaf:
            self._fault(path, f"{quote_value(leaf)} has no origin: write {_FORM}")
            return leaf
        self.marks[path] = self.document.marks[(*path, "value")]
        for key in leaf:
            if key not in _LEAF_KEYS:
                self._fault((*path, key), unknown_key(str(key), leaf, _LEAF_KEYS, {})[0], at_key=True)
        value, source = leaf["value"], leaf.get("source")
        if not isinstance(source, str) or not source.strip():
            self._fault((*path, "source"), "is missing: a manual's page, a measurement, or `assumed`")
        elif (problem := _range_problem(leaf, unit_of(path[-1]))) is not None:
            self._fault((*path, problem[0]), problem[1])
        elif _is_number(value):
            bounds = (float(leaf["range"][0]), float(leaf["range"][1])) if "range" in leaf else None
            self.origins[path_text(path)] = Origin(float(value), source, bounds)
        return value

    def _fault(self, path: Path, message: str, *, at_key: bool = False) -> None:
        self.faults.append(self.document.fault(path, message, at_key=at_key))
        self.refused.add(path_text(path))


def _range_problem(leaf: dict[Any, Any], unit: str) -> tuple[str, str] | None:
    """Return (key, sentence) when a leaf's range is none, or does not hold its value."""
    bounds, value = leaf.get("range", [0, 0]), leaf["value"]
    if not (isinstance(bounds, list) and len(bounds) == 2 and all(map(_is_number, bounds)) and bounds[0] <= bounds[1]):
        return "range", "must be [low, high], two rising numbers"
    if "range" in leaf and _is_number(value) and not bounds[0] <= value <= bounds[1]:
        return (
            "value",
            f"{quote_value(value)}{unit} is outside its range {number(bounds[0])} .. {number(bounds[1])}{unit}",
        )
    return None


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
