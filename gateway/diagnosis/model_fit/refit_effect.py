"""What refitting the base model has changed: the error of the rig's plant as it stands, and which number of it that is.

A seal that has become stiff is no effect that is missing: the base model has Coulomb friction, and fits it. So where nothing is
missing, the rig's plant may still simulate its machine wrongly.
"""

from math import sqrt

import numpy as np

from gateway.catalogue.cylinder import AREA, COULOMB
from gateway.catalogue.regulator import LAG
from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.bench.parameters import ModelParameters
from gateway.diagnosis.measurement import Floats
from gateway.diagnosis.model_fit.levenberg_marquardt import FittedModel
from gateway.diagnosis.result import Refit, RefittedNumber
from gateway.twin.plant import Plant


def measure_refit(bench: Bench, base: FittedModel, given: Plant, *, is_own: bool) -> Refit:
    """Return what of the recordings' error the refit of this plant has taken away. base: refitted from it; what fits how each
    recording begins, and its offset, is no error of the plant. is_own: see Refit."""
    refitted = [each for each in (AREA, LAG, COULOMB) if any(each.path == free.path for free in base.free)]
    before = [float(getattr(getattr(given, each.section), each.name)) for each in refitted]
    as_given = base.parameters
    for parameter, value in zip(refitted, before, strict=True):
        as_given = as_given.with_value(parameter, value)
    alone = [base.parameters.with_value(*each) for each in zip(refitted, before, strict=True)]
    rms_n, given_rms_n, *alone_rms_n = _errors_n(bench, [base.parameters, as_given, *alone])
    numbers = (
        RefittedNumber(each.section, each.name, each.unit, value, base.parameters.value(each), _excess_n(one_n, rms_n))
        for each, value, one_n in zip(refitted, before, alone_rms_n, strict=True)
    )
    return Refit(given_rms_n, _excess_n(given_rms_n, rms_n), tuple(numbers), is_own)


def _errors_n(bench: Bench, models: list[ModelParameters]) -> list[float]:
    """RMS error of each model, N, an offset of each recording apart."""
    residuals: Floats = bench.measured_n - bench.simulate(models)
    judged = bench.judged
    for channel in bench.channels:
        rows = np.arange(channel.rows.start, channel.rows.stop)[judged[channel.rows]]
        if rows.size:
            residuals[:, rows] -= residuals[:, rows].mean(axis=1)[:, None]
    return [bench.rms_n(each) for each in residuals]


def _excess_n(rms_n: float, least_n: float) -> float:
    return sqrt(max(0.0, rms_n**2 - least_n**2))
