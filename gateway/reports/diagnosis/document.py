"""A diagnosis as plain values: the JSON contract of `diagnose --json`, format 1. Programs read it: no field may change."""

from collections.abc import Mapping
from typing import Any, Final

from gateway.diagnosis.input_checks import Suspect
from gateway.diagnosis.notes import why_blind
from gateway.diagnosis.result import Baseline, Cause, Diagnosis, Estimate, Interval, Leftover, Machine, Refit
from gateway.reports.diagnosis.wording import all_notes
from gateway.reports.json_numbers import finite_or_none

FORMAT: Final = 1
Document = dict[str, Any]


def diagnosis_document(diagnosis: Diagnosis, runtime_s: float) -> Document:
    """Return plain values. Forces in N, times in s, ci95 is [low, high], confidence and shares 0..1; not finite: null.

    suspects (columns that are not what they say) and notes stand beside the contract's fields; where older recordings of the
    machine were given also machine, and what each cause's parameters were before; with the plant of the recordings' own rig
    also refit: the error of that plant as it stands, and what of its numbers the refit has changed.
    """
    return {
        "format": FORMAT,
        "verdict": str(diagnosis.verdict),
        "baseline": _baseline(diagnosis.baseline),
        "causes": [_cause(cause) | _before(diagnosis, cause) for cause in diagnosis.causes],
        "leftover": [_leftover(rest) for rest in diagnosis.leftover],
        "not_identifiable": [
            {"name": unseen.name, "why": unseen.why, "experiment": unseen.experiment}
            for unseen in diagnosis.not_identifiable
        ],
        "rejected": [{"name": loser.name, "gain": finite_or_none(loser.gain)} for loser in diagnosis.rejected],
        "extended": {
            "held_out_rms_n": finite_or_none(diagnosis.extended.held_out_rms_n),
            "reaches_noise_floor": bool(diagnosis.extended.reaches_noise_floor),
        },
        "runtime_s": finite_or_none(runtime_s),
        "suspects": [_suspect(each) for each in diagnosis.suspects],
        "notes": [*filter(None, [why_blind(diagnosis)]), *all_notes(diagnosis)],
    } | {
        name: value
        for name, value in (("machine", _machine(diagnosis.machine)), ("refit", _refit(diagnosis.refit)))
        if value is not None
    }


def _baseline(baseline: Baseline) -> Document:
    return {
        "rms_n": finite_or_none(baseline.rms_n),
        "noise_floor_n": finite_or_none(baseline.noise_floor_n),
        "noise_floor_source": str(baseline.noise_floor_source),
        "samples": int(baseline.samples),
        "duration_s": finite_or_none(baseline.duration_s),
    }


def _refit(refit: Refit | None) -> Document | None:
    if refit is None or not refit.is_own:
        return None
    return {
        "as_given_rms_n": finite_or_none(refit.as_given_rms_n),
        "parameters": {
            each.name: {
                "value": finite_or_none(each.value),
                "before": finite_or_none(each.before),
                "unit": each.unit,
                "costs_n": finite_or_none(each.costs_n),
            }
            for each in refit.numbers
        },
    }


def _leftover(rest: Leftover) -> Document:
    """What does not belong to its form is null."""
    return {
        "depends_on": rest.depends_on,
        "shape": rest.shape,
        "share": finite_or_none(rest.share),
        "columns": list(rest.columns),
        "frequency_hz": _or_none(rest.frequency_hz),
        "amplitude_n": _or_none(rest.amplitude_n),
        "period_s": _or_none(rest.period_s),
        "file": rest.file or None,
        "experiment": rest.experiment,
    }


def _or_none(value: float | None) -> float | None:
    return None if value is None else finite_or_none(value)


def _suspect(suspect: Suspect) -> Document:
    return {
        "code": suspect.code,
        "recording": suspect.recording,
        "column": suspect.column,
        "swapped_with": suspect.other or None,
        "unit": suspect.unit or None,
        "factor": finite_or_none(suspect.factor),
        "is_sure": suspect.is_sure,
        "option": suspect.option,
        "sentence": suspect.sentence,
    }


def _cause(cause: Cause) -> Document:
    gain = cause.gain
    return {
        "name": cause.name,
        "group": list(cause.group),
        "confidence": finite_or_none(cause.confidence),
        "parameters": _parameters(cause.parameters),
        "gain": {
            "held_out_rms_before_n": finite_or_none(gain.held_out_rms_before_n),
            "held_out_rms_after_n": finite_or_none(gain.held_out_rms_after_n),
            "ci95": _interval(gain.ci95),
            "share_of_excess": finite_or_none(gain.share_of_excess),
        },
    }


def _parameters(parameters: Mapping[str, Estimate]) -> Document:
    return {
        name: {"value": finite_or_none(estimate.value), "unit": estimate.unit, "ci95": _interval(estimate.ci95)}
        for name, estimate in parameters.items()
    }


def _before(diagnosis: Diagnosis, cause: Cause) -> Document:
    """What the cause's parameters were in the older recordings, where it is a change since."""
    if diagnosis.machine is None:
        return {}
    return {
        "before": {
            name: finite_or_none(getattr(getattr(diagnosis.base, estimate.section), name))
            for name, estimate in cause.parameters.items()
        }
    }


def _machine(machine: Machine | None) -> Document | None:
    """What belongs to the machine, by its older recordings: no finding."""
    if machine is None:
        return None
    return {
        "against": list(machine.recordings),
        "effects": [{"name": each.name, "parameters": _parameters(each.parameters)} for each in machine.effects],
        "common_error_n": finite_or_none(machine.common_error_n),
        "left_n": finite_or_none(machine.left_n),
    }


def _interval(interval: Interval) -> list[float | None]:
    return [finite_or_none(end) for end in interval]
