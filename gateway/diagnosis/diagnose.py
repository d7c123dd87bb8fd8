"""The diagnosis of recordings: what the model gets wrong, the cause with its confidence, the gain on unseen data.

The way: choose how motion is known, fit the base model, take out what the readings themselves tell, search for effects,
test what is left, and give the verdict. `confirmed` is a strong word: it needs residual tests that find nothing, and a
residual that reaches a noise floor which is known, from replicate cycles or from the user.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import numpy as np

from gateway import progress
from gateway.catalogue.all_effects import BY_NAME, EFFECTS
from gateway.catalogue.cylinder import COULOMB, DRAG_ASYMMETRY
from gateway.catalogue.effect import Effect, Parameter
from gateway.diagnosis.bench.bench import Bench, bench_of
from gateway.diagnosis.bench.parameters import ModelParameters
from gateway.diagnosis.bench.recording_drive import MOTIONS
from gateway.diagnosis.excerpt import MOST_ROWS, take_excerpt
from gateway.diagnosis.input_checks import Suspect, find_suspects
from gateway.diagnosis.measurement import Flags, Measurement
from gateway.diagnosis.model_fit.base_fit import DEFAULT_PLANT, base_parameters, fit_base, refit
from gateway.diagnosis.model_fit.initial_state import drop_unfelt_starts, settle_known_rests
from gateway.diagnosis.model_fit.levenberg_marquardt import FittedModel
from gateway.diagnosis.model_fit.line_lengths import fit_line_lengths
from gateway.diagnosis.model_fit.refit_effect import measure_refit
from gateway.diagnosis.noise.whitening import Whitener, fast_noise_n, timing_weights, white_whitener
from gateway.diagnosis.notes import (
    implausible_area,
    nothing_to_switch_off,
    set_aside_notes,
    uninformative_force,
    withhold_all_clear,
)
from gateway.diagnosis.residuals.dependence_tests import find_dependences
from gateway.diagnosis.result import Baseline, Diagnosis, Extended, Trace, Verdict
from gateway.diagnosis.search.direct_evidence import (
    FEWEST_SPIKES,
    DirectEvidence,
    find_outliers,
    find_quantisation,
    find_repeats,
    flag_spoiling_spikes,
)
from gateway.diagnosis.search.search import search_effects
from gateway.diagnosis.verdict import SearchFindings, compose_diagnosis
from gateway.one_blas_thread import one_blas_thread
from gateway.twin.plant import Plant, with_value

_LEAST_CHANCE_S, _MOST_CHANCE_S = 1.0e-3, 9.0e-3
_CHANCE_SHARE: Final = 0.25  # of the time that readings may be late is chance: a process that was not woken at once


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """without: an effect of the base model to switch off, to see it found again. noise_floor_n: known floor, N.

    calibration_noise_n: noise of the readings at rest as the rig's calibration measured it, N.
    late_s: readings may come up to so much late without being a finding (the wires of a gateway's own recording).
    quantum_n: step of the readings that is known and no finding either. is_own: the plant is that of the recording's rig.
    """

    without: str | None = None
    noise_floor_n: float | None = None
    calibration_noise_n: float | None = None
    late_s: float = 0.0
    quantum_n: float = 0.0
    is_own: bool = False


@dataclass(frozen=True, slots=True)
class SearchStart:
    """Where a search begins. evidence: what the readings tell by themselves; effects: those to search for; aside: rows that
    are no witness and no finding."""

    bench: Bench
    base: FittedModel
    whiten: Whitener
    evidence: tuple[DirectEvidence, ...]
    effects: tuple[Effect, ...]
    aside: Flags


@one_blas_thread()
def diagnose(
    measurements: Sequence[Measurement], plant: Plant | None = None, options: Options | None = None
) -> Diagnosis:
    """Diagnose recordings of one machine under one model (an offset for each). `plant` None: the shipped slide's start.

    Errors: ValueError without measurements; KeyError for an effect name in `without` that the catalogue does not have.
    """
    if not measurements:
        raise ValueError("a diagnosis needs at least one recording")
    options = options or Options()
    measurements = [take_excerpt(each, max(MOST_ROWS // len(measurements), 1)) for each in measurements]
    given = plant or DEFAULT_PLANT
    progress.report("checking the columns")
    suspected = find_suspects(measurements, given, is_own=options.is_own)
    if any(each.is_sure for each in suspected):
        return diagnosis_of_wrong_columns(measurements, given, suspected)
    result = _diagnose_columns(measurements, given, options)
    result = replace(
        result,
        notes=(*result.notes, *_notes_on_the_start(measurements, given, options, result, suspected)),
        suspects=suspected,
        base=with_readings_of(given, result.base),
        plant=with_readings_of(given, result.plant),
    )
    return withhold_all_clear(result)


def _diagnose_columns(measurements: Sequence[Measurement], given: Plant, options: Options) -> Diagnosis:
    """Return the diagnosis of columns that are what they say: base model, search, residual tests, verdict."""
    start = prepare_search(measurements, given, options)
    found = search_effects(start.bench, start.base, start.effects, start.whiten)
    progress.report("testing what is left")
    left = find_dependences(found.bench, found.fitted, found.whiten, found.unnamed)
    findings = SearchFindings(start.bench, found, start.evidence, left, start.effects)
    result = compose_diagnosis(findings, options.noise_floor_n, options.calibration_noise_n)
    if not options.without:
        result = replace(result, refit=measure_refit(start.bench, start.base, given, is_own=options.is_own))
    return _without_aside(result, start) if start.aside.any() else result


def _without_aside(result: Diagnosis, start: SearchStart) -> Diagnosis:
    """The answer that says which rows are no witness, and in whose pictures and figures they do not count."""
    forces = (channel for channel in start.bench.channels if channel.is_force)
    traces = [
        replace(
            trace, measurement=replace(trace.measurement, usable=trace.measurement.usable & ~start.aside[each.rows])
        )
        for trace, each in zip(result.traces, forces, strict=True)
    ]
    return replace(result, traces=tuple(traces), notes=(*result.notes, *set_aside_notes(start.bench, start.aside)))


def prepare_search(measurements: Sequence[Measurement], given: Plant, options: Options) -> SearchStart:
    """Return where a search begins: the base model, and what the readings tell by themselves."""
    progress.report("fitting the base model")
    hidden = frozenset({options.without} if options.without else ())
    (bench, base, whiten), aside = _fit_beside_spikes(
        measurements, without_hidden(given, hidden), hidden, options.late_s
    )
    quantum_n = max(options.quantum_n, given.cell.quantum_n)
    bench, base, evidence = _take_direct_evidence(bench, base, whiten, quantum_n)
    if options.late_s > 0.0 or any(each.even_s for each in measurements):
        base, whiten = doubt_times(bench, base, whiten, options.late_s)
        bench, base = fit_line_lengths(bench, base, whiten, given.regulator.command_step_v)
    effects = effects_to_search(base.free, hidden, options.late_s)
    return SearchStart(bench, base, whiten, evidence, effects, aside)


def doubt_times(bench: Bench, base: FittedModel, whiten: Whitener, late_s: float) -> tuple[FittedModel, Whitener]:
    """Return the base model where readings whose times are a matter of chance weigh less, and that weighting."""
    simulated_n = bench.simulate([base.parameters])[0]
    noise_n = fast_noise_n(base.residual_n[bench.judged])
    weights = timing_weights(bench, simulated_n, _chance_s(bench.measurements, late_s), noise_n)
    whiten = replace(whiten, weights=weights)
    return refit(bench, base, whiten), whiten


def _notes_on_the_start(
    measurements: Sequence[Measurement],
    given: Plant,
    options: Options,
    result: Diagnosis,
    suspected: Sequence[Suspect],
) -> Iterator[str]:
    """Yield what to know of the start plant: nothing to switch off in it, or a force of another size than its piston's."""
    if options.without and not _has_effect(given, options.without):
        yield nothing_to_switch_off(options.without)
    if not suspected and not uninformative_force(measurements):
        why = implausible_area(result.base.cylinder.area_m2, given.cylinder.area_m2)
        if why:
            yield why


def _chance_s(measurements: Sequence[Measurement], late_s: float) -> float:
    """How late readings are by chance: what their own times show, else a share of all that they may be late."""
    if all(each.even_s for each in measurements):
        return min(max(_LEAST_CHANCE_S, *(each.jitter_s for each in measurements)), _MOST_CHANCE_S)
    return _CHANCE_SHARE * late_s


def diagnosis_of_wrong_columns(
    measurements: Sequence[Measurement], given: Plant, suspected: tuple[Suspect, ...]
) -> Diagnosis:
    """Return the answer where columns are wrong: what stands in them, and no cause."""
    bench = bench_of(measurements)
    simulated_n = bench.simulate(
        [ModelParameters(without_hidden(given, frozenset()), tuple(0.0 for _ in measurements))]
    )[0]
    rms_n = float(np.std((bench.measured_n - simulated_n)[bench.judged]))
    floor_n = min(fast_noise_n(bench.measured_n[bench.judged]), rms_n)
    return Diagnosis(
        verdict=Verdict.UNKNOWN,
        baseline=Baseline(rms_n, floor_n, int(bench.judged.sum()), sum(each.duration_s for each in measurements)),
        causes=(),
        leftover=(),
        not_identifiable=(),
        rejected=(),
        extended=Extended(rms_n, False),
        base=given,
        plant=given,
        traces=tuple(
            Trace(bench.measurements[channel.recording], simulated_n[channel.rows], simulated_n[channel.rows])
            for channel in bench.channels
            if channel.is_force
        ),
        notes=tuple(note for each in measurements for note in each.notes),
        suspects=suspected,
    )


def without_hidden(plant: Plant, hidden: frozenset[str]) -> Plant:
    """Return the plant without noise and rounding, and without the effects that are to be found again."""
    plant = with_value(with_value(plant, "cell", "noise_n", 0.0), "cell", "quantum_n", 0.0)
    for name in hidden:
        for parameter in BY_NAME[name].parameters:
            if not parameter.shape:
                plant = with_value(plant, parameter.section, parameter.name, float(parameter.null))
    return plant


def _has_effect(plant: Plant, name: str) -> bool:
    """Has the plant this effect, or would the base model fit it?"""
    sizes = [parameter for parameter in BY_NAME[name].parameters if not parameter.shape]
    if any(parameter.path == COULOMB.path for parameter in sizes):
        return True
    return any(getattr(getattr(plant, each.section), each.name) != each.null for each in sizes)


def with_readings_of(given: Plant, plant: Plant) -> Plant:
    """Return the plant with the noise and the rounding that were known before, unless a coarser rounding was found."""
    quantum_n = max(given.cell.quantum_n, plant.cell.quantum_n)
    return with_value(with_value(plant, "cell", "noise_n", given.cell.noise_n), "cell", "quantum_n", quantum_n)


_BaseModel: TypeAlias = tuple[Bench, FittedModel, Whitener]


def _fit_beside_spikes(
    measurements: Sequence[Measurement], start: Plant, hidden: frozenset[str], late_s: float
) -> tuple[_BaseModel, Flags]:
    """The base model, fitted without the spikes that would spoil it, and the rows that are set aside: those, where they are
    too few to be a finding.

    Four readings of -9999 N, which a logger writes for no value, left the gain unknown and the area where it began; two bent
    lines then explained the difference, surely.
    """
    bench, base, whiten = _fit_base_model(measurements, start, hidden, late_s)
    spikes = flag_spoiling_spikes(bench, base.residual_n)
    if not spikes.any():
        return (bench, base, whiten), spikes
    bench, base, whiten = _fit_base_model(measurements, start, hidden, late_s, spikes)
    if int(spikes.sum()) < FEWEST_SPIKES:
        return (bench, base, whiten), spikes
    bench = replace(bench, usable=bench.usable | spikes)
    residual_n = bench.residuals(bench.simulate([base.parameters])[0])
    return (bench, replace(base, residual_n=residual_n), whiten), np.zeros_like(spikes)


def _fit_base_model(
    measurements: Sequence[Measurement],
    start: Plant,
    hidden: frozenset[str],
    late_s: float,
    left_out: Flags | None = None,
) -> _BaseModel:
    """The bench and base model that fit best, over the ways in which motion may be known. left_out: rows (rows,)."""
    measured = any(each.position_m is not None for each in measurements)
    motions = MOTIONS if measured else MOTIONS[:1]
    tries = []
    for motion in motions:
        bench = bench_of(measurements, motion)
        bench = bench if left_out is None else bench.without_rows(left_out)
        whiten = white_whitener(bench, bench.measured_n)
        free = base_parameters(bench, hidden - {"coulomb-friction"}, late_s)  # friction tells which way is which
        tries.append((fit_base(bench, start, free, whiten), motion, bench, whiten))
    fitted, motion, bench, whiten = min(tries, key=lambda each: each[0].chi2)
    free = base_parameters(bench, hidden, late_s)
    if free != fitted.free[: len(free)] or hidden - {"coulomb-friction"} != hidden:
        fitted = fit_base(bench, start, free, whiten)
    bench, fitted = drop_unfelt_starts(bench, settle_known_rests(bench, fitted, whiten), whiten)
    return bench, fitted, whiten


def _take_direct_evidence(
    bench: Bench, base: FittedModel, whiten: Whitener, known_quantum_n: float
) -> tuple[Bench, FittedModel, tuple[DirectEvidence, ...]]:
    """What the readings tell by themselves; rows that are no witness are left out and the base is fitted again."""
    lattice = find_quantisation(bench, base.residual_n, known_quantum_n)
    found = [lattice] if lattice else []
    quantum_n = lattice.values[0][1] if lattice else 0.0
    for direct in (
        find_outliers(bench, base.residual_n, quantum_n),
        None if lattice else find_repeats(bench, base.residual_n),
    ):
        if direct is not None:
            found.append(direct)
            bench = bench.without_rows(direct.rows)
            base = refit(bench, base, whiten)
    return bench, base, tuple(found)


def effects_to_search(free: Sequence[Parameter], hidden: frozenset[str], late_s: float) -> tuple[Effect, ...]:
    """Return the effects that may be found: all that the base model does not fit anyway.

    Where wires may be late by themselves, a drag that differs by direction is not looked for: on the pad it comes late
    like a wire, only by milliseconds more in one direction than in the other.
    """
    taken = {parameter.path for parameter in free}
    return tuple(
        replace(
            effect, forms=tuple(form for form in effect.forms if late_s == 0.0 or DRAG_ASYMMETRY not in form.parameters)
        )
        for effect in EFFECTS
        if not effect.direct and (effect.name in hidden or not taken & {p.path for p in effect.parameters})
    )
