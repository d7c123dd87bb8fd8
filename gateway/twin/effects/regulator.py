"""The regulator's effects beyond steps, play and lags: each a formula for one step or for a whole series."""

import math
from typing import Final

from gateway.twin.elementwise import Real, exponential, larger, root, sine
from gateway.twin.sections import Regulator

ATMOSPHERE_PA: Final = 1.0e5
CLOSING_PA: Final = 2.0e4
CHOKED_RATIO: Final = 0.528  # of the pressures at a hole, below which the flow is that of sound


def bend_command(regulator: Regulator, voltage_v: Real) -> Real:
    """Apply command-nonlinearity: return u + bow 4 u (1 - u) + s 8 u (1 - u) (2 u - 1), V, exact at both ends of the scale.

    u: the voltage as a share of the full scale, which the sum is multiplied with again.
    """
    share = voltage_v / regulator.full_scale_v
    middle = 4.0 * share * (1.0 - share)
    return voltage_v + regulator.full_scale_v * middle * (
        regulator.command_bow + regulator.command_s * 2.0 * (2.0 * share - 1.0)
    )


def add_droop(regulator: Regulator, pressure_pa: Real, supply_kpa: Real) -> Real:
    """Add supply-droop: return the pressure, Pa, with what a stronger line adds as far as the regulator is open; at least 0."""
    excess_pa = supply_kpa * 1.0e3 - regulator.droop_reference_pa
    added = regulator.droop_pa_per_pa * open_share(pressure_pa)
    return larger(pressure_pa + (pressure_pa * regulator.droop_share_per_pa + added) * excess_pa, 0.0)


def open_share(pressure_pa: Real) -> Real:
    """Return how far the regulator works at all, 0 .. 1: it closes over the last few 10 kPa above none."""
    return 1.0 - exponential(-larger(pressure_pa, 0.0) / CLOSING_PA)


def apply_leak(regulator: Regulator, pressure_pa: Real) -> Real:
    """Apply leak: return the pressure, Pa, less what the valve's resistance takes at the flow of a hole; at least 0.

    After ISO 6358 the flow grows with the absolute pressure, and below a pressure ratio of 0.528 (choked) with nothing else.
    It is scaled to 1 at 0.3 MPa.
    """
    absolute_pa = larger(pressure_pa, 0.0) + ATMOSPHERE_PA
    beyond = larger(ATMOSPHERE_PA / absolute_pa - CHOKED_RATIO, 0.0) / (1.0 - CHOKED_RATIO)
    flow = absolute_pa / (0.3e6 + ATMOSPHERE_PA) * root(larger(1.0 - beyond * beyond, 0.0))
    return larger(pressure_pa - regulator.leak_flow_pa * flow, 0.0)


def add_hunting(regulator: Regulator, pressure_pa: Real, time_s: Real) -> Real:
    """Add regulator-hunting: return the pressure, Pa, with a limit cycle as far as the regulator is open; at least 0."""
    angle_rad = (2.0 * math.pi) * regulator.hunting_hz * time_s + regulator.hunting_phase_rad
    return larger(pressure_pa + regulator.hunting_pa * open_share(pressure_pa) * sine(angle_rad), 0.0)
