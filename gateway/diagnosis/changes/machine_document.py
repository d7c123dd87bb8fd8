"""A described machine as a document of plain values, so that it is described once: JSON can hold it.

The recordings themselves are not in it: who reads it back has them.
"""

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any, Final

import numpy as np

from gateway.catalogue.all_effects import EFFECTS
from gateway.catalogue.cylinder import AREA, COULOMB
from gateway.catalogue.effect import Parameter
from gateway.catalogue.regulator import LAG
from gateway.catalogue.sensing import CLOCK_OFFSET
from gateway.diagnosis.bench.bench import bench_of
from gateway.diagnosis.bench.parameters import ModelParameters
from gateway.diagnosis.changes.machine import MachineModel
from gateway.diagnosis.changes.machine_error import ErrorModel
from gateway.diagnosis.measurement import Flags, Measurement
from gateway.diagnosis.result import Estimate, OwnEffect
from gateway.twin.plant import Plant, values, with_value
from gateway.twin.replay.drive import StartState

FORMAT: Final = 1
"""Changes with what a described machine is: documents of another format are described anew."""
_PARAMETERS: Final[dict[str, Parameter]] = {
    each.path: each
    for each in (
        *(parameter for effect in EFFECTS for form in effect.forms for parameter in form.parameters),
        *(AREA, LAG, COULOMB, CLOCK_OFFSET),
    )
}


def machine_document(machine: MachineModel) -> dict[str, Any]:
    """Return what `read_machine` makes the same machine of, beside its recordings."""
    parameters = machine.parameters
    return {
        "format": FORMAT,
        "motion": machine.bench.motion,
        "rows": machine.bench.rows,
        "left_out": _edges(~machine.bench.usable),
        "plant": [list(each) for each in values(parameters.plant)],
        "offsets_n": list(parameters.offsets_n),
        "starts": [each._asdict() for each in parameters.starts],
        "free": [each.path for each in machine.free],
        "readings": dict(machine.readings),
        "error": asdict(machine.error),
        "effects": [{"name": each.name, "parameters": _parameter_facts(each)} for each in machine.effects],
    }


def read_machine(document: dict[str, Any], old: Sequence[Measurement]) -> MachineModel:
    """Return the machine of a document and its recordings. ValueError where they do not belong together."""
    try:
        if document["format"] != FORMAT:
            raise ValueError(f"format {document['format']}, known is {FORMAT}")
        bench = bench_of(old, document["motion"])
        if bench.rows != document["rows"]:
            raise ValueError(f"{document['rows']} rows were described, there are {bench.rows}")
        return MachineModel(
            replace(bench, usable=~_between(document["left_out"], bench.rows)),
            _parameters(document),
            tuple(_PARAMETERS[path] for path in document["free"]),
            {name: float(size) for name, size in document["readings"].items()},
            tuple(_effect(each) for each in document["effects"]),
            _error(document["error"]),
        )
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"is no described machine: {error}") from None


def _parameter_facts(effect: OwnEffect) -> dict[str, list[Any]]:
    return {name: [each.section, each.value, each.unit, *each.ci95] for name, each in effect.parameters.items()}


def _effect(facts: dict[str, Any]) -> OwnEffect:
    estimates = {
        name: Estimate(section, value, unit, (low, high))
        for name, (section, value, unit, low, high) in facts["parameters"].items()
    }
    return OwnEffect(facts["name"], estimates)


def _error(facts: dict[str, Any]) -> ErrorModel:
    lists = {name: tuple(facts[name]) for name in ("scale", "sizes")}
    return ErrorModel(**facts | lists | {"added": tuple(tuple(each) for each in facts["added"])})


def _parameters(document: dict[str, Any]) -> ModelParameters:
    plant = Plant()
    for section, name, value in document["plant"]:
        plant = with_value(plant, section, name, value)
    starts = (each | {"strains": each["strains"] and tuple(each["strains"])} for each in document["starts"])
    return ModelParameters(plant, tuple(document["offsets_n"]), tuple(StartState(**each) for each in starts))


def _edges(flags: Flags) -> list[int]:
    """Rows where flags change, from none before the first row."""
    return [int(row) for row in np.flatnonzero(np.diff(flags.astype(np.int8), prepend=0))]


def _between(edges: Sequence[int], rows: int) -> Flags:
    counts = np.zeros(rows, dtype=np.int64)
    counts[np.array(edges, dtype=np.int64)] = 1
    return np.asarray(np.cumsum(counts) % 2 == 1)
