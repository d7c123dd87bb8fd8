"""A fit as plain values: what `fit --json` prints, what the table and the HTML report are made from."""

from pathlib import Path
from typing import Any

import numpy as np

from gateway.bsfm.branches import Branches
from gateway.bsfm.fit.blend_span import command_error_n, rms_n
from gateway.bsfm.fit.evaluation import Evaluation
from gateway.bsfm.fit.order_choice import Score
from gateway.bsfm.ladder.measured_ladder import FALLING, RISING
from gateway.reports.json_numbers import finite_or_none

FORMAT = 1
Document = dict[str, Any]


def fit_document(evaluation: Evaluation, recording: Path, facts: dict[str, Any]) -> Document:
    """Return the JSON document of a fit, format 1.

    recording, rig, ladder, fits (one per model and order), chosen (of the fits), reversal, model (what is to be activated),
    notes. Forces in N, voltages in V.
    """
    return {
        "format": FORMAT,
        "recording": str(recording),
        "rig": facts.get("rig"),
        "rig_fingerprint": facts.get("rig_fingerprint"),
        "started_utc": facts.get("started_utc"),
        "ladder": _ladder_facts(evaluation),
        "fits": [_fit_facts(score, score is evaluation.chosen) for score in evaluation.scores],
        "chosen": _chosen_facts(evaluation),
        "reversal": _reversal_facts(evaluation),
        "model": _model_facts(evaluation),
        "notes": list(evaluation.notes),
    }


def _ladder_facts(evaluation: Evaluation) -> Document:
    ladder = evaluation.checked.ladder
    return {
        "points": len(ladder),
        "groups": len(ladder.groups),
        "rising": int((ladder.direction == RISING).sum()),
        "falling": int((ladder.direction == FALLING).sum()),
        "voltage_v": [float(ladder.voltage_v.min()), float(ladder.voltage_v.max())],
        "force_n": [float(ladder.force_n.min()), float(ladder.force_n.max())],
        "noise_n": finite_or_none(evaluation.checked.noise_n),
        "minor_points": len(evaluation.checked.minor_v),
    }


def _fit_facts(score: Score, is_chosen: bool) -> Document:
    result = score.result
    verdicts = result.verdicts
    heldout_n = finite_or_none(score.heldout_rms_n)
    return {
        "model": str(result.model),
        "order": result.order,
        "coefficients": score.coefficients,
        "rms_n": result.rms_n,
        "max_n": result.max_n,
        "rising_rms_n": result.rising.rms_n,
        "falling_rms_n": result.falling.rms_n,
        "heldout_rms_n": heldout_n,
        "heldout_error_n": finite_or_none(score.error_n2 / (2.0 * heldout_n)) if heldout_n else None,
        "monotone": verdicts.rising_monotone and verdicts.falling_monotone,
        "crossing": str(verdicts.crossing) if verdicts.crossing else None,
        "steep": verdicts.steep,
        "usable": verdicts.usable,
        "verdicts": list(verdicts.sentences),
        "identifiable": not isinstance(result.covariance, str),
        "rejected": result.rejected,
        "paper_norm": result.paper_norm,
        "chosen": is_chosen,
    }


def _chosen_facts(evaluation: Evaluation) -> Document:
    branches = evaluation.chosen.result.branches
    return (
        _fit_facts(evaluation.chosen, True)
        | {"constrained": evaluation.chosen not in evaluation.scores}
        | coefficients_of(branches)
        | {"force_range_n": list(evaluation.model.force_range_n)}
    )


def coefficients_of(branches: Branches) -> Document:
    """Return the coefficients of both branches: handles in N, voltages in V."""
    rising, falling = branches.rising, branches.falling
    return {
        "x0_v": rising.x0,
        "x1_v": rising.x1,
        "rising_handles_n": list(rising.handles),
        "rising_weights": list(rising.weights),
        "falling_handles_n": list(falling.handles),
        "falling_weights": list(falling.weights),
    }


def _reversal_facts(evaluation: Evaluation) -> Document:
    """policy: linear-blend or slip-stops, `stops` of them; rms_n, max_n: on the whole walk; *_heldout_n: on the half not
    fitted to."""
    reversal = evaluation.reversal
    if reversal is None:
        return {"policy": "linear-blend", "identified": False, "span_n": evaluation.span_n, "points": 0}
    checked = evaluation.checked
    error_n = command_error_n(evaluation.model, checked.minor_v, checked.minor_n)
    switched_n = command_error_n(evaluation.chosen.result.bsfm(0.0), checked.minor_v, checked.minor_n)
    return {
        "policy": "slip-stops" if reversal.slip else "linear-blend",
        "identified": True,
        "span_n": evaluation.span_n,
        "stops": len(reversal.slip.stops.radii_v) if reversal.slip else 0,
        "points": len(checked.minor_v),
        "rms_n": rms_n(error_n),
        "max_n": float(np.abs(error_n).max()),
        "switched_rms_n": rms_n(switched_n),
        "blend_heldout_n": finite_or_none(reversal.blend_heldout_n),
        "slip_heldout_n": finite_or_none(reversal.slip_heldout_n),
    }


def _model_facts(evaluation: Evaluation) -> Document:
    """Return the coefficients to be activated.

    With slip stops the branches are not those of the chosen fit, a joint fit has moved them.
    """
    slip = evaluation.reversal.slip if evaluation.reversal else None
    stops = slip.stops if slip else None
    return coefficients_of(evaluation.model.branches) | {
        "blend_span_n": evaluation.span_n,
        "slip_radii_v": list(stops.radii_v) if stops else [],
        "slip_shares": list(stops.shares) if stops else [],
    }


def residual_of(evaluation: Evaluation) -> "np.ndarray[Any, np.dtype[np.float64]]":
    """Return measured minus the chosen model at each stair of the ladder, N."""
    ladder, branches = evaluation.checked.ladder, evaluation.chosen.result.branches
    rising, falling = branches.rising.value(ladder.voltage_v), branches.falling.value(ladder.voltage_v)
    return np.asarray(ladder.force_n - np.where(ladder.direction == RISING, rising, falling))
