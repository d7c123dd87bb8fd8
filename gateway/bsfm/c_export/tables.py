"""The float32 constants of a calibration: what the generated C holds, and what its model in Python computes with.

Coefficients are multiplied out in double and rounded once. Weights are first scaled by a power of two (exact) so that
the largest is in [1/2, 1). What float32 cannot carry is refused here, in words: numbers beyond the bounds below (they
keep each product of the Newton form within 1e-36 .. 1e36), and branches that stop increasing when they are rounded.
"""

import struct
from dataclasses import dataclass, replace
from math import comb, frexp, ldexp

from gateway.bsfm.branches import Branches
from gateway.bsfm.curve import RationalBezier
from gateway.bsfm.model import Calibration
from gateway.bsfm.slip.slip_stops import SlipStops

VOLTAGE_LIMIT_V = 1.0e3
FORCE_LIMIT_N = 1.0e6
SMALLEST_RANGE = 1.0e-3  # V and N
WEIGHT_SPREAD = 1.0e9


@dataclass(frozen=True, slots=True)
class BranchTable:
    """One branch, index 0..order; every number is a float32."""

    handles_n: tuple[float, ...]
    weights: tuple[float, ...]
    totals: tuple[float, ...]  # C(n,i) w_i
    products: tuple[float, ...]  # C(n,i) w_i b_i
    half_n: float  # force at t = 1/2


@dataclass(frozen=True, slots=True)
class Tables:
    """A calibration in float32."""

    order: int
    x0_v: float
    x1_v: float
    x_span_v: float
    blend_span_n: float
    rising: BranchTable
    falling: BranchTable
    radii_v: tuple[float, ...] = ()  # of slip stops; none: the linear blend
    shares: tuple[float, ...] = ()
    stiffness_per_v: float = 0.0

    @property
    def reached_n(self) -> tuple[float, float]:
        """Lowest and highest force of either branch."""
        ends = zip(*((table.handles_n[0], table.handles_n[-1]) for table in (self.rising, self.falling)), strict=True)
        lows, highs = ends
        return min(lows), max(highs)

    @property
    def shared_n(self) -> tuple[float, float]:
        """Lowest and highest force that both branches reach."""
        rising, falling = self.rising.handles_n, self.falling.handles_n
        return max(rising[0], falling[0]), min(rising[-1], falling[-1])


def round_to_float32(value: float) -> float:
    """Return the nearest float32. OverflowError beyond its range."""
    nearest: float = struct.unpack("<f", struct.pack("<f", value))[0]
    return nearest


def tables_of(calibration: Calibration) -> Tables:
    """Return a calibration's numbers as float32. ValueError with a sentence if this is no model, or none that float32 can
    carry.
    """
    calibration.model()
    _check_range("voltage", "V", (calibration.x0_v, calibration.x1_v), VOLTAGE_LIMIT_V)
    if calibration.blend_span_n > FORCE_LIMIT_N:
        raise ValueError(f"blend span {calibration.blend_span_n:g} N: at most {FORCE_LIMIT_N:g} N is allowed in C")
    x0_v, x1_v = round_to_float32(calibration.x0_v), round_to_float32(calibration.x1_v)
    tables = Tables(
        order=calibration.order,
        x0_v=x0_v,
        x1_v=x1_v,
        x_span_v=round_to_float32(x1_v - x0_v),
        blend_span_n=round_to_float32(calibration.blend_span_n),
        rising=_branch_table("rising", calibration.rising_handles_n, calibration.rising_weights),
        falling=_branch_table("falling", calibration.falling_handles_n, calibration.falling_weights),
        radii_v=tuple(map(round_to_float32, calibration.slip_radii_v)),
        shares=tuple(map(round_to_float32, calibration.slip_shares)),
    )
    low_n, high_n = tables.shared_n
    if low_n >= high_n:
        raise ValueError("the branches share no force: one begins where the other ends")
    return replace(tables, stiffness_per_v=_stiffness_per_v(tables)) if tables.radii_v else tables


def _stiffness_per_v(tables: Tables) -> float:
    """Of the rounded stops, rounded. ValueError where they are too stiff for the rounded branches."""
    stops = SlipStops(tables.radii_v, tables.shares)
    curves = [
        RationalBezier(tables.x0_v, tables.x1_v, table.handles_n, table.weights)
        for table in (tables.rising, tables.falling)
    ]
    stops.check(Branches(*curves))
    return round_to_float32(stops.stiffness_per_v)


def _branch_table(name: str, handles_n: tuple[float, ...], weights: tuple[float, ...]) -> BranchTable:
    _check_range(f"{name} force", "N", (handles_n[0], handles_n[-1], *handles_n), FORCE_LIMIT_N)
    if max(weights) > WEIGHT_SPREAD * min(weights):
        raise ValueError(f"{name} weights: spread over more than {WEIGHT_SPREAD:g}, more than float32 can carry")
    exponent = frexp(max(weights))[1]
    handles = tuple(map(round_to_float32, handles_n))
    scaled = tuple(round_to_float32(ldexp(weight, -exponent)) for weight in weights)
    if not RationalBezier(0.0, 1.0, handles, scaled).is_increasing():
        raise ValueError(f"the {name} branch stops increasing when its handles and weights are rounded to float32")
    totals = [comb(len(handles) - 1, i) * weight for i, weight in enumerate(scaled)]
    products = [total * handle for total, handle in zip(totals, handles, strict=True)]
    half_n = sum(products) / sum(totals)
    return BranchTable(
        handles,
        scaled,
        tuple(map(round_to_float32, totals)),
        tuple(map(round_to_float32, products)),
        round_to_float32(half_n),
    )


def _check_range(what: str, unit: str, values: tuple[float, ...], limit: float) -> None:
    """values: first and last of the range, then others that must stay below the limit too."""
    if max(map(abs, values)) > limit:
        raise ValueError(f"{what} {max(values, key=abs):g} {unit}: at most {limit:g} {unit} is allowed in C")
    if values[1] - values[0] < max(SMALLEST_RANGE, SMALLEST_RANGE * max(abs(values[0]), abs(values[1]))):
        raise ValueError(f"{what} {values[0]:g} .. {values[1]:g} {unit}: too narrow a range for float32")
