"""The curve against 50 digits: value, slope, inverse, status; ordinary, spread, nearly polar, tiny."""

import math
import random
import subprocess
import sys

import numpy as np
import pytest

from gateway.bsfm import InverseStatus, RationalBezier

ORDERS = (1, 2, 3, 5, 15)
TOLERANCE = 1e-12  # the contract allows 1e-11


def increasing_curve(rng: random.Random, order: int, spread: float, x0: float = 0.0, x1: float = 8.0) -> RationalBezier:
    handles = [rng.uniform(-1.0, 1.0)]
    for _ in range(order):
        handles.append(handles[-1] + rng.uniform(0.01, 6.0))
    return RationalBezier(x0, x1, handles, [math.exp(rng.uniform(-spread, spread)) for _ in handles])


def places(rng: random.Random, x0: float, x1: float) -> list[float]:
    """Inside, and crowding towards either end."""
    shares = [rng.random(), 0.5, rng.random() ** 12, 1.0 - rng.random() ** 12, 1e-9, 1.0 - 1e-9]
    return [x0 + (x1 - x0) * share for share in shares]


@pytest.mark.sampled
@pytest.mark.parametrize("spread", [0.0, 1.0, 6.0])
@pytest.mark.parametrize("order", ORDERS)
def test_value_and_slope_agree_with_fifty_digits(order, spread, reference):
    rng = random.Random(order * 100 + spread)
    for _ in range(3):
        curve = increasing_curve(rng, order, spread)
        truth, size = reference(curve), max(map(abs, curve.handles))
        for x in places(rng, 0.0, 8.0):
            assert abs(curve.value(x) - truth.value(x)) <= TOLERANCE * (abs(truth.value(x)) + 1e-3 * size)
            assert curve.slope(x) == pytest.approx(float(truth.slope(x)), rel=TOLERANCE)


@pytest.mark.sampled
@pytest.mark.parametrize("spread", [0.0, 1.0, 6.0, 12.0])
@pytest.mark.parametrize("order", ORDERS)
def test_inverse_agrees_with_fifty_digits_even_near_both_ends(order, spread, reference):
    rng = random.Random(order * 1000 + spread)
    curve = increasing_curve(rng, order, spread)
    truth, (low, high) = reference(curve), (curve.handles[0], curve.handles[-1])
    for share in (rng.random(), 1e-3, 1e-9, 1e-13, 1.0 - 1e-9, 1.0 - 1e-13):
        force = low + (high - low) * share
        x, status = curve.inverse(force)
        assert status is InverseStatus.OK
        assert x == pytest.approx(float(truth.inverse(force)), rel=TOLERANCE)


@pytest.mark.parametrize("order", ORDERS)
def test_a_range_that_ends_at_zero_volts_keeps_relative_accuracy_there(order, reference):
    curve = increasing_curve(random.Random(order), order, 1.0, x0=-3.0, x1=0.0)
    force = math.nextafter(curve.handles[-1], -math.inf)
    for _ in range(3):
        assert curve.inverse(force)[0] == pytest.approx(float(reference(curve).inverse(force)), rel=TOLERANCE)
        force -= 1e-9


@pytest.mark.sampled
@pytest.mark.parametrize("weight", [1e-12, 1e-6, 1e6, 1e12])
@pytest.mark.parametrize("order", [2, 3, 5, 15])
def test_weights_that_are_nearly_a_pole_or_nearly_absent_stay_exact(order, weight, reference):
    handles = [36.0 * i / order for i in range(order + 1)]
    weights = [weight if i == order // 2 + 1 else 1.0 for i in range(order + 1)]
    curve, force = RationalBezier(0.0, 8.0, handles, weights), 17.25
    truth = reference(curve)
    assert curve.value(3.1) == pytest.approx(float(truth.value(3.1)), rel=TOLERANCE)
    assert curve.inverse(force)[0] == pytest.approx(float(truth.inverse(force)), rel=TOLERANCE)


def test_a_denominator_that_nearly_vanishes_at_one_end_is_no_pole(reference):
    curve = RationalBezier(0.0, 8.0, (0.0, 10.0, 20.0, 40.0), (1e-9, 1e-7, 1.0, 2.0))
    for x in (1e-12, 1e-9, 1e-4, 0.3, 7.9):
        assert curve.value(x) == pytest.approx(float(reference(curve).value(x)), rel=TOLERANCE)
        force = curve.value(x)
        assert curve.inverse(force)[0] == pytest.approx(float(reference(curve).inverse(force)), rel=TOLERANCE)


@pytest.mark.parametrize("order", ORDERS)
def test_tiny_forces_and_tiny_ranges_are_not_special(order, reference):
    handles = [1e-200 * i for i in range(order + 1)]
    curve = RationalBezier(5.0, 5.0 + 1e-6, handles, [1.0 + 0.25 * (i % 3) for i in range(order + 1)])
    force = 0.3e-200 * order
    x = float(reference(curve).inverse(force))
    assert curve.inverse(force)[0] - 5.0 == pytest.approx(x - 5.0, abs=2e-15)
    assert curve.value(x) == pytest.approx(float(reference(curve).value(x)), rel=TOLERANCE)


@pytest.mark.parametrize("order", ORDERS)
def test_enormous_spreads_neither_overflow_nor_divide_by_zero(order):
    curve = RationalBezier(0.0, 8.0, range(order + 1), [1e-120 if i % 2 else 1e120 for i in range(order + 1)])
    for share in (1e-12, 0.2, 0.5, 0.9):
        x, status = curve.inverse(order * share)
        assert status is InverseStatus.OK and 0.0 <= x <= 8.0
        assert math.isfinite(curve.value(x)) and math.isfinite(curve.slope(x))


def test_increasing_curve_with_unsorted_handles_is_inverted_too(reference):
    curve = RationalBezier(0.0, 1.0, (0.0, 2.0, 1.9, 4.0), (1.0, 1.0, 1.0, 1.0))
    assert curve.is_increasing()
    for force in (0.1, 1.6, 1.95, 2.2, 3.99):
        assert curve.inverse(force)[0] == pytest.approx(float(reference(curve).inverse(force)), rel=TOLERANCE)


@pytest.mark.parametrize("order", [3, 7, 15])
def test_flat_ends_and_nearly_flat_middles_are_inverted(order, reference):
    flat_end = RationalBezier(0.0, 8.0, [0.0] * order + [30.0], [1.0] * (order + 1))
    for force in (1e-12, 1e-5, 29.0):
        assert flat_end.inverse(force)[0] == pytest.approx(float(reference(flat_end).inverse(force)), rel=TOLERANCE)
    dip = RationalBezier(0.0, 1.0, (0.0, 0.25, 0.0 + 1e-6, 0.25), (1.0,) * 4)
    x = float(reference(dip).inverse(0.125))
    assert dip.inverse(0.125)[0] == pytest.approx(x, rel=1e-9)  # slope 1e-6: the force's own rounding shows


def test_textbook_quadratic_would_divide_zero_by_zero_here():
    curve = RationalBezier(0.0, 10.0, (0.0, 18.0, 36.0), (1.0, 1.0, 1.0))
    assert curve.inverse(18.0) == (5.0, InverseStatus.OK)
    assert curve.inverse(9.0)[0] == pytest.approx(2.5, rel=1e-15)


@pytest.mark.parametrize("order", ORDERS)
def test_ends_are_exact_and_beyond_them_is_clamped_with_a_status(order):
    curve = increasing_curve(random.Random(7), order, 6.0, 0.5, 7.5)
    low, high = curve.handles[0], curve.handles[-1]
    assert curve.inverse(low) == (0.5, InverseStatus.OK)
    assert curve.inverse(high) == (7.5, InverseStatus.OK)
    assert curve.inverse(math.nextafter(low, -math.inf)) == (0.5, InverseStatus.LOW)
    assert curve.inverse(math.nextafter(high, math.inf)) == (7.5, InverseStatus.HIGH)
    assert (curve.inverse(-math.inf)[1], curve.inverse(math.inf)[1]) == (InverseStatus.LOW, InverseStatus.HIGH)
    assert (curve.value(0.5), curve.value(-9.0), curve.value(-math.inf)) == (low,) * 3
    assert (curve.value(7.5), curve.value(99.0), curve.value(math.inf)) == (high,) * 3
    assert curve.slope(-1.0) == curve.slope(0.5) and curve.slope(8.0) == curve.slope(7.5)


@pytest.mark.parametrize("order", ORDERS)
def test_inverse_of_nan_raises_and_value_of_nan_is_nan(order):
    curve = increasing_curve(random.Random(3), order, 1.0)
    with pytest.raises(ValueError, match="not a number"):
        curve.inverse(math.nan)
    assert math.isnan(curve.value(math.nan)) and math.isnan(curve.slope(math.nan))
    assert np.isnan(curve.value(np.array([math.nan, 1.0]))).tolist() == [True, False]


@pytest.mark.parametrize("order", ORDERS)
def test_an_array_gives_what_its_floats_give(order):
    curve = increasing_curve(random.Random(order), order, 3.0)
    x = np.array([[-1.0, 0.0, 1e-9, 0.1], [4.0, 7.99, 8.0, 9.0]])
    for of in (curve.value, curve.slope):
        result = of(x)
        assert result.shape == x.shape and result.dtype == np.float64
        assert result.ravel().tolist() == [of(float(each)) for each in x.ravel()]
    assert type(curve.value(1.0)) is float and type(curve.value(np.float32(1.0))) is float
    assert type(curve.value(2)) is float


@pytest.mark.parametrize(
    ("x0", "x1", "handles", "weights"),
    [
        (0.0, 8.0, (0.0, 1.0), (1.0, 0.0)),
        (0.0, 8.0, (0.0, 1.0), (1.0, -1.0)),
        (0.0, 8.0, (0.0, 1.0), (1.0, math.nan)),
        (0.0, 8.0, (0.0, 1.0), (math.inf, 1.0)),
        (0.0, 8.0, (0.0, math.nan), (1.0, 1.0)),
        (0.0, 8.0, (0.0, math.inf), (1.0, 1.0)),
        (math.nan, 8.0, (0.0, 1.0), (1.0, 1.0)),
        (0.0, math.inf, (0.0, 1.0), (1.0, 1.0)),
        (8.0, 8.0, (0.0, 1.0), (1.0, 1.0)),
        (8.0, 0.0, (0.0, 1.0), (1.0, 1.0)),
        (0.0, 8.0, (0.0,), (1.0,)),
        (0.0, 8.0, (), ()),
        (0.0, 8.0, range(17), (1.0,) * 17),
        (0.0, 8.0, (0.0, 1.0, 2.0), (1.0, 1.0)),
        (0.0, 8.0, (0.0, 1.0), (1e-300, 1e300)),
        (0.0, 8.0, (0.0, 1.6e308, 1.7e308), (1.0, 1.0, 1.0)),
    ],
)
def test_arguments_that_are_no_curve_are_refused(x0, x1, handles, weights):
    with pytest.raises(ValueError, match=r".+"):
        RationalBezier(x0, x1, handles, weights)


def test_a_common_scale_of_the_weights_is_free():
    handles, weights = (0.0, 10.0, 12.0, 36.0), (1.0, 0.3, 2.0, 5.0)
    small = RationalBezier(0.0, 8.0, handles, [w * 2.0**-40 for w in weights])
    plain = RationalBezier(0.0, 8.0, handles, weights)
    assert small.value(2.7) == plain.value(2.7) and small.inverse(11.0) == plain.inverse(11.0)


def test_equal_weights_are_the_polynomial():
    curve = RationalBezier(0.0, 1.0, (0.0, 0.0, 0.0, 1.0), (2.0,) * 4)
    assert curve.value(0.3) == pytest.approx(0.3**3, rel=1e-15)
    assert curve.slope(0.3) == pytest.approx(3 * 0.3**2, rel=1e-15)


def test_importing_the_model_brings_neither_numpy_nor_scipy():
    code = """
import sys, gateway.bsfm as b
c = b.RationalBezier(0, 8, (0, 18, 36, 40), (1, 2, 3, 4)); c.value(1.0); c.slope(1.0); c.inverse(2.0)
print(sorted({'numpy', 'scipy', 'time', 'asyncio'} & set(sys.modules) - {'time'}))
"""
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"
