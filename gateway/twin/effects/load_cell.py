"""Sensing and logging: what the load cell, its amplifier and the logger make of the contact force.

Order: nonlinearity, span, then everything that adds to the zero, then what the logger does to the finished reading.
The clock (an offset, a skew) has a memory: load_cell.py keeps it for the running twin, replay shifts the series.
"""

import math
from typing import Final

from gateway.twin.effects.term import Term
from gateway.twin.elementwise import Real, clip, exponential, quantise, sine
from gateway.twin.sections import LoadCell
from gateway.twin.surroundings import TwinConditions


def bend_line(cell: LoadCell, force_n: Real, conditions: TwinConditions) -> Real:
    """Bend the cell's line by sensor-quadratic and sensor-cubic: return F + q F^2 + c F^3, N."""
    return force_n + (cell.quadratic_per_n + cell.cubic_per_n2 * force_n) * (force_n * force_n)


def drift_span(cell: LoadCell, force_n: Real, conditions: TwinConditions) -> Real:
    """Apply thermal-span-drift: return the force, N, times 1 + span x (temperature - reference)."""
    return force_n * (1.0 + cell.span_per_k * (conditions.temperature_c - cell.reference_c))


def drift_zero(cell: LoadCell, force_n: Real, conditions: TwinConditions) -> Real:
    """Add thermal-zero-drift: return the force, N, plus zero x (temperature - reference)."""
    return force_n + cell.zero_n_per_k * (conditions.temperature_c - cell.reference_c)


def add_warm_up(cell: LoadCell, force_n: Real, conditions: TwinConditions) -> Real:
    """Add warm-up: return the force, N, with an error that dies away after switching on."""
    return force_n + cell.warm_up_n * exponential(-conditions.time_s / cell.warm_up_s)


def add_drift(cell: LoadCell, force_n: Real, conditions: TwinConditions) -> Real:
    """Add linear-drift: return the force, N, plus drift x time."""
    return force_n + cell.drift_n_per_s * conditions.time_s


def add_hum(cell: LoadCell, force_n: Real, conditions: TwinConditions) -> Real:
    """Add mains-hum: return the force, N, with a sine of the mains' frequency."""
    return force_n + cell.hum_n * sine((2.0 * math.pi) * cell.hum_hz * conditions.time_s + cell.hum_phase_rad)


def add_crosstalk(cell: LoadCell, force_n: Real, conditions: TwinConditions) -> Real:
    """Add valve-crosstalk: return the force, N, plus a share of the command voltage of this moment, before a new one acts."""
    return force_n + cell.crosstalk_n_per_v * conditions.command_v


def lose_sign(cell: LoadCell, reading_n: Real) -> Real:
    """Apply sign-loss: return the reading, N, a share of which has lost its sign."""
    return (1.0 - cell.sign_lost) * reading_n + cell.sign_lost * abs(reading_n)


def convert_reading(cell: LoadCell, reading_n: Real) -> Real:
    """Return what the converter makes of a reading: range and steps (sensor-quantisation)."""
    return clip(quantise(clip(reading_n, -cell.range_n, cell.range_n), cell.quantum_n), -cell.range_n, cell.range_n)


TERMS: Final = (
    Term(("quadratic_per_n", "cubic_per_n2"), None, bend_line),
    Term(("span_per_k",), "temperature_c", drift_span),
    Term(("zero_n_per_k",), "temperature_c", drift_zero),
    Term(("warm_up_n",), None, add_warm_up),
    Term(("drift_n_per_s",), None, add_drift),
    Term(("hum_n",), None, add_hum),
    Term(("crosstalk_n_per_v",), "command_v", add_crosstalk),
)
"""In the order in which they act."""
