"""Memories that more than one part of the machine has: a play, and first-order lags, exact for steps of any length."""

import math
from typing import NamedTuple

from gateway.compiled import step


@step
def apply_play(state: float, value: float, width: float) -> float:
    """Return the state of a play of full width `width`: it is dragged along, half a width behind."""
    return min(max(state, value - 0.5 * width), value + 0.5 * width)


class RampShares(NamedTuple):
    """What a lag keeps of its state over one step, and what it takes of a straight input's begin and end."""

    kept: float
    begin: float
    end: float


@step
def ramp_shares(lag_s: float, step_s: float) -> RampShares:
    """Return the shares of a lag that is not 0, for an input that is straight over the step."""
    ratio = step_s / lag_s
    slope = -math.expm1(-ratio) / ratio
    kept = math.exp(-ratio)
    return RampShares(kept, slope - kept, 1.0 - slope)


@step
def follow_ramp(state: float, shares: RampShares, begin: float, end: float) -> float:
    """Return the state of a lag after one step under an input that goes straight from `begin` to `end`."""
    return shares.kept * state + shares.begin * begin + shares.end * end
