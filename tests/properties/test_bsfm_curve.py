"""Laws of the curve for any curve."""

import math

import mpmath
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from gateway.bsfm import (
    Branches,
    CoefficientLimits,
    CoefficientReason,
    Coefficients,
    RationalBezier,
    validate_coefficients,
)
from tests.calibrations.coefficients import swapped
from tests.gate.budgets import examples

EPS = 2.0**-52
MANY = settings(derandomize=True, deadline=None, max_examples=examples(150))
logs = st.floats(-6.0, 6.0)
rises = st.floats(0.0, 9.0).map(lambda rise: rise if rise > 1e-3 else 0.0)


@st.composite
def increasing_curves(draw: st.DrawFn, lowest: int = 1, highest: int = 15) -> RationalBezier:
    n = draw(st.integers(lowest, highest))
    start, steps = draw(st.floats(-5.0, 5.0)), draw(st.lists(rises, min_size=n, max_size=n))
    assume(sum(steps) > 0.1)
    handles = [start + sum(steps[:i]) for i in range(n + 1)]
    weights = [math.exp(draw(logs)) for _ in range(n + 1)]
    return RationalBezier(0.0, draw(st.sampled_from([1.0, 5.0, 8.0, 10.0])), handles, weights)


@st.composite
def any_curves(draw: st.DrawFn) -> RationalBezier:
    n = draw(st.integers(1, 5))
    handles = draw(st.lists(st.integers(-8, 20).map(lambda i: i / 2), min_size=n + 1, max_size=n + 1))
    return RationalBezier(0.0, 1.0, handles, [math.exp(draw(logs)) for _ in range(n + 1)])


@MANY
@given(increasing_curves(), st.floats(0.0, 1.0))
def test_value_of_inverse_is_the_force(curve, share):
    low, high = curve.handles[0], curve.handles[-1]
    force = min(low + (high - low) * share, high)
    x, status = curve.inverse(force)
    assert status == "ok" and curve.x0 <= x <= curve.x1
    conditioning = max(curve.slope(place) for place in (x, x * (1 - EPS), x * (1 + EPS))) * x
    assert abs(curve.value(x) - force) <= 16 * EPS * (conditioning + 4 * max(map(abs, curve.handles)) + abs(force))


@MANY
@given(increasing_curves(), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_more_force_never_needs_less_voltage(curve, a, b):
    low, span = curve.handles[0], curve.handles[-1] - curve.handles[0]
    smaller, larger = sorted((a, b))
    assert curve.inverse(low + span * smaller)[0] <= curve.inverse(low + span * larger)[0] + 8 * EPS * curve.x1


@MANY
@given(increasing_curves(), st.floats(-2.0, 12.0))
def test_value_stays_between_its_smallest_and_largest_handle(curve, x):
    size = 40 * EPS * max(map(abs, curve.handles))
    assert min(curve.handles) - size <= curve.value(x) <= max(curve.handles) + size


@MANY
@given(any_curves(), st.floats(0.01, 0.99))
def test_slope_is_the_difference_quotient(curve, x):
    step = 1e-6 * min(x, 1.0 - x)
    quotient = (curve.value(x + step) - curve.value(x - step)) / (2 * step)
    steepest = max(abs(curve.slope(x + k * step)) for k in range(-3, 4))
    assert abs(curve.slope(x) - quotient) <= 1e-5 * (steepest + 1.0)


@settings(MANY, max_examples=examples(80))
@given(any_curves())
def test_monotone_test_agrees_with_dense_sampling_and_with_the_roots_of_the_derivative(curve):
    sampled = [curve.slope(i / 512) for i in range(1, 512)]
    if min(sampled) < -1e-9:
        assert not curve.is_increasing()
    assert curve.is_increasing() == derivative_is_positive(curve)


def derivative_is_positive(curve: RationalBezier) -> bool:
    """From N'W - NW' in powers of r, its roots in 60 digits, and its sign between them: nothing shared with the code."""
    with mpmath.workdps(60):
        n = curve.order
        weights = [mpmath.binomial(n, i) * mpmath.mpf(w) for i, w in enumerate(curve.weights)]
        numbers = [w * mpmath.mpf(b) for w, b in zip(weights, curve.handles, strict=True)]
        numerator = [mpmath.mpf(0)] * (2 * n)
        for i, a in enumerate(numbers):
            for j, w in enumerate(weights):
                if i != j:
                    numerator[i + j - 1] += (i - j) * a * w
        while numerator and numerator[-1] == 0:
            numerator.pop()
        while numerator and numerator[0] == 0:
            numerator.pop(0)
        if not numerator:
            return False
        roots = mpmath.polyroots(numerator, maxsteps=400, extraprec=400, asc=True) if len(numerator) > 1 else []
        inside = [
            root
            for root in roots
            if abs(mpmath.im(root)) < mpmath.mpf(10) ** -18 * (1 + abs(root)) and mpmath.re(root) > 0
        ]
        return not inside and numerator[0] > 0


@MANY
@given(increasing_curves(1, 6), st.data())
def test_the_proof_that_branches_do_not_cross_agrees_with_dense_sampling(rising, data):
    inner = [data.draw(st.floats(-3.0, 3.0)) for _ in rising.handles[1:-1]]
    handles = [
        rising.handles[0],
        *(b + d for b, d in zip(rising.handles[1:-1], inner, strict=True)),
        rising.handles[-1],
    ]
    falling = RationalBezier(rising.x0, rising.x1, handles, rising.weights)
    gaps = [falling.value(rising.x1 * i / 400) - rising.value(rising.x1 * i / 400) for i in range(401)]
    crossing = Branches(rising, falling).crossing_fault()
    if min(gaps) < -1e-9:
        assert crossing is not None
    if crossing is not None and max(map(abs, inner), default=0.0) > 1e-3:
        assert crossing.gap_n <= 1e-9


LIMITS = CoefficientLimits(cell_range_n=98.0, slope_floor_n_per_v=0.0)


@MANY
@given(increasing_curves(2))
def test_rounding_to_float32_keeps_a_usable_curve_or_is_refused(curve):
    raw = Coefficients(0.0, curve.x1, curve.handles, curve.weights, curve.handles, curve.weights)
    stored = raw.round_to_float32()
    assert stored == stored.round_to_float32()
    if validate_coefficients(raw, LIMITS):
        return
    remaining = RationalBezier(stored.x0_v, stored.x1_v, stored.rising_handles_n, stored.rising_weights)
    assert remaining.is_increasing()
    for i in range(11):
        x = curve.x1 * i / 10
        assert abs(remaining.value(x) - curve.value(x)) <= 4e-6 * (1.0 + max(map(abs, curve.handles)))


def with_weight(weight: float, index: int) -> Coefficients:
    weights = [1.0, 1.0, 1.0]
    weights[index] = weight
    return Coefficients(0.0, 5.0, (0.0, 18.0, 36.0), tuple(weights), (0.0, 18.0, 36.0), (1.0, 1.0, 1.0))


@MANY
@given(st.floats(2.0**-9, 512.0, width=32), st.integers(0, 2))
def test_a_weight_that_a_word_swap_threw_out_of_range_is_called_swapped(weight, index):
    wrong = swapped(weight)
    faults = {fault.index: fault.reason for fault in validate_coefficients(with_weight(wrong, index), LIMITS)}
    if not 1e-3 <= wrong <= 1e3:
        assert faults[16 + index] is CoefficientReason.WORDS_SWAPPED


@MANY
@given(st.integers(1, 255), st.integers(0, 7), st.integers(1, 2))
def test_a_swapped_weight_of_few_digits_never_passes(digits, shift, index):
    wrong = swapped(digits / 2**shift)  # eight bits: the low word is 0, the swapped number below 1e-38
    assert [fault.index for fault in validate_coefficients(with_weight(wrong, index), LIMITS)] == [16 + index]
