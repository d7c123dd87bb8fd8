"""Unit conversions and constants, nothing else. Inside the house everything is SI; names end with the unit."""

from typing import Final

STANDARD_GRAVITY_M_PER_S2: Final = 9.80665  # CGPM 1901
PASCAL_PER_BAR: Final = 1.0e5
PASCAL_PER_KILOPASCAL: Final = 1.0e3
NEWTON_PER_POUND_FORCE: Final = 4.4482216152605  # NIST SP 811, exact

NEWTON_PER_UNIT: Final = {
    "N": 1.0,
    "kg": STANDARD_GRAVITY_M_PER_S2,
    "g": STANDARD_GRAVITY_M_PER_S2 * 1.0e-3,
    "lb": NEWTON_PER_POUND_FORCE,
}
"""Newtons in one unit of what load-cell amplifiers print."""


def pascal_from_bar(pressure_bar: float) -> float:
    return pressure_bar * PASCAL_PER_BAR


def kilopascal_from_pascal(pressure_pa: float) -> float:
    return pressure_pa / PASCAL_PER_KILOPASCAL


def newton_from_kilogram_force(force_kgf: float) -> float:
    return force_kgf * STANDARD_GRAVITY_M_PER_S2
