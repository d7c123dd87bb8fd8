"""The bounded integral of the force error, in volts on top of the feedforward.

The error is the target as the plant should follow it (first-order lag) minus the measured force, so that the lag itself
is not integrated. Anti-windup is conditional: the controller calls `integrate` only in contact, on a new sample, with
no limit acting and the target not far ahead. What was learned at one force fades as the target travels away (memory_n),
and is kept over small steps. Errors within the dead zone are left to stiction: integrating them makes a limit cycle of
the width of the friction.

Bounds: Trim.gain_v_per_n_s, limit_v, dead_zone_n and memory_n in control/settings.py.
"""

from math import exp

from gateway.control.limits import trim_limited
from gateway.control.settings import Trim
from gateway.registers.words import LimitedBy


class TrimIntegral:
    """value_v is added to the feedforward; limited_by says whether it stands at its limit."""

    def __init__(self, settings: Trim) -> None:
        self._settings = settings
        self.value_v = 0.0
        self.limited_by = LimitedBy.NONE

    def reset(self) -> None:
        """Forget the correction."""
        self.value_v, self.limited_by = 0.0, LimitedBy.NONE

    def resume(self, value_v: float) -> None:
        """Go on from a correction that another trim has learned."""
        self.value_v, self.limited_by = trim_limited(value_v, self._settings.limit_v)

    def travel(self, moved_n: float) -> None:
        """Fade the correction: the applied target moved by so much, N."""
        if moved_n and self.value_v:
            self.value_v *= exp(-abs(moved_n) / self._settings.memory_n)
            self.limited_by = LimitedBy.NONE

    def integrate(self, error_n: float, interval_s: float) -> None:
        """Add one sample to the integral. error_n: wanted minus measured; interval_s: since the sample before."""
        zone_n = self._settings.dead_zone_n
        beyond_n = error_n - max(-zone_n, min(zone_n, error_n))
        wanted_v = self.value_v + self._settings.gain_v_per_n_s * beyond_n * interval_s
        self.value_v, self.limited_by = trim_limited(wanted_v, self._settings.limit_v)
