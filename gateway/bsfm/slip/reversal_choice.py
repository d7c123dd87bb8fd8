"""Linear blend or slip stops? Decided on points of the minor-loop walk that neither has seen.

Slip stops need the walk for many numbers where the blend has one, so they must be better on data that they were not
fitted to; then both are fitted to all of it. The blend is identified in any case: upload and C code carry it alone.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.bsfm.branches import Branches
from gateway.bsfm.fit.blend_span import choose_span_n, command_error_n, rms_n
from gateway.bsfm.fit.projected_problem import Floats
from gateway.bsfm.ladder.measured_ladder import Ladder
from gateway.bsfm.model import Bsfm
from gateway.bsfm.slip.problem import Walk
from gateway.bsfm.slip.reversal import LinearBlend
from gateway.bsfm.slip.slip_fit import SlipFit, fit_joint, walk_of

FEWEST_POINTS: Final = 12  # of the walk: it must turn round a few times, as a plan's fourteen turns do
BETTER_SHARE: Final = 0.9  # held-out error of the stops, of the blend's


@dataclass(frozen=True, slots=True, eq=False)
class ReversalChoice:
    """The reversal that predicts a walk best.

    span_n: of the blend on the model's own branches. slip: None where the blend is used. *_heldout_n: RMS on the points of
    the walk by a fit to the others, nan where it was not tried.
    """

    model: Bsfm
    span_n: float
    slip: SlipFit | None
    blend_heldout_n: float
    slip_heldout_n: float


def choose_reversal(branches: Branches, ladder: Ladder, volts: Floats, newtons: Floats) -> ReversalChoice | None:
    """Choose between blend and slip stops by a walk of partial reversals; None where it is too short for anything."""
    span_n = choose_span_n(branches, volts, newtons)
    if span_n is None:
        return None
    blend = Bsfm(branches, LinearBlend(span_n))
    if len(volts) < FEWEST_POINTS:
        return ReversalChoice(blend, span_n, None, float("nan"), float("nan"))
    errors_n = _held_out_errors(branches, ladder, volts, newtons)
    if errors_n[1] >= BETTER_SHARE * errors_n[0]:
        return ReversalChoice(blend, span_n, None, *errors_n)
    slip = fit_joint(branches, [walk_of(ladder), Walk(volts, newtons)])
    carried_n = choose_span_n(slip.branches, volts, newtons)
    return ReversalChoice(slip.model, span_n if carried_n is None else carried_n, slip, *errors_n)


def _held_out_errors(branches: Branches, ladder: Ladder, volts: Floats, newtons: Floats) -> tuple[float, float]:
    """RMS of blend and stops on the walk, each half of whose points is told by a fit to the other and to the ladder. All pass
    all points, so that they remember what came before."""
    halves = np.arange(len(volts)) % 2
    errors: list[list[Floats]] = [[], []]
    for half in (0, 1):
        try:
            slip = fit_joint(branches, [walk_of(ladder), Walk(volts, newtons, (halves != half).astype(float))], 0)
        except ValueError:  # no loop between the branches that stops could select in
            return 0.0, float("inf")
        span_n = choose_span_n(branches, volts, newtons, halves != half)
        blend = Bsfm(branches, LinearBlend(span_n or 0.0))
        for model_errors, model in zip(errors, (blend, slip.model), strict=True):
            model_errors.append(command_error_n(model, volts, newtons)[halves[1:] == half])
    rms = [rms_n(np.concatenate(model_errors)) for model_errors in errors]
    return rms[0], rms[1]
