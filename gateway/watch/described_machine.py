"""The machine of the rig's reference recording, described once: STATE/reference/machine.json keeps it.

It is described anew when the recording, the plant that the description starts from, or the way of describing is another one.
"""

import json
from contextlib import suppress
from dataclasses import asdict, replace
from hashlib import sha256
from pathlib import Path
from typing import Final

from gateway import VERSION
from gateway.control.compensation.cell_map import CellMap
from gateway.diagnosis.changes.machine import MachineModel, describe_machine
from gateway.diagnosis.changes.machine_document import machine_document, read_machine
from gateway.diagnosis.diagnose import Options
from gateway.diagnosis.excerpt import take_excerpt
from gateway.diagnosis.measurement import Measurement
from gateway.plants.recorded_number import header_in_use
from gateway.processes.durable_file import add_checksum, lock_directory, read_regular, replace_durably, verify_checksum
from gateway.recording import read_table
from gateway.recording.measurement import measurement_of
from gateway.twin.plant import Plant, values
from gateway.watch.reference_recording import ReferenceRecording, reference_path

MOST_ROWS: Final = 4000
"""Of the reference, its liveliest: forty seconds at 100 rows a second. Every search holds hundreds of columns as long."""
_FILE: Final = "machine.json"


def described_machine(state: Path, reference: ReferenceRecording, plant: Plant) -> MachineModel:
    """Return the machine of the reference recording. RecordingError or OSError where it cannot be read.

    plant: that the description starts from. It takes some ten seconds of a processor where nothing is kept.
    """
    folder, key = reference_path(state, reference).parent, _key(reference, plant)
    old = reference_measurement(state, reference)
    try:
        kept = json.loads(verify_checksum(read_regular(folder / _FILE)))
        if kept["key"] == key:
            return read_machine(kept["machine"], [old])
    except (OSError, ValueError, KeyError, TypeError):
        pass  # nothing kept, or nothing that can be read
    document = machine_document(describe_machine([old], plant, Options(is_own=True)))
    with suppress(OSError), lock_directory(folder) as descriptor:  # a full disk: it is described again the next time
        replace_durably(descriptor, _FILE, add_checksum(json.dumps({"key": key, "machine": document})))
    return read_machine(document, [old])  # without what the description has kept in memory


def reference_measurement(state: Path, reference: ReferenceRecording) -> Measurement:
    """Return the reference's liveliest rows, its polled pressure left out as in a window."""
    measurement = measurement_of(read_table(reference_path(state, reference)))
    return take_excerpt(replace(measurement, pressure_pa=None), MOST_ROWS)


def _key(reference: ReferenceRecording, plant: Plant) -> str:
    text = json.dumps([VERSION, reference.sha256, MOST_ROWS, [list(each) for each in values(plant)]])
    return sha256(text.encode()).hexdigest()


def is_straightened_alike(state: Path, reference: ReferenceRecording, cell: CellMap | None) -> bool:
    """Return whether the plant in use has the cell's readings as the one that was in use when the reference was recorded."""
    header = read_table(reference_path(state, reference)).header
    return (header_in_use(header).get("cell") or None) == (asdict(cell) if cell else None)
