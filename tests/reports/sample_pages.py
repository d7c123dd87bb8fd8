"""One page of each report, made from little: a diagnosis by hand, a fit of a small ladder, a comparison of two calibrations."""

from dataclasses import asdict, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from gateway.bsfm.fit.evaluation import Evaluation, FitRequest, evaluate
from gateway.bsfm.fit.model_error import Error, measured_error_n
from gateway.bsfm.fit.result import ModelName
from gateway.bsfm.ladder.check import CheckedLadder, check_ladder
from gateway.cli.calibration.comparison import compare_calibrations
from gateway.cli.calibration.comparison_page import comparison_page
from gateway.cli.calibration.measured_points import MeasuredPoints
from gateway.profiles import load_calibration
from gateway.reports.diagnosis.page import ReportContext, diagnosis_page
from gateway.reports.fit.document import fit_document
from gateway.reports.fit.page import fit_page
from gateway.reports.fit.raw_ladder import raw_ladder
from tests.reports.fake_diagnosis import FRICTION, WARMTH, diagnosis

EVIL = "<img src=x onerror=alert(1)>&"


def ladder_columns(groups: int = 2) -> dict[str, Any]:
    """10 Hz rows of a loop 3 N wide: 0 .. 6 V in steps of 0.5 V, 0.5 s each."""
    up = np.arange(0.0, 6.01, 0.5).tolist()
    rng, rows, force_n = np.random.default_rng(7), [], 0.0
    for volts in [*(up + up[-2::-1]) * groups, 0.0]:
        for _ in range(5):
            rows.append((0.1 * len(rows), volts, force_n + rng.normal(0.0, 0.05)))
            force_n = float(np.clip(force_n, 8.0 * volts - 1.5, 8.0 * volts + 1.5))
    return dict(zip(("time_s", "command_v", "force_n"), np.array(rows).T, strict=True))


@cache
def checked_ladder() -> CheckedLadder:
    """The ladder with a walk of partial reversals within its loop."""
    checked = check_ladder(ladder_columns(), {})
    turns_v = np.array([3.0, 4.0, 5.0, 4.0, 3.0, 2.0, 3.0, 4.5, 3.5, 2.5, 3.5, 3.0])
    force_n, walk_n = 24.0, []
    for volts in turns_v.tolist():
        force_n = float(np.clip(force_n, 8.0 * volts - 1.5, 8.0 * volts + 1.5))
        walk_n.append(force_n)
    return replace(checked, minor_v=turns_v, minor_n=np.array(walk_n))


@cache
def fit_evaluation() -> Evaluation:
    """What the fit of the ladder has found."""
    return evaluate(checked_ladder(), FitRequest(models=(ModelName.PSFM, ModelName.BSFM), orders=(1, 2)))


@cache
def fit_sample() -> tuple[str, dict[str, Any]]:
    """The page of a fit, and its document."""
    evaluation = fit_evaluation()
    document = fit_document(evaluation, Path("/recordings/ladder.csv"), {"rig": "demo"})
    error = asdict(Error.of(measured_error_n(evaluation.model, evaluation.checked)))
    document |= {"name": "left cell", "measured": {**error, "reversals": True, "rejected": ""}}
    return fit_page(evaluation, document, raw_ladder(ladder_columns(), {})), document


@cache
def comparison_sample() -> str:
    """The page of a comparison, with measured points of the first and none of the second."""
    one = load_calibration("demo")
    other = replace(one, number=2, name=EVIL, falling_handles_n=(*(h * 1.04 for h in one.falling_handles_n[:-1]), 70.0))
    points = {"A": MeasuredPoints(checked_ladder()), "B": MeasuredPoints(None, "it names no data")}
    return comparison_page(compare_calibrations(one, other), points)


@cache
def diagnosis_sample() -> str:
    """The page of a diagnosis with two causes."""
    circumstances = ReportContext(
        rig="demo",
        plant="paper-slide",
        made_utc="2026-11-21 15:50 UTC",
        runtime_s=2.3,
        about={FRICTION.name: "of load"},
    )
    return diagnosis_page(diagnosis(causes=(FRICTION, WARMTH)), circumstances)


PAGES = {"diagnosis": diagnosis_sample, "fit": lambda: fit_sample()[0], "comparison": comparison_sample}
