"""One recording's row: what `fit` and `diagnose` would answer of it, as plain values. Pure: the file and the question decide.

Importable by any worker: a cluster's processes get the function by its name. No time stands in a row, nor anything else that
would differ from one computer to the next run.
"""

import os
from dataclasses import dataclass
from math import copysign, isfinite, sqrt
from typing import Any, Final

from gateway.catalogue.all_effects import BY_NAME
from gateway.fleet.tasks import Row, Task

FIT_COLUMNS: Final = (
    "model", "order", "rms_n", "max_n", "held_out_rms_n", "x0_v", "x1_v", "rising_handles_n", "rising_weights",
    "falling_handles_n", "falling_weights", "blend_span_n", "value_n", "causes",
)  # fmt: skip
DIAGNOSE_COLUMNS: Final = (
    "verdict", "rms_before_n", "rms_after_n", "floor_n", "floor_source", "samples", "duration_s", "value_n", "causes",
    "refitted",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Question:
    """What is asked of every recording. rig: its name or file, None for the recording's own; columns: a mapping file."""

    rig: str | None = None
    columns: str | None = None


def diagnose_row(question: Question, task: Task) -> Row:
    """Return the diagnosis of one recording. RecordingError and its kin for one that cannot be read."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    from gateway.cli.diagnosis.inputs import read_sources
    from gateway.diagnosis import Options, diagnose
    from gateway.side_by_side import one_after_another

    sources = read_sources([task.path], rig=question.rig, columns=question.columns, state=None)
    options = Options(
        calibration_noise_n=sources.calibration_noise_n,
        late_s=sources.late_s,
        quantum_n=sources.quantum_n,
        is_own=sources.is_own,
    )
    with one_after_another():  # each recording has a process: a second thread would take another's core
        found = diagnose(sources.measurements, sources.plant.plant, options)
    rms_n, floor_n = found.baseline.rms_n, found.baseline.noise_floor_n
    return {
        **task.head,
        "verdict": str(found.verdict),
        "rms_before_n": _plain(rms_n),
        "rms_after_n": _plain(found.extended.held_out_rms_n),
        "floor_n": _plain(floor_n),
        "floor_source": str(found.baseline.noise_floor_source),
        "samples": int(found.baseline.samples),
        "duration_s": _plain(found.baseline.duration_s),
        "value_n": sqrt(max(0.0, rms_n * rms_n - floor_n * floor_n)),
        "causes": [_cause(cause) for cause in found.causes],
        "refitted": [_refitted(each) for each in found.refit.numbers] if found.refit else [],
        "error_code": "",
        "error": "",
    }


def fit_row(question: Question, task: Task) -> Row:
    """Return the fit of one ladder. LadderError where its data must not be fitted."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    from pathlib import Path

    from gateway.bsfm.fit.evaluation import FitRequest
    from gateway.bsfm.ladder.ladder_error import LadderError
    from gateway.recording.tables.mapping_file import column_mapping
    from gateway.service.fitting.ladder_fit import fit_recording
    from gateway.service.fitting.ladder_source import RigContext, read_source

    recording = read_source(Path(task.path), column_mapping(question.columns))
    try:
        fit = fit_recording(recording, FitRequest(), RigContext(rig=question.rig))
    except LadderError as error:
        raise ValueError(f"E421 {error}") from None
    chosen, branches = fit.document["chosen"], fit.evaluation.model.branches
    rising, falling = branches.rising, branches.falling
    middle_v = 0.5 * (rising.x0 + rising.x1)
    return {
        **task.head,
        "model": str(chosen["model"]),
        "order": int(chosen["order"]),
        "rms_n": _plain(fit.verdict.error.rms_n),
        "max_n": _plain(fit.verdict.error.max_n),
        "held_out_rms_n": _plain(chosen["heldout_rms_n"]),
        "x0_v": float(rising.x0),
        "x1_v": float(rising.x1),
        "rising_handles_n": [float(each) for each in rising.handles],
        "rising_weights": [float(each) for each in rising.weights],
        "falling_handles_n": [float(each) for each in falling.handles],
        "falling_weights": [float(each) for each in falling.weights],
        "blend_span_n": float(fit.evaluation.span_n),
        "value_n": 0.5 * float(rising.value(middle_v) + falling.value(middle_v)),
        "causes": [],
        "error_code": "",
        "error": "",
    }


def _cause(cause: Any) -> dict[str, Any]:
    gain = cause.gain
    return {
        "name": cause.name,
        "group": list(cause.group),
        "confidence": _plain(cause.confidence),
        "gain_n": _plain(gain.held_out_rms_before_n - gain.held_out_rms_after_n),
        "sizes": [
            {"name": name, "value": _plain(size.value), "unit": size.unit} for name, size in cause.parameters.items()
        ],
    }


def _refitted(number: Any) -> dict[str, Any]:
    """A number of the plant that the base model refits, by the effect that has it; by_n: what its change does to the force."""
    names = [name for name, effect in BY_NAME.items() if any(each.name == number.name for each in effect.parameters)]
    return {
        "name": names[0] if names else number.name,
        "value": _plain(number.value),
        "unit": number.unit,
        "by_n": copysign(number.costs_n, number.value - number.before),
    }


def _plain(value: float | None) -> float | None:
    return float(value) if value is not None and isfinite(value) else None
