"""A run stays below the rig's largest contact force: what the cell feels, and what the payload's weight adds to it."""

import pytest

from gateway.control.runs.ladder_run import LadderRow
from gateway.control.runs.ladder_stairs import PlannedStair
from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.force_ceiling import ForceCeiling
from gateway.registers.words import CalibrationPhase
from tests.control.bench import bsfm

MOST_N = 50.0


def ceiling_at(cell_n: float, weight_n: float) -> ForceCeiling:
    """After a stair of 3 V that has settled as the calibration says."""
    ceiling = ForceCeiling(MOST_N, bsfm(), 0.0)
    for _ in range(3):
        ceiling.observe(Reading(cell_n=cell_n, contact_n=cell_n + weight_n, is_new=True, is_usable=True))
    ceiling.observe_row(LadderRow(PlannedStair(3.0, 1, 0, CalibrationPhase.LADDER), cell_n, 1.0, True))
    return ceiling


@pytest.mark.parametrize(("weight_n", "is_beyond"), [(0.0, False), (20.0, True), (-20.0, False)])
def test_a_stair_is_judged_with_the_payloads_weight(weight_n: float, is_beyond: bool) -> None:
    cell_n = bsfm().force_n(3.0, 1.0)
    assert 30.0 < bsfm().force_n(5.0, 1.0) < 45.0
    assert ceiling_at(cell_n, weight_n).is_beyond(5.0, 0.0) is is_beyond


@pytest.mark.parametrize(("weight_n", "is_reached"), [(0.0, False), (20.0, True)])
def test_the_force_of_now_is_judged_with_it_too(weight_n: float, is_reached: bool) -> None:
    assert ceiling_at(35.0, weight_n).is_reached(0.0) is is_reached
