"""What a model gets wrong on everything that was measured: staircase and partial reversals, with the reversal's own memory.

The error of the branches alone is no measure of a model that is to drive a rig: each stair is compared with its own branch
there, and a reversal that leaves both for a while costs nothing. Here the memory moves with the measured forces, as in
control, and the model's force at each measured voltage is compared with the measured one. Where no reversal part was measured
the way of reversing is an assumption, which a staircase cannot judge; there the branches are all that is compared. But not of
a model with slip stops: those were measured, and its branches alone are reached only far behind a turn.
"""

from dataclasses import dataclass

import numpy as np

from gateway.bsfm.fit.projected_problem import Floats
from gateway.bsfm.ladder.check import CheckedLadder
from gateway.bsfm.ladder.measured_ladder import RISING, Ladder
from gateway.bsfm.model import Bsfm
from gateway.bsfm.slip.reversal import LinearBlend


@dataclass(frozen=True, slots=True)
class Error:
    """RMS and largest error in N, of `points` measured points."""

    rms_n: float
    max_n: float
    points: int

    @classmethod
    def of(cls, away_n: Floats) -> "Error":
        """Return the RMS, the largest and the number of errors in N, (N,), at least one."""
        return cls(float(np.sqrt(np.mean(away_n * away_n))), float(np.abs(away_n).max()), len(away_n))


def walked_error_n(model: Bsfm, voltage_v: Floats, force_n: Floats) -> Floats:
    """Return model minus measured at each point of a walk that begins on the rising branch, N."""
    memory, errors = model.reversal.start(), []
    before_n = float(force_n[0]) if len(force_n) else 0.0
    for volts, newtons in zip(voltage_v.tolist(), force_n.tolist(), strict=True):
        memory, before_n = model.memory_after(memory, before_n, newtons), newtons
        errors.append(model.settled_n(volts, model.branch_share(memory)) - newtons)
    return np.array(errors)


def branch_error_n(model: Bsfm, ladder: Ladder) -> Floats:
    """Return model minus measured at every stair by the branch of its direction, N."""
    rising, falling = model.branches.rising.value(ladder.voltage_v), model.branches.falling.value(ladder.voltage_v)
    return np.asarray(np.where(ladder.direction == RISING, rising, falling) - ladder.force_n)


def measured_error_n(model: Bsfm, checked: CheckedLadder) -> Floats:
    """Return model minus measured at every stair and every point of the walk, whose first only says where it began."""
    if len(checked.minor_v) < 2 and isinstance(model.reversal, LinearBlend):
        return branch_error_n(model, checked.ladder)
    ladder = walked_error_n(model, checked.ladder.voltage_v, checked.ladder.force_n)
    return np.concatenate([ladder, walked_error_n(model, checked.minor_v, checked.minor_n)[1:]])
