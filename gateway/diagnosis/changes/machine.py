"""The machine as its old recordings show it: base model, the effects that they ask for, and its common error.

None of that is a finding of the new recordings. They join the old ones under this model, each with its own offset and start.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.catalogue.effect import Effect, EffectForm, Parameter
from gateway.diagnosis.bench.bench import Bench, bench_of
from gateway.diagnosis.bench.parameters import STARTS, ModelParameters, StartParameter
from gateway.diagnosis.changes.machine_error import ErrorModel, fit_error
from gateway.diagnosis.diagnose import Options, SearchStart, doubt_times, prepare_search
from gateway.diagnosis.measurement import Floats, Measurement
from gateway.diagnosis.model_fit.base_fit import refit
from gateway.diagnosis.model_fit.initial_state import drop_unfelt_starts, fit_initial_states, start_parameters
from gateway.diagnosis.model_fit.levenberg_marquardt import FitProblem, FittedModel, linearise
from gateway.diagnosis.model_fit.line_lengths import fit_line_lengths
from gateway.diagnosis.model_fit.normal_equations import held_out_errors
from gateway.diagnosis.noise.whitening import Whitener, white_whitener
from gateway.diagnosis.result import OwnEffect
from gateway.diagnosis.search.model_comparison import is_significant
from gateway.diagnosis.search.search import SearchResult, compare_under_noise, search_effects
from gateway.diagnosis.verdict import estimates_of
from gateway.one_blas_thread import one_blas_thread
from gateway.twin.plant import Plant

_MOST_EFFECTS: Final = 8  # of a machine; a foreign rig asked for four to six
_OF_ONE_RECORDING: Final = ("linear-drift", "warm-up", "clock-skew", "creep")  # slow: what they fit is a wander
_PREDICTS: Final = 0.995  # of the held-out error: from here on an effect predicts better
_WAVES: Final = 8  # from the optimum under coloured noise to the plain one

NamedForm = tuple[Effect, EffectForm]


@dataclass(frozen=True, slots=True)
class MachineModel:
    """A machine by its old recordings. parameters, free: of the model that was fitted to them; readings: by name, the first
    number of what their readings told by themselves; error: their common error."""

    bench: Bench
    parameters: ModelParameters
    free: tuple[Parameter, ...]
    readings: Mapping[str, float]
    effects: tuple[OwnEffect, ...]
    error: ErrorModel


@dataclass(frozen=True, slots=True)
class JointModel:
    """New recordings, which come first, and old ones under the machine's model.

    bench: judges by the new ones, and counts the machine's common error as explained; error_n: that error, (rows,).
    """

    bench: Bench
    fitted: FittedModel
    whiten: Whitener
    error_n: Floats


@one_blas_thread()
def describe_machine(old: Sequence[Measurement], given: Plant, options: Options) -> MachineModel:
    """Return the machine that these recordings show, with as many effects as they ask for. given: the plant to start from."""
    start = prepare_search(old, given, options)
    found = search_effects(start.bench, start.base, start.effects, start.whiten)
    fitted, named = _add_predictive_effects(start, found)
    plain = white_whitener(start.bench, fitted.residual_n)  # the whitened optimum leaves slow errors, which come again
    fitted = refit(start.bench, fitted, plain, waves=_WAVES)
    effects = tuple(
        OwnEffect(effect.name, estimates_of(start.bench, fitted, form.parameters, plain)) for effect, form in named
    )
    free = tuple(each for each in fitted.free if each.section != STARTS)
    readings = {each.name: each.values[0][1] for each in start.evidence}
    return MachineModel(start.bench, fitted.parameters, free, readings, effects, fit_error(start.bench, fitted))


def _add_predictive_effects(start: SearchStart, found: SearchResult) -> tuple[FittedModel, list[NamedForm]]:
    """The model of the search with every further effect that predicts better, however small, and all its effects: the machine
    is to be described, not to be explained."""
    bench, fitted, whiten = start.bench, found.fitted, found.whiten
    named = [(each.effect, each.form) for each in found.accepted]
    while len(named) < _MOST_EFFECTS:
        taken = {effect.name for effect, _ in named}
        effects = [effect for effect in start.effects if effect.name not in taken and _comes_again(effect)]
        fitted, whiten, comparison = compare_under_noise(bench, fitted, effects, whiten)
        if not comparison.ranked or not is_significant(comparison.winner, comparison.starts):
            break
        winner = comparison.winner
        before_n, after_n = (held_out_errors(bench, each, whiten).rms_n for each in (fitted, winner.fitted))
        if after_n > _PREDICTS * before_n:
            break
        fitted = winner.fitted
        named.append((winner.effect, winner.form))
    return fitted, named


def _comes_again(effect: Effect) -> bool:
    """Is it the same in another recording? Not what has a phase, or steps so fine that no fit finds them again."""
    return effect.name not in _OF_ONE_RECORDING and not any(form.quadrature or form.everywhere for form in effect.forms)


def join_recordings(new: Sequence[Measurement], machine: MachineModel, given: Plant, options: Options) -> JointModel:
    """Return the new recordings beside the old ones, under the machine's model.

    Its numbers stay as they were fitted to the old ones: a fit that moves a dozen of them, some at a bound, beside every
    change went nowhere, and left sizes at a third of the true ones. What they are uncertain by counts as explained, as the
    common error does: a share of their derivatives, the same for all recordings.
    """
    bench, fitted, whiten = _fit_jointly(new, machine)
    if options.late_s > 0.0 or any(each.even_s for each in bench.measurements):
        fitted, whiten = doubt_times(bench, fitted, whiten, options.late_s)
        bench, fitted = fit_line_lengths(bench, fitted, whiten, given.regulator.command_step_v)
    columns = machine.error.columns(bench, fitted.parameters)
    error_n = machine.error.error_n(columns)
    old_starts = [each for each in start_parameters(bench, machine.parameters.plant) if _recording_of(each) >= len(new)]
    uncertain = _derivatives(bench, fitted, (*machine.free, *old_starts), whiten)
    bench = replace(
        bench.without_columns(np.vstack([columns, uncertain])),
        raw_n=bench.raw_n - error_n,
        witnesses=frozenset(range(len(new))),
    )
    fitted = refit(bench, fitted, whiten)
    return JointModel(bench, fitted, whiten, error_n)


def _fit_jointly(new: Sequence[Measurement], machine: MachineModel) -> tuple[Bench, FittedModel, Whitener]:
    """All recordings under the machine's parameters as the old ones show them, with offsets and starts of their own."""
    bench = bench_of([*new, *machine.bench.measurements], machine.bench.motion)
    fresh = bench.rows - machine.bench.rows
    bench = replace(bench, usable=np.concatenate([bench.usable[:fresh], machine.bench.usable]))
    parameters = _joined_parameters(new, machine)
    strains = tuple(each for each in start_parameters(bench, parameters.plant) if _recording_of(each) < len(new))
    whiten = white_whitener(bench, machine_residual(bench, parameters))
    (fitted,) = linearise(bench, [FitProblem(parameters, strains)], whiten)
    return (*drop_unfelt_starts(bench, fitted, whiten), whiten)


def _recording_of(parameter: Parameter) -> int:
    """The recording that a start belongs to."""
    return parameter.recording if isinstance(parameter, StartParameter) else 0


def _derivatives(bench: Bench, fitted: FittedModel, free: tuple[Parameter, ...], whiten: Whitener) -> Floats:
    """What each of these parameters changes in the readings, all of one size, (parameters, rows)."""
    (felt,) = linearise(bench, [FitProblem(fitted.parameters, free)], whiten)
    rows = felt.jacobian[len(fitted.parameters.offsets_n) :]
    sizes = np.sqrt(np.mean(rows**2, axis=1))
    return np.asarray(rows[sizes > 0.0] / sizes[sizes > 0.0, None])


def machine_residual(bench: Bench, parameters: ModelParameters) -> Floats:
    """Return measured minus simulated of one model, (rows,)."""
    return np.asarray(bench.residuals(bench.simulate([parameters]))[0])


def _joined_parameters(new: Sequence[Measurement], machine: MachineModel) -> ModelParameters:
    """The machine's parameters with the offsets and starts that fit the new recordings best before those of the old."""
    own = machine.parameters
    fresh = fit_initial_states(bench_of(new, machine.bench.motion), own.plant).parameters
    olds = range(len(machine.bench.measurements))
    starts = (*(fresh.start(k) for k in range(len(new))), *(own.start(k) for k in olds))
    return replace(
        own,
        offsets_n=(*fresh.offsets_n, *own.offsets_n),
        starts=starts if any(each is not None for each in starts) else (),
        character_s=0.0,
    )
