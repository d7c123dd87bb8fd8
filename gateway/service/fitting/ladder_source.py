"""Where a ladder comes from, and what is known about the rig that it was recorded on."""

import contextlib
from dataclasses import dataclass, replace
from math import isclose
from pathlib import Path
from typing import Final

import numpy as np

from gateway import defaults
from gateway.bsfm import Calibration
from gateway.bsfm.ladder.check import CheckedLadder, Expectation, check_ladder, join_ladders
from gateway.bsfm.ladder.ladder_error import LadderError, LadderFlaw
from gateway.bsfm.ladder.rows import FORCE_UNITS, OVERLOADED
from gateway.calibrations.store import calibration_in_use
from gateway.profiles import ProfileError, Rig, read_rig
from gateway.recording import (
    ColumnMapping,
    Recording,
    RecordingError,
    read_header,
    read_recording,
    read_table,
    recording_paths,
)
from gateway.recording.layout import SUFFIX
from gateway.recording.tables.covariates import is_own_recording
from gateway.recording.tables.row_validity import valid_by_quality

_DEFAULT_RIG: Final = defaults.RIG  # whose calibration a table without a known rig is compared with
_MM2_PER_M2: Final = 1.0e6


@dataclass(frozen=True, slots=True, kw_only=True)
class RigContext:
    """rig: the one asked for, None for the recording's own; state: whose calibration in use is the reference, None for
    the rig's built-in one; force_unit: as the user says, None as the table says."""

    rig: str | None = None
    state: Path | None = None
    force_unit: str | None = None


def read_source(path: Path, mapping: ColumnMapping | None = None) -> Recording:
    """Return a recording of ours, Parquet or a CSV, by its first bytes. RecordingError and OSError as the readers.

    Cells that are no number are told and left out: a fit takes stairs, not every row. A force whose unit the mapping says
    is in newtons from here on, and known to be. What another program's quality means is told by what is usual in it.
    """
    recording = _with_our_quality(read_table(path, mapping, lenient=True))
    says_unit = mapping and any(source.name == "force_n" and source.unit for source in mapping.sources)
    return replace(recording, header=recording.header | {"force_unit": "N"}) if says_unit else recording


def _with_our_quality(recording: Recording) -> Recording:
    """A table of others with a quality as our recorder means it: its 192 is no overload."""
    columns = recording.columns
    if "quality" not in columns or is_own_recording(columns):
        return recording
    valid, notes = valid_by_quality(columns["quality"], is_ours=False)
    ours = np.where(valid, 0.0, OVERLOADED)
    return replace(recording, columns=columns | {"quality": ours}, notes=(*recording.notes, *notes))


def in_unit(recording: Recording, force_unit: str | None) -> Recording:
    """Return the recording that says which unit its force is in, as the user does. LadderError where its header or a mapping
    has said another one, by which it was read."""
    factor = recording.factors.get("force_n")
    if force_unit is None or factor is None:
        return (
            recording
            if force_unit is None
            else replace(recording, header=recording.header | {"force_unit": force_unit})
        )
    if not isclose(FORCE_UNITS.get(force_unit.strip().lower(), 0.0), factor, rel_tol=1.0e-6):
        sentence = (
            f"--force-unit {force_unit}, but force_n was read in another unit already (1 of it = {factor:.5g} N), as its "
            "header, a comment or --columns says: leave one of both out"
        )
        raise LadderError(LadderFlaw.UNIT, sentence)
    return replace(recording, header=recording.header | {"force_unit": "N"})


def read_resumed(recording: Recording) -> list[Recording]:
    """Return the recordings that a resumed run goes on from, oldest first, and itself. An exported table stands alone."""
    numbers = recording.header.get("continues", ()) if recording.path.suffix == SUFFIX else ()
    earlier = numbers if isinstance(numbers, list) else ()
    parts = [*(_read_earlier(recording, int(number)) for number in earlier), recording]
    return [_shift_to_zero(part, float(parts[0].header.get("zero_n", 0.0))) for part in parts]


def _read_earlier(recording: Recording, number: int) -> Recording:
    path = recording.path.with_name(f"{number:04d}{recording.path.suffix}")
    try:
        return read_recording(path)
    except FileNotFoundError:
        raise RecordingError(
            f"{recording.path}: goes on from {path.name}, which has the groups before and does not lie beside it: copy it there"
        ) from None


def _shift_to_zero(part: Recording, zero_n: float) -> Recording:
    """Its forces from this zero of the cell: a restart of the gateway has lost the tare that the first part was made with."""
    moved_n = float(part.header.get("zero_n", zero_n)) - zero_n
    if moved_n == 0.0 or "force_n" not in part.columns:
        return part
    note = f"{part.path.name} was recorded from another zero, {moved_n:+.2f} N: its forces were moved to that of the first part"
    columns = part.columns | {"force_n": part.columns["force_n"] + moved_n}
    return replace(part, columns=columns, notes=(*part.notes, note))


def check_source(recording: Recording, context: RigContext) -> CheckedLadder:
    """Return the ladder of a recording, of a resumed one with what came before. LadderError if it must not be fitted."""
    expected, rig_notes = expectation(recording, context)
    recordings = read_resumed(recording)
    ladders = [check_ladder(part.columns, part.header, expected) for part in recordings]
    if len(ladders) > 1:  # or what is left out of one would read as if the fit had to do without it
        ladders = [
            replace(ladder, notes=tuple(f"{part.path.name}: {note}" for note in ladder.notes))
            for part, ladder in zip(recordings, ladders, strict=True)
        ]
    ladder = join_ladders(ladders)
    notes = dict.fromkeys(note for part in recordings for note in part.notes)
    return replace(ladder, notes=(*notes, *rig_notes, *ladder.notes))


def expectation(recording: Recording, context: RigContext) -> tuple[Expectation, list[str]]:
    """Return what to compare the data with, and sentences about what could not be compared."""
    recorded = str(recording.header.get("rig", "")).strip()
    rig_name = context.rig or rig_of_state(context.state)
    rig, rig_notes = find_rig(rig_name or recorded, str(recording.header.get("rig_file", "")))
    reference = _reference(rig, context.state)
    fingerprint = recording.header.get("rig_fingerprint")
    if rig is not None and fingerprint and fingerprint != rig.fingerprint and recorded == rig.name:
        rig_notes.append(f"the files of rig {rig.name} have changed since the recording was made")
    fallback_rig = rig or read_rig(_DEFAULT_RIG)
    plant = rig.plant if rig else None
    expected = Expectation(
        reference=reference.model() if reference else fallback_rig.calibration.model(),
        named=f"{reference.number} ({reference.name})"
        if reference
        else f"{fallback_rig.calibration.name} (a stand-in)",
        area_mm2=plant.cylinder.area_m2 * _MM2_PER_M2 if plant else None,
        rig=rig.name if rig and rig_name else rig_name,
        saturation_n=rig.control.supervision.saturation_n if rig else None,
        force_unit=context.force_unit,
    )
    return expected, rig_notes


def acceptance_bounds(recording: Recording, context: RigContext) -> tuple[float | None, Calibration | None]:
    """Return what a fit of it must not miss: the rig's in-band tolerance, N, and the calibration in use. None: not known."""
    rig_name = context.rig or rig_of_state(context.state)
    rig, _ = find_rig(rig_name or str(recording.header.get("rig", "")), str(recording.header.get("rig_file", "")))
    tolerance_n = rig.control.defaults.in_band_tolerance_n if rig else None
    return tolerance_n, _reference(rig, context.state)


def rig_of_state(state: Path | None) -> str | None:
    """Return the rig whose recordings a state directory holds; None where it holds none."""
    for path in reversed(recording_paths(state) if state else []):
        with contextlib.suppress(RecordingError, OSError):
            if rig := read_header(path).get("rig"):
                return str(rig)
    return None


def find_rig(name: str, file: str) -> tuple[Rig | None, list[str]]:
    """Find the rig by name, else by the file that the recording names, if that is (still) the one."""
    if not name:
        return None, []
    try:
        return read_rig(name), []
    except ProfileError:
        if file and (rig := _from_file(file)) and rig.name == name:
            return rig, []
        return None, [f"rig {name} is not known here: its limits and its plant could not be compared with the data"]


def _from_file(file: str) -> Rig | None:
    try:
        return read_rig(file)
    except ProfileError:
        return None


def _reference(rig: Rig | None, state: Path | None) -> Calibration | None:
    """Return the calibration in use, else the rig's built-in one."""
    return None if rig is None else calibration_in_use(rig, state) if state else rig.calibration
