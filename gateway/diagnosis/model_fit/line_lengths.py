"""When a setting acts: once the last character of its line is there.

A gateway's own recording knows when the writing of each setting began. A regulator that takes text has a setting when its line
has ended, and `SET 0` ends earlier than `SET 870`: by 1.04 ms a digit at 9600 baud. Falls, whose lead asks for 0 V, then come
2 ms earlier than rises, and neither the lines' delay, which is one for all settings, nor readings that are late by chance can
say so. It is a misfit of the base model and no chance: on clean steps of the demo rig it left 0.132 N instead of 0.125 N,
`command-nonlinearity` took a part of it, and every test of significance agreed, as it must. So the time of a character
is a parameter of the base model like the lines' delay, free in every model (0.85 to 1.01 ms in six runs there, where it is
1.00) and bounded by how slow lines can be. Were it fitted once and kept, it would take what belongs to a cause that is not in
the model yet. It is a shift of a few milliseconds at most: its response is linear, and one column holds it.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.bench.parameters import CHARACTER
from gateway.diagnosis.measurement import Measurement
from gateway.diagnosis.model_fit.levenberg_marquardt import FitProblem, FittedModel, refine
from gateway.diagnosis.noise.whitening import Whitener

_TRIED_S: Final = 1.0e-3  # of a character, for the secant: 9600 baud
_POWERS_OF_TEN: Final = 10.0 ** np.arange(1, 10)
_WAVES: Final = 3  # of a model that is at its optimum but for this one parameter


def fit_line_lengths(bench: Bench, base: FittedModel, whiten: Whitener, step_v: float) -> tuple[Bench, FittedModel]:
    """Return the bench that knows what a character changes, and the base model refitted with its time; both as they are where
    it cannot matter.

    step_v: one count of the regulator's setting, V; 0 where it is not known. Only recordings that are driven by what was
    sent (even rows) are asked.
    """
    if step_v <= 0.0 or not any(map(_is_driven_by_settings, bench.measurements)):
        return bench, base
    tried = bench.with_measurements([_earlier_settings(each, step_v, _TRIED_S) for each in bench.measurements])
    now_n, tried_n = (each.simulate([base.parameters])[0] for each in (bench, tried))
    if np.array_equal(now_n, tried_n):
        return bench, base
    bench = replace(bench, character_n_per_s=(tried_n - now_n) / _TRIED_S)
    return bench, refine(bench, [FitProblem(base.parameters, (*base.free, CHARACTER))], whiten, waves=_WAVES)[0]


def _earlier_settings(measurement: Measurement, step_v: float, character_s: float) -> Measurement:
    """The measurement with settings of fewer digits so much earlier; the longest stay where they are, for the lines' delay is
    theirs. Each setting is moved by itself: a row's command is a mean, and that of 870 and 0 counts has other digits."""
    sent = measurement.sent
    if sent is None or not _is_driven_by_settings(measurement):
        return measurement
    digits = np.searchsorted(_POWERS_OF_TEN, np.rint(sent.volts / step_v), side="right")
    earlier = replace(sent, times_s=sent.times_s - (digits.max() - digits) * character_s)
    edges_s = np.append(measurement.time_s, measurement.time_s[-1] + measurement.even_s)
    return replace(measurement, command_v=earlier.interval_means(edges_s))


def _is_driven_by_settings(measurement: Measurement) -> bool:
    return measurement.even_s > 0.0 and measurement.command_v is not None and measurement.sent is not None
