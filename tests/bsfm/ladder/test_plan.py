"""The staircase and its data."""

import numpy as np
import pytest

from gateway.bsfm.fit.outliers import huber_weight, inlier_mask
from gateway.bsfm.ladder.measured_ladder import Ladder, ladder_plan


def test_the_papers_ladder_has_1010_points_in_ten_groups():
    plan = ladder_plan(5.0, 0.1, 10)
    assert len(plan) == 1010 and plan.group[-1] == 9
    assert plan.voltage_v[:2] == (0.0, 0.1) and plan.voltage_v[50:52] == (5.0, pytest.approx(4.9))
    assert plan.voltage_v[100] == 0.0
    assert plan.direction[:51] == (1,) * 51 and plan.direction[51:101] == (-1,) * 50


def test_up_and_down_visit_the_very_same_voltages():
    plan = ladder_plan(8.0, 0.3, 2)
    assert max(plan.voltage_v) == 8.0 and len(set(plan.voltage_v)) == 28


@pytest.mark.parametrize(
    "arguments", [(5.0, 0.0, 1), (5.0, -0.1, 1), (5.0, 6.0, 1), (5.0, 0.1, 0), (float("nan"), 0.1, 1)]
)
def test_what_is_no_ladder_is_refused(arguments):
    with pytest.raises(ValueError, match="no such ladder"):
        ladder_plan(*arguments)


@pytest.mark.parametrize(
    "change",
    [
        {"force_n": [1.0]},
        {"force_n": [1.0, float("nan")]},
        {"direction": [1, 0]},
        {"direction": [1, 0.5]},
        {"weight": [1.0, 0.0]},
        {"voltage_v": [], "force_n": [], "direction": [], "group": []},
    ],
)
def test_columns_that_are_no_ladder_are_refused(change):
    columns = {"voltage_v": [0.0, 1.0], "force_n": [0.0, 7.0], "direction": [1, -1], "group": [0, 0], "weight": None}
    with pytest.raises(ValueError, match="ladder"):
        Ladder(**{**columns, **change})


def test_rows_and_columns_are_the_same_ladder_and_cannot_be_changed():
    ladder = Ladder.from_rows([(0.0, 0.1, 1, 0), (1.0, 7.0, -1, 3)])
    assert ladder.groups == (0, 3) and len(ladder) == 2
    with pytest.raises(ValueError, match="read-only"):
        ladder.force_n[0] = 9.0


def test_planted_outliers_are_found_and_clean_data_keeps_all(loops):
    ladder = loops["smooth"](1)
    assert inlier_mask(ladder).all()
    force = np.array(ladder.force_n)
    force[[17, 500, 903]] += (3.0, -4.0, 9.0)
    spoiled = Ladder(ladder.voltage_v, force, ladder.direction, ladder.group)
    assert np.flatnonzero(~inlier_mask(spoiled)).tolist() == [17, 500, 903]


def test_coarse_counts_are_not_outliers_and_single_readings_are_kept(loops):
    ladder = loops["smooth"](2, noise_n=0.02)
    coarse = Ladder(ladder.voltage_v, np.round(ladder.force_n, 1), ladder.direction, ladder.group)
    assert inlier_mask(coarse).all()
    once = ladder.part(ladder.group == 0)
    assert inlier_mask(once).all()


def test_of_two_readings_that_differ_nobody_can_say_which_is_wrong(loops):
    """Both stay: their median is as far from the one as from the other."""
    twice = (ladder := loops["smooth"](2, noise_n=0.02)).part(ladder.group < 2)
    force = np.array(twice.force_n)
    force[17] += 3.0
    assert inlier_mask(Ladder(twice.voltage_v, force, twice.direction, twice.group)).all()


def test_huber_plays_down_what_is_far():
    weights = huber_weight(np.array([0.1, -0.1, 0.12, -0.08, 10.0]))
    assert weights[:2].tolist() == [1.0, 1.0] and 0.0 < weights[4] < 0.1
    even = np.linspace(-1.0, 1.0, 1001)  # a robust standard deviation of 0.74
    assert np.flatnonzero(huber_weight(even) == 1.0).tolist() == np.flatnonzero(np.abs(even) < 0.997).tolist()
