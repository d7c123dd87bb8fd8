"""The plant: one rig's physics, as profiles/plants/*.yaml fills it, field by field, with source and range.

Every effect has a null value, which is the default: off equals absent. The sections stand in sections.py. For many
parameter sets at once, `stack` makes one Plant whose fields are arrays of lanes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from gateway.defaults import STRICT, UNLIMITED
from gateway.twin.elementwise import Real
from gateway.twin.sections import Contact, Cylinder, Friction, LoadCell, Regulator

__all__ = [
    "UNLIMITED",
    "Contact",
    "Cylinder",
    "Friction",
    "LoadCell",
    "Plant",
    "Regulator",
    "lane_count",
    "plain",
    "stack",
    "values",
    "with_value",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Plant:
    """One rig's physics. `Plant()` is an ideal machine: force = area x pressure, at once."""

    __pydantic_config__ = STRICT
    regulator: Regulator = field(default_factory=Regulator)
    cylinder: Cylinder = field(default_factory=Cylinder)
    friction: Friction = field(default_factory=Friction)
    contact: Contact = field(default_factory=Contact)
    cell: LoadCell = field(default_factory=LoadCell)


def values(plant: Plant) -> Iterator[tuple[str, str, Real]]:
    """Yield every (section, field, value) of a plant, in the order of the file."""
    for section in fields(plant):
        part = getattr(plant, section.name)
        for entry in fields(part):
            yield section.name, entry.name, getattr(part, entry.name)


def with_value(plant: Plant, section: str, name: str, value: Real) -> Plant:
    """Return the same plant with one field changed; AttributeError or TypeError for a name that it does not have."""
    changed: dict[str, Any] = {section: replace(getattr(plant, section), **{name: value})}
    return replace(plant, **changed)


def stack(plants: Sequence[Plant]) -> Plant:
    """Return one plant whose fields are arrays with one value per lane; ValueError when there is none."""
    if not plants:
        raise ValueError("a stack needs at least one plant")
    stacked = plants[0]
    for section, name, _ in values(plants[0]):
        column = np.array([getattr(getattr(plant, section), name) for plant in plants], dtype=np.float64)
        stacked = with_value(stacked, section, name, column)
    return stacked


def plain(plant: Plant) -> Plant:
    """Return the same plant with Python floats where it has integers or numpy scalars: those would be slow, or taken for
    lanes."""
    for section, name, value in values(plant):
        if type(value) is not float and not isinstance(value, np.ndarray):
            plant = with_value(plant, section, name, float(value))
    return plant


def lane_count(plant: Plant) -> int | None:
    """Return how many lanes a stacked plant has; None for a plant of plain floats. ValueError when lanes differ in number."""
    counts = {value.size for _, _, value in values(plant) if isinstance(value, np.ndarray)}
    if len(counts) > 1:
        raise ValueError(f"fields of one plant have different numbers of lanes: {sorted(counts)}")
    return counts.pop() if counts else None
