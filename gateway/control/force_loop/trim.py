"""The bounded integral of the force error, in volts on top of the feedforward.

The error is the target as the plant should follow it (first-order lag) minus the measured force, so that the lag itself
is not integrated. Anti-windup is conditional: the controller calls `integrate` only in contact, on a new sample, with
no limit acting and the target not far ahead. What was learned at one force fades as the target travels away (memory_n),
and is kept over small steps. Errors within the dead zone are left to stiction: integrating them makes a limit cycle of
the width of the friction.

A gain that is too large for the rig makes the force swing about its target for good: so each swing after the first few makes
the pace slower, until the output is at rest again. A swing is an error of SWING_N at least, SEEN_S long, on the other side of
the same target, CALM_S behind the one before at the most.

Bounds: Trim.gain_v_per_n_s, limit_v, dead_zone_n and memory_n in control/settings.py.
"""

from math import exp
from typing import Final

from gateway.control.force_loop.measured_trim import NEW_TARGET_N, SLOWER
from gateway.control.limits import trim_limited
from gateway.control.settings import Trim
from gateway.registers.words import LimitedBy

SWING_N: Final = 1.0
SEEN_S: Final = 0.05  # longer than the noise of a cell
SEEN_SAMPLES: Final = 3  # the same, of a slow one
CALM_S: Final = 3.0  # so long between two of them, and it is not the trim that swings
FREE_SWINGS: Final = 3  # what a step, or a workpiece, may make of it
LEAST_PACE: Final = 0.02
NEAR_LIMIT: Final = 0.8  # as a share of it, above which a trim that has reached it has not left it
LEARNING: Final = (
    LimitedBy.NONE,
    LimitedBy.TRIM_RANGE,
    LimitedBy.VOLTAGE_RANGE,
    LimitedBy.CALIBRATION_RANGE,
    LimitedBy.FORCE_RANGE,
)
"""Limits at which a trim may learn, but away from its `blocked_way`. That of the setpoint leaves the voltage free."""


def blocked_way(limited_by: LimitedBy, trim_v: float, *, is_lowest: bool, is_low: bool) -> int:
    """Return the way that a trim may not go, -1 or 1, for the range ends there; 0: none. Back it must, or it would stay.
    is_lowest: no less voltage can be out; is_low: the model's range begins above what is asked of it."""
    if limited_by is LimitedBy.VOLTAGE_RANGE:
        return -1 if is_lowest else 1
    way = -1 if is_low else 1
    return way if limited_by is LimitedBy.CALIBRATION_RANGE and way * trim_v >= 0.0 else 0


class TrimIntegral:
    """value_v is added to the feedforward; limited_by says whether it stands at its limit; swings: how often the force has
    gone from one side of this target to the other; blocked_way: see there."""

    def __init__(self, settings: Trim) -> None:
        self._settings, self.blocked_way = settings, 0
        self.reset()

    @property
    def is_off(self) -> bool:
        """Decide whether the trim has no gain."""
        return self._settings.gain_v_per_n_s <= 0.0

    @property
    def has_hunted(self) -> bool:
        """Decide whether the force has swung so often that the trim goes slower."""
        return self._pace < 1.0

    def reset(self) -> None:
        """Forget the correction, and the swings."""
        self.value_v, self.limited_by = 0.0, LimitedBy.NONE
        self._pace = 1.0
        self._begin_target()

    def forget(self) -> None:
        """Forget the correction, for contact is lost: it was of a force that has gone. The swings are remembered."""
        self.value_v, self.limited_by = 0.0, LimitedBy.NONE

    def _begin_target(self) -> None:
        self.swings = self._side = self._beyond_side = self._samples = 0
        self._beyond_s = self._moved_n = self._since_swing_s = 0.0

    def resume(self, value_v: float) -> None:
        """Go on from a correction that another trim has learned."""
        self.value_v, self.limited_by = trim_limited(value_v, self._settings.limit_v)

    def travel(self, moved_n: float) -> None:
        """Fade the correction: the applied target moved by so much, N."""
        if moved_n and self.value_v:
            faded_v = self.value_v * exp(-abs(moved_n) / self._settings.memory_n)
            self.value_v, self.limited_by = trim_limited(faded_v, self._settings.limit_v)
        self._moved_n += moved_n
        if abs(self._moved_n) > NEW_TARGET_N:
            self._begin_target()

    def integrate(self, error_n: float, interval_s: float) -> None:
        """Add one sample to the integral. error_n: wanted minus measured; interval_s: since the sample before."""
        self._count_swings(error_n, interval_s)
        zone_n = self._settings.dead_zone_n
        beyond_n = error_n - max(-zone_n, min(zone_n, error_n))
        if beyond_n * self.blocked_way > 0.0:
            return
        wanted_v = self.value_v + self._pace * self._settings.gain_v_per_n_s * beyond_n * interval_s
        self.value_v, self.limited_by = trim_limited(wanted_v, self._settings.limit_v)

    def _count_swings(self, error_n: float, interval_s: float) -> None:
        self._since_swing_s += interval_s
        if self._since_swing_s > CALM_S:
            self.swings = self._side = 0
        side = 0 if abs(error_n) < SWING_N else 1 if error_n > 0.0 else -1
        is_same = side == self._beyond_side
        self._beyond_side = side
        self._beyond_s, self._samples = (self._beyond_s + interval_s, self._samples + 1) if is_same else (interval_s, 1)
        if not side or side == self._side or self._beyond_s < SEEN_S or self._samples < SEEN_SAMPLES:
            return
        if self._side:
            self.swings += 1
            if self.swings > FREE_SWINGS:
                self._pace = max(LEAST_PACE, SLOWER * self._pace)
        self._side, self._since_swing_s = side, 0.0
