"""Compensate the defects that a diagnosis has found: known, small, and named one by one.

Four places, each a formula that is inverted exactly (the twin's terms of the same name are the forward direction):
- the cell: a bent, warm or disturbed reading becomes the force that made it, before anything looks at it;
- the command map: the model speaks straight volts, what is sent is bent so that they arrive (compensation_model);
- forces from outside, by tilt and feed: added to what the model expects, so that they need not be trimmed away;
- the timing: the trim compares the force with what was asked for a transport delay ago, and the lead knows the lags.
Friction has no formula here: it is the model's, by a ladder on the rig, or on the twin of the extended plant. A second
formula beside the branches and the reversal's memory would be at odds with them.

A part whose input nobody gives (nan) is off, and `limited` says so. The null compensation changes no bit.
"""

from dataclasses import dataclass, field, replace
from math import cos, isfinite
from typing import Final

from gateway.control.compensation.cell_map import CellMap
from gateway.control.compensation.command_map import CommandMap
from gateway.control.settings import ControlSettings


@dataclass(frozen=True, slots=True, kw_only=True)
class OutsideForce:
    """Contact force that does not come from the slide. tilt_n cos(tilt - tilt_zero), and drag by feed speed and its sign."""

    tilt_n: float = 0.0
    tilt_zero_rad: float = 0.0
    feed_drag_n_s_per_mm: float = 0.0
    feed_drag_n: float = 0.0
    feed_drag_abs_n_s_per_mm: float = 0.0

    def force_n(self, tilt_rad: float, feed_mm_s: float) -> float:
        """Return the force from outside in N towards the workpiece; what is not known (nan) adds nothing."""
        force_n = self.tilt_n * cos(tilt_rad - self.tilt_zero_rad) if self.tilt_n and isfinite(tilt_rad) else 0.0
        if isfinite(feed_mm_s):
            sign = (feed_mm_s > 0.0) - (feed_mm_s < 0.0)
            force_n += self.feed_drag_n_s_per_mm * feed_mm_s + self.feed_drag_n * sign
            force_n += self.feed_drag_abs_n_s_per_mm * abs(feed_mm_s)
        return force_n


@dataclass(frozen=True, slots=True, kw_only=True)
class TimingCompensation:
    """Timing of the rig as it is: dead time and the sum of all lags behind it; more_*: what the settings do not know of."""

    delay_s: float
    lags_s: float
    more_s: float = 0.0  # delay and lags together
    more_lag_s: float = 0.0
    more_second_lag_s: float = 0.0

    def settings(self, settings: ControlSettings) -> ControlSettings:
        """Return the same for a slower rig: the lead's lags, the supervision's patience, and a trim that is no faster than the
        answer to it."""
        lead, supervision, trim = settings.lead, settings.supervision, settings.trim
        if lead.lag_s > 0.0:
            lag_s, second_lag_s = lead.lag_s + self.more_lag_s, lead.second_lag_s + self.more_second_lag_s
            lead = replace(lead, lag_s=_within_2_s(lag_s), second_lag_s=_within_2_s(second_lag_s))
        response_s = max(_SHORTEST_S, supervision.response_lag_s + self.more_s)
        patience = min(1.0, supervision.response_lag_s / response_s)
        return replace(
            settings,
            lead=lead,
            trim=replace(trim, gain_v_per_n_s=trim.gain_v_per_n_s * patience),
            supervision=replace(supervision, response_lag_s=response_s),
        )


_SHORTEST_S: Final = 0.01


def _within_2_s(lag_s: float) -> float:
    return max(0.0, min(2.0, lag_s))


@dataclass(frozen=True, slots=True, kw_only=True)
class Compensation:
    """Parts of the compensation, None where one is off.
    acts: names of the effects that are compensated; limited: (name, why not) of the others."""

    cell: CellMap | None = None
    command: CommandMap | None = None
    outside: OutsideForce | None = None
    timing: TimingCompensation | None = None
    acts: tuple[str, ...] = ()
    limited: tuple[tuple[str, str], ...] = field(default=())

    @property
    def is_null(self) -> bool:
        """Decide whether nothing is compensated."""
        return not (self.cell or self.command or self.outside or self.timing)

    def outside_n(self, tilt_rad: float, feed_mm_s: float) -> float:
        """Return the force that tilt and feed bring onto the workpiece, N; 0 where it is not compensated."""
        return self.outside.force_n(tilt_rad, feed_mm_s) if self.outside else 0.0

    def settings(self, settings: ControlSettings) -> ControlSettings:
        """Return what the rig file says about control, for the rig as it is."""
        return self.timing.settings(settings) if self.timing else settings


NO_COMPENSATION: Final = Compensation()
