"""Numbers as JSON can hold them."""

from math import isfinite


def finite_or_none(value: float) -> float | None:
    """Return a float (a numpy scalar becomes one); None for NaN and infinity, which JSON does not have."""
    return float(value) if isfinite(value) else None
