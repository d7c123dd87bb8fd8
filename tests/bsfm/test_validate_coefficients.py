"""What may not drive a plant, and which number is to blame."""

import math
import struct
from dataclasses import replace

import pytest

from gateway.bsfm import (
    Branches,
    Bsfm,
    CoefficientLimits,
    CoefficientReason,
    Coefficients,
    LinearBlend,
    RationalBezier,
    validate_coefficients,
)
from gateway.bsfm.branches import Crossing
from gateway.bsfm.coefficients import float32
from gateway.bsfm.model import Response
from gateway.bsfm.slip.slip_stops import half_width_bound_v
from tests.calibrations.coefficients import calibration, swapped

LIMITS = CoefficientLimits(cell_range_n=98.0)
HANDLES, WEIGHTS = ("rising_handles_n", "falling_handles_n"), ("rising_weights", "falling_weights")
GOOD = Coefficients(0.0, 5.0, (0.5, 14.0, 38.0), (1.0, 0.93, 1.2), (0.5, 22.0, 38.0), (1.0, 1.1, 1.2), 3.0)


def bits(digits: str) -> float:
    return struct.unpack(">f", bytes.fromhex(digits))[0]


def branches(rising: tuple[float, ...], falling: tuple[float, ...]) -> Branches:
    return Branches(*(RationalBezier(0.0, 5.0, handles, (1.0,) * len(handles)) for handles in (rising, falling)))


def test_a_good_set_has_no_fault():
    over_all = replace(GOOD, x1_v=10.0)  # the whole range of a regulator, as most ladders have it
    assert validate_coefficients(over_all, LIMITS) == []
    assert validate_coefficients(GOOD, LIMITS) == []
    assert validate_coefficients(Coefficients.of(branches((0.0, 10.0, 20.0), (0.0, 12.0, 20.0))), LIMITS) == []


@pytest.mark.parametrize(
    ("change", "index", "reason"),
    [
        ({"rising_weights": (1.0, swapped(0.93), 1.2)}, 17, CoefficientReason.WORDS_SWAPPED),
        ({"falling_handles_n": (0.5, swapped(22.0), 38.0)}, 33, CoefficientReason.WORDS_SWAPPED),
        ({"falling_weights": (1.0, 1.1, -1.0)}, 50, CoefficientReason.WEIGHT_RANGE),
        ({"falling_weights": (1.0, 1.1, 1.1e3)}, 50, CoefficientReason.WEIGHT_RANGE),
        ({"rising_weights": (100.0, 0.01, 100.0)}, 17, CoefficientReason.WEIGHT_RANGE),
        ({"rising_handles_n": (0.5, 14.0, 98.1)}, 2, CoefficientReason.HANDLE_RANGE),
        ({"rising_handles_n": (-98.1, 14.0, 38.0)}, 0, CoefficientReason.HANDLE_RANGE),
        ({"rising_handles_n": (math.nan, 14.0, 38.0)}, 0, CoefficientReason.NOT_FINITE),
        ({"rising_handles_n": (0.5, 14.0, 1e39)}, 2, CoefficientReason.NOT_FINITE),
        ({"falling_handles_n": (0.5, 39.0, 38.0)}, 32, CoefficientReason.NOT_INCREASING),
        ({"rising_handles_n": (0.5, 0.6, 38.0)}, 0, CoefficientReason.SLOPE_FLOOR),
        ({"falling_handles_n": (0.5, 37.9, 38.0)}, 32, CoefficientReason.SLOPE_FLOOR),
        ({"rising_handles_n": (0.5, swapped(bits("41608001")), 38.0)}, 1, CoefficientReason.WORDS_SWAPPED),
        ({"x0_v": swapped(0.3)}, -1, CoefficientReason.WORDS_SWAPPED),
        ({"x1_v": swapped(8.0)}, -1, CoefficientReason.WORDS_SWAPPED),
        ({"blend_span_n": swapped(3.0)}, -1, CoefficientReason.WORDS_SWAPPED),
        ({"falling_handles_n": (0.5, 13.0, 38.0)}, -1, CoefficientReason.CROSSING),
        ({"x1_v": 10.5}, -1, CoefficientReason.VOLTAGE_RANGE),
        ({"x1_v": 1e-40}, -1, CoefficientReason.VOLTAGE_RANGE),
        ({"x0_v": 4.95}, -1, CoefficientReason.VOLTAGE_RANGE),
        ({"x0_v": math.nan}, -1, CoefficientReason.VOLTAGE_RANGE),
        ({"x0_v": -0.5}, -1, CoefficientReason.VOLTAGE_RANGE),
        ({"blend_span_n": math.nan}, -1, CoefficientReason.BLEND_SPAN),
        ({"rising_weights": (1.0, 1.0)}, -1, CoefficientReason.ORDER),
        (dict.fromkeys(HANDLES, (0.5,)) | dict.fromkeys(WEIGHTS, (1.0,)), -1, CoefficientReason.ORDER),
    ],
)
def test_the_faulty_number_is_named_with_its_reason(change, index, reason):
    faults = validate_coefficients(replace(GOOD, **change), LIMITS)
    assert [(fault.index, fault.reason) for fault in faults] == [(index, reason)]


def test_next_to_nothing_that_means_nothing_in_the_other_order_is_what_a_fit_has_left():
    """1e-30 N is no force, but it is in range: refused it would be told as such."""
    assert validate_coefficients(replace(GOOD, rising_handles_n=(bits("0da20001"), 14.0, 38.0)), LIMITS) == []
    assert validate_coefficients(replace(GOOD, rising_handles_n=(bits("8da20001"), 14.0, 38.0)), LIMITS) == []


@pytest.mark.parametrize(("weight", "faulty"), [(0.5, []), (0.5625, [17])])
def test_a_weight_counts_in_those_of_a_first_one_at_its_very_limit_too(weight, faulty):
    limits = replace(LIMITS, weight_min=0.25, weight_max=2.0)
    given = replace(GOOD, rising_weights=(0.25, weight, 0.375), falling_weights=(0.25, 0.5, 0.375))
    assert [fault.index for fault in validate_coefficients(given, limits)] == faulty


def test_the_text_says_what_a_swapped_weight_was_meant_to_be():
    faults = validate_coefficients(replace(GOOD, rising_weights=(1.0, swapped(0.93), 1.2)), LIMITS)
    assert "words swapped 0.93" in faults[0].text


def test_what_is_allowed_is_told_beside_what_its_words_may_have_meant():
    """A fit's handle beyond the cell's range was told as a sender's mistake alone: one in ten makes sense by chance."""
    limits = replace(LIMITS, cell_range_n=40.0)
    (fault,) = validate_coefficients(replace(GOOD, falling_handles_n=(0.0, 8.0, bits("423ab770"))), limits)
    assert fault.reason is CoefficientReason.WORDS_SWAPPED
    assert "falling handle 2 = 46.6791: -40 .. 40 is allowed; with its words swapped" in fault.text


def test_all_numbers_are_named_at_once():
    faults = validate_coefficients(replace(GOOD, rising_handles_n=(math.nan, 200.0, 38.0), x1_v=99.0), LIMITS)
    assert len(faults) == 3


def test_what_is_checked_is_what_float32_stores():
    barely = math.nextafter(20.0, 0.0)  # increasing in double, flat after rounding
    rising = (0.0, 10.0, barely, 20.0)
    limits = replace(LIMITS, slope_floor_n_per_v=0.0)
    double = branches(rising, rising)
    assert double.rising.is_increasing()
    stored = Coefficients.of(double).round_to_float32()
    assert stored.rising_handles_n == (0.0, 10.0, 20.0, 20.0)
    assert validate_coefficients(Coefficients.of(double), limits) == []  # still increasing inside: the end may be flat
    flat = branches((0.0, math.nextafter(0.0, 1.0)), (0.0, math.nextafter(0.0, 1.0)))
    assert flat.rising.is_increasing()
    assert {fault.reason for fault in validate_coefficients(Coefficients.of(flat), limits)} == {
        CoefficientReason.NOT_INCREASING
    }


def test_a_weight_limit_is_met_exactly():
    assert (
        validate_coefficients(
            replace(GOOD, x1_v=5.0), replace(LIMITS, weight_max=struct.unpack(">f", struct.pack(">f", 1.2))[0])
        )
        == []
    )


def test_a_missing_array_is_an_order_fault_and_nothing_crashes():
    faults = validate_coefficients(Coefficients(0.0, 5.0, (), (), (), ()), LIMITS)
    assert [fault.reason for fault in faults] == [CoefficientReason.ORDER]


def test_sixteen_handles_are_taken_and_seventeen_are_an_order_fault():
    for count, reasons in ((16, []), (17, [CoefficientReason.ORDER])):
        line = tuple(2.0 * place for place in range(count))
        weights = (1.0,) * count
        found = validate_coefficients(Coefficients(0.0, 5.0, line, weights, line, weights), LIMITS)
        assert [fault.reason for fault in found] == reasons


def test_a_calibration_is_checked_with_all_that_it_carries():
    stops = {"slip_radii_v": (0.5, 1.0), "slip_shares": (0.6, 0.4)}
    given = calibration(8, **stops, response=Response(dead_time_s=0.1, lag_s=0.2, second_lag_s=0.1, damping=0.3))
    taken = Coefficients.of_calibration(given)
    assert (taken.slip_radii_v, taken.slip_shares) == ((0.5, 1.0), (0.6, 0.4))
    assert taken.response == given.response
    stored = taken.round_to_float32().response
    assert stored is not None and taken.response is not None
    for name in ("dead_time_s", "lag_s", "second_lag_s", "damping"):
        assert getattr(stored, name) == struct.unpack(">f", struct.pack(">f", getattr(taken.response, name)))[0], name


@pytest.mark.parametrize(("share", "is_taken"), [(0.94, True), (0.96, False)])
def test_stops_are_not_much_stiffer_than_a_voltage_that_is_unique(share: float, is_taken: bool):
    """Right after a reversal the voltage would jump by more than twenty times its way."""
    loop = branches((0.0, 10.0, 20.0), (0.0, 12.0, 20.0))
    stiff = replace(Coefficients.of(loop), slip_radii_v=(half_width_bound_v(loop) / share,), slip_shares=(1.0,))
    faults = validate_coefficients(stiff, LIMITS)
    assert [fault.reason for fault in faults] == ([] if is_taken else [CoefficientReason.SLIP_STIFFNESS])


def test_the_forces_of_both_branches_are_those_at_their_shares():
    model = Bsfm(branches((0.0, 10.0, 20.0), (0.0, 12.0, 20.0)), LinearBlend(3.0))
    for voltage_v in (0.5, 2.5, 4.5):
        assert model.branch_forces_n(voltage_v) == (model.force_n(voltage_v, 1.0), model.force_n(voltage_v, -1.0))


def test_a_crossing_says_by_how_much_the_falling_branch_is_below() -> None:
    assert str(Crossing(1.5, -0.25)) == "the falling branch is 0.25 N below the rising one at 1.500 V"


@pytest.mark.parametrize(("slope_n_per_v", "is_taken"), [(0.45, False), (0.55, True)])
def test_the_floor_of_the_slope_is_per_volt_whatever_the_range(slope_n_per_v: float, is_taken: bool) -> None:
    line = RationalBezier(0.0, 8.0, (0.0, 8.0 * slope_n_per_v), (1.0, 1.0))
    reasons = [fault.reason for fault in validate_coefficients(Coefficients.of(Branches(line, line)), LIMITS)]
    assert reasons == [] if is_taken else set(reasons) == {CoefficientReason.SLOPE_FLOOR}
    assert line.minimum_slope() == pytest.approx(slope_n_per_v)


@pytest.mark.parametrize(("low_v", "high_v"), [(0.0, 5.0), (0.5, 6.0)])
def test_two_branches_are_over_the_same_voltages_or_none(low_v: float, high_v: float) -> None:
    falling = RationalBezier(0.0, 6.0, (0.0, 20.0), (1.0, 1.0))
    with pytest.raises(ValueError, match="same voltages"):
        Branches(RationalBezier(low_v, high_v, (0.0, 20.0), (1.0, 1.0)), falling)


def test_what_overflows_is_infinite_on_its_own_side() -> None:
    assert (float32(1.0e39), float32(-1.0e39)) == (math.inf, -math.inf)
