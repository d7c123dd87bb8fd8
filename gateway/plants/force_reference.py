"""The reference that is kept when a plant is taken into use: how large the error of the commanded force was before.

It stands beside the plants as `reference.json`, for one number; another plant in use has none. What is in it comes from a
real run of this rig, made before: the newest recording in which a force was commanded without that plant.
"""

import json
from dataclasses import asdict, dataclass
from math import isfinite
from pathlib import Path
from typing import Any, Final

from gateway.control.compensation.cell_map import CellMap
from gateway.diagnosis.force_error import FEWEST_BLOCKS, ErrorBlock
from gateway.plants.recorded_force import read_recorded_force
from gateway.processes.durable_file import lock_directory, make_directory, read_object, replace_durably
from gateway.processes.state_directory import PLANTS
from gateway.recording import Recording, RecordingError, read_recording, recording_paths

_FILE: Final = "reference.json"
_NEWEST: Final = 8
"""Recordings that are looked at, the newest first: further back the machine was another one."""


@dataclass(frozen=True, slots=True)
class ForceReference:
    """plant: the number that it was kept for; recording: the run before, under plant_before; blocks: of its force."""

    plant: int
    recording: str
    plant_before: int
    blocks: tuple[ErrorBlock, ...]


def find_reference(state: Path, plant: int, cell: CellMap | None) -> ForceReference | None:
    """Return the reference from the newest recording before; None where no run tells enough. cell: as the plant has it."""
    for path in reversed(recording_paths(state)[-_NEWEST:]):
        try:
            reference = reference_of(read_recording(path), plant, cell)
        except (OSError, RecordingError, ValueError):
            continue
        if reference.plant_before != plant and len(reference.blocks) >= FEWEST_BLOCKS:
            return reference
    return None


def reference_of(recording: Recording, plant: int, cell: CellMap | None) -> ForceReference:
    """Return the reference that one recording gives. ValueError where it does not say what was asked."""
    run = read_recorded_force(recording)
    return ForceReference(plant, run.name, run.plant, run.blocks(cell))


def keep_reference(state: Path, reference: ForceReference | None) -> None:
    """Keep the reference, None: none, for the watch. OSError where the disk refuses."""
    path = state / PLANTS / _FILE
    if reference is None:
        path.unlink(missing_ok=True)
        return
    make_directory(path.parent)
    with lock_directory(path.parent) as descriptor:
        replace_durably(descriptor, _FILE, json.dumps(asdict(reference)).encode())


def read_reference(state: Path, plant: int) -> ForceReference | None:
    """Return the reference that was kept for this plant; None where there is none, or a damaged one."""
    reference = kept_reference(state)
    return reference if reference and reference.plant == plant else None


def kept_reference(state: Path) -> ForceReference | None:
    """Return the reference that was kept last, for whichever plant; None as of `read_reference`."""
    try:
        facts = read_object(state / PLANTS / _FILE)
        blocks = tuple(_block_of(block) for block in facts["blocks"])
        return ForceReference(int(facts["plant"]), str(facts["recording"]), int(facts["plant_before"]), blocks)
    except (OSError, ValueError, TypeError, KeyError, OverflowError):
        return None


def _block_of(facts: dict[str, Any]) -> ErrorBlock:
    """Return a block as it was kept. ValueError, TypeError or KeyError for anything else: the watch would end over it, at
    each start anew."""
    block = ErrorBlock(**facts)
    numbers = (block.from_n, block.to_n, block.squares_n2, float(block.rows))
    if not (all(map(isfinite, numbers)) and block.rows > 0 and block.squares_n2 >= 0.0):
        raise ValueError(f"no block of a run: {block}")
    return block
