"""From a measured response to everything in control that depends on time: one pure function.

The trim is an integral controller of a plant with dead time D and, with the lags inverted, a landing time L behind it. It
integrates the error that is left once all that is on its way has come, by the model of dead time and lags (a Smith
predictor), so that its time constant may be lambda = D + L, without what a plain integral adds for the delay. That gives a
maximum sensitivity of 1.6 and a gain margin of 3 where all is as measured, and a gain margin above 1.6 where gain, dead time
and lags are all 30 % off, either way (a test computes them). It corrects newtons of the target; the model makes volts of them.

What the rig file says stays: whether there is a trim at all (gain 0: none), how far it may go, its least dead zone. With
`response: rig` nothing is derived.
"""

from dataclasses import replace
from typing import Final

from gateway.bsfm.model import Response
from gateway.bsfm.response.second_order import SecondOrder
from gateway.control.force_loop.lag_inverse import LagInverse
from gateway.control.settings import ControlSettings, LeadSettings, LoopTiming, ResponseSource

LAMBDA_SHARE: Final = 1.0  # of dead time and landing
HELD_S: Final = 0.01  # by which tick and sample are late, on average
UNREACHABLE: Final = 5.0  # times the whole response
SHORTEST_LAG_S: Final = 0.01
SHORT_S: Final = 0.012  # a second lag that cell, wire and ticks alone may look like
SHORT_SHARE: Final = 0.3  # of the first lag: so short a second one ends before the setting that would brake it
SHORT_AT_MOST_S: Final = 0.04  # if it is no longer than one setting and its answer
LONGEST_LAG_S: Final = 2.0


def timing_of(response: Response | None, settings: ControlSettings) -> ControlSettings:
    """Return the rig's settings with what follows from a measured response; unchanged without one, or where the rig file
    rules."""
    if response is None or settings.response is ResponseSource.RIG:
        return replace(settings, timing=None)
    response = _without_short_lag(response)
    lags_s = response.lag_s + response.second_lag_s
    lead = LeadSettings(lag_s=_within(response.lag_s), second_lag_s=min(LONGEST_LAG_S, response.second_lag_s))
    lags = SecondOrder(lead.lag_s, lead.second_lag_s, response.damping)
    landing_s = LagInverse(lags, settings.limits).landing_s
    slow_s = response.dead_time_s + landing_s + HELD_S
    timing = LoopTiming(
        dead_time_s=response.dead_time_s,
        lags=lags,
        landing_s=landing_s,
        integral_per_s=1.0 / (LAMBDA_SHARE * slow_s),
    )
    whole_s = response.dead_time_s + lags_s
    supervision = replace(
        settings.supervision,
        response_lag_s=max(SHORTEST_LAG_S, whole_s),
        unreachable_s=max(settings.supervision.unreachable_s, UNREACHABLE * whole_s),
    )
    return replace(settings, lead=lead, supervision=supervision, timing=timing)


def _without_short_lag(response: Response) -> Response:
    """A second lag that is short beside the output's wire counts as dead time: whoever inverts it pushes and brakes in settings
    that last longer than it does, and goes beyond the wish on the way down."""
    longer_s, shorter_s = sorted((response.lag_s, response.second_lag_s), reverse=True)
    is_short = shorter_s < SHORT_S or shorter_s < min(SHORT_AT_MOST_S, SHORT_SHARE * longer_s)
    if response.damping or not is_short:
        return response
    return replace(response, dead_time_s=response.dead_time_s + shorter_s, lag_s=longer_s, second_lag_s=0.0)


def _within(lag_s: float) -> float:
    return max(1.0e-3, min(LONGEST_LAG_S, lag_s))
