"""What friction remembers when a recording begins: unknown, fitted with the base model, and never a finding.

A slide that was pressed before the first row stands anywhere within its loop, a seal that gives way has its elements
strained by the last reversals, and a recording that moves through a part of its range only may never forget it. On clean
recordings of the demo rig such starts were called warm-up, presliding, dwell-stiction and creep. So the strains of the
friction elements (friction.py) at the first settled row are parameters of each recording beside gain, lag and friction;
three where the plant has presliding, one for all where its friction is rigid. Those that the recording does not feel are
not fitted. Where motion is measured there is nothing to fit: friction follows the position.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from gateway.catalogue.effect import Parameter
from gateway.diagnosis.measurement import Flags, Floats
from gateway.diagnosis.noise import Whitener, white_whitener
from gateway.diagnosis.search.bench import Bench
from gateway.diagnosis.search.levenberg_marquardt import FitProblem, FittedModel, refine
from gateway.diagnosis.search.parameters import InitialStrain, ModelParameters
from gateway.diagnosis.search.recording_drive import begins_at_rest
from gateway.twin.plant import Plant
from gateway.twin.replay.drive import Strains

_TRIED_STRAINS: Final[tuple[Strains, ...]] = (
    (0.0, 0.0, 0.0),
    *((one, two, three) for one in (1.0, -1.0) for two in (1.0, -1.0) for three in (1.0, -1.0)),
)
"""The middle, both branches, and what reversals of different sizes within the loop leave."""
_WAVES: Final = 4
_LEAST_CHI2: Final = 2.0  # chi-square that the whole way of a strain must make for it to be fitted
_FORGOTTEN_SHARE: Final = 0.1  # of the noise: what is less of the start is forgotten
_LONGEST_START_SHARE: Final = 0.25  # of a recording may count as its beginning


def start_parameters(bench: Bench, plant: Plant) -> tuple[Parameter, ...]:
    """Return the strains of every recording whose motion is inferred."""
    if bench.motion != "inferred" or not any(each.command_v is not None for each in bench.measurements):
        return ()
    yields = plant.friction.presliding_m > 0.0
    return tuple(
        InitialStrain(recording, elements)
        for recording in range(len(bench.measurements))
        for elements in (((0,), (1,), (2,)) if yields else ((0, 1, 2),))
    )


def try_initial_strains(
    bench: Bench, parameters: ModelParameters, whiten: Whitener, most: int = 3
) -> list[ModelParameters]:
    """Return the point with the best few starts for each recording, the best first: a fit may end in the wrong one."""
    parameter_sets = [replace(parameters, starts=(strains,) * len(bench.measurements)) for strains in _TRIED_STRAINS]
    costs = [
        _squares_per_recording(bench, residual)
        for residual in whiten(_subtract_offsets(bench, bench.residuals(bench.simulate(parameter_sets))))
    ]
    ranked = np.argsort(np.array(costs), axis=0)[:most]
    return [replace(parameters, starts=tuple(_TRIED_STRAINS[int(index)] for index in best)) for best in ranked]


def fit_initial_strains(bench: Bench, plant: Plant) -> FittedModel:
    """Return this very plant with the offset and the start that fit each recording best: what of its error is not the
    start's."""
    whiten = white_whitener(bench, bench.measured_n)
    (parameters,) = try_initial_strains(
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


def drop_unfelt_strains(bench: Bench, fitted: FittedModel, whiten: Whitener) -> tuple[Bench, FittedModel]:
    """Return the same fit without strains that its recording does not feel, on a bench whose young rows are those that feel
    them."""
    offsets = len(fitted.parameters.offsets_n)
    columns = whiten.spectra(fitted.jacobian)
    kept = [
        not isinstance(parameter, InitialStrain) or float(np.sum(column**2)) > _LEAST_CHI2
        for parameter, column in zip(fitted.free, columns[offsets:], strict=True)
    ]
    free = tuple(parameter for parameter, keep in zip(fitted.free, kept, strict=True) if keep)
    rows = [True] * offsets + kept
    young = replace(bench, young=_rows_that_feel_the_start(bench, fitted, whiten))
    return young, replace(fitted, free=free, jacobian=fitted.jacobian[np.array(rows)])


def _rows_that_feel_the_start(bench: Bench, fitted: FittedModel, whiten: Whitener) -> Flags:
    """Rows until the last one that feels the start of its recording, at most the first quarter of it."""
    young = np.zeros(bench.rows, dtype=bool)
    offsets = len(fitted.parameters.offsets_n)
    for parameter, column in zip(fitted.free, fitted.jacobian[offsets:], strict=True):
        if isinstance(parameter, InitialStrain):
            for channel in bench.channels:
                if channel.recording == parameter.recording and not begins_at_rest(
                    bench.measurements[channel.recording]
                ):
                    part = np.flatnonzero(np.abs(column[channel.rows]) > _FORGOTTEN_SHARE * whiten.floor_n)
                    most = int(_LONGEST_START_SHARE * (channel.rows.stop - channel.rows.start))
                    last = min(int(part[-1]) + 1, most) if part.size else 0
                    young[channel.rows.start : channel.rows.start + last] = True
    return young
