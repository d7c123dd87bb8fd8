"""From a measured response to everything in control that depends on time: one pure function.

The trim is an integral controller of a plant with dead time D and, with the lags inverted, a landing time L behind it. The
lambda rule for such a plant is an integral gain of 1/(K (lambda + D + L)); lambda = 1.1 (D + L) gives a gain margin above 3
where all is as measured, and above 1.5 where gain, dead time and lags are all 30 % larger (a test computes both). K is
the slope of the model at the working point, so the loop is as fast at 5 N as at 40 N, on the flat part of a branch as on
the steep one.

What the rig file says stays: whether there is a trim at all (gain 0: none), how far it may go, its least dead zone. With
`response: rig` nothing is derived.
"""

from dataclasses import replace
from typing import Final

from gateway.bsfm.model import Response
from gateway.control.force_loop.lag_inverse import LagInverse
from gateway.control.settings import ControlSettings, LeadSettings, LoopTiming, ResponseSource

LAMBDA_SHARE: Final = 1.1  # of dead time and landing
HELD_S: Final = 0.01  # by which tick and sample are late, on average
PATIENCE: Final = 0.7  # of the lags
UNREACHABLE: Final = 5.0  # times the whole response
SHORTEST_LAG_S: Final = 0.01
LONGEST_LAG_S: Final = 2.0


def timing_of(response: Response | None, settings: ControlSettings) -> ControlSettings:
    """The rig's settings with what follows from a measured response; unchanged without one, or where the rig file rules."""
    if response is None or settings.response is ResponseSource.RIG:
        return replace(settings, timing=None)
    lags_s = response.lag_s + response.second_lag_s
    lead = LeadSettings(lag_s=_within(response.lag_s), second_lag_s=min(LONGEST_LAG_S, response.second_lag_s))
    landing_s = LagInverse(lead, settings.limits).landing_s
    slow_s = response.dead_time_s + landing_s + HELD_S
    timing = LoopTiming(
        dead_time_s=response.dead_time_s,
        lag_s=lead.lag_s,
        second_lag_s=lead.second_lag_s,
        landing_s=landing_s,
        integral_per_s=1.0 / ((1.0 + LAMBDA_SHARE) * slow_s),
        patience_s=PATIENCE * lags_s,
    )
    whole_s = response.dead_time_s + lags_s
    supervision = replace(
        settings.supervision,
        response_lag_s=max(SHORTEST_LAG_S, whole_s),
        unreachable_s=max(settings.supervision.unreachable_s, UNREACHABLE * whole_s),
    )
    return replace(settings, lead=lead, supervision=supervision, timing=timing)


def _within(lag_s: float) -> float:
    return max(1.0e-3, min(LONGEST_LAG_S, lag_s))
