"""Limit the voltage just before the wire: range, then slew, and which of them acted.

The safe voltage is not a movement but a state: it is set at once in either direction.
"""

from gateway.control.limits import RateBudget, slew_limited, voltage_limited
from gateway.control.settings import Limits
from gateway.registers.words import LimitedBy


def strongest(*limits: LimitedBy) -> LimitedBy:
    """The strongest of several limits that act at once: the smallest number but NONE."""
    return min((limit for limit in limits if limit), default=LimitedBy.NONE)


class VoltageLimiter:
    """voltage_v is what stands on the output since the last step."""

    def __init__(self, limits: Limits) -> None:
        self.voltage_v = limits.safe_voltage_v
        self._limits = limits
        self._pace = RateBudget()

    def earn(self, dt_s: float) -> None:
        self._pace.earn(dt_s)

    def drive(self, target_v: float) -> LimitedBy:
        """Towards the target as far as the limits allow now."""
        last_v, slew_v_per_s = self.voltage_v, self._limits.voltage_slew_v_per_s
        ranged_v, by_range = voltage_limited(target_v, self._limits)
        self.voltage_v, by_slew = slew_limited(ranged_v, last_v, slew_v_per_s, self._pace.available_s)
        if self.voltage_v > last_v:
            self._pace.spend(self.voltage_v - last_v, slew_v_per_s)
        return by_slew or by_range

    def make_safe(self) -> None:
        self.voltage_v = self._limits.safe_voltage_v
