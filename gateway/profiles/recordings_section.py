"""What a rig file says of its recordings: how long they are retained, and how much room they may take."""

from dataclasses import dataclass, field
from typing import Annotated, Any, Protocol

from annotated_types import Ge, Gt, Le

from gateway.defaults import STRICT
from gateway.profiles.http_sections import HttpSections, http_sections_of


@dataclass(frozen=True, slots=True, kw_only=True)
class Retention:
    """What is retained; kept recordings, the reference, the one being recorded, the ladders of the calibrations in use and the
    last ladder always are."""

    __pydantic_config__ = STRICT
    days: Annotated[float, Gt(0), Le(36500)] | None = None  # older ones are deleted, the oldest first; null: never
    bytes: Annotated[int, Ge(1_000_000)] | None = None  # of all together; beyond it the oldest go; null: any

    @property
    def is_unlimited(self) -> bool:
        """Decide whether nothing is ever deleted."""
        return self.days is None and self.bytes is None


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingsSection:
    """The recordings in the state directory."""

    __pydantic_config__ = STRICT
    retention: Retention = field(default_factory=Retention)  # which are deleted, at the start and every hour


class ServiceSections(HttpSections, Protocol):
    """A rig file, as far as what serves beside control is concerned."""

    @property
    def recordings(self) -> RecordingsSection:
        """Section `recordings`."""


def service_sections_of(file: ServiceSections) -> dict[str, Any]:
    """Return what the sections of a rig file say, by their names in a Rig."""
    return http_sections_of(file) | {"retention": file.recordings.retention}
