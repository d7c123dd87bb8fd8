"""Plan files of `calibrate --plan`: an experiment (parts of moves), or a ladder whose calibration is fitted and stored.

Which of the two is told by the keys: an experiment has `name`, `parts` and so on at the top, anything else is read as a
ladder, whose every key may be left out. Both are read strictly, with every fault at its line and column, here and again by
the gateway that runs them.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, Final, TypeAlias

from gateway.control.runs.experiment_plan import ExperimentPlan, Move, MoveKind, Part, plan_faults
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.profiles.load import open_profile, refer_to
from gateway.profiles.strict_yaml.faults import Findings, ProfileError, ProfileFault, printable
from gateway.profiles.strict_yaml.text import Document
from gateway.profiles.strict_yaml.typed import build

AnyPlan: TypeAlias = CalibrationPlan | ExperimentPlan

_EXPERIMENT_KEYS: Final = frozenset(entry.name for entry in fields(ExperimentPlan)) - {"tare"}
_SCHEMA_LINE: Final = "# force-gateway schema plan > plan.json gives editors the schema\n"


def load_plan_fields(path: str | Path) -> dict[str, Any]:
    """Return what a good file says and no more, for options that fill in what it leaves out. ProfileError with every fault."""
    document = _open_plan(path)
    read_plan(document)
    return dict(document.value)


def _open_plan(path: str | Path) -> Document:
    findings = Findings()
    opened = open_profile("plan", refer_to(path), findings)
    if opened is None:
        raise ProfileError(findings.faults)
    return opened[0]


def read_plan(document: Document) -> AnyPlan:
    """Return the plan of a document. ProfileError with every fault, at its place."""
    plan: AnyPlan | None
    if _EXPERIMENT_KEYS & set(document.value):
        plan, faults = _experiment(document)
    else:
        plan, faults = build(CalibrationPlan, document)
    if plan is None or faults:
        raise ProfileError(faults)
    return plan


def _experiment(document: Document) -> tuple[ExperimentPlan | None, list[ProfileFault]]:
    plan, faults = build(ExperimentPlan, document)
    return plan, faults + ([] if plan is None else [document.fault(path, reason) for path, reason in plan_faults(plan)])


def plan_of(fields_: Mapping[str, Any]) -> AnyPlan:
    """Return a plan from plain values, as they come over the control socket. ValueError with the first fault's sentence."""
    try:
        return read_plan(Document("plan", dict(fields_), {}))
    except ProfileError as error:
        fault = error.faults[0]
        raise ValueError(f"plan: {fault.path} {fault.message}".replace("  ", " ")) from None


def plan_document(plan: AnyPlan) -> dict[str, Any]:
    """Return the plan as JSON takes it and `plan_of` reads it back: without what is not given."""
    document: dict[str, Any] = json.loads(json.dumps(asdict(plan)))
    for part in document.get("parts", ()):
        part["moves"] = [{key: value for key, value in move.items() if value is not None} for move in part["moves"]]
    return document


def plan_text(plan: ExperimentPlan, comment: str = "") -> str:
    """Return the whole file, which `read_plan` reads back to the same plan. comment: lines to stand at its top."""
    head = "".join(f"# {printable(line)}\n" for line in comment.splitlines())
    return head + _SCHEMA_LINE + "".join(_about(plan)) + "parts:\n" + "".join(map(_part, plan.parts))


def _about(plan: ExperimentPlan) -> Iterator[str]:
    for entry in fields(plan):
        value = getattr(plan, entry.name)
        if entry.name == "parts" or value == entry.default:
            continue
        if isinstance(value, tuple):
            yield f"{entry.name}:\n" + "".join(f"  - {_scalar(item)}\n" for item in value)
        else:
            yield f"{entry.name}: {_scalar(value)}\n"


def _part(part: Part) -> str:
    why = f"    why: {_scalar(part.why)}\n" if part.why else ""
    moves = "".join(f"      - {{{_move(move)}}}\n" for move in part.moves)
    return f"  - name: {_scalar(part.name)} # {part.duration_s:.0f} s\n{why}    moves:\n{moves}"


def _move(move: Move) -> str:
    given = ((entry.name, getattr(move, entry.name)) for entry in fields(move))
    return ", ".join(f"{name}: {_scalar(value)}" for name, value in given if value is not None)


def _scalar(value: object) -> str:
    """Plain for numbers and kinds of moves; a text is double-quoted, for it may hold any sign."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (MoveKind, int)):
        return str(value)
    if isinstance(value, float):
        mantissa, exponent, power = repr(value).partition("e")
        return f"{mantissa if '.' in mantissa else mantissa + '.0'}{exponent}{power}"
    return json.dumps(printable(str(value)), ensure_ascii=False)
