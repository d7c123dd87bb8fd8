"""When a setting acts: once the last character of its line is there.

A gateway's own recording knows when the writing of each setting began. A regulator that takes text has a setting when its line
has ended, and `SET 0` ends earlier than `SET 870`: by 1.04 ms a digit at 9600 baud. Falls, whose lead asks for 0 V, then come
2 ms earlier than rises, and neither the lines' delay, which is one for all settings, nor readings that are late by chance can
say so. It is a misfit of the base model and no chance: on clean steps of the demo rig it left 0.132 N instead of 0.125 N,
`command-nonlinearity` took a part of it, and every test of significance agreed, as it must. So the time of a character
belongs to the base model like the lines' delay: estimated by least squares from the recording itself (1.03 +- 0.05 ms
there), believed as far as lines can be that slow. A protocol whose lines are all alike shows none.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from gateway.diagnosis.measurement import Measurement
from gateway.diagnosis.noise import Whitener
from gateway.diagnosis.search.base_fit import refit
from gateway.diagnosis.search.bench import Bench
from gateway.diagnosis.search.levenberg_marquardt import FittedModel
from gateway.diagnosis.search.normal_equations import NormalEquations

_TRIED_S: Final = 1.0e-3  # of a character, for the secant: 9600 baud
_SLOWEST_S: Final = 4.2e-3  # of a character: 10 bits at 2400 baud, the slowest that serial devices are set to
_LEAST_CHI2: Final = 6.6  # chi-square of one parameter that chance exceeds in 1 % of all recordings
_POWERS_OF_TEN: Final = 10.0 ** np.arange(1, 10)


def fit_line_lengths(bench: Bench, base: FittedModel, whiten: Whitener, step_v: float) -> tuple[Bench, FittedModel]:
    """Return the bench driven by settings as their lines ended, and the base model refitted to it; both as they are where the
    recordings do not show it.

    step_v: one count of the regulator's setting, V; 0 where it is not known. Only recordings that are driven by what was
    sent (even rows) are asked.
    """
    character_s = estimate_character_s(bench, base, whiten, step_v)
    if character_s == 0.0:
        return bench, base
    bench = _with_characters(bench, step_v, character_s)
    return bench, refit(bench, base, whiten)


def estimate_character_s(bench: Bench, base: FittedModel, whiten: Whitener, step_v: float) -> float:
    """Return how long a character of a setting's line takes, s; 0 where the recordings do not show it."""
    if step_v <= 0.0 or not any(map(_is_driven_by_settings, bench.measurements)):
        return 0.0
    tried = _with_characters(bench, step_v, _TRIED_S)
    column = bench.reduced(np.diff([each.simulate([base.parameters])[0] for each in (bench, tried)], axis=0))
    seen = NormalEquations(whiten(base.jacobian), whiten(column), whiten(base.residual_n)).add([0])
    return float(np.clip(seen.sizes[0] * _TRIED_S, 0.0, _SLOWEST_S)) if seen.gain > _LEAST_CHI2 else 0.0


def _with_characters(bench: Bench, step_v: float, character_s: float) -> Bench:
    """The bench where a character takes so long."""
    return bench.with_measurements([_earlier_settings(each, step_v, character_s) for each in bench.measurements])


def _earlier_settings(measurement: Measurement, step_v: float, character_s: float) -> Measurement:
    """The measurement with settings of fewer digits so much earlier; the longest stay where they are, for the lines' delay is
    theirs. A row's command is the mean over the row: a setting that comes earlier has a share of the row before."""
    if measurement.command_v is None or not _is_driven_by_settings(measurement):
        return measurement
    digits = np.searchsorted(_POWERS_OF_TEN, np.rint(measurement.command_v / step_v), side="right")
    share = np.minimum((digits.max() - digits) * character_s / measurement.even_s, 1.0)
    command_v = measurement.command_v.copy()
    command_v[:-1] += share[1:] * np.diff(measurement.command_v)
    return replace(measurement, command_v=command_v)


def _is_driven_by_settings(measurement: Measurement) -> bool:
    return measurement.even_s > 0.0 and measurement.command_v is not None
