"""Are these coefficients fit to drive a plant? Checked on the values as they are stored: rounded to float32.

"w > 0" is not enough: a swap of the two words of a float32 turns 0.93 into 1.3e-26, which is positive. Hence limits on
weights and handles, and a second look at each refused number with its words swapped, so that the answer can say what
probably happened. How a fault names its number: gateway.bsfm.coefficients.
"""

from collections.abc import Iterator

from gateway.bsfm.branches import Branches
from gateway.bsfm.coefficients import (
    STRIDE,
    WHOLE,
    Allowed,
    CoefficientFault,
    CoefficientLimits,
    CoefficientReason,
    Coefficients,
)
from gateway.bsfm.curve import ORDER_MAX, RationalBezier
from gateway.bsfm.validate_dynamics import response_faults, stiffness_faults, stop_faults

__all__ = [
    "CoefficientFault",
    "CoefficientLimits",
    "CoefficientReason",
    "Coefficients",
    "validate_coefficients",
]


def validate_coefficients(raw: Coefficients, limits: CoefficientLimits) -> list[CoefficientFault]:
    """Return all faults of numbers that may be anything. Curves are built and proven only
    from numbers that passed one by one, and stops against curves that passed."""
    stored = raw.round_to_float32()
    faults = [*_frame_faults(stored, limits), *_number_faults(stored, limits)]
    faults += [*stop_faults(stored, limits), *response_faults(stored.response, limits)]
    if faults:
        return faults
    branches = _branches(stored)
    return list(_curve_faults(branches, limits)) or list(stiffness_faults(stored, branches))


def _branches(stored: Coefficients) -> Branches:
    return Branches(
        RationalBezier(stored.x0_v, stored.x1_v, stored.rising_handles_n, stored.rising_weights),
        RationalBezier(stored.x0_v, stored.x1_v, stored.falling_handles_n, stored.falling_weights),
    )


def _frame_faults(stored: Coefficients, limits: CoefficientLimits) -> Iterator[CoefficientFault]:
    low, high, span = stored.x0_v, stored.x1_v, stored.blend_span_n
    swapped = _swapped_faults(stored, limits)
    yield from swapped
    if not swapped:
        yield from _range_faults(low, high, limits)
    if not swapped and not 0.0 <= span <= limits.blend_span_max_n:
        text = f"blend span {span:g} N: 0 .. {limits.blend_span_max_n:g} N is allowed"
        yield CoefficientFault(WHOLE, CoefficientReason.BLEND_SPAN, text)
    lengths = {len(array) for _, _, array in _arrays(stored)}
    if len(lengths) != 1 or not 2 <= next(iter(lengths)) <= ORDER_MAX + 1:
        text = f"2 to {ORDER_MAX + 1} handles and as many weights per branch are needed"
        yield CoefficientFault(WHOLE, CoefficientReason.ORDER, text)


def _range_faults(low: float, high: float, limits: CoefficientLimits) -> Iterator[CoefficientFault]:
    """Of a range that is next to nothing every force would be the same voltage: what presses would be let go."""
    text = ""
    if not limits.voltage_min_v <= low < high <= limits.voltage_max_v:
        text = f"{limits.voltage_min_v:g} <= x0 < x1 <= {limits.voltage_max_v:g} V is allowed"
    elif high - low < limits.voltage_range_least_v:
        text = f"a range of {limits.voltage_range_least_v:g} V and more is allowed"
    if text:
        yield CoefficientFault(WHOLE, CoefficientReason.VOLTAGE_RANGE, f"range {low:g} .. {high:g} V: {text}")


def _swapped_faults(stored: Coefficients, limits: CoefficientLimits) -> list[CoefficientFault]:
    """8 V with its words swapped are 2.3e-41 V, which is within the range: all forces would be asked for with no voltage."""
    volts = limits.voltage_min_v, limits.voltage_max_v, "V", CoefficientReason.VOLTAGE_RANGE
    span = Allowed("blend span", 0.0, limits.blend_span_max_n, "N", CoefficientReason.BLEND_SPAN)
    single = [Allowed(name, *volts).swap_fault(end) for name, end in (("x0", stored.x0_v), ("x1", stored.x1_v))]
    return [fault for fault in (*single, span.swap_fault(stored.blend_span_n)) if fault]


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
        for i, number in enumerate(numbers):
            if name.endswith("weight"):
                yield from _weight_faults(f"{name} {i}", first + i, (number, numbers[0]), limits)
            else:
                bound_n = limits.cell_range_n
                allowed = Allowed(f"{name} {i}", -bound_n, bound_n, "", CoefficientReason.HANDLE_RANGE)
                yield from allowed.faults(first + i, number)


def _weight_faults(
    name: str, index: int, weights: tuple[float, float], limits: CoefficientLimits
) -> Iterator[CoefficientFault]:
    """weights: this one and weight 0 of its branch."""
    low, high, (weight, base) = limits.weight_min, limits.weight_max, weights
    single = list(Allowed(name, low, high, "", CoefficientReason.WEIGHT_RANGE).faults(index, weight))
    yield from single
    if not single and low <= base and not low <= weight / base <= high:
        text = f"{name} = {weight:g} is {weight / base:g} times weight 0: {low:g} .. {high:g} is allowed"
        yield CoefficientFault(index, CoefficientReason.WEIGHT_RANGE, text)


def _curve_faults(branches: Branches, limits: CoefficientLimits) -> Iterator[CoefficientFault]:
    for name, first, curve in (("rising", 0, branches.rising), ("falling", 2 * STRIDE, branches.falling)):
        if not curve.is_increasing():
            text = f"the {name} branch is not increasing: force could not be inverted to voltage"
            yield CoefficientFault(first, CoefficientReason.NOT_INCREASING, text)
        elif not curve.slope_is_at_least(limits.slope_floor_n_per_v):
            slope, floor = curve.minimum_slope(), limits.slope_floor_n_per_v
            text = (
                f"the {name} branch falls to {slope:.3g} N/V: at least {floor:g} N/V is needed, or noise is amplified"
            )
            yield CoefficientFault(first, CoefficientReason.SLOPE_FLOOR, text)
    crossing = branches.crossing_fault()
    if crossing is not None:
        yield CoefficientFault(WHOLE, CoefficientReason.CROSSING, str(crossing))
