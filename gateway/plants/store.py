"""The plants of one rig: numbered, immutable, each with its provenance, and which of them is in use
(gateway.numbered_documents.store).

STATE/plants holds them. Each is an ordinary plant file, which `simulate --plant` and a rig file take as they take any other:
the CRC-32 stands in its first line, and its provenance in the second, as JSON; both are comments to other readers. The rig's
own plant has no number: none in use means that one.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

from gateway.numbered_documents.store import NumberedStore, StoreError
from gateway.processes.durable_file import add_checksum, verify_checksum
from gateway.processes.state_directory import PLANTS
from gateway.profiles import PlantProfile, ProfileError
from gateway.profiles.kinds.plant_writer import plant_text
from gateway.profiles.kinds.plants import read_plant
from gateway.profiles.strict_yaml.text import parse

_PROVENANCE: Final = "# provenance "


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceRecording:
    """A recording that a plant was diagnosed from. sha256: of the whole file."""

    name: str
    sha256: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundCause:
    """One cause of a diagnosis. parameters: by name, each {value, unit, ci95}."""

    name: str
    confidence: float
    parameters: Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """Where a plant comes from. made_utc: 2026-11-22T17:30:00Z; version: of the program; start: the plant that was extended;
    verdict: of the diagnosis, empty for a plant that was added from a file."""

    made_utc: str
    version: str
    rig: str
    start: str
    verdict: str = ""
    file: str = ""
    recordings: tuple[SourceRecording, ...] = ()
    causes: tuple[FoundCause, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class NumberedPlant:
    """A plant of the store."""

    number: int
    profile: PlantProfile
    provenance: Provenance


class PlantStore(NumberedStore[NumberedPlant]):
    """The numbered plants of a state directory."""

    noun = "plant"

    def __init__(self, state: Path) -> None:
        super().__init__(state / PLANTS)

    def number_of(self, document: NumberedPlant) -> int:
        """Return its number."""
        return document.number

    def encode(self, document: NumberedPlant, number: int) -> bytes:
        """Return its file under this number. StoreError for one that could not be read back as it is."""
        plant = replace(document, number=number)
        try:
            data = add_checksum(as_text(plant))
        except ValueError as error:
            raise StoreError("E432", f"plant {plant.profile.name}: {error}") from None
        read = self.decode(data, Path(plant.profile.name))
        if (read.number, read.provenance, read.profile.plant) != (number, plant.provenance, plant.profile.plant):
            raise StoreError("E432", f"plant {plant.profile.name} holds a number that no file can")
        return data

    def decode(self, data: bytes, path: Path) -> NumberedPlant:
        """Return the plant of a file's bytes. StoreError for anything but what was sealed."""
        try:
            verify_checksum(data)
            number, provenance = _read_provenance(data.decode("utf-8"))
            profile, faults = read_plant(parse(data, str(path)))
        except (ValueError, KeyError, TypeError) as error:
            raise StoreError("E432", f"{path} {error}") from None
        except ProfileError as error:
            profile, faults = None, list(error.faults)
        if profile is None:
            raise StoreError("E432", str(faults[0]))
        return NumberedPlant(number=number, profile=profile, provenance=provenance)


def as_text(plant: NumberedPlant) -> str:
    """Return a plant as its file has it, without the checksum. ValueError for a number that no file can hold."""
    facts = {"number": plant.number} | asdict(plant.provenance)
    return f"{_PROVENANCE}{json.dumps(facts, ensure_ascii=True, allow_nan=False)}\n{plant_text(plant.profile)}"


def _read_provenance(text: str) -> tuple[int, Provenance]:
    line = next((line for line in text.splitlines() if line.startswith(_PROVENANCE)), None)
    if line is None:
        raise ValueError("says nothing of where it comes from")
    facts = json.loads(line.removeprefix(_PROVENANCE))
    number = facts.pop("number")
    facts["recordings"] = tuple(SourceRecording(**each) for each in facts["recordings"])
    facts["causes"] = tuple(FoundCause(**each) for each in facts["causes"])
    return int(number), Provenance(**facts)
