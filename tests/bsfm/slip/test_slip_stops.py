"""Slip stops as values: what is refused, what a calibration carries, and what one movement costs."""

from dataclasses import replace
from math import inf, nan

import pytest

from gateway.bsfm import Branches, Bsfm, LinearBlend, RationalBezier, SlipStops
from gateway.bsfm.c_export.code import c_source
from gateway.bsfm.slip.slip_stops import half_width_bound_v, middle_and_half
from gateway.profiles import load_calibration

RISING = RationalBezier(0.0, 5.0, (0.5, 14.0, 38.0), (1.0, 0.9, 1.2))
FALLING = RationalBezier(0.0, 5.0, (0.5, 24.0, 42.0), (1.0, 1.1, 1.2))
BRANCHES = Branches(RISING, FALLING)


@pytest.mark.parametrize(
    ("radii", "shares", "text"),
    [
        ((), (), "0 radii"),
        ((1.0,), (0.5, 0.5), "1 radii and 2 shares"),
        ((0.5, 0.5), (0.5, 0.5), "ascending"),
        ((0.0, 1.0), (0.5, 0.5), "positive"),
        ((1.0, inf), (0.5, 0.5), "ascending"),
        ((1.0, nan), (0.5, 0.5), "ascending"),
        ((1.0, 2.0), (0.5, 0.6), "sum of 1"),
        ((1.0, 2.0), (-0.5, 1.5), "0 or more"),
        ((1.0, 2.0), (nan, 1.0), "0 or more"),
        (tuple(range(1, 18)), (1 / 17,) * 17, "1 to 16"),
    ],
)
def test_what_are_no_stops_is_refused(radii, shares, text):
    with pytest.raises(ValueError, match=text):
        SlipStops(radii, shares)


def test_stops_too_stiff_for_the_loop_make_no_model():
    widest_v = half_width_bound_v(BRANCHES)
    Bsfm(BRANCHES, SlipStops((1.1 * widest_v,), (1.0,)))
    with pytest.raises(ValueError, match="give way over"):
        Bsfm(BRANCHES, SlipStops((0.9 * widest_v,), (1.0,)))


def test_the_bound_of_the_width_is_one_and_close():
    widths = [middle_and_half(BRANCHES, 0.5 + 41.5 * k / 3000)[1] for k in range(3001)]
    assert max(widths) <= half_width_bound_v(BRANCHES) <= 1.06 * max(widths)


@pytest.mark.parametrize("bad", [nan, inf])
def test_a_voltage_change_or_a_force_that_is_no_number_is_refused(bad):
    stops = SlipStops((1.0,), (1.0,))
    with pytest.raises(ValueError, match="finite"):
        stops.advance(stops.start(), bad)
    with pytest.raises(ValueError, match="not a number"):
        stops.memory_after(BRANCHES, stops.start(), 1.0, nan)


def test_the_shipped_calibration_has_stops_and_its_c_code_too_and_keeps_a_blend_beside_them():
    calibration = load_calibration("demo")
    assert calibration.model().reversal == SlipStops(calibration.slip_radii_v, calibration.slip_shares)
    plain = replace(calibration, slip_radii_v=(), slip_shares=())
    assert plain.model().reversal == LinearBlend(calibration.blend_span_n)
    code, plain_code = (c_source(each)["bsfm_demo.c"] for each in (calibration, plain))
    assert "enum { STOPS = 7 };" in code and "BLEND_SPAN_N" not in code
    assert "BLEND_SPAN_N = 14.0f;" in plain_code and "STOPS" not in plain_code


@pytest.mark.parametrize("fields", [{"slip_radii_v": (0.5, 1.0)}, {"slip_shares": (1.0,)}])
def test_half_a_set_of_stops_is_refused_not_taken_for_a_blend(fields):
    with pytest.raises(ValueError, match="radii and"):
        replace(load_calibration("demo"), **{"slip_radii_v": (), "slip_shares": (), **fields}).model()


def test_after_a_reversal_the_stops_give_way_one_by_one():
    model = Bsfm(BRANCHES, SlipStops((0.5, 1.5), (0.5, 0.5)))
    memory = model.memory_after(model.reversal.start(), 1.0, 37.0)
    assert memory == (1.0, 1.0)
    memory = model.memory_after(memory, 37.0, 29.0)
    assert memory[0] == -1.0 < memory[1] < 1.0
    memory = model.memory_after(memory, 29.0, 1.0)
    assert memory == (-1.0, -1.0)


def test_shares_of_decimal_digits_take_no_branch_beyond_itself() -> None:
    stops = SlipStops((1.0, 2.0), (0.5, 0.5000005))
    assert stops.branch_share(stops.at(1)) == 1.0 and stops.branch_share(stops.at(-1)) == -1.0


@pytest.mark.parametrize(("stiffness", "is_taken"), [(0.94, True), (0.96, False)])
def test_stops_that_leave_the_voltage_open_right_after_a_reversal_are_refused(stiffness: float, is_taken: bool) -> None:
    """At 1 it is any voltage; from 0.95 on it moves more than twenty times as far as on a branch."""
    rising, falling = (RationalBezier(0.0, 10.0, [0.0, middle_n, 40.0], [1.0, 1.0, 1.0]) for middle_n in (15.0, 25.0))
    branches = Branches(rising, falling)
    stops = SlipStops((half_width_bound_v(branches) / stiffness,), (1.0,))
    if is_taken:
        stops.check(branches)
    else:
        with pytest.raises(ValueError, match="is needed"):
            stops.check(branches)
