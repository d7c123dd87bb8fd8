"""The plant: one rig's physics, as profiles/plants/*.yaml fills it, field by field, with source and range.

Every effect has a null value, which is the default: off equals absent. The sections stand in sections.py.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import Any, Final

from gateway.defaults import STRICT, UNLIMITED
from gateway.twin.sections import Contact, Cylinder, Friction, LoadCell, Regulator

__all__ = [
    "UNLIMITED",
    "Contact",
    "Cylinder",
    "Friction",
    "LoadCell",
    "Plant",
    "Regulator",
    "plain",
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


def values(plant: Plant) -> Iterator[tuple[str, str, float]]:
    """Yield every (section, field, value) of a plant, in the order of the file."""
    for section in fields(plant):
        part = getattr(plant, section.name)
        for entry in fields(part):
            yield section.name, entry.name, getattr(part, entry.name)


def with_value(plant: Plant, section: str, name: str, value: float) -> Plant:
    """Return the same plant with one field changed; AttributeError or TypeError for a name that it does not have."""
    changed: dict[str, Any] = {section: replace(getattr(plant, section), **{name: value})}
    return replace(plant, **changed)


def plain(plant: Plant) -> Plant:
    """Return the same plant with Python floats where it has integers or numpy scalars, which are slow.

    TypeError where a value is not a number.
    """
    return Plant(**{name: plain_section(getattr(plant, name)) for name in SECTIONS})


@lru_cache(maxsize=512)
def plain_section(section: Any) -> Any:
    """Return a section of Python floats. The cache makes this, which every plant of a search goes through, cheap."""
    return replace(section, **{entry.name: float(getattr(section, entry.name)) for entry in fields(section)})


SECTIONS: Final = tuple(entry.name for entry in fields(Plant))
