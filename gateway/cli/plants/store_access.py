"""What the verb `plant` does with a store: find, add, keep what was diagnosed, and change with or without a running gateway."""

from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gateway import VERSION
from gateway.cli.change_in_use import ask_until_done, not_running
from gateway.cli.errors import CliError, NoAnswerError
from gateway.cli.options import StateChoice
from gateway.numbered_documents.store import StoredDocument, StoreError
from gateway.plants.in_use import compensation_on, own_plant, with_cell_terms
from gateway.plants.store import FoundCause, NumberedPlant, PlantStore, Provenance, SourceRecording
from gateway.processes import exit_codes
from gateway.profiles import PlantProfile, ProfileError, Rig, load_plant, read_rig

if TYPE_CHECKING:
    from gateway.cli.diagnosis.inputs import Sources
    from gateway.control.compensation.cell_map import CellMap
    from gateway.diagnosis.result import Cause, Diagnosis
    from gateway.plants.force_reference import ForceReference


def open_store(directory: Path) -> PlantStore:
    """Return the plants of a state directory."""
    return PlantStore(directory)


def load_stored(store: PlantStore, number: int) -> NumberedPlant:
    """Return a plant by its number. CliError (65) when it is not there or damaged."""
    try:
        return store.load(number)
    except StoreError as error:
        raise CliError(str(error), exit_codes.DATA) from None


def load_numbered(state: StateChoice, number: int) -> NumberedPlant:
    """Return a plant by its number, 0: the rig's own. CliError (65) when it is not there or damaged."""
    if number:
        return load_stored(open_store(state.directory), number)
    rig = read_rig(state.rig)
    own = own_plant(rig)
    stands_in = own.name if rig.plant_profile is None else ""
    nothing = Provenance(made_utc="", version="", rig=state.rig, start=stands_in)
    return NumberedPlant(number=0, profile=own, provenance=nothing)


def load_rig_or_none(state: StateChoice) -> Rig | None:
    """Return the rig that is meant, with the calibration that is in use on it; None where it cannot be read."""
    from gateway.calibrations.store import CalibrationStore

    try:
        rig = read_rig(state.rig)
    except ProfileError:
        return None
    calibration = CalibrationStore(state.directory, rig.calibration).find_selected().document
    return replace(rig, calibration=calibration or rig.calibration)


def find_plant(state: StateChoice, which: str) -> PlantProfile:
    """Return a plant by its number (0: the rig's own), a shipped name or a file."""
    if not which.isdecimal():
        return load_plant(which)
    if int(which):
        return load_stored(open_store(state.directory), int(which)).profile
    return own_plant(read_rig(state.rig))


def add_file(state: StateChoice, file: Path) -> int:
    """Add a plant file; return its number. ProfileError with every fault of the file."""
    profile = load_plant(file)
    provenance = Provenance(made_utc=now_utc(), version=VERSION, rig=state.rig, start="", file=file.name)
    return add(state.directory, profile, provenance)


def add(directory: Path, profile: PlantProfile, provenance: Provenance) -> int:
    """Add a plant under the next number and return it. CliError where the disk refuses."""
    try:
        return open_store(directory).add(NumberedPlant(number=0, profile=profile, provenance=provenance))
    except StoreError as error:
        raise CliError(str(error), exit_codes.FAILED) from None


def save_diagnosed(directory: Path, diagnosis: "Diagnosis", sources: "Sources", profile: PlantProfile) -> int:
    """Add the plant that a diagnosis has extended, with its provenance; return its number. profile: as `--extend` writes it."""
    from hashlib import sha256

    from gateway.profiles.rigs.rig import rehearsed

    recordings = tuple(
        SourceRecording(name=path.name, sha256=sha256(path.read_bytes()).hexdigest()) for path in sources.paths
    )
    provenance = Provenance(
        made_utc=now_utc(),
        version=VERSION,
        rig=rehearsed(sources.rig) if sources.rig and sources.is_rehearsal else sources.rig,
        start=sources.plant.name,
        verdict=diagnosis.verdict.value,
        recordings=recordings,
        causes=tuple(_cause_of(cause) for cause in diagnosis.causes),
    )
    return add(directory, with_cell_terms(profile, sources.straightened), provenance)


def _cause_of(cause: "Cause") -> FoundCause:
    parameters = {
        name: {"value": float(each.value), "unit": each.unit, "ci95": [float(end) for end in each.ci95]}
        for name, each in cause.parameters.items()
    }
    return FoundCause(name=cause.name, confidence=float(cause.confidence), parameters=parameters)


def now_utc() -> str:
    """Return the time as provenance has it."""
    return f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"


def change_plant(state: StateChoice, request: dict[str, Any], before: str | None) -> dict[str, Any]:
    """Use another plant or roll back. request: {"use": N} or {"rollback": True}; before: the run that the watch compares
    with, None: the newest one. Return the gateway's answer, or what was done here where none runs, and the reference."""
    from gateway.plants.force_reference import keep_reference, kept_reference

    earlier = kept_reference(state.directory)
    kept = _keep_reference(state, request.get("use", 0), before)  # before the change: the watch reads it as it comes
    try:
        return _change(state.directory, request) | kept
    except NoAnswerError as error:  # more likely than not it takes the new one
        if kept:
            said = f"{error}; the reference of the watch is kept for plant {request['use']}"
            raise NoAnswerError(said, error.exit_code) from None
        raise
    except CliError:
        if kept:  # the plant that stays in use is compared with its own
            keep_reference(state.directory, earlier)
        raise


def _change(directory: Path, request: dict[str, Any]) -> dict[str, Any]:
    with not_running(directory) as is_free:
        if is_free:
            return _change_without_gateway(directory, request)
    answer = ask_until_done(directory, "plant", request)
    if answer["failed"]:
        raise CliError(answer["said"], exit_codes.DATA)
    return answer


def _change_without_gateway(directory: Path, request: dict[str, Any]) -> dict[str, Any]:
    store = open_store(directory)
    try:
        number = store.previous().number if "rollback" in request else request["use"]
        name = store.load(number).profile.name if number else ""
        store.use(number or None)
    except StoreError as error:
        raise CliError(str(error), exit_codes.FAILED if error.code == "E431" else exit_codes.DATA) from None
    what = f"plant {number} ({name})" if number else "the rig's own plant"
    return {
        "active": number or 0,
        "name": name,
        "waiting": None,
        "said": f"{what} will be used from the next start: no gateway runs",
    }


def _keep_reference(state: StateChoice, number: int, before: str | None) -> dict[str, Any]:
    """Keep how large the error of the force was before, where a plant comes into use; a sentence of it, and the numbers."""
    from gateway.diagnosis.force_error import rms_n
    from gateway.plants.force_reference import keep_reference

    if not number:
        return {}
    plant, rig = load_stored(open_store(state.directory), number), load_rig_or_none(state)
    cell = compensation_on(rig, plant.profile).cell if rig else None
    reference = _reference(state, number, cell, before)
    keep_reference(state.directory, reference)
    if reference is None:
        nothing = "no run under force was recorded before: nobody can say whether it makes the force worse (--before names one)"
        return {"reference": nothing, "reference_rms_n": None}
    error_n = rms_n(reference.blocks)
    sentence = f"reference: {reference.recording}, {error_n:.2f} N RMS; the watch warns (A347) when it gets worse"
    return {"reference": sentence, "reference_rms_n": error_n}


def _reference(state: StateChoice, number: int, cell: "CellMap | None", before: str | None) -> "ForceReference | None":
    from gateway.cli.recordings.named_recording import recording_path
    from gateway.plants.force_reference import find_reference, reference_of
    from gateway.recording import read_table

    if before is None:
        return find_reference(state.directory, number, cell)
    path = recording_path(before, state.rig, state.path)
    try:
        return reference_of(read_table(path), number, cell)
    except ValueError as error:
        raise CliError(f"E403 {path}: {error}", exit_codes.DATA) from None


def plant_facts(entry: StoredDocument[NumberedPlant], *, is_active: bool) -> dict[str, Any]:
    """Return one entry of the list as JSON has it."""
    plant = entry.document
    return {
        "number": entry.number,
        "active": is_active,
        "fault": entry.fault or None,
        "name": plant and plant.profile.name,
        "provenance": asdict(plant.provenance) if plant else None,
    }


def all_plant_facts(plant: NumberedPlant, rig: Rig | None) -> dict[str, Any]:
    """Return everything of a plant as JSON has it."""
    from gateway.cli.plants.descriptions import compensation_facts

    return {
        "number": plant.number,
        "name": plant.profile.name,
        "description": plant.profile.description,
        "provenance": asdict(plant.provenance) if plant.number else None,
        **compensation_facts(plant, rig),
        "plant": asdict(plant.profile.plant),
    }
