"""The extended model as a plant profile: every number says whether it was diagnosed, refitted, or known before."""

from dataclasses import replace

from gateway.diagnosis.result import Diagnosis, Estimate
from gateway.profiles import PlantProfile
from gateway.profiles.plant_writer import with_origins
from gateway.service.reporting.diagnosis_words import listed
from gateway.twin.plant import values, with_value


def extended_plant(diagnosis: Diagnosis, start: PlantProfile, recording: str, date: str) -> PlantProfile:
    """start: the plant that the base model was refitted from; recording: what was diagnosed; date: YYYY-MM-DD.

    A refitted number carries no interval: the one of the base fit does not hold for the extended model. The cell's noise,
    which no diagnosis simulates, stays that of the start.
    """
    plant = with_value(diagnosis.plant, "cell", "noise_n", start.plant.cell.noise_n)
    before = {f"{section}.{name}": value for section, name, value in values(start.plant)}
    moved = [f"{section}.{name}" for section, name, value in values(plant) if before[f"{section}.{name}"] != value]
    refitted = [f"{found.section}.{name}" for name, found in diagnosis.base_parameters.items()]
    sources = dict.fromkeys([*moved, *refitted], f"refitted to {recording}, {date}")
    for cause in diagnosis.causes:
        for name, found in cause.parameters.items():
            sources[f"{found.section}.{name}"] = _diagnosed(found, recording, date)
    return replace(with_origins(start, plant, sources), description=_description(diagnosis, start, recording))


def _diagnosed(found: Estimate, recording: str, date: str) -> str:
    low, high = found.ci95
    return f"diagnosed from {recording}, {date}, ci95 [{low:.6g}, {high:.6g}]"


def _description(diagnosis: Diagnosis, start: PlantProfile, recording: str) -> str:
    names = [cause.name for cause in diagnosis.causes]
    what = f"extended by {listed(names)} from" if names else "refitted to"
    return f"{start.name}, {what} {recording}: {start.description}".rstrip(": ")
