"""What is told of a calibration or an experiment: before it begins, while it runs, and in the header of its recording."""

from dataclasses import asdict
from typing import Any

from gateway.control.runs.active_run import RecordedPlan, RecordedRun
from gateway.control.runs.experiment_plan import ExperimentPlan
from gateway.control.runs.experiment_run import ExperimentRun
from gateway.profiles.kinds.plans import plan_document
from gateway.service.running_rig.recording.recorded_row import COLUMNS

Answer = dict[str, Any]


def describe_experiment(plan: RecordedPlan) -> Answer:
    """Return what a person should know and do before an experiment."""
    if not isinstance(plan, ExperimentPlan):
        return {"experiment": "", "check": True, "notes": [], "questions": []}
    missing = [name for name in plan.columns if name not in COLUMNS]
    advice = f"this gateway does not record {' and '.join(missing)}: record it beside, and join the tables by time"
    return {
        "experiment": f"experiment {plan.name}, {len(plan.parts)} parts ({', '.join(part.name for part in plan.parts)})",
        "check": plan.check,
        "notes": [advice] if missing else [],
        "questions": [f"Ready to do this while it runs: {text}?" for text in plan.by_hand],
    }


def describe_progress(run: RecordedRun | None) -> Answer:
    """Return how far a run is, in its own terms."""
    progress: Answer = {"stair": 0, "stairs": 0, "group": 0, "groups": 0, "part": 0, "parts": 0, "part_name": ""}
    if isinstance(run, ExperimentRun):
        part = run.part
        return progress | {"part": part + 1, "parts": len(run.plan.parts), "part_name": run.plan.parts[part].name}
    if run is None:
        return progress
    stair = run.stairs[min(run.done, len(run.stairs) - 1)]
    groups = run.plan.groups
    return progress | {"stair": run.done, "stairs": len(run.stairs), "group": max(0, stair.group + 1), "groups": groups}


def header_of_plan(run: RecordedRun) -> Answer:
    """Return what stands of it in the header of its recording: a ladder is what `fit` and --resume look for."""
    if isinstance(run, ExperimentRun):
        return {"experiment": plan_document(run.plan)}
    top_v = max(stair.voltage_v for stair in run.stairs)
    return {"ladder": asdict(run.plan) | {"stairs": len(run.stairs), "top_v": top_v}}
