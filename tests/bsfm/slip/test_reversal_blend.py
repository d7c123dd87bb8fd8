"""Reversals: the play operator, and the two-branch model that uses them."""

import math

import pytest

from gateway.bsfm import Branches, Bsfm, Calibration, InverseStatus, LinearBlend, RationalBezier

RISING = RationalBezier(0.0, 5.0, (0.5, 14.0, 38.0), (1.0, 0.9, 1.2))
FALLING = RationalBezier(0.0, 5.0, (0.5, 22.0, 38.0), (1.0, 1.1, 1.2))


@pytest.fixture
def model() -> Bsfm:
    return Bsfm(Branches(RISING, FALLING), LinearBlend(3.0))


def test_a_whole_span_leads_from_one_branch_to_the_other_and_no_further():
    blend = LinearBlend(4.0)
    assert blend.advance(-1.0, 2.0) == 0.0
    assert blend.advance(0.0, 2.0) == 1.0
    assert blend.advance(1.0, 50.0) == 1.0
    assert blend.advance(1.0, -4.0) == -1.0


def test_span_zero_switches_as_the_paper_does_and_no_movement_keeps_the_branch():
    blend = LinearBlend(0.0)
    assert blend.advance(1.0, -1e-300) == -1.0
    assert blend.advance(-1.0, 0.0) == -1.0


def test_a_tiny_span_does_not_overflow():
    assert LinearBlend(5e-324).advance(0.0, -1e300) == -1.0


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_what_is_not_finite_is_refused_instead_of_clipped(bad):
    with pytest.raises(ValueError, match="not finite"):
        LinearBlend(3.0).advance(0.0, bad)
    with pytest.raises(ValueError, match="not finite"):
        LinearBlend(3.0).advance(bad, 0.0)
    with pytest.raises(ValueError, match="0 or more"):
        LinearBlend(bad)
    with pytest.raises(ValueError, match="0 or more"):
        LinearBlend(-1.0)


def test_at_the_two_ends_of_the_blend_the_model_is_one_branch(model):
    assert model.voltage_v(12.0, 1.0) == RISING.inverse(12.0)
    assert model.voltage_v(12.0, -1.0) == FALLING.inverse(12.0)
    assert model.force_n(2.0, 1.0) == RISING.value(2.0) and model.force_n(2.0, -1.0) == FALLING.value(2.0)


def test_halfway_the_voltage_is_halfway(model):
    halves = RISING.inverse(12.0)[0] / 2 + FALLING.inverse(12.0)[0] / 2
    assert model.voltage_v(12.0, 0.0)[0] == pytest.approx(halves, rel=1e-15)


@pytest.mark.parametrize("share", [-1.0, -0.3, 1.0])
def test_beyond_the_range_the_model_holds_the_end_and_says_so(model, share):
    assert model.voltage_v(0.4, share) == (0.0, InverseStatus.LOW)
    assert model.voltage_v(38.1, share) == (5.0, InverseStatus.HIGH)
    assert model.voltage_v(38.0, share)[1] is InverseStatus.OK
    assert (model.force_range_n, model.voltage_range_v) == ((0.5, 38.0), (0.0, 5.0))


def test_a_branch_that_is_clamped_alone_is_reported_only_when_it_takes_part():
    free = RationalBezier(0.0, 5.0, (2.0, 20.0, 40.0), (1.0, 1.0, 1.0))
    model = Bsfm(Branches(RISING, free), LinearBlend(3.0))
    assert model.force_range_n == (2.0, 38.0)
    assert model.voltage_v(1.0, 1.0)[1] is InverseStatus.OK
    assert model.voltage_v(1.0, 0.0)[1] is InverseStatus.LOW
    assert model.voltage_v(39.0, -1.0)[1] is InverseStatus.OK
    assert model.voltage_v(39.0, 0.5)[1] is InverseStatus.HIGH


def test_nan_and_states_outside_the_blend_are_refused(model):
    for share in (-1.0, 0.0, 1.0):
        with pytest.raises(ValueError, match="not a number"):
            model.voltage_v(math.nan, share)
    for share in (1.01, math.nan):
        with pytest.raises(ValueError, match="branch share"):
            model.voltage_v(12.0, share)
        with pytest.raises(ValueError, match="branch share"):
            model.force_n(2.0, share)


def test_branches_without_an_inverse_make_no_model():
    dip = RationalBezier(0.0, 5.0, (0.0, 50.0, 38.0), (1.0, 1.0, 1.0))
    with pytest.raises(ValueError, match="must increase"):
        Bsfm(Branches(RISING, dip), LinearBlend(3.0))


def calibration(**changes: object) -> Calibration:
    facts = {
        "number": 16, "name": "demo", "order": 2, "x0_v": 0.0, "x1_v": 5.0, "blend_span_n": 3.0, "rms_n": 0.15, "max_n": 0.6,
        "rising_handles_n": RISING.handles, "rising_weights": RISING.weights,
        "falling_handles_n": FALLING.handles, "falling_weights": FALLING.weights,
        "date_utc": "2024-01-01T00:00:00Z", "source": "ladder", "rig": "demo", "data_sha256": "00",
    }  # fmt: skip
    return Calibration(**{**facts, **changes})


@pytest.mark.parametrize(
    ("changes", "kind"),
    [
        ({}, "bsfm n=2"),
        ({"falling_handles_n": RISING.handles, "falling_weights": RISING.weights}, "bfm n=2"),
        ({"rising_weights": (1.0, 1.0, 1.0), "falling_weights": (1.0, 1.0, 1.0)}, "psfm n=2"),
    ],
)
def test_a_calibration_says_which_of_the_four_models_it_is(changes, kind):
    assert calibration(**changes).kind == kind


def test_a_calibration_becomes_its_model(model):
    assert calibration().model() == model


@pytest.mark.parametrize(
    "changes", [{"order": 3}, {"rising_weights": (1.0, 1.0)}, {"x1_v": 0.0}, {"blend_span_n": -1.0}]
)
def test_a_calibration_that_is_no_model_says_why(changes):
    with pytest.raises(ValueError, match=r"\w+"):
        calibration(**changes).model()
