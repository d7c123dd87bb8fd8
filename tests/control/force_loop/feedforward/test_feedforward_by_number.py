"""The feedforward against numbers worked out by hand: goals, aims, slopes and what follows."""

from math import exp, nan

import pytest

from gateway.bsfm import FALLING, RISING, Branches, Bsfm, LinearBlend, RationalBezier
from gateway.control import Limits
from gateway.control.demand import demand_of
from gateway.control.force_loop.feedforward import LEAST_SLOPE_N_PER_V, Approach, Feedforward, ModelError
from gateway.registers.command import Command
from gateway.registers.words import LimitedBy
from tests.control.bench import bsfm, settings

LIMITS = Limits(force_max_n=50.0, over_force_n=60.0, smallest_force_n=0.5)


def straight(rising_n: tuple[float, float], falling_n: tuple[float, float]) -> Bsfm:
    """0..8 V, both branches straight."""
    branches = (RationalBezier(0.0, 8.0, list(ends), [1.0, 1.0]) for ends in (rising_n, falling_n))
    return Bsfm(Branches(*branches), LinearBlend(6.0))


def at(force_n: float, branch_share: float = RISING, model: Bsfm | None = None, **course: float) -> Feedforward:
    law = Feedforward(model or bsfm(), LIMITS, 0.1, **course)
    law.take_over(force_n, branch_share)
    return law


@pytest.mark.parametrize(
    ("touching", "now_s", "force_n", "applied_n", "goal_n", "rate_n_per_s"),
    [
        (False, 1.5, 30.0, 2.0, 3.0, 200.0),  # the pre-contact force
        (False, 1.5, 1.5, 2.0, 1.5, 200.0),
        (True, 1.5, 30.0, 10.0, 30.0, 40.0),  # half of the ramp is left
        (True, 1.5, 30.0, 30.0, 30.0, 200.0),
        (True, 1.5, 5.0, 10.0, 5.0, 200.0),  # down by the force ramp
        (True, 2.0, 30.0, 10.0, 30.0, 200.0),  # the ramp is over
        (True, 1.999, 30.0, 10.0, 30.0, 200.0),
        (True, 1.0, 30.0, 10.0, 30.0, 20.0),
    ],
)
def test_a_goal_and_its_rate_go_by_contact_and_by_what_is_left_of_its_ramp(
    touching: bool, now_s: float, force_n: float, applied_n: float, goal_n: float, rate_n_per_s: float
) -> None:
    asked = demand_of(Command(force_setpoint_n=force_n, contact_ramp_s=1.0, precontact_force_n=3.0), settings())
    approach, law = Approach(), at(applied_n)
    approach.goal(1.0, asked, True, law)
    assert approach.goal(now_s, asked, touching, law) == pytest.approx((goal_n, rate_n_per_s))


@pytest.mark.parametrize(
    ("least_n", "asked_n", "force_n"), [(0.0, 2.0, 2.0), (0.0, 0.5, 1.0), (3.0, 2.0, 7.0), (3.0, 9.0, 9.0)]
)
def test_a_vented_tool_is_approached_with_what_moves_it(least_n: float, asked_n: float, force_n: float) -> None:
    model = straight((least_n, 64.0), (least_n, 64.0))
    assert model.force_range_n[0] == pytest.approx(least_n)
    assert at(10.0, model=model).approaching_n(asked_n) == pytest.approx(force_n)


def test_what_a_model_presses_that_begins_above_0_v_is_no_friction_to_approach_with() -> None:
    """Of a rig with a lowest voltage, or of a set from a PLC: a tool without contact was sent out with 21 N instead of 5."""
    branches = (RationalBezier(1.0, 8.0, [10.0, 66.0], [1.0, 1.0]) for _ in range(2))
    law = at(20.0, model=Bsfm(Branches(*branches), LinearBlend(6.0)))
    assert law.approaching_n(3.0) == pytest.approx(2.0 * (10.0 - 8.0) + 1.0)
    assert law.approaching_n(9.0) == 9.0
    steep = (RationalBezier(1.0, 8.0, [2.0, 66.0], [1.0, 1.0]) for _ in range(2))
    assert at(20.0, model=Bsfm(Branches(*steep), LinearBlend(6.0))).approaching_n(0.5) == 1.0


@pytest.mark.parametrize(
    ("branch_share", "slope_n_per_v"), [(RISING, 8.0), (FALLING, 4.0), (0.0, 1.0 / (0.5 / 8.0 + 0.5 / 4.0))]
)
def test_a_volt_makes_what_the_branches_share(branch_share: float, slope_n_per_v: float) -> None:
    model = straight((0.0, 64.0), (20.0, 52.0))
    assert at(30.0, branch_share, model).slope_n_per_v(0.0) == pytest.approx(slope_n_per_v)
    flat = straight((0.0, 64.0), (20.0, 21.0))
    assert at(20.5, FALLING, flat).slope_n_per_v(0.0) == LEAST_SLOPE_N_PER_V


def test_the_weight_s_share_of_a_force_is_none_of_the_slide_s() -> None:
    law, rising = at(20.0), bsfm().branches.rising
    assert law.compute_voltage(5.0) == (pytest.approx(rising.inverse(15.0)[0]), LimitedBy.NONE)
    bent = at(20.0).slope_n_per_v(5.0)
    assert bent == pytest.approx(at(15.0).slope_n_per_v(0.0)) != pytest.approx(at(20.0).slope_n_per_v(0.0))


def test_what_is_too_small_or_beyond_the_model_is_told() -> None:
    assert at(0.4).compute_voltage(0.0) == (0.0, LimitedBy.SMALLEST_FORCE)
    assert at(0.0).compute_voltage(0.0) == (0.0, LimitedBy.NONE)
    low = straight((0.0, 16.0), (0.0, 16.0))
    assert at(20.0, model=low).compute_voltage(0.0) == (8.0, LimitedBy.CALIBRATION_RANGE)
    with pytest.raises(ModelError):
        at(20.0).compute_voltage(nan)


def test_a_force_that_is_taken_over_is_none_that_may_not_be_commanded() -> None:
    assert (at(70.0).applied_n, at(-3.0).applied_n) == (50.0, 0.0)


def test_the_reference_follows_behind_delay_and_lag() -> None:
    law = at(10.0, delay_s=0.05)
    followed_n = []
    for _ in range(30):
        law.advance(20.0, 1e6, 0.005)
        followed_n.append(law.reference_n)
    assert followed_n[8] == 10.0 < followed_n[11]
    assert followed_n[29] == pytest.approx(20.0 - 10.0 * exp(-0.1 / 0.1), abs=0.3)


def test_the_aim_on_a_ramp_is_where_the_target_will_be_and_never_beyond_the_goal() -> None:
    law = at(10.0, ahead_s=0.08)
    moved_n = law.advance(20.0, 10.0, 0.01)
    assert moved_n == pytest.approx(0.1) and law.applied_n == pytest.approx(10.1)
    assert law.aimed_n == pytest.approx(10.9)
    fast = at(10.0, ahead_s=0.5)
    fast.advance(40.0, 30.0, 0.01)
    assert fast.aimed_n - fast.applied_n == pytest.approx(4.0), "no further than 4 N"
    for _ in range(200):
        law.advance(20.0, 10.0, 0.01)
    assert law.aimed_n == law.applied_n == 20.0
    released = at(10.0, ahead_s=0.08)
    released.advance(0.0, 10.0, 0.01)
    assert released.aimed_n == released.applied_n == pytest.approx(9.9)


def test_a_swapped_calibration_s_difference_is_carried_over_and_fades() -> None:
    law = at(20.0)
    before_v = law.compute_voltage(0.0)[0]
    law.use(bsfm(1.2), 0.0)
    assert law.compute_voltage(0.0)[0] == pytest.approx(before_v)
    own_v = bsfm(1.2).branches.rising.inverse(20.0)[0]
    for _ in range(500):
        law.advance(20.0, 10.0, 0.001)
    assert law.compute_voltage(0.0)[0] == pytest.approx(own_v + (before_v - own_v) * exp(-1.0), abs=1e-3)
    law.reset()
    law.take_over(20.0)
    assert law.compute_voltage(0.0)[0] == pytest.approx(own_v)
