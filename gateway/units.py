"""Unit conversions, constants, and how sentences write them. Inside the program everything is SI; names end with the unit."""

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


def kilopascal_from_pascal(pressure_pa: float) -> float:
    return pressure_pa / PASCAL_PER_KILOPASCAL


LINEAR: Final[dict[str, dict[str, tuple[float, float]]]] = {
    "time": {
        "s": (1.0, 0.0),
        "ms": (1.0e-3, 0.0),
        "us": (1.0e-6, 0.0),
        "ns": (1.0e-9, 0.0),
        "min": (60.0, 0.0),
        "h": (3600.0, 0.0),
    },
    "force": {
        "n": (1.0, 0.0),
        "mn": (1.0e-3, 0.0),
        "kn": (1.0e3, 0.0),
        "kgf": (STANDARD_GRAVITY_M_PER_S2, 0.0),
        "gf": (STANDARD_GRAVITY_M_PER_S2 * 1.0e-3, 0.0),
        "lbf": (NEWTON_PER_POUND_FORCE, 0.0),
    },
    "voltage": {"v": (1.0, 0.0), "mv": (1.0e-3, 0.0), "percent": (0.1, 0.0)},  # of the usual 0 .. 10 V
    "pressure": {
        "pa": (1.0, 0.0),
        "kpa": (PASCAL_PER_KILOPASCAL, 0.0),
        "mpa": (1.0e6, 0.0),
        "bar": (PASCAL_PER_BAR, 0.0),
        "mbar": (PASCAL_PER_BAR * 1.0e-3, 0.0),
        "psi": (NEWTON_PER_POUND_FORCE / 0.0254**2, 0.0),
    },
    "length": {"m": (1.0, 0.0), "cm": (1.0e-2, 0.0), "mm": (1.0e-3, 0.0), "um": (1.0e-6, 0.0)},
    "speed": {
        "m_s": (1.0, 0.0),
        "mm_s": (1.0e-3, 0.0),
        "m_min": (1.0 / 60.0, 0.0),
        "mm_min": (1.0e-3 / 60.0, 0.0),
    },
    "temperature": {"k": (1.0, 0.0), "c": (1.0, 273.15), "f": (5.0 / 9.0, 459.67 * 5.0 / 9.0)},
    "turning": {"hz": (1.0, 0.0), "rpm": (1.0 / 60.0, 0.0)},
    "angle": {"rad": (1.0, 0.0), "deg": (3.141592653589793 / 180.0, 0.0)},
}
"""Per quantity: SI = factor x value + offset, by the lower-case unit that ends a column's name (`mpa` is MPa, `mn` mN)."""


def linear_conversion(quantity: str, given: str, wanted: str) -> tuple[float, float]:
    """Return (factor, offset) with wanted = factor x given + offset; (1, 0) exactly when both are one. KeyError if unknown."""
    (factor, offset), (factor_to, offset_to) = LINEAR[quantity][given], LINEAR[quantity][wanted]
    return factor / factor_to, (offset - offset_to) / factor_to


def format_ms(seconds: float) -> str:
    """Return seconds as whole milliseconds for a sentence, such as `120 ms`."""
    return f"{seconds * 1e3:.0f} ms"
