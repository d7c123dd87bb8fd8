"""DriveMap volts: a map and its exact inverse, the bow of a bent command map, and never flatter than is believed."""

from math import comb

import numpy as np
import pytest

from gateway.bsfm import Branches, Bsfm, LinearBlend, RationalBezier
from gateway.bsfm.curve import elevate_order
from gateway.bsfm.drive_map import FLATTEST, STEEPEST, DriveMap

VOLTS = np.linspace(-1.0, 11.0, 241)


def model(bow: float) -> Bsfm:
    """0..8 V, the middle a parabola with this bow of its handles."""
    middle_n = 24.0 * (1.0 + bow)
    rising = RationalBezier(0.0, 8.0, (1.0, middle_n, 46.0), (1.0, 1.0, 1.0))
    falling = RationalBezier(0.0, 8.0, (1.0, middle_n + 4.0, 50.0), (1.0, 1.0, 1.0))
    return Bsfm(Branches(rising, falling), LinearBlend(6.0))


def rubbing(thrust_n: "np.ndarray[tuple[int], np.dtype[np.float64]]", friction_n: float = 3.0) -> Bsfm:
    """0..8 V, thrust at four even places; friction has developed on the falling branch below and on the rising one above: the
    loop closes at both ends, as a ladder shows it."""
    place = np.linspace(0.0, 1.0, 4)
    falling_n = thrust_n + friction_n * (1.0 - place**3)
    rising_n = thrust_n + friction_n * (2.0 * (1.0 - place) ** 3 - 1.0)
    return Bsfm(Branches(through(rising_n), through(falling_n)), LinearBlend(6.0))


def through(force_n: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> RationalBezier:
    """The cubic through four even places of 0..8 V."""
    place = np.linspace(0.0, 1.0, 4)
    bernstein = np.array([comb(3, k) * place**k * (1.0 - place) ** (3 - k) for k in range(4)]).T
    handles = np.linalg.solve(bernstein, force_n)
    return RationalBezier(0.0, 8.0, tuple(handles.tolist()), (1.0,) * 4)


DEAD_START_N = np.array([0.0, 13.0, 33.0, 55.0])  # little below, as a valve that opens late
FLATTENING_N = np.array([0.0, 20.5, 39.0, 55.0])


@pytest.mark.parametrize("bow", [-0.9, -0.3, 0.0, 0.2, 0.9])
def test_it_increases_and_leads_back_to_the_volts_beyond_the_range_as_well(bow):
    scale = DriveMap(model(bow))
    straight_v = np.array([scale.linear_v(volts) for volts in VOLTS.tolist()])
    slopes = np.diff(straight_v) / np.diff(VOLTS)
    assert slopes.min() >= FLATTEST - 1.0e-9
    assert slopes.max() <= STEEPEST + 1.0e-9
    assert [scale.volts(volts) for volts in straight_v.tolist()] == pytest.approx(VOLTS.tolist(), abs=1.0e-9)


@pytest.mark.parametrize("thrust_n", [DEAD_START_N, FLATTENING_N])
@pytest.mark.parametrize("to_v", [0.0, 8.5])
def test_a_push_along_the_range_is_as_strong_as_the_thrust_makes_it(thrust_n, to_v):
    """Friction is in the branches, and not in the thrust: the middle between them was 12 % off on a way down to 0 V."""
    scale, thrust = DriveMap(rubbing(thrust_n)), through(thrust_n)
    beyond_n = 0.5 * thrust.slope(8.0) if to_v > 8.0 else 0.0
    for from_v in (3.0, 4.0, 5.0):
        real_n = thrust.value(min(to_v, 8.0)) + beyond_n - thrust.value(from_v)
        reckoned_n = scale.n_per_v * (scale.linear_v(to_v) - scale.linear_v(from_v))
        assert reckoned_n == pytest.approx(real_n, rel=0.1)


@pytest.mark.parametrize("bow", [-0.1, 0.05, 0.2])
def test_beyond_its_last_quarter_it_goes_on_as_steep_as_there(bow):
    """A push to 8.5 V on a model that ends at 6 V was reckoned 3 N too strong, and the force came short of its wish."""
    scale = DriveMap(model(bow))
    within, end, beyond = (scale.linear_v(at + 0.2) - scale.linear_v(at) for at in (6.1, 7.8, 9.0))
    assert within == pytest.approx(end)
    assert beyond == pytest.approx(end)
    assert beyond < (0.2 if bow < 0.0 else 0.19)


def test_without_a_model_volts_stay_what_they_are():
    assert [DriveMap().linear_v(volts) for volts in (-1.0, 0.0, 3.7, 9.0)] == [-1.0, 0.0, 3.7, 9.0]


def test_one_order_more_is_the_same_curve():
    curve = RationalBezier(0.0, 5.0, (0.8, 17.0, 39.0), (1.0, 0.3, 2.0))
    volts = np.linspace(0.0, 5.0, 51)
    assert elevate_order(curve).order == 3
    assert np.abs(elevate_order(curve).value(volts) - curve.value(volts)).max() < 1.0e-9


def test_it_begins_at_the_ranges_first_volt_and_below_that_volts_stay_what_they_are():
    falling = rising = RationalBezier(1.0, 8.0, (1.0, 5.0, 46.0), (1.0, 1.0, 1.0))
    scale = DriveMap(Bsfm(Branches(rising, falling), LinearBlend(6.0)))
    assert [scale.linear_v(volts) for volts in (0.0, 0.5, 1.0)] == pytest.approx([0.0, 0.5, 1.0])
    assert scale.linear_v(1.5) - scale.linear_v(1.0) == pytest.approx(0.5 * FLATTEST), "a valve's dead start"
