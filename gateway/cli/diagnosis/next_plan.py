"""`diagnose --plan`: what to record next, as a file that `calibrate --plan` runs."""

from pathlib import Path
from shlex import quote

from gateway.diagnosis.experiments.experiments import Plan, plan_next
from gateway.diagnosis.result import Diagnosis
from gateway.profiles.kinds.plans import plan_text

NOTHING = "nothing to plan: every effect of the catalogue is found, ruled out, or not to be shown by an experiment"


def next_plan(diagnosis: Diagnosis) -> Plan | None:
    """Return the next plan; None where there is nothing to plan."""
    return plan_next(diagnosis)


def text(plan: Plan, recordings: str) -> str:
    """Return the file, with what it leaves out as comments. recordings: what the diagnosis was made from."""
    lines = [
        f"Written by force-gateway diagnose for what {recordings} could not tell; about {duration(plan.total_s)}.",
        "Run it: force-gateway calibrate --plan THIS-FILE, then force-gateway diagnose with the number of the recording.",
    ]
    lines += [f"Besides: {comments}" for comments in plan.apart]
    lines += [f"Not in it: {name}: {why}" for name, why in plan.left_out]
    return plan_text(plan.experiment, "\n".join(lines))


def sentence(plan: Plan, path: Path) -> str:
    """Return the sentence on the plan for `what to record next`, in the terminal and in the report."""
    parts = ", ".join(part.name for part in plan.experiment.parts)
    return f"force-gateway calibrate --plan {quote(str(path))} runs it: {parts}; about {duration(plan.total_s)}"


def duration(seconds: float) -> str:
    """Return a duration in words: seconds, or whole minutes from 90 s on."""
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"
