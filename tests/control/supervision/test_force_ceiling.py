"""A run stays below the rig's largest contact force: what the cell feels, and what the payload's weight adds to it."""

from math import nan

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


def test_behind_a_way_down_a_stair_is_judged_by_those_of_its_own_way_up() -> None:
    cell_n = bsfm().force_n(3.0, 1.0)
    ceiling = ceiling_at(cell_n, 20.0)
    for direction in (-1, 1):
        ceiling.observe_row(LadderRow(PlannedStair(3.0, direction, 0, CalibrationPhase.LADDER), cell_n, 1.0, True))
    assert ceiling.is_beyond(5.0, 0.0)


def test_a_partial_reversal_is_no_top_of_the_ladder() -> None:
    """Friction may have kept more there, and stairs that this rig may take were left out."""
    ceiling = ceiling_at(bsfm().force_n(3.0, 1.0), 0.0)
    for volts, direction, force_n in (
        (5.0, 1, bsfm().force_n(5.0, 1.0)),
        (3.0, -1, 20.0),
        (5.0, 1, 49.0),
        (3.0, -1, 20.0),
    ):
        phase = CalibrationPhase.MINOR_LOOPS if force_n in (20.0, 49.0) else CalibrationPhase.LADDER
        ceiling.observe_row(LadderRow(PlannedStair(volts, direction, 0, phase), force_n, 1.0, True))
    assert not ceiling.is_beyond(5.5, 0.0)


@pytest.mark.parametrize(("lately_n", "is_beyond"), [((19.0, 26.0), False), ((30.0, 44.0), True)])
def test_a_machine_that_has_become_stronger_is_judged_by_its_last_stairs(
    lately_n: tuple[float, float], is_beyond: bool
) -> None:
    ceiling = ForceCeiling(MOST_N, bsfm(), 0.0)
    for volts, direction, cell_n in (
        (3.0, 1, 19.0),
        (5.0, 1, 33.0),
        (3.0, -1, 20.0),
        *((volts, 1, cell_n) for volts, cell_n in zip((3.0, 4.0), lately_n, strict=True)),
    ):
        ceiling.observe_row(LadderRow(PlannedStair(volts, direction, 0, CalibrationPhase.LADDER), cell_n, 1.0, True))
    assert ceiling.is_beyond(5.0, 0.0) is is_beyond


@pytest.mark.parametrize(("weight_n", "is_reached"), [(0.0, False), (20.0, True)])
def test_the_force_of_now_is_judged_with_it_too(weight_n: float, is_reached: bool) -> None:
    assert ceiling_at(35.0, weight_n).is_reached(0.0) is is_reached


def reading(contact_n: float, *, is_usable: bool = True) -> Reading:
    return Reading(cell_n=contact_n, contact_n=contact_n, is_new=True, is_usable=is_usable)


@pytest.mark.parametrize("before_n", [35.0, 48.0])
def test_one_spike_is_not_the_force_of_now(before_n: float) -> None:
    ceiling = ceiling_at(before_n, 0.0)
    ceiling.observe(reading(MOST_N + 10.0))
    assert not ceiling.is_reached(0.0)
    ceiling.observe(reading(MOST_N + 10.0))
    ceiling.observe(reading(MOST_N + 10.0))
    assert ceiling.is_reached(0.0)


def test_what_the_cell_could_not_measure_is_no_force() -> None:
    ceiling = ceiling_at(MOST_N, 0.0)
    ceiling.observe(reading(nan, is_usable=False))
    assert ceiling.is_reached(0.0)
    for _ in range(2):
        ceiling.observe(reading(MOST_N))
        assert ceiling.is_reached(0.0)


@pytest.mark.parametrize(("noise_n", "is_reached"), [(0.0, False), (0.2, False), (0.5, True)])
def test_a_cell_with_noise_needs_more_room_below_the_largest_force(noise_n: float, is_reached: bool) -> None:
    """Else single readings would pass it: three sigma of 0.5 N are 1.5 N."""
    ceiling = ceiling_at(MOST_N - 1.0, 0.0)
    assert ceiling.is_reached(noise_n) is is_reached
    assert ceiling.is_beyond(3.0, noise_n) is False, "a stair that stands there is no higher one"


def test_a_stair_on_the_way_down_says_nothing_of_how_the_force_rises() -> None:
    """It presses with what friction has kept: from there to the next stair the force seems to rise by little."""
    model, ceiling = bsfm(), ForceCeiling(MOST_N, bsfm(), 0.0)
    for voltage_v, way in ((2.0, -1), (3.0, 1)):
        force_n = 2.0 * model.force_n(voltage_v, float(way))  # of a machine twice as strong as it was calibrated
        ceiling.observe_row(LadderRow(PlannedStair(voltage_v, way, 0, CalibrationPhase.LADDER), force_n, 1.0, True))
    assert 2.0 * model.force_n(4.0, 1.0) > MOST_N
    assert ceiling.is_beyond(4.0, 0.0)


@pytest.mark.parametrize("top_v", [4.0, 4.07])
def test_the_top_is_what_the_machine_has_given_there_last(top_v: float) -> None:
    """It has become stronger since its first way up, and nothing but the top tells how high the next one goes."""
    low_n, top_n = model_n(2.0), 1.3 * model_n(top_v)
    expected_n = top_n + (top_n - low_n) * (model_n(5.0) - model_n(top_v)) / (model_n(top_v) - low_n)
    for room_n, is_beyond in ((0.35, True), (0.45, False)):
        ceiling = ForceCeiling(expected_n + room_n, bsfm(), 0.0)
        for volts, way, force_n in (
            (2.0, 1, low_n),
            (4.0, 1, model_n(4.0)),
            (1.0, -1, 5.0),
            (top_v, 1, top_n),
            (1.0, -1, 5.0),
        ):
            ceiling.observe_row(LadderRow(PlannedStair(volts, way, 0, CalibrationPhase.LADDER), force_n, 1.0, True))
        assert ceiling.is_beyond(5.0, 0.0) is is_beyond


def model_n(voltage_v: float) -> float:
    return bsfm().force_n(voltage_v, 1.0)


@pytest.mark.parametrize(
    ("rows", "next_v", "expected_n"),
    [
        ([(3.0, 2.0 * model_n(3.0))], 4.0, 2.0 * model_n(4.0)),
        ([(2.0, 2.0 * model_n(2.0)), (3.0, 2.0 * model_n(3.0))], 4.0, 2.0 * model_n(4.0)),
        ([(2.0, 8.0), (3.0, 8.0 + model_n(3.0) - model_n(2.0))], 4.0, 8.0 + model_n(4.0) - model_n(2.0)),
        ([(2.0, 30.0), (3.0, 25.0)], 4.0, 25.0),  # what has fallen does not go on falling
        ([(3.0, 30.0), (3.0, 31.0)], 4.0, 31.0),  # nothing to tell the slope by
        ([(3.0, 30.0)], 3.0, 0.0),
        ([(3.0, 30.0)], 2.0, 0.0),
        ([], 4.0, 0.0),
    ],
)
def test_the_force_of_a_higher_stair_goes_on_as_it_rose_in_the_shape_of_the_calibration(
    rows: list[tuple[float, float]], next_v: float, expected_n: float
) -> None:
    for room_n, is_beyond in ((0.35, True), (0.45, False)):
        ceiling = ForceCeiling(expected_n + room_n, bsfm(), 0.0)
        for voltage_v, force_n in rows:
            ceiling.observe_row(LadderRow(PlannedStair(voltage_v, 1, 0, CalibrationPhase.LADDER), force_n, 1.0, True))
        assert ceiling.is_beyond(next_v, 0.0) is is_beyond


@pytest.mark.parametrize(
    ("noise_n", "below_n", "is_reached"), [(0.0, 0.39, True), (0.0, 0.41, False), (0.4, 1.19, True), (0.4, 1.21, False)]
)
def test_the_room_below_the_largest_force_is_three_sigma_and_four_counts_at_least(
    noise_n: float, below_n: float, is_reached: bool
) -> None:
    assert ceiling_at(MOST_N - below_n, 0.0).is_reached(noise_n) is is_reached


def test_the_first_rise_counts_from_the_force_at_rest() -> None:
    """A rig that presses at its safe voltage, or whose cell has not been tared, seemed ten times as strong."""
    rest_n = model_n(1.0)
    for stronger, is_beyond in ((1.0, False), (3.0, True)):
        ceiling = ForceCeiling(MOST_N, bsfm(), 1.0)
        force_n = rest_n + stronger * (model_n(1.2) - rest_n)
        stair = PlannedStair(1.2, 1, 0, CalibrationPhase.CHECK)
        ceiling.observe_row(LadderRow(stair, force_n, 1.0, True, rest_n))
        assert ceiling.is_beyond(4.0, 0.0) is is_beyond


@pytest.mark.parametrize(
    ("noise_n", "beyond_n", "is_passed"), [(0.0, 0.39, False), (0.0, 0.41, True), (0.4, 1.19, False)]
)
def test_beyond_the_largest_force_is_what_no_noise_explains(noise_n: float, beyond_n: float, is_passed: bool) -> None:
    assert ceiling_at(MOST_N + beyond_n, 0.0).is_passed(noise_n) is is_passed
    assert not ForceCeiling(MOST_N, bsfm(), 0.0).is_passed(noise_n), "nothing is measured yet"
