"""DriveMap volts: a map and its exact inverse, the bow of a bent command map, and never flatter than is believed."""

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


@pytest.mark.parametrize("bow", [-0.3, 0.0, 0.2])
def test_it_increases_and_leads_back_to_the_volts_beyond_the_range_as_well(bow):
    scale = DriveMap(model(bow))
    straight_v = np.array([scale.linear_v(volts) for volts in VOLTS.tolist()])
    slopes = np.diff(straight_v) / np.diff(VOLTS)
    assert slopes.min() >= FLATTEST - 1.0e-9
    assert slopes.max() <= STEEPEST + 1.0e-9
    assert [scale.volts(volts) for volts in straight_v.tolist()] == pytest.approx(VOLTS.tolist(), abs=1.0e-9)


def test_a_bent_map_becomes_a_straight_one_where_its_bow_is_believed():
    bent = model(0.08)
    scale = DriveMap(bent)
    volts = np.linspace(1.0, 7.0, 25)
    thrust_n = np.array([bent.force_n(at, 0.0) for at in volts.tolist()])
    straight_v = np.array([scale.linear_v(at) for at in volts.tolist()])
    assert np.abs(np.polyval(np.polyfit(straight_v, thrust_n, 1), straight_v) - thrust_n).max() < 0.25
    assert np.abs(np.polyval(np.polyfit(volts, thrust_n, 1), volts) - thrust_n).max() > 0.4


@pytest.mark.parametrize("bow", [0.05, 0.2])
def test_a_map_that_flattens_goes_on_as_flat_beyond_its_range(bow):
    """A push to 8.5 V on a model that ends at 6 V was reckoned 3 N too strong, and the force came short of its wish."""
    scale = DriveMap(model(bow))
    within, beyond = (scale.linear_v(at + 0.2) - scale.linear_v(at) for at in (7.8, 9.0))
    assert beyond == pytest.approx(within)
    assert beyond < 0.19


def test_a_map_that_steepens_goes_on_with_its_mean_slope():
    scale = DriveMap(model(-0.1))
    assert scale.linear_v(9.2) - scale.linear_v(9.0) == pytest.approx(0.2)


def test_without_a_model_volts_stay_what_they_are():
    assert [DriveMap().linear_v(volts) for volts in (-1.0, 0.0, 3.7, 9.0)] == [-1.0, 0.0, 3.7, 9.0]


def test_one_order_more_is_the_same_curve():
    curve = RationalBezier(0.0, 5.0, (0.8, 17.0, 39.0), (1.0, 0.3, 2.0))
    volts = np.linspace(0.0, 5.0, 51)
    assert elevate_order(curve).order == 3
    assert np.abs(elevate_order(curve).value(volts) - curve.value(volts)).max() < 1.0e-9
