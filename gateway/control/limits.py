"""Bound forces and voltages: every bound is a named function that tells whether it acted.

`isfinite` comes before min and max: max(0, min(100, nan)) is 100.

Time-bounded movements (voltage slew, force ramp) claim time from a `RateBudget`: it earns what passes, holds at most one
nominal tick when nothing moves, and so lets a new command act at the moment it arrives without letting calls in quick
succession beat the limit. On the wire: a rise between any two writes is at most slew x (time between them + one tick).
"""

from dataclasses import replace
from math import isfinite
from typing import Final

from gateway import defaults
from gateway.control.settings import Limits
from gateway.registers.words import LimitedBy

TICK_S: Final = defaults.TICK_S  # nominal tick: what a movement may claim at once after rest
LONGEST_STEP_S: Final = 0.02  # a later step of the voltage catches up no more
LONGEST_RAMP_STEP_S: Final = 0.045  # nor one of a ramp: two ticks of the slowest loop, and jitter

Limited = tuple[float, LimitedBy]
_NONE, _VOLTAGE_SLEW = LimitedBy.NONE, LimitedBy.VOLTAGE_SLEW  # a look-up on the class costs as much as a limit


class NotFiniteError(ValueError):
    """A value that must be a number is NaN or infinite."""


def finite(value: float, name: str) -> float:
    """Return the value. NotFiniteError with its name where it is NaN or infinite."""
    if not isfinite(value):
        raise NotFiniteError(f"{name} = {value}")
    return value


def force_limited(target_n: float, limits: Limits) -> Limited:
    """Limit a setpoint to 0 .. force_max_n (rig limits); the bank refuses such a setpoint before, this is the second line."""
    target_n = finite(target_n, "force_setpoint_n")
    ranged_n = max(0.0, min(limits.force_max_n, target_n))
    return ranged_n, _NONE if ranged_n == target_n else LimitedBy.FORCE_RANGE


def narrow_limits(limits: Limits, own_n: tuple[float, float] | None) -> Limits:
    """Return the rig's limits with the smaller of its largest force and a calibration's.

    The smallest force of a set bounds setpoints, in the bank: here it would keep a tool from its pre-contact force."""
    if own_n is None:
        return limits
    return replace(limits, force_max_n=min(limits.force_max_n, finite(own_n[1], "force_high_n")))


def is_below_usable(target_n: float, limits: Limits) -> bool:
    """Return whether the target is below the smallest usable force, where the output is 0 V."""
    return finite(target_n, "force_target_n") < limits.smallest_force_n


def trim_limited(trim_v: float, limit_v: float) -> Limited:
    """Limit a correction to +- limit_v (rig, trim.limit_v): the trim corrects the model, it does not replace it."""
    ranged_v = max(-limit_v, min(limit_v, finite(trim_v, "trim_v")))
    return ranged_v, _NONE if abs(ranged_v) < limit_v or limit_v == 0.0 else LimitedBy.TRIM_RANGE


def voltage_limited(target_v: float, limits: Limits) -> Limited:
    """Limit a voltage to voltage_min_v .. voltage_max_v (rig limits, within the output device's range)."""
    target_v = finite(target_v, "voltage_v")
    ranged_v = max(limits.voltage_min_v, min(limits.voltage_max_v, target_v))
    return ranged_v, _NONE if ranged_v == target_v else LimitedBy.VOLTAGE_RANGE


def slew_limited(target_v: float, last_v: float, slew_v_per_s: float, dt_s: float) -> Limited:
    """Limit a rise to at most slew_v_per_s x dt_s above last_v; falling is immediate: less voltage is less force."""
    highest_v = last_v + slew_v_per_s * finite(dt_s, "dt_s")
    if finite(target_v, "voltage_v") > highest_v:
        return highest_v, _VOLTAGE_SLEW
    return target_v, _NONE


def ramp_limited(target_n: float, last_n: float, rate_n_per_s: float, dt_s: float) -> float:
    """Move towards the target by at most rate x dt, both ways (command register force_ramp, or the rig's default)."""
    step_n = rate_n_per_s * finite(dt_s, "dt_s")
    if finite(target_n, "force_target_n") > last_n + step_n:
        return last_n + step_n
    return last_n - step_n if target_n < last_n - step_n else target_n


class RateBudget:
    """Seconds that a movement may claim now. longest_step_s: a step that comes later catches up no more."""

    def __init__(self, longest_step_s: float = LONGEST_RAMP_STEP_S) -> None:
        self._longest_step_s = longest_step_s
        self.available_s = TICK_S

    def earn(self, dt_s: float) -> None:
        """Add the time that has passed, within what one movement may claim."""
        most_s = TICK_S if dt_s <= TICK_S else min(dt_s, self._longest_step_s)
        self.available_s = min(self.available_s + dt_s, most_s)

    def spend(self, step: float, rate_per_s: float) -> None:
        """Take what a movement costs from the budget. step: by how much the value went; rate_per_s: its limit, in the same
        unit per second."""
        self.available_s = max(0.0, self.available_s - abs(step) / rate_per_s)


def strongest(*limits: LimitedBy) -> LimitedBy:
    """Return the strongest of several limits that act at once: the smallest number but NONE."""
    return min(filter(None, limits), default=_NONE)


class VoltageLimiter:
    """Limits the voltage just before the wire: range, then slew. voltage_v stands on the output since the last step; the safe
    voltage is not a movement but a state, set at once in either direction."""

    def __init__(self, limits: Limits) -> None:
        self.voltage_v = limits.safe_voltage_v
        self._limits = limits
        self._pace = RateBudget(LONGEST_STEP_S)

    @property
    def lowest_v(self) -> float:
        """The least voltage that may be out, for a force of 0."""
        return self._limits.voltage_min_v

    @property
    def is_lowest(self) -> bool:
        """Decide whether no less voltage can be out."""
        return self.voltage_v <= self.lowest_v

    def earn(self, dt_s: float) -> None:
        """Add the time that has passed, within what one movement may claim."""
        self._pace.earn(dt_s)

    def drive(self, target_v: float) -> LimitedBy:
        """Move the output towards the target as far as the limits allow now."""
        last_v, slew_v_per_s = self.voltage_v, self._limits.voltage_slew_v_per_s
        ranged_v, by_range = voltage_limited(target_v, self._limits)
        self.voltage_v, by_slew = slew_limited(ranged_v, last_v, slew_v_per_s, self._pace.available_s)
        if self.voltage_v > last_v:
            self._pace.spend(self.voltage_v - last_v, slew_v_per_s)
        return by_slew or by_range

    def make_safe(self) -> None:
        """Put the output at the safe voltage at once."""
        self.voltage_v = self._limits.safe_voltage_v
