"""A rig with a numbered plant in use: what control compensates of it, what not and why, and what the watch compares with."""

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final

from gateway.catalogue.effect import By
from gateway.control.compensation.cell_map import COMPENSATED_CELL_TERMS
from gateway.control.compensation.compensation import Compensation
from gateway.plants.store import NumberedPlant, PlantStore
from gateway.profiles import PlantProfile, Rig, load_plant
from gateway.profiles.kinds.plant_writer import with_origins
from gateway.profiles.rigs.assembly import FALLBACK_PLANT
from gateway.profiles.rigs.compensated_effects import (
    TREATMENTS,
    compensation_of,
    compensation_words,
    in_simulation,
    without_compensable,
)
from gateway.profiles.rigs.rig import PlantInUse, rehearsed
from gateway.twin.plant import with_value

_HAS_MEASURED: Final = (
    "was made on this rig and has measured it; if it came later: `force-gateway calibrate` measures it again"
)


def own_plant(rig: Rig) -> PlantProfile:
    """Return the plant of the rig's file; of one that names none the one that stands in its place."""
    return rig.plant_profile or rig.fallback_plant or load_plant(FALLBACK_PLANT)


def compensation_on(rig: Rig, plant: PlantProfile) -> Compensation:
    """Return what control takes back of a plant on this rig: of what differs from the rig's own plant, and of what it could
    take back of that one, too."""
    compensation = compensation_of(without_compensable(own_plant(rig).plant), plant.plant)
    return _tell_calibrated(rig, in_simulation(compensation) if rig.simulated else compensation)


def _tell_calibrated(rig: Rig, compensation: Compensation) -> Compensation:
    """Say what is left to a calibration that was made on this very rig and has measured it: the command map, and with its
    response the timing. The parts stay, for another calibration may come into use: control leaves them out by itself."""
    measured = {By.COMMAND} if rig.has_measured(rig.calibration) else set()
    measured |= {By.TIMING} if rig.response_of(rig.calibration) else set()
    known = {treatment.name for treatment in TREATMENTS if treatment.by in measured}
    left = tuple(
        (name, f"calibration {rig.calibration.number} {_HAS_MEASURED}") for name in compensation.acts if name in known
    )
    return replace(
        compensation,
        acts=tuple(name for name in compensation.acts if name not in known),
        limited=(*compensation.limited, *left),
    )


def with_plant_in_use(rig: Rig, plant: NumberedPlant | None) -> Rig:
    """Return the rig, as its file has it, with this plant in use; None: as its file has it. The world of a simulated rig
    stays what it is."""
    if plant is None:
        return rig
    compensation = compensation_on(rig, plant.profile)
    notes_before = compensation_words(rig.compensation)
    doubts = _doubts_on(rig, plant)
    words = (f"plant {plant.number} ({plant.profile.name}) in use", *compensation_words(compensation), doubts)
    notes = (*(note for note in rig.notes if note not in notes_before), *filter(None, words))
    in_use = PlantInUse(plant.number, plant.profile, doubts)
    return replace(rig, compensation=compensation, plant_in_use=in_use, notes=notes)


def _doubts_on(rig: Rig, plant: NumberedPlant) -> str:
    """Return why what a plant takes back may not be in this real machine; empty where nothing says so. Of one that somebody has
    added from a file nobody knows where it was found."""
    found_on = plant.provenance.rig
    if rig.simulated or found_on == rig.name or not plant.provenance.recordings:
        return ""
    if found_on == rehearsed(rig.name):
        return f'plant {plant.number} was found on "{found_on}": what it takes back may be in no machine'
    origin = f'on "{found_on}"' if found_on else "in recordings that name no rig"
    cure = "`force-gateway diagnose` of a recording of this rig makes another one"
    return f"plant {plant.number} was found {origin}, not on {rig.name}: what it takes back may not be in this machine; {cure}"


def with_selected_plant(rig: Rig, state: Path) -> tuple[Rig, tuple[str, ...]]:
    """Return the rig with the plant that its state directory has in use, and what was passed over to find it."""
    selected = PlantStore(state).find_selected()
    return with_plant_in_use(rig, selected.document), selected.notes


def in_use_facts(rig: Rig) -> dict[str, Any]:
    """Return what a recording says of the plant in use: its number (0: the rig's own), what is compensated, and how the
    readings were straightened."""
    cell = rig.compensation.cell
    return {
        "number": rig.plant_in_use.number if rig.plant_in_use else 0,
        "compensated": list(rig.compensation.acts),
        "cell": asdict(cell) if cell else None,
    }


def with_cell_terms(profile: PlantProfile, cell: dict[str, Any] | None) -> PlantProfile:
    """Return a plant that was diagnosed from straightened readings, for the cell as it is: what was taken back comes on top
    of what is still there. cell: as a recording has it, None where nothing was straightened."""
    plant, sources = profile.plant, {}
    for name in COMPENSATED_CELL_TERMS:
        if more := (cell or {}).get(name, 0.0):
            plant = with_value(plant, "cell", name, getattr(plant.cell, name) + more)
            sources[f"cell.{name}"] = "as the plant in use had it, with what was found on top"
    return with_origins(profile, plant, sources) if sources else profile
