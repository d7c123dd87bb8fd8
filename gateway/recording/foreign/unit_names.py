"""How people write units: `Sek`, `µs`, `kp`, `°C`, `m/s`, each with the unit of `gateway.units.LINEAR` that it is.

Letters' case counts where it decides: mN is a thousandth of MN, so MN is none of these, and mPa is no MPa. A word all in
small or all in capital letters is taken where only one unit can be meant.
"""

from typing import Final

from gateway.units import LINEAR

_WRITTEN: Final[dict[str, dict[str, str]]] = {
    "time": {
        "s": "s sec secs second seconds sek Sek sekunde sekunden Sekunde Sekunden",
        "ms": "ms msec msecs millisecond milliseconds Millisekunden",
        "us": "us µs μs usec microsecond microseconds Mikrosekunden",
        "ns": "ns nsec nanosecond nanoseconds Nanosekunden",
        "min": "min mins minute minutes Min Minuten",
        "h": "h hr hrs hour hours Std Stunden",
    },
    "force": {
        "n": "N newton newtons Newton",
        "mn": "mN millinewton",
        "kn": "kN kilonewton",
        "kgf": "kgf kg kp kilogram kilograms kilopond",
        "gf": "gf g gram grams pond",
        "lbf": "lbf lb lbs pound pounds",
    },
    "voltage": {"v": "V volt volts Volt Vdc VDC", "mv": "mV millivolt millivolts", "percent": "% percent Prozent"},
    "pressure": {
        "pa": "Pa pascal Pascal",
        "kpa": "kPa",
        "mpa": "MPa",
        "bar": "bar bars",
        "mbar": "mbar hPa",
        "psi": "psi psig",
    },
    "length": {"m": "m metre meter", "cm": "cm", "mm": "mm", "um": "um µm μm micron microns"},
    "speed": {"m_s": "m/s", "mm_s": "mm/s", "m_min": "m/min", "mm_min": "mm/min"},
    "temperature": {"k": "K kelvin Kelvin", "c": "°C C degC celsius Celsius grdC", "f": "°F degF F fahrenheit"},
    "turning": {"hz": "Hz hertz 1/s", "rpm": "rpm 1/min min-1 U/min r/min"},
    "angle": {"rad": "rad", "deg": "deg ° degrees Grad"},
}
_KEYS: Final = {
    (quantity, name): unit
    for quantity, units in _WRITTEN.items()
    for unit, names in units.items()
    for name in names.split()
} | {(quantity, unit): unit for quantity, units in LINEAR.items() for unit in units if unit != "mn" and unit != "mpa"}
_ALL_CAPITALS_MEAN_TWO: Final = frozenset(("MN", "MV", "MS", "MPA", "US"))
_FOREIGN: Final = frozenset(("mA", "A", "mV/V", "µA", "Ohm", "counts", "digits", "raw", "LSB", "Nm"))
"""Units that no column of the contract has: what they mean depends on the sensor."""


def unit_of(text: str, quantity: str) -> str | None:
    """Return the unit's name in `LINEAR[quantity]`; None where the text is none of its units."""
    word = text.strip().rstrip(".")
    known = _KEYS.get((quantity, word))
    if known or word in _ALL_CAPITALS_MEAN_TWO:
        return known
    if word.islower() or word.isupper():
        low = word.lower()
        named = {unit for (of, name), unit in _KEYS.items() if of == quantity and name.lower() == low}
        named |= {low} if low in LINEAR[quantity] else set()
        return named.pop() if len(named) == 1 else None
    return None


def is_unit(text: str) -> bool:
    """Decide whether this is how a unit is written, of whatever quantity."""
    word = text.strip().strip("[]()")
    return word in _FOREIGN or any(unit_of(word, quantity) for quantity in LINEAR)
