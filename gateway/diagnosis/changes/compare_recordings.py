"""What has changed between recordings of one machine: the new ones against the old ones, under one model.

The machine is described by the old recordings: base model, as many effects as they ask for, and its common error. All of
that holds for the new recordings, too. What differs there is searched for as changes of the plant's numbers, effect by
effect, with the rules of every search, judged by the new recordings only; what the old ones leave is the noise floor.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import hypot
from typing import Final

from gateway import progress
from gateway.diagnosis.changes.change_effects import change_effects
from gateway.diagnosis.changes.machine import JointModel, MachineModel, describe_machine, join_recordings
from gateway.diagnosis.changes.new_evidence import take_new_evidence
from gateway.diagnosis.changes.other_machine import doubt_machine
from gateway.diagnosis.diagnose import Options, diagnosis_of_wrong_columns, with_readings_of
from gateway.diagnosis.excerpt import MOST_ROWS, take_excerpt
from gateway.diagnosis.input_checks import find_suspects
from gateway.diagnosis.measurement import Measurement
from gateway.diagnosis.model_fit.base_fit import DEFAULT_PLANT
from gateway.diagnosis.residuals.dependence_tests import find_dependences
from gateway.diagnosis.residuals.leftovers import is_same_form
from gateway.diagnosis.result import Cause, Diagnosis, Leftover, Machine, Trace, Verdict
from gateway.diagnosis.search.search import SearchResult, search_effects
from gateway.diagnosis.verdict import SearchFindings, compose_diagnosis
from gateway.one_blas_thread import one_blas_thread
from gateway.twin.plant import Plant

_MORE_THAN_BEFORE: Final = (
    0.98  # what the old recordings leave is a floor where the new ones leave more, by more than chance
)
_LEAST_SHARE_OF_LEFT: Final = 0.05  # of the squared error that is left anyway; a quiet day showed 0.02


@one_blas_thread()
def find_changes(
    new: Sequence[Measurement],
    old: Sequence[Measurement],
    plant: Plant | None = None,
    options: Options | None = None,
) -> Diagnosis:
    """Return what differs in the new recordings from the old ones of the same machine; its causes are changes.

    `plant` None: the shipped slide's start. Errors: ValueError without recordings on either side.
    """
    if not new or not old:
        raise ValueError("what has changed needs recordings from before and after")
    options, given = options or Options(), plant or DEFAULT_PLANT
    rows = max(MOST_ROWS // (len(new) + len(old)), 1)
    new, old = ([take_excerpt(each, rows) for each in some] for some in (new, old))
    suspected = find_suspects([*new, *old], given, is_own=options.is_own)
    if any(each.is_sure for each in suspected):
        return diagnosis_of_wrong_columns(new, given, suspected)
    progress.report("describing the machine by its older recordings")
    machine = describe_machine(old, given, options)
    result = compare_with_machine(new, machine, given, options)
    of_old = doubt_machine(old, hypot(machine.error.common_n, machine.error.left_n))
    doubts = of_old or doubt_machine(new, result.baseline.rms_n)
    return replace(result, suspects=suspected, notes=(*doubts, *result.notes))


@one_blas_thread()
def compare_with_machine(
    new: Sequence[Measurement], machine: MachineModel, given: Plant, options: Options
) -> Diagnosis:
    """Return what differs in the new recordings from a machine that is described already."""
    progress.report("looking for what has changed")
    joint = join_recordings(new, machine, given, options)
    joint, evidence = take_new_evidence(joint, machine, max(options.quantum_n, given.cell.quantum_n))
    assert joint.bench.witnesses is not None
    effects = change_effects(joint.fitted.parameters, joint.bench.witnesses, options.late_s)
    found = search_effects(joint.bench, joint.fitted, effects, joint.whiten)
    left = find_dependences(found.bench, found.fitted, found.whiten, found.unnamed)
    left = _without_old(joint, found, left) if left else left
    floor_n = options.noise_floor_n
    if floor_n is None and machine.error.left_n < _MORE_THAN_BEFORE * joint.bench.rms_n(found.base.residual_n):
        floor_n = machine.error.left_n  # else nothing is off, and nothing has to be explained
    result = compose_diagnosis(SearchFindings(joint.bench, found, evidence, left, effects), floor_n)
    result = _drop_trifles(result, machine.error.left_n)
    return replace(
        result,
        base=with_readings_of(given, result.base),
        plant=with_readings_of(given, result.plant),
        traces=tuple(_with_error(joint, trace) for trace in result.traces if _is_of(new, trace)),
        baseline=replace(result.baseline, duration_s=sum(each.duration_s for each in new)),
        machine=Machine(
            recordings=tuple(each.name for each in machine.bench.measurements),
            effects=machine.effects,
            common_error_n=machine.error.common_n,
            left_n=machine.error.left_n,
        ),
    )


def _drop_trifles(result: Diagnosis, left_n: float) -> Diagnosis:
    """The answer without changes that are small beside what the machine's model leaves anyway."""
    usual_n2 = max(left_n, result.extended.held_out_rms_n) ** 2  # coarser readings leave more, and more by chance
    kept = tuple(each for each in result.causes if _saved_n2(each) > _LEAST_SHARE_OF_LEFT * usual_n2)
    if len(kept) == len(result.causes):
        return result
    dropped = ", ".join(each.name for each in result.causes if each not in kept)
    note = f"{dropped}: no change is told, for it saves less than the machine's own model is uncertain by"
    quiet = Verdict.UNKNOWN if result.leftover else Verdict.NOTHING_FOUND
    return replace(
        result,
        causes=kept,
        verdict=result.verdict if kept else quiet,
        plant=result.plant if kept else result.base,
        notes=(*result.notes, note),
    )


def _saved_n2(cause: Cause) -> float:
    return cause.gain.held_out_rms_before_n**2 - cause.gain.held_out_rms_after_n**2


def _without_old(joint: JointModel, found: SearchResult, left: Sequence[Leftover]) -> tuple[Leftover, ...]:
    """What is left in the new recordings and is not left in the old ones in the same way."""
    assert joint.bench.witnesses is not None
    olds = frozenset(range(len(joint.bench.measurements))) - joint.bench.witnesses
    before = find_dependences(replace(found.bench, witnesses=olds), found.fitted, found.whiten, ())
    return tuple(each for each in left if not any(is_same_form(each, known) for known in before))


def _is_of(new: Sequence[Measurement], trace: Trace) -> bool:
    return any(trace.measurement is each for each in new)


def _with_error(joint: JointModel, trace: Trace) -> Trace:
    """The simulated readings with what the machine's model always gets wrong."""
    for channel in joint.bench.channels:
        if channel.is_force and joint.bench.measurements[channel.recording] is trace.measurement:
            error_n = joint.error_n[channel.rows]
            return replace(trace, before_n=trace.before_n + error_n, after_n=trace.after_n + error_n)
    return trace
