"""Choose the span of the reversal blend from the minor-loop walk: the staircase alone cannot identify it, for it turns
round at its two ends only.

Judged as control would use it: volts asked for each force in turn against those that made it, told in newtons. The walk
begins on the rising branch, after a full cycle down; its first point only says where.
"""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.bsfm.branches import Branches
from gateway.bsfm.fit.projected_problem import Floats
from gateway.bsfm.model import Bsfm
from gateway.bsfm.slip.reversal import LinearBlend

SPANS: Final = 60
LARGEST_SHARE: Final = 0.7  # of the force range
FEWEST_POINTS: Final = 8


def command_error_n(model: Bsfm, voltage_v: Floats, force_n: Floats) -> Floats:
    """Return what the control law gets wrong along a walk, N; one shorter than the walk."""
    memory, errors = model.reversal.start(), []
    low_n, high_n = model.force_range_n
    for k in range(1, len(force_n)):
        memory = model.memory_after(memory, float(force_n[k - 1]), float(force_n[k]))
        share = model.branch_share(memory)
        asked_v, _ = model.voltage_v(min(max(float(force_n[k]), low_n), high_n), share)
        errors.append(model.force_n(asked_v, share) - model.force_n(float(voltage_v[k]), share))
    return np.array(errors)


def choose_span_n(
    branches: Branches, voltage_v: Floats, force_n: Floats, mask: NDArray[np.bool_] | None = None
) -> float | None:
    """Return the span with the smallest error on the walk, or on those of its points that are seen, N; None where the walk is
    too short."""
    if len(voltage_v) < FEWEST_POINTS:
        return None
    model = Bsfm(branches, LinearBlend(0.0))
    low_n, high_n = model.force_range_n
    spans_n = np.round((high_n - low_n) * LARGEST_SHARE * np.arange(1, SPANS + 1) / SPANS, 2)
    counts = np.ones(len(force_n), bool) if mask is None else mask
    errors = [command_error_n(_with(model, span_n), voltage_v, force_n)[counts[1:]] for span_n in spans_n.tolist()]
    best = min(range(SPANS), key=lambda k: float(np.mean(errors[k] ** 2)))
    return float(spans_n[best])


def _with(model: Bsfm, span_n: float) -> Bsfm:
    return replace(model, reversal=LinearBlend(span_n))


def rms_n(values: Floats) -> float:
    """Return the root mean square of errors, N."""
    return float(np.sqrt(np.mean(values * values)))
