"""What the readings of the new recordings tell by themselves: spikes, copies and counts that the old ones did not have."""

from dataclasses import replace
from typing import Final

import numpy as np

from gateway.diagnosis.bench.bench import Bench, bench_of
from gateway.diagnosis.changes.machine import JointModel, MachineModel
from gateway.diagnosis.model_fit.base_fit import refit
from gateway.diagnosis.search.direct_evidence import (
    DirectEvidence,
    find_outliers,
    find_quantisation,
    find_repeats,
    flag_spoiling_spikes,
)

_TIMES_AS_MANY: Final = 2.0  # what the old recordings had, from which more is a change


def take_new_evidence(
    joint: JointModel, machine: MachineModel, known_quantum_n: float
) -> tuple[JointModel, tuple[DirectEvidence, ...]]:
    """Return the joint model without rows that are no witness, and what is new. known_quantum_n: step of the readings."""
    part, residual_n = _new_part(joint, machine), joint.fitted.residual_n
    fresh = part.rows
    quantum_n = max(known_quantum_n, *(_size(machine, "sensor-quantisation"), 0.0))
    lattice = find_quantisation(part, residual_n[:fresh], quantum_n)
    coarse_n = lattice.values[0][1] if lattice else 0.0
    others = [
        find_outliers(part, residual_n[:fresh], coarse_n),
        None if lattice else find_repeats(part, residual_n[:fresh]),
    ]
    rows = np.zeros(joint.bench.rows, dtype=bool)
    rows[:fresh] = flag_spoiling_spikes(part, residual_n[:fresh])
    for each in others:
        if each is not None:
            rows[:fresh] |= each.rows
    bench = joint.bench.without_rows(rows)
    fitted = refit(bench, joint.fitted, joint.whiten) if rows.any() else joint.fitted
    found = [each for each in (lattice, *others) if each is not None and _is_new(each, machine)]
    return replace(joint, bench=bench, fitted=fitted), tuple(_on_all_rows(each, joint.bench.rows) for each in found)


def _new_part(joint: JointModel, machine: MachineModel) -> Bench:
    """The bench of the new recordings alone."""
    recordings = len(joint.bench.measurements) - len(machine.bench.measurements)
    part = bench_of(joint.bench.measurements[:recordings], joint.bench.motion)
    return replace(part, raw_n=joint.bench.raw_n[: part.rows], usable=joint.bench.usable[: part.rows])


def _size(machine: MachineModel, name: str) -> float:
    """First number of what the old recordings' readings told by themselves; 0 where they did not."""
    return machine.readings.get(name, 0.0)


def _is_new(evidence: DirectEvidence, machine: MachineModel) -> bool:
    return evidence.values[0][1] > _TIMES_AS_MANY * _size(machine, evidence.name)


def _on_all_rows(evidence: DirectEvidence, rows: int) -> DirectEvidence:
    flagged = np.zeros(rows, dtype=bool)
    flagged[: evidence.rows.size] = evidence.rows
    return replace(evidence, rows=flagged)
