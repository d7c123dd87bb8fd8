"""Models and reversals spelled out: `BSFM, order 2`, and what that is."""

from typing import Final

_DESCRIPTIONS: Final = {
    "pfm": "a polynomial, one for both directions",
    "psfm": "polynomials, one for each direction",
    "bfm": "a rational Bezier curve, one for both directions",
    "bsfm": "rational Bezier curves, one for each direction",
}


def spell_model(model: str, order: int) -> str:
    """Return `BSFM, order 2`."""
    return f"{str(model).upper()}, order {order}"


def describe_model(model: str) -> str:
    """Return what the letters of a model stand for."""
    return _DESCRIPTIONS[str(model)]


def spell_groups(count: int) -> str:
    """Return `1 group`, `3 groups`."""
    return f"{count} group{'s' * (count != 1)}"


def spell_held_out(groups: int) -> str:
    """Return what a fit was judged by that it has not seen: of a ladder of one group there are stairs alone."""
    return "a group" if groups > 1 else "stairs"


def spell_reversal(stops: int, span_n: float) -> str:
    """Return how the command turns back within the loop: `2 slip stops`, or `a linear blend over 5 N`."""
    if stops:
        return f"{stops} slip stop{'s' * (stops > 1)}"
    return f"a linear blend over {span_n:.3g} N"
