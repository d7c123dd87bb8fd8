"""Are these coefficients fit to drive a plant? Checked on the values as they are stored: rounded to float32.

"w > 0" is not enough: a swap of the two words of a float32 turns 0.93 into 1.3e-26, which is positive. Hence limits on
weights and handles, and a second look at each refused number with its words swapped, so that the answer can say what
probably happened.

A fault's index counts the floats of the upload: 32 per branch (rising, falling), 16 handles then 16 weights each, so
that it is branch * 32 + (16 if weight) + i. A fault of a whole branch has the index of its first handle; one of the
whole set has -1.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from math import isfinite

from gateway.bsfm.branches import Branches
from gateway.bsfm.curve import ORDER_MAX, RationalBezier
from gateway.bsfm.model import Calibration

STRIDE = 16


class CoefficientReason(IntEnum):
    """Why coefficients were refused: the numbers go to the failing_reason register."""

    NONE = 0
    NOT_FINITE = 1
    HANDLE_RANGE = 2
    WEIGHT_RANGE = 3
    WORDS_SWAPPED = 4
    NOT_INCREASING = 5
    SLOPE_FLOOR = 6
    CROSSING = 7
    VOLTAGE_RANGE = 8
    ORDER = 9
    BLEND_SPAN = 10


@dataclass(frozen=True, slots=True)
class CoefficientFault:
    """index: see the module; text: a sentence with the number seen and what is allowed."""

    index: int
    reason: CoefficientReason
    text: str


@dataclass(frozen=True, slots=True)
class CoefficientLimits:
    """cell_range_n: the load cell's range, bound of |b|; weights are bounded as given and after w0 = 1."""

    cell_range_n: float
    voltage_min_v: float = 0.0
    voltage_max_v: float = 10.0
    weight_min: float = 1.0e-3
    weight_max: float = 1.0e3
    slope_floor_n_per_v: float = 0.5
    blend_span_max_n: float = 100.0


@dataclass(frozen=True, slots=True)
class Coefficients:
    """Numbers not yet trusted: any length, any value."""

    x0_v: float
    x1_v: float
    rising_handles_n: tuple[float, ...]
    rising_weights: tuple[float, ...]
    falling_handles_n: tuple[float, ...]
    falling_weights: tuple[float, ...]
    blend_span_n: float = 0.0

    @classmethod
    def of(cls, branches: Branches, blend_span_n: float = 0.0) -> "Coefficients":
        rising, falling = branches.rising, branches.falling
        return cls(rising.x0, rising.x1, rising.handles, rising.weights, falling.handles, falling.weights, blend_span_n)

    @classmethod
    def of_calibration(cls, calibration: Calibration) -> "Coefficients":
        return cls.of(calibration.model().branches, calibration.blend_span_n)

    def rounded(self) -> "Coefficients":
        """As float32 stores them; what overflows float32 becomes infinite."""
        return Coefficients(
            _float32(self.x0_v),
            _float32(self.x1_v),
            tuple(map(_float32, self.rising_handles_n)),
            tuple(map(_float32, self.rising_weights)),
            tuple(map(_float32, self.falling_handles_n)),
            tuple(map(_float32, self.falling_weights)),
            _float32(self.blend_span_n),
        )


def validate(branches: Branches, limits: CoefficientLimits) -> list[CoefficientFault]:
    """All faults of two branches, or [] if they may drive the plant."""
    return validate_coefficients(Coefficients.of(branches), limits)


def validate_coefficients(raw: Coefficients, limits: CoefficientLimits) -> list[CoefficientFault]:
    """All faults of numbers that may be anything. Curves are built and proven only from numbers that passed one by one."""
    stored = raw.rounded()
    faults = [*_frame_faults(stored, limits), *_number_faults(stored, limits)]
    return faults or list(_curve_faults(stored, limits))


def _frame_faults(stored: Coefficients, limits: CoefficientLimits) -> Iterator[CoefficientFault]:
    low, high, span = stored.x0_v, stored.x1_v, stored.blend_span_n
    if not limits.voltage_min_v <= low < high <= limits.voltage_max_v:
        allowed = f"{limits.voltage_min_v:g} <= x0 < x1 <= {limits.voltage_max_v:g}"
        yield CoefficientFault(
            -1, CoefficientReason.VOLTAGE_RANGE, f"range {low:g} .. {high:g} V: {allowed} V is allowed"
        )
    if not 0.0 <= span <= limits.blend_span_max_n:
        text = f"blend span {span:g} N: 0 .. {limits.blend_span_max_n:g} N is allowed"
        yield CoefficientFault(-1, CoefficientReason.BLEND_SPAN, text)
    lengths = {len(array) for _, _, array in _arrays(stored)}
    if len(lengths) != 1 or not 2 <= next(iter(lengths)) <= ORDER_MAX + 1:
        text = f"2 to {ORDER_MAX + 1} handles and as many weights per branch are needed"
        yield CoefficientFault(-1, CoefficientReason.ORDER, text)


def _arrays(stored: Coefficients) -> tuple[tuple[str, int, tuple[float, ...]], ...]:
    """Name, index of the first number, numbers: in the order of the upload."""
    return (
        ("rising handle", 0, stored.rising_handles_n),
        ("rising weight", STRIDE, stored.rising_weights),
        ("falling handle", 2 * STRIDE, stored.falling_handles_n),
        ("falling weight", 3 * STRIDE, stored.falling_weights),
    )


def _number_faults(stored: Coefficients, limits: CoefficientLimits) -> Iterator[CoefficientFault]:
    for name, first, numbers in _arrays(stored):
        weights = name.endswith("weight")
        low, high = (limits.weight_min, limits.weight_max) if weights else (-limits.cell_range_n, limits.cell_range_n)
        for i, number in enumerate(numbers):
            fault = _number_fault(f"{name} {i}", number, (low, high), weights)
            base = numbers[0] if weights else 1.0
            if fault is None and weights and low <= base and not low <= number / base <= high:
                text = f"{name} {i} = {number:g} is {number / base:g} times weight 0: {low:g} .. {high:g} is allowed"
                fault = (CoefficientReason.WEIGHT_RANGE, text)
            if fault is not None:
                yield CoefficientFault(first + i, *fault)


def _number_fault(
    name: str, number: float, allowed: tuple[float, float], weight: bool
) -> tuple[CoefficientReason, str] | None:
    low, high = allowed
    tiny_handle = not weight and 0.0 < abs(number) < 1.0e-20  # in range, yet no fit gives it
    if low <= number <= high and not tiny_handle:
        return None
    swapped = _swapped(number)
    if low <= swapped <= high and abs(swapped) > 1.0e-6:
        text = f"{name} = {number:g}; with its words swapped {swapped:g}: the sender uses the other word order"
        return CoefficientReason.WORDS_SWAPPED, text
    if tiny_handle:
        return None
    reason = CoefficientReason.WEIGHT_RANGE if weight else CoefficientReason.HANDLE_RANGE
    reason = reason if isfinite(number) else CoefficientReason.NOT_FINITE
    return reason, f"{name} = {number:g}: {low:g} .. {high:g} is allowed"


def _curve_faults(stored: Coefficients, limits: CoefficientLimits) -> Iterator[CoefficientFault]:
    rising = RationalBezier(stored.x0_v, stored.x1_v, stored.rising_handles_n, stored.rising_weights)
    falling = RationalBezier(stored.x0_v, stored.x1_v, stored.falling_handles_n, stored.falling_weights)
    for name, first, curve in (("rising", 0, rising), ("falling", 2 * STRIDE, falling)):
        if not curve.is_increasing():
            text = f"the {name} branch is not increasing: force could not be inverted to voltage"
            yield CoefficientFault(first, CoefficientReason.NOT_INCREASING, text)
        elif not curve.slope_is_at_least(limits.slope_floor_n_per_v):
            slope, floor = curve.minimum_slope(), limits.slope_floor_n_per_v
            text = (
                f"the {name} branch falls to {slope:.3g} N/V: at least {floor:g} N/V is needed, or noise is amplified"
            )
            yield CoefficientFault(first, CoefficientReason.SLOPE_FLOOR, text)
    crossing = Branches(rising, falling).crossing_fault()
    if crossing is not None:
        yield CoefficientFault(-1, CoefficientReason.CROSSING, str(crossing))


def _float32(number: float) -> float:
    try:
        return float(struct.unpack(">f", struct.pack(">f", number))[0])
    except OverflowError:
        return float("inf") if number > 0 else float("-inf")


def _swapped(number: float) -> float:
    data = struct.pack(">f", number)
    return float(struct.unpack(">f", data[2:] + data[:2])[0])
