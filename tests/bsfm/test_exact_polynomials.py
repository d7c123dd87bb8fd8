"""The exact tests: monotone, slope floor, crossing; where grids and rounding go wrong."""

import copy
import math
import pickle

import numpy as np
import pytest

from gateway.bsfm import Branches, RationalBezier
from gateway.bsfm.exact_polynomials import (
    place_negative,
    place_not_positive,
    product,
    raise_degree_by_two,
    whole_numbers,
)


def polynomial(handles: tuple[float, ...]) -> RationalBezier:
    return RationalBezier(0.0, 1.0, handles, (1.0,) * len(handles))


def test_doubles_become_whole_numbers_without_loss():
    values = (0.1, -3.0, 2.0**-1074, 1e300, 0.0)
    numbers, scale = whole_numbers(values)
    assert all(number / scale == value for number, value in zip(numbers, values, strict=True))


def test_zero_at_the_ends_is_positive_inside():
    assert place_not_positive([0, 1, 0]) is None
    assert place_not_positive([0, 0, 1]) is None


def test_zero_everywhere_and_touching_inside_are_not_positive():
    assert place_not_positive([0, 0, 0]) is not None
    assert place_not_positive([1, -2, 1]) == 0.5  # (1-2t)^2
    assert place_not_positive([4, -4, 1]) == pytest.approx(2 / 3)  # (2-3t)^2: no dyadic root, depth decides
    assert place_negative([4, -4, 1]) is None
    assert place_negative([0, 0, 0]) is None


def test_a_dip_narrower_than_any_grid_is_found():
    root = 1 / 3 + 1e-9
    numbers, scale = whole_numbers([root])
    r = numbers[0]
    dip = [r * r, -2 * r * (scale - r), (scale - r) ** 2]  # (t - root)^2 in scaled Bernstein form, times scale^2
    lowered = [c * 10**24 - scale**2 * w for c, w in zip(dip, (1, 2, 1), strict=True)]  # minus 1e-24
    assert place_negative(dip) is None
    assert place_negative(lowered) == pytest.approx(root, abs=1e-9)


def test_raising_the_degree_changes_nothing():
    assert raise_degree_by_two([3]) == [3, 6, 3] == product([1, 1], [3, 3])


@pytest.mark.parametrize(
    ("handles", "increasing"),
    [
        ((0.0, 1.0), True),
        ((1.0, 0.0), False),
        ((1.0, 1.0), False),
        ((0.0, 0.0, 1.0), True),  # zero slope at an end
        ((0.0, 1.0, 1.0), True),
        ((0.0, 2.0, 1.0), False),
        ((0.0, 2.0, 1.9, 4.0), True),  # unsorted, yet increasing
        ((0.0, 0.25, 0.0, 0.25), False),  # (t - 1/2)^3: the slope vanishes inside
        ((0.0, math.nextafter(0.25, 0), 0.0, 0.25), True),
        ((0.0, math.nextafter(0.25, 1), 0.0, 0.25), False),
    ],
)
def test_is_increasing_is_exact(handles, increasing):
    assert polynomial(handles).is_increasing() is increasing


def test_a_curve_that_is_not_increasing_has_values_but_no_inverse():
    curve = polynomial((0.0, 2.0, 1.0))
    assert curve.value(0.5) == 1.25
    for force in (0.5, 0.0, 1.0):
        with pytest.raises(ValueError, match="not increasing"):
            curve.inverse(force)


def test_products_that_underflow_a_double_keep_their_sign():
    weights = (1.0, 1e-160, 1e-160, 1e-160)
    assert RationalBezier(0.0, 1.0, (0.0, 1.0, 2.0, 3.0), weights).is_increasing()
    assert not RationalBezier(0.0, 1.0, (0.0, 1.0, 3.0, 2.0), weights).is_increasing()


@pytest.mark.parametrize(("x0", "x1"), [(0.0, 8.0), (0.25, 8.25), (1.125, 1.625)])
@pytest.mark.parametrize("order", [1, 2, 5, 15])
def test_slope_floor_is_exact_on_a_straight_line(order, x0, x1):
    """Over broken voltages as well: a flat branch that passed would amplify noise."""
    line = RationalBezier(x0, x1, [4.0 * i for i in range(order + 1)], (1.0,) * (order + 1))
    slope = 4.0 * order / (x1 - x0)
    assert line.slope_is_at_least(slope)
    assert not line.slope_is_at_least(math.nextafter(slope, math.inf))
    assert slope * (1 - 2e-8) <= line.minimum_slope() <= slope


@pytest.mark.parametrize("seed", range(6))
def test_minimum_slope_is_a_tight_lower_bound(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 7))
    curve = RationalBezier(0.0, 5.0, np.sort(rng.uniform(0, 40, n + 1)), np.exp(rng.uniform(-2, 2, n + 1)))
    dense = float(curve.slope(np.linspace(0.0, 5.0, 20001)).min())
    assert curve.minimum_slope() <= dense
    assert curve.minimum_slope() == pytest.approx(dense, abs=1e-4)
    assert curve.slope_is_at_least(curve.minimum_slope())


def test_minimum_slope_of_a_falling_curve_is_negative():
    curve = polynomial((0.0, 2.0, 1.0))
    assert curve.minimum_slope() == pytest.approx(-2.0, abs=1e-6)


def test_branches_that_share_ends_do_not_cross():
    rising, falling = polynomial((0.0, 1.0, 4.0)), polynomial((0.0, 2.0, 4.0))
    branches = Branches(rising, falling)
    assert branches.tied and branches.crossing_fault() is None
    crossing = Branches(falling, rising).crossing_fault()
    assert crossing is not None and crossing.gap_n == pytest.approx(-0.5)
    assert "0.5 N below" in str(crossing)


def test_a_loop_of_no_width_is_no_crossing_even_if_written_differently():
    low, high = polynomial((0.0, 2.0, 4.0)), RationalBezier(0.0, 1.0, (0.0, 4.0), (3.0, 3.0))
    assert Branches(low, high).crossing_fault() is None


def test_a_crossing_of_a_hair_is_found_and_a_hair_apart_is_not():
    rising = polynomial((0.0, 1.0, 2.0, 3.0))
    touching = polynomial((0.0, 1.0, 2.0, 3.0 + 1e-9))
    assert Branches(rising, touching).crossing_fault() is None
    assert Branches(touching, rising).crossing_fault() is not None
    s_shaped = polynomial((0.0, 1.0 + 1e-12, 2.0 - 1e-12, 3.0))
    assert Branches(rising, s_shaped).crossing_fault() is not None


def test_branches_over_different_voltages_are_refused():
    with pytest.raises(ValueError, match="same voltages"):
        Branches(polynomial((0.0, 1.0)), RationalBezier(0.0, 2.0, (0.0, 1.0), (1.0, 1.0)))


def test_branches_are_tied_where_they_share_both_of_their_ends():
    rising = polynomial((0.0, 1.0, 3.0))
    tied = [Branches(rising, polynomial((low, 2.0, high))).tied for low, high in ((0.0, 3.0), (0.0, 3.5), (0.5, 3.0))]
    assert tied == [True, False, False]


def test_a_range_that_no_double_holds_is_refused():
    with pytest.raises(ValueError, match="x0 < x1, both finite"):
        RationalBezier(-1.5e308, 1.5e308, (0.0, 1.0), (1.0, 1.0))


def test_curves_are_compared_hashed_copied_and_pickled_by_their_numbers():
    curve = RationalBezier(0.0, 8.0, (0.0, 18.0, 36.0), (1.0, 2.0, 3.0))
    for twin in (pickle.loads(pickle.dumps(curve)), copy.deepcopy(curve)):
        assert twin == curve and hash(twin) == hash(curve) and twin.inverse(12.0) == curve.inverse(12.0)
    assert curve != polynomial((0.0, 18.0, 36.0)) and curve != "curve"
    assert "handles=(0.0, 18.0, 36.0)" in repr(curve)
