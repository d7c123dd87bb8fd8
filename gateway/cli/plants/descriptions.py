"""What is said of a numbered plant: where it comes from, what of it is compensated on a rig, and how two differ."""

from collections.abc import Iterator
from typing import Any

from gateway.plants.in_use import compensation_on
from gateway.plants.store import FoundCause, NumberedPlant
from gateway.profiles import PlantProfile, Rig
from gateway.profiles.rigs.compensated_effects import compensation_words
from gateway.twin.plant import values

_MOST_SHOWN = 3  # numbers that are told in the sentence on a comparison


def describe_provenance(plant: NumberedPlant) -> Iterator[str]:
    """Yield where a plant comes from: its recordings and causes."""
    source = plant.provenance
    if not plant.number:
        whose = "stands in: the rig names none" if source.start else "the rig's own"
        yield f"plant 0 ({plant.profile.name}), {whose}"
        return
    yield f"plant {plant.number} ({plant.profile.name}), made {source.made_utc} by force-gateway {source.version}"
    if source.file:
        yield f"added from {source.file}"
    for recording in source.recordings:
        yield f"diagnosed from {recording.name}, sha256 {recording.sha256[:16]}, starting from {source.start}: {source.verdict}"
    for cause in source.causes:
        yield f"  {cause.name}: {_numbers(cause)}, confidence {cause.confidence:.2f}"


def _numbers(cause: FoundCause) -> str:
    return ", ".join(
        f"{name} {each['value']:.4g} {each['unit']} [{each['ci95'][0]:.4g}, {each['ci95'][1]:.4g}]"
        for name, each in cause.parameters.items()
    )


def describe_compensation(plant: NumberedPlant, rig: Rig | None, fault: str = "") -> tuple[str, ...]:
    """Return what control would take back of a plant on this rig, and of what not and why. fault: why there is no rig."""
    if rig is None:
        return (f"what is compensated depends on the rig: {fault or '--rig names it'}",)
    return (f"plant {plant.number} on rig {rig.name}", *compensation_words(compensation_on(rig, plant.profile)))


def compensation_facts(plant: NumberedPlant, rig: Rig | None) -> dict[str, Any]:
    """Return the same as JSON has it; null where the rig is not known."""
    if rig is None:
        return {"compensated": None, "not_compensated": None}
    compensation = compensation_on(rig, plant.profile)
    limited = [{"name": name, "why": why} for name, why in compensation.limited]
    return {"compensated": list(compensation.acts), "not_compensated": limited}


def differing_numbers(a: PlantProfile, b: PlantProfile) -> dict[str, list[float]]:
    """Return every number in which two plants differ, by path: [a, b]."""
    second = {f"{section}.{name}": value for section, name, value in values(b.plant)}
    first = {f"{section}.{name}": value for section, name, value in values(a.plant)}
    return {path: [float(first[path]), float(second[path])] for path in first if first[path] != second[path]}


def answer_sentence(differing: dict[str, list[float]], a: str, b: str) -> str:
    """Return the answer of a comparison, for terminal and page: how many numbers differ, and which if they are few."""
    if not differing:
        return f"plants {a} and {b} have the same numbers"
    count = f"{len(differing)} number{'s' * (len(differing) > 1)}"
    shown = ", ".join(f"{path} {first:.4g} -> {second:.4g}" for path, (first, second) in differing.items())
    return f"B ({b}) differs from A ({a}) in {count}{f': {shown}' if len(differing) <= _MOST_SHOWN else ''}"


def describe_difference(differing: dict[str, list[float]], a: str, b: str) -> Iterator[str]:
    """Yield a line for each number that differs."""
    yield answer_sentence(differing, a, b)
    if not differing:
        return
    yield f"{'':<36}{a:>14} {b:>14}"
    for path, (first, second) in differing.items():
        yield f"{path:<36}{first:>14.6g} {second:>14.6g}"
