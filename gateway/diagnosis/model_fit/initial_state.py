"""In which state a recording begins: unknown, fitted with the base model, and never a finding.

A slide that was pressed before the first row stands anywhere within its loop, a seal that gives way has its elements
strained by the last reversals, a recording that moves through a part of its range only may never forget it, and the
pressure is on its way to what was asked before. On clean recordings of the demo rig such starts were called warm-up,
presliding, dwell-stiction and creep, and in others leak and a jump of the gain. So at the first row of each recording these are
parameters beside gain, lag and friction, and no row has to be left out:
    - the strains of the friction elements (friction.py), three where the plant has presliding, one where friction is rigid;
    - the pressure, behind each lag, where a command drives it, and what is under way in the delay;
    - with an effect that remembers more, what it remembers: stiction that a rest has grown, the pad's creep.
Those that the recording does not feel are not fitted. Where motion is measured, friction follows the position and nobody
knows only how far its elements are strained until they have slid once: there the first rows are left out.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from gateway.catalogue.contact import CREEP
from gateway.catalogue.cylinder import AREA, PRESLIDING, STICTION
from gateway.catalogue.effect import EffectForm, Parameter
from gateway.catalogue.regulator import DELAY, SECOND_LAG
from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.bench.parameters import (
    ModelParameters,
    StartParameter,
    initial_command,
    initial_creep,
    initial_pressure,
    initial_second_pressure,
    initial_stiction,
    initial_strain,
)
from gateway.diagnosis.bench.recording_drive import begins_at_rest
from gateway.diagnosis.measurement import Flags, Floats
from gateway.diagnosis.model_fit.levenberg_marquardt import FitProblem, FittedModel, refine
from gateway.diagnosis.noise.whitening import Whitener, white_whitener
from gateway.twin.plant import Plant
from gateway.twin.replay.drive import AT_REST, StartState, Strains

_TRIED_STRAINS: Final[tuple[Strains, ...]] = (
    (0.0, 0.0, 0.0),
    *((one, two, three) for one in (1.0, -1.0) for two in (1.0, -1.0) for three in (1.0, -1.0)),
)
"""The middle, both branches, and what reversals of different sizes within the loop leave."""
_ALL: Final = (0, 1, 2)
_EACH: Final = ((0,), (1,), (2,))
_REMEMBERED: Final = {
    SECOND_LAG.path: initial_second_pressure,
    DELAY.path: initial_command,
    CREEP.path: initial_creep,
    STICTION.path: initial_stiction,
}
_FIRST_READINGS: Final = 3
_USUAL_WAY_PA: Final = 1.0e5  # that a pressure may have to go to its command: a volt
_USUAL_WAY_N: Final = 10.0  # that a pad's creep may be behind: a step of a volt
_WAVES: Final = 4
_LEAST_HELD_CHI2: Final = 12.0  # chi-square of a rest that is none: three parameters exceed it by chance once in 130
_LEAST_CHI2: Final = 2.0  # chi-square that the whole way of a strain must make for it to be fitted
_FORGOTTEN_SHARE: Final = 0.1  # of the noise: what is less of the start is forgotten
_LONGEST_START_SHARE: Final = 0.25  # of a recording may count as its beginning


def start_parameters(bench: Bench, plant: Plant) -> tuple[Parameter, ...]:
    """Return the strains of every recording whose motion is inferred, and for those that a command drives the pressure and
    whatever else this plant remembers."""
    found: list[Parameter] = []
    yields = plant.friction.presliding_m > 0.0
    for recording, measurement in enumerate(bench.measurements):
        if bench.motion == "inferred":
            found += [initial_strain(recording, elements) for elements in (_EACH if yields else (_ALL,))]
        if measurement.command_v is not None:
            found.append(initial_pressure(recording))
            found += [initial_second_pressure(recording)] if plant.regulator.second_lag_s > 0.0 else []
            found += [initial_command(recording)] if plant.regulator.delay_s > 0.0 else []
            found += [initial_creep(recording)] if plant.contact.creep_share != 0.0 else []
            found += [initial_stiction(recording)] if plant.friction.dwell_stiction_n > 0.0 else []
    return tuple(found)


def with_start_of(form: EffectForm, free: Sequence[Parameter], begins: Sequence[bool]) -> tuple[Parameter, ...]:
    """Return the free parameters of a model that a form joins, with what it remembers at the beginning.

    begins: of each recording, whether it begins in a state that nobody knows.
    """
    found = list(free)
    for parameter in form.parameters:
        make = _REMEMBERED.get(parameter.path)
        found += [make(recording) for recording, unknown in enumerate(begins) if make and unknown]
        if parameter.path == PRESLIDING.path:
            found = [part for each in found for part in _split_strain(each)]
    return tuple(dict.fromkeys(found))


def _split_strain(parameter: Parameter) -> Iterator[Parameter]:
    """The strain of all elements as one of each: with presliding they are no longer alike."""
    if isinstance(parameter, StartParameter) and parameter.elements == _ALL:
        yield from (initial_strain(parameter.recording, elements) for elements in _EACH)
    else:
        yield parameter


def try_initial_states(
    bench: Bench, parameters: ModelParameters, whiten: Whitener, most: int = 3
) -> list[ModelParameters]:
    """Return the point with the best few starts for each recording, the best first: a fit may end in the wrong one."""
    states = (AT_REST, *map(StartState, _TRIED_STRAINS))  # of equal ones the first is taken
    tried = [replace(parameters, starts=(each,) * len(bench.measurements)) for each in states]
    residuals = bench.residuals(bench.simulate(tried))
    ahead = [_with_first_force(bench, *each) for each in zip(tried, residuals, strict=True)]
    tried += ahead
    residuals = np.vstack([residuals, bench.residuals(bench.simulate(ahead))])
    costs = [_squares_per_recording(bench, each) for each in whiten(_subtract_offsets(bench, residuals))]
    ranked = np.argsort(np.array(costs), axis=0, kind="stable")[:most]
    return [
        replace(parameters, starts=tuple(tried[int(k)].start(recording) for recording, k in enumerate(best)))
        for best in ranked
    ]


def without_pressures(parameters: ModelParameters) -> ModelParameters:
    """Return the same with every recording's pressure that of its first command, and nothing else under way."""
    return replace(parameters, starts=tuple(StartState(each.strains) for each in parameters.starts))


def _with_first_force(bench: Bench, parameters: ModelParameters, residual_n: Floats) -> ModelParameters:
    """The same with the pressure that the first readings of each recording ask for."""
    for channel in bench.channels:
        measurement = bench.measurements[channel.recording]
        first = channel.rows.start + np.flatnonzero(bench.usable[channel.rows])[:_FIRST_READINGS]
        if channel.is_force and first.size and measurement.command_v is not None:
            ahead_pa = float(np.mean(residual_n[first])) / parameters.value(AREA)
            parameters = parameters.with_value(initial_pressure(channel.recording), ahead_pa)
    return parameters


def fit_initial_states(bench: Bench, plant: Plant) -> FittedModel:
    """Return this very plant with the offset and the start that fit each recording best: what of its error is not the
    start's."""
    whiten = white_whitener(bench, bench.measured_n)
    (parameters,) = try_initial_states(
        bench, ModelParameters(plant, tuple(0.0 for _ in bench.measurements)), whiten, most=1
    )
    return refine(bench, [FitProblem(parameters, start_parameters(bench, plant))], whiten, waves=_WAVES)[0]


def _subtract_offsets(bench: Bench, residuals: Floats) -> Floats:
    """Without the offset of each recording."""
    found = residuals.copy()
    for channel in bench.channels:
        part, usable = found[:, channel.rows], bench.usable[channel.rows]
        part -= usable * (part.sum(axis=1) / max(int(usable.sum()), 1))[:, None]
    return found


def _squares_per_recording(bench: Bench, residual: Floats) -> list[float]:
    """Squared residual of each recording."""
    costs = [0.0] * len(bench.measurements)
    for channel in bench.channels:
        costs[channel.recording] += float(np.sum(residual[channel.rows] ** 2))
    return costs


def drop_unfelt_starts(bench: Bench, fitted: FittedModel, whiten: Whitener) -> tuple[Bench, FittedModel]:
    """Return the same fit without what of its start a recording does not feel, on a bench whose unsettled rows are those that
    feel it."""
    offsets = len(fitted.parameters.offsets_n)
    columns = whiten.spectra(fitted.jacobian)
    kept = [
        not isinstance(parameter, StartParameter) or _is_felt(parameter, column)
        for parameter, column in zip(fitted.free, columns[offsets:], strict=True)
    ]
    free = tuple(parameter for parameter, keep in zip(fitted.free, kept, strict=True) if keep)
    rows = [True] * offsets + kept
    fitted_bench = replace(bench, unsettled=_rows_that_feel_the_start(bench, fitted, whiten))
    return fitted_bench, replace(fitted, free=free, jacobian=fitted.jacobian[np.array(rows)])


def settle_known_rests(bench: Bench, fitted: FittedModel, whiten: Whitener) -> FittedModel:
    """Return the same fit with rest where recordings begin at rest, unless chi-square says that friction holds a force there.

    A slide that nothing presses feels strains of one sign only: free, they would stop every later refinement at that kink.
    """
    at_rest = with_known_rests(bench, FitProblem(fitted.parameters, fitted.free))
    if at_rest is None:
        return fitted
    (known,) = refine(bench, [at_rest], whiten, waves=_WAVES)
    usual = max(known.chi2 / max(int(bench.usable.sum()), 1), 1.0)  # per row: no cause is found yet
    rests = sum(map(begins_at_rest, bench.measurements))
    return known if known.chi2 < fitted.chi2 + _LEAST_HELD_CHI2 * usual * rests else fitted


def with_known_rests(bench: Bench, problem: FitProblem) -> FitProblem | None:
    """Return the same problem with rest where recordings begin at rest; None where nothing of such a start is free."""
    rests = {k for k, each in enumerate(bench.measurements) if begins_at_rest(each)}
    free = tuple(each for each in problem.free if not (isinstance(each, StartParameter) and each.recording in rests))
    if len(free) == len(problem.free):
        return None
    starts = [AT_REST if k in rests else problem.parameters.start(k) for k in range(len(bench.measurements))]
    return FitProblem(replace(problem.parameters, starts=tuple(starts)), free)


def _is_felt(parameter: StartParameter, column: Floats) -> bool:
    """Does the usual way of the number make chi-square? column: its whitened derivative."""
    return float(np.sum((_usual_way(parameter) * column) ** 2)) > _LEAST_CHI2


def _usual_way(parameter: StartParameter) -> float:
    """How far the number may usually be from its null value, in its unit."""
    return {"Pa": _USUAL_WAY_PA, "N": _USUAL_WAY_N}.get(parameter.unit, 1.0)


def _rows_that_feel_the_start(bench: Bench, fitted: FittedModel, whiten: Whitener) -> Flags:
    """Rows until the last one that feels the start of its recording, at most the first quarter of it."""
    unsettled = np.zeros(bench.rows, dtype=bool)
    offsets = len(fitted.parameters.offsets_n)
    for parameter, column in zip(fitted.free, fitted.jacobian[offsets:], strict=True):
        if isinstance(parameter, StartParameter):
            for channel in bench.channels:
                if channel.recording == parameter.recording and not begins_at_rest(
                    bench.measurements[channel.recording]
                ):
                    way = _usual_way(parameter)
                    part = np.flatnonzero(np.abs(way * column[channel.rows]) > _FORGOTTEN_SHARE * whiten.floor_n)
                    most = int(_LONGEST_START_SHARE * (channel.rows.stop - channel.rows.start))
                    last = min(int(part[-1]) + 1, most) if part.size else 0
                    unsettled[channel.rows.start : channel.rows.start + last] = True
    return unsettled
