"""The base model: the rig's plant with gain (area), offset, regulator lag and Coulomb friction refitted.

Without a rig the start is the shipped slide's dimensions with every effect at its null value: nobody has said that the
recorder's machine has the delay, the second lag or the seals of the paper's. A coarse look over lag and friction comes
first, for a search that begins with the wrong half of the loop never finds the other; then Levenberg-Marquardt.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from math import inf
from typing import Final

import numpy as np

from gateway.catalogue.all_effects import EFFECTS
from gateway.catalogue.cylinder import AREA, COULOMB
from gateway.catalogue.effect import Parameter
from gateway.catalogue.regulator import LAG
from gateway.catalogue.sensing import CLOCK_OFFSET
from gateway.defaults import UNLIMITED
from gateway.diagnosis.bench.bench import Bench, unsettled_rows
from gateway.diagnosis.bench.parameters import ModelParameters, StartParameter
from gateway.diagnosis.measurement import Floats
from gateway.diagnosis.model_fit.initial_state import start_parameters, try_initial_states, without_pressures
from gateway.diagnosis.model_fit.levenberg_marquardt import Contest, FitProblem, FittedModel, refine
from gateway.diagnosis.noise.whitening import Whitener
from gateway.twin.plant import Contact, Cylinder, Friction, LoadCell, Plant, Regulator, with_value

DEFAULT_PLANT: Final = Plant(
    regulator=Regulator(lag_s=0.072),
    cylinder=Cylinder(area_m2=95.0e-6),
    friction=Friction(coulomb_n=1.0),
    contact=Contact(),
    cell=LoadCell(),
)
_LAGS_S: Final = (0.005, 0.02, 0.05, 0.1, 0.2)  # from a fast valve to a regulator with long hoses
_COULOMBS_N: Final = (0.0, 0.3, 1.0, 2.5, 6.0)  # from an air slide to a sealed cylinder; the start plant has 1 N
_BELIEVED_GAINS: Final = (
    0.02,
    50.0,
)  # measured over simulated; beyond it the force does not answer, or is in another unit
_KNOWN_SHARE: Final = 0.1  # of a gain: ten standard errors, for slow noise makes the true one several times as large
_LEAST_OF_PRESSURES_CHI2: Final = 16.0  # that three parameters exceed by chance once in 900 recordings
_WAVES: Final = 8  # most waves of a base fit ...
_WAVES_WITH_START: Final = 16  # ... and of one that also fits how a recording begins
_LEAST_GAIN: Final = 1.0e-4  # of chi-square, in a wave: what is less is left to the fits that follow


def without_effects(plant: Plant) -> Plant:
    """Return the plant's dimensions and base parameters, every effect at its null value: what is known of a foreign machine."""
    kept = {AREA.path, LAG.path, COULOMB.path}
    for effect in EFFECTS:
        for parameter in effect.parameters:
            if not parameter.shape and parameter.path not in kept:
                plant = with_value(plant, parameter.section, parameter.name, float(parameter.null))
    for section, name in (("contact", "mass_kg"), ("contact", "pad_damping_n_s_per_m"), ("cell", "filter_s")):
        plant = with_value(plant, section, name, 0.0)  # a filter that is not there looks like crosstalk
    return with_value(plant, "cell", "range_n", UNLIMITED)  # nobody said which cell it is


def base_parameters(bench: Bench, hidden: frozenset[str], late_s: float = 0.0) -> tuple[Parameter, ...]:
    """Return what is refitted. hidden: names of effects that are switched off; late_s: how late readings may come, see
    Options."""
    commanded = any(each.command_v is not None for each in bench.measurements)
    found = [AREA]
    found += [LAG] if commanded else []
    found += [COULOMB] if "coulomb-friction" not in hidden else []
    found += [replace(CLOCK_OFFSET, low=0.0, high=late_s)] if late_s > 0.0 else []
    return tuple(found)


def fit_base(bench: Bench, plant: Plant, free: tuple[Parameter, ...], whiten: Whitener) -> FittedModel:
    """Return the refitted base model; the state in which each recording begins is fitted besides.

    The pressures of the beginning belong to it only where chi-square asks for them: a recording that hardly moves would take
    its gain from the noise of their decay.
    """
    start = ModelParameters(plant, tuple(0.0 for _ in bench.measurements))
    settled_bench = bench.without_rows(unsettled_rows(bench))
    coarse = _grid_search(settled_bench, start, free)
    if _gain_error(settled_bench, settled_bench.simulate([coarse])[0]) > _KNOWN_SHARE:
        free = tuple(each for each in free if each is not AREA)  # the noise would choose it
    starts = start_parameters(bench, plant)
    if not starts:
        return refine(bench, [FitProblem(coarse, free)], whiten, waves=_WAVES)[0]
    tried = try_initial_states(bench, coarse, whiten)
    strains = tuple(each for each in starts if isinstance(each, StartParameter) and each.elements)
    settled = list(dict.fromkeys(map(without_pressures, tried)))
    whole = _best_start(bench, [FitProblem(each, (*free, *starts)) for each in tried], whiten)
    plain = _best_start(bench, [FitProblem(each, (*free, *strains)) for each in settled], whiten, whole.chi2)
    usual = max(whole.chi2 / max(int(bench.usable.sum()), 1), 1.0)  # per row: no cause is found yet
    asked = _LEAST_OF_PRESSURES_CHI2 * usual * len(bench.measurements)
    return whole if whole.chi2 < plain.chi2 - asked else plain


def _best_start(bench: Bench, problems: Sequence[FitProblem], whiten: Whitener, best_chi2: float = inf) -> FittedModel:
    """The best of one model's fits from several starts."""
    contest = Contest(best_chi2, _LEAST_GAIN)
    return min(refine(bench, problems, whiten, _WAVES_WITH_START, contest), key=lambda each: each.chi2)


def refit(bench: Bench, fitted: FittedModel, whiten: Whitener, waves: int = 3) -> FittedModel:
    """Return the same model again, after rows or noise have changed."""
    return refine(bench, [FitProblem(fitted.parameters, fitted.free)], whiten, waves)[0]


def _grid_search(bench: Bench, start: ModelParameters, free: tuple[Parameter, ...]) -> ModelParameters:
    """The best of a grid, gain and offset by linear regression."""
    start = _scale_by_regression(bench, start, bench.simulate([start])[0])
    lags = {start.value(LAG), *_LAGS_S} if LAG in free else {start.value(LAG)}
    frictions = {start.value(COULOMB), *_COULOMBS_N} if COULOMB in free else {start.value(COULOMB)}
    parameter_sets = [
        start.with_value(LAG, lag).with_value(COULOMB, friction) for lag, friction in product(lags, frictions)
    ]
    simulated = bench.simulate(parameter_sets)
    costs = [_regression(bench, simulated[k])[2] for k in range(len(parameter_sets))]
    best = int(np.argmin(costs))
    return _scale_by_regression(bench, parameter_sets[best], simulated[best])


def _scale_by_regression(bench: Bench, parameters: ModelParameters, simulated_n: Floats) -> ModelParameters:
    """The point with area and offsets that regression finds; only the offsets where the force does not answer.

    Where hardly anything was commanded, noise has a gain too: it once put the offset of a clean hold to -1700 N, from where no
    refinement came back. So a gain is believed where it is known.
    """
    gain, offset, _ = _regression(bench, simulated_n)
    known = _BELIEVED_GAINS[0] < gain < _BELIEVED_GAINS[1] and _gain_error(bench, simulated_n) < _KNOWN_SHARE * gain
    if not known:
        rows = bench.judged
        gain, offset = 1.0, float(np.mean(bench.measured_n[rows] - simulated_n[rows]))
    offsets = tuple(offset + gain * each for each in parameters.offsets_n)
    return replace(parameters, offsets_n=offsets).with_value(AREA, parameters.value(AREA) * gain)


def _gain_error(bench: Bench, simulated_n: Floats) -> float:
    """Return the standard error of the regression's gain, for noise that is independent from row to row."""
    rows = bench.judged
    _, _, cost = _regression(bench, simulated_n)
    power = float(np.sum((simulated_n[rows] - np.mean(simulated_n[rows])) ** 2))
    return float(np.sqrt(cost / max(int(rows.sum()) - 2, 1) / power)) if power > 0.0 else np.inf


def _regression(bench: Bench, simulated_n: Floats) -> tuple[float, float, float]:
    """Gain, offset and cost of measured = gain x simulated + offset over the judged force rows."""
    rows = bench.judged
    x, y = simulated_n[rows], bench.measured_n[rows]
    spread = float(np.var(x))
    gain = float(np.mean((x - x.mean()) * (y - y.mean())) / spread) if spread > 1.0e-12 else 0.0
    offset = float(y.mean() - gain * x.mean())
    residual = y - gain * x - offset
    return gain, offset, float(residual @ residual)
