"""The extended model as a plant profile: every number says whether it was diagnosed, refitted, or known before."""

from dataclasses import replace
from typing import Final

from gateway.diagnosis.result import Diagnosis, Estimate
from gateway.profiles import PlantProfile
from gateway.profiles.kinds.plant_writer import with_origins
from gateway.reports.diagnosis.wording import join_words
from gateway.twin.plant import values, with_value

_DETERMINED_BY_LINES: Final = "cell.clock_offset_s"
"""Known from how a gateway reads its lines, so never from a refit."""
_LARGEST_RELATIVE_WIDTH: Final = 0.5
"""Width of an interval over its number, from which the recording does not determine the number (a choice)."""


def extended_plant(diagnosis: Diagnosis, start: PlantProfile, recording: str, date: str) -> PlantProfile:
    """Return the extended model as a profile. start: the plant that the base model was refitted from; recording: what was
    diagnosed; date: YYYY-MM-DD.

    Only what was found is written: a refitted number whose interval holds the start's, or that the recording hardly
    determines, stays as it was, and so does what the wires of a gateway add to its readings. A refitted number carries no
    interval: the one of the base fit does not hold for the extended model. The cell's noise, which no diagnosis simulates,
    stays that of the start.
    """
    plant = with_value(diagnosis.plant, "cell", "noise_n", start.plant.cell.noise_n)
    before = {f"{section}.{name}": value for section, name, value in values(start.plant)}
    diagnosed = {
        f"{estimate.section}.{name}" for cause in diagnosis.causes for name, estimate in cause.parameters.items()
    }
    for name, estimate in diagnosis.base_parameters.items():
        path = f"{estimate.section}.{name}"
        if path not in diagnosed and not _is_new_value(path, estimate, before[path]):
            plant = with_value(plant, estimate.section, name, before[path])
    changed = [f"{section}.{name}" for section, name, value in values(plant) if before[f"{section}.{name}"] != value]
    sources = dict.fromkeys(changed, f"refitted to {recording}, {date}")
    for cause in diagnosis.causes:
        for name, estimate in cause.parameters.items():
            sources[f"{estimate.section}.{name}"] = _source_of_diagnosed(estimate, recording, date)
    return replace(with_origins(start, plant, sources), description=_description(diagnosis, start, recording))


def _is_new_value(path: str, refitted: Estimate, before: float) -> bool:
    """Return whether a refitted number differs from the one before and is certain enough to be written down."""
    low, high = refitted.ci95
    is_sure = high - low < _LARGEST_RELATIVE_WIDTH * max(abs(refitted.value), abs(before))
    return path != _DETERMINED_BY_LINES and is_sure and not low <= before <= high


def _source_of_diagnosed(estimate: Estimate, recording: str, date: str) -> str:
    low, high = estimate.ci95
    return f"diagnosed from {recording}, {date}, ci95 [{low:.6g}, {high:.6g}]"


def _description(diagnosis: Diagnosis, start: PlantProfile, recording: str) -> str:
    names = [cause.name for cause in diagnosis.causes]
    what = f"extended by {join_words(names)} from" if names else "refitted to"
    return f"{start.name}, {what} {recording}: {start.description}".rstrip(": ")
