"""A recorded run as its commanded force is judged: the plant that was in use, and the readings as that one had the cell."""

from dataclasses import dataclass, replace
from math import nan

import numpy as np

from gateway.control.compensation.cell_map import CellMap
from gateway.diagnosis.force_error import CommandedForce, ErrorBlock, commanded_force, error_blocks
from gateway.diagnosis.measurement import Floats
from gateway.plants.recorded_number import header_in_use
from gateway.recording import Recording, RecordingError
from gateway.recording.tables.time_axis import check_time_axis


@dataclass(frozen=True, slots=True)
class RecordedForce:
    """plant: number in use while the run was recorded, 0 the rig's own; cell: what of the readings that plant has
    straightened; voltage_v: on the output, by row."""

    name: str
    plant: int
    cell: CellMap | None
    force: CommandedForce
    voltage_v: Floats

    def blocks(self, cell: CellMap | None) -> tuple[ErrorBlock, ...]:
        """Return the blocks of this run, its force as read through `cell`. The tare is left as it is."""
        if cell == self.cell:
            return error_blocks(self.force)
        rows = zip(self.force.measured_n, self.voltage_v, strict=True)
        measured_n = np.array([_read_through(force_n, voltage_v, self.cell, cell) for force_n, voltage_v in rows])
        return error_blocks(replace(self.force, measured_n=measured_n))


def read_recorded_force(recording: Recording) -> RecordedForce:
    """Return the run of a recording. ValueError names the column without which nobody knows what was asked, RecordingError the
    row where time runs backwards; no rows are no run."""
    commanded_force(recording.columns)
    kept = check_time_axis(recording).kept
    if not kept.size:
        raise RecordingError(f"{recording.path}: no rows")
    columns = {name: values[kept] for name, values in recording.columns.items()}
    force = commanded_force(columns)
    in_use = header_in_use(recording.header)
    cell = CellMap(**in_use["cell"]) if in_use.get("cell") else None
    voltage_v = columns.get("sent_v", columns.get("command_v", np.full(force.time_s.size, nan)))
    return RecordedForce(recording.path.name, int(in_use.get("number", 0)), cell, force, voltage_v)


def _read_through(measured_n: float, voltage_v: float, known: CellMap | None, other: CellMap | None) -> float:
    """Return what a reading straightened by `known` would be when straightened by `other`."""
    raw_n = known.reading_n(measured_n, nan, voltage_v) if known else measured_n
    return other.force_n(raw_n, nan, voltage_v) if other else raw_n
