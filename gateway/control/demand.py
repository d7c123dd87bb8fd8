"""Complete a command with the rig's defaults where it says 0: computed once per command, not once per step.

Gravity: tilt 0 means that the tool points down; then the whole payload presses, at 90 degrees none of it, at 180 all of
it pulls back. The load cell sits between slide and payload, so it does not feel the payload's weight in the contact:
    contact force = cell force + payload_kg g cos(tilt)
The setpoint and the published measured force are contact forces; the model (calibrated on the cell) speaks cell force.
"""

from math import cos
from typing import Final, NamedTuple

from gateway.control.limits import finite, force_limited
from gateway.control.settings import ControlSettings, Defaults
from gateway.registers.command import Command
from gateway.registers.words import LimitedBy, Mode
from gateway.units import STANDARD_GRAVITY_M_PER_S2

STOP_S: Final = 4.0  # a ramp down takes at most this long (the guardian waits 5 s)


class Manner(NamedTuple):
    """How a force is gone for, complete: what a master sets once, while setpoints come and go."""

    ramp_n_per_s: float
    precontact_n: float
    contact_ramp_s: float
    gravity_n: float
    tolerance_n: float
    in_band_time_s: float


class Demand(NamedTuple):
    """One command, complete: no field means "default" any more. force_n is the accepted contact force."""

    mode: Mode
    force_n: float
    force_limited_by: LimitedBy
    voltage_v: float
    manner: Manner


def gravity_n(payload_kg: float, tilt_rad: float) -> float:
    """Return the part of the payload's weight that presses, N: m g cos(tilt), tilt 0 = tool pointing down."""
    return finite(payload_kg, "payload_kg") * STANDARD_GRAVITY_M_PER_S2 * cos(finite(tilt_rad, "tilt_angle_rad"))


def demand_of(command: Command, settings: ControlSettings, manner: Manner | None = None) -> Demand:
    """Return what the command demands. NotFiniteError if any number that matters is NaN or infinite.
    manner: of this command, where it is known."""
    force_n, limited_by = force_limited(command.force_setpoint_n, settings.limits)
    voltage_v = finite(command.voltage_setpoint_v, "voltage_setpoint_v")
    return Demand(command.mode, force_n, limited_by, voltage_v, manner or manner_of(command, settings.defaults))


def manner_of(command: Command, defaults: Defaults) -> Manner:
    """Return how the command wants its force to be gone for. NotFiniteError as `demand_of`."""
    return Manner(
        ramp_n_per_s=_or_default(command.force_ramp_n_per_s, defaults.force_ramp_n_per_s, "force_ramp_n_per_s"),
        precontact_n=_or_default(command.precontact_force_n, defaults.precontact_force_n, "precontact_force_n"),
        contact_ramp_s=_or_default(command.contact_ramp_s, defaults.contact_ramp_s, "contact_ramp_s"),
        gravity_n=_gravity_of(command, defaults),
        tolerance_n=_or_default(command.in_band_tolerance_n, defaults.in_band_tolerance_n, "in_band_tolerance_n"),
        in_band_time_s=_or_default(command.in_band_time_s, defaults.in_band_time_s, "in_band_time_s"),
    )


def is_same_manner(one: Command, other: Command) -> bool:
    """Decide whether two commands say the same of how a force is gone for."""
    return (
        one.force_ramp_n_per_s == other.force_ramp_n_per_s
        and one.tilt_angle_rad == other.tilt_angle_rad
        and one.precontact_force_n == other.precontact_force_n
        and one.contact_ramp_s == other.contact_ramp_s
        and one.payload_kg == other.payload_kg
        and one.in_band_tolerance_n == other.in_band_tolerance_n
        and one.in_band_time_s == other.in_band_time_s
    )


def _gravity_of(command: Command, defaults: Defaults) -> float:
    return gravity_n(_or_default(command.payload_kg, defaults.payload_kg, "payload_kg"), command.tilt_angle_rad)


def _or_default(value: float, default: float, name: str) -> float:
    """0 in these registers means the rig's default; a negative one is as meaningless and treated alike."""
    return value if finite(value, name) > 0.0 else default


def ramp_down_demand(demand: Demand, settings: ControlSettings) -> Demand:
    """Return the same on the way to 0 N, within STOP_S whatever the force is."""
    rate_n_per_s = max(settings.defaults.force_ramp_n_per_s, settings.limits.force_max_n / STOP_S)
    return Demand(Mode.FORCE, 0.0, LimitedBy.NONE, demand.voltage_v, demand.manner._replace(ramp_n_per_s=rate_n_per_s))
