"""What the labels of our own recordings say: which groups are whole, and where the walk of partial reversals begins."""

import numpy as np
import pytest

from gateway.bsfm.ladder.labels import DONE, NO_GROUP, WALK, Labels, split_by_labels
from gateway.bsfm.ladder.plan import RESPONSE_GROUP
from gateway.bsfm.ladder.settled_points import Points

LADDER = 3
FIRST, SECOND = ([(LADDER, group)] * 4 for group in (0, 1))
STEPS, TURNS, END = [(WALK, RESPONSE_GROUP)] * 2, [(WALK, NO_GROUP)] * 3, [(DONE, NO_GROUP)]


def labels_of(*stairs: tuple[int, int]) -> Labels:
    """One row to a stair, in order."""
    phase, group = np.array(stairs).T
    return Labels(phase, group, np.arange(len(stairs)))


def points_of(labels: Labels) -> Points:
    """A voltage of its own for each stair, and as many newtons."""
    stairs = labels.stair.astype(float)
    return Points(stairs, 10.0 * stairs, labels.stair, np.zeros(len(stairs)), 0.1)


@pytest.mark.parametrize(("behind", "whole", "cut"), [([], [0], [1]), (TURNS[:1], [0, 1], []), (END, [0, 1], [])])
def test_a_group_is_whole_once_its_last_stair_was_left(behind: list[tuple[int, int]], whole: list[int], cut: list[int]):
    """A recording that ends on a stair has not seen it settle."""
    labels = labels_of(*FIRST, *SECOND, *behind)
    assert (labels.whole_groups, labels.cut_groups) == (whole, cut)


def test_a_group_of_which_a_stair_is_missing_is_none() -> None:
    labels = labels_of(*FIRST, *SECOND, *END)
    assert labels.part(labels.stair != 2).whole_groups == [1]


def test_the_walk_begins_at_the_point_before_it_and_the_steps_for_the_response_are_not_of_it() -> None:
    labels = labels_of(*FIRST, *TURNS, *STEPS, *END)
    split = split_by_labels(points_of(labels), labels, by_check=False)
    assert split.minor_v.tolist() == [3.0, 4.0, 5.0, 6.0], "3: where the ladder has ended"
    assert split.minor_n.tolist() == [30.0, 40.0, 50.0, 60.0]
    assert split.ladder is not None and split.ladder.voltage_v.tolist() == [0.0, 1.0, 2.0, 3.0]
    assert split.left_out == ()


def test_a_walk_that_was_cut_is_left_out_and_that_is_said() -> None:
    labels = labels_of(*FIRST, *TURNS)
    split = split_by_labels(points_of(labels), labels, by_check=False)
    assert split.minor_v.tolist() == [] and split.left_out == ("the reversal part was cut: left out",)
