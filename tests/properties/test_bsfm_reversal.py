"""Laws of the blend at reversals: bounded, continuous, calm under chatter."""

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.bsfm import Branches, Bsfm, LinearBlend, RationalBezier
from tests.gate.budgets import examples

MANY = settings(derandomize=True, deadline=None, max_examples=examples(200))
RISING = RationalBezier(0.0, 5.0, (0.0, 14.0, 38.0), (1.0, 0.9, 1.2))
FALLING = RationalBezier(0.0, 5.0, (0.0, 22.0, 38.0), (1.0, 1.1, 1.2))
SPAN_N = 3.0
MODEL = Bsfm(Branches(RISING, FALLING), LinearBlend(SPAN_N))
WIDTH_V = max(RISING.inverse(f / 10)[0] - FALLING.inverse(f / 10)[0] for f in range(381))
GENTLEST_N_PER_V = min(RISING.minimum_slope(), FALLING.minimum_slope())

forces = st.floats(0.0, 38.0)
finite = st.floats(allow_nan=False, allow_infinity=False)


@MANY
@given(st.floats(-1.0, 1.0), st.lists(finite, max_size=20), st.floats(0.0, 1e6))
def test_blend_state_is_bounded_whatever_happens(state, deltas, span):
    blend = LinearBlend(span)
    for delta in deltas:
        state = blend.advance(state, delta)
        assert -1.0 <= state <= 1.0


@pytest.mark.parametrize("span_n", [-0.5, -1.0e-9, math.nan, math.inf])
def test_a_blend_over_less_than_nothing_is_none(span_n: float) -> None:
    """It would lead away from the branch that the force goes to."""
    with pytest.raises(ValueError, match="blend span"):
        LinearBlend(span_n)


def test_a_vented_tool_is_on_the_rising_branch() -> None:
    """There a ladder starts, and so the first force after a start is led by the branch that was fitted to it."""
    memory = MODEL.reversal.start()
    assert MODEL.voltage_v(19.0, MODEL.branch_share(memory)) == RISING.inverse(19.0)


@MANY
@given(st.lists(forces, min_size=2, max_size=40))
def test_voltage_is_continuous_along_any_path_of_force(path):
    """|dV| <= |df| (1 / gentlest slope + loop width / span): no jump at any reversal."""
    state, volts = 0.0, []
    for last, force in pairwise([path[0], *path]):
        state = MODEL.reversal.advance(state, force - last)
        volts.append(MODEL.voltage_v(force, state)[0])
    for (f1, v1), (f2, v2) in pairwise(zip(path, volts, strict=True)):
        assert abs(v2 - v1) <= abs(f2 - f1) * (1.0 / GENTLEST_N_PER_V + WIDTH_V / SPAN_N) + 1e-9


@MANY
@given(st.floats(1.0, 37.0), st.floats(0.0, 0.05), st.integers(1, 30))
def test_chatter_moves_the_voltage_by_its_share_of_the_loop_and_does_not_drift(force, chatter, cycles):
    state = MODEL.reversal.advance(1.0, force)
    values = []
    for _ in range(cycles):
        for delta in (-chatter, chatter):
            state = MODEL.reversal.advance(state, delta)
        values.append(MODEL.voltage_v(force, state)[0])
    assert max(values) - min(values) <= 1e-12
    assert abs(values[0] - RISING.inverse(force)[0]) <= 2 * chatter / SPAN_N * WIDTH_V + 1e-12


@MANY
@given(st.floats(-1.0, 1.0), st.floats(-5.0, 5.0), st.integers(1, 50))
def test_cutting_a_movement_into_steps_changes_nothing(state, delta, steps):
    whole = MODEL.reversal.advance(state, delta)
    for _ in range(steps):
        state = MODEL.reversal.advance(state, delta / steps)
    assert math.isclose(state, whole, abs_tol=1e-12)


@MANY
@given(forces, st.floats(-1.0, 1.0))
def test_blended_voltage_lies_between_the_branches(force, state):
    up, down = RISING.inverse(force)[0], FALLING.inverse(force)[0]
    assert down - 1e-12 <= MODEL.voltage_v(force, state)[0] <= up + 1e-12


@MANY
@given(forces, st.sampled_from([-1.0, 1.0]))
def test_on_a_branch_force_and_voltage_invert_each_other(force, state):
    voltage, _ = MODEL.voltage_v(force, state)
    assert math.isclose(MODEL.force_n(voltage, state), force, abs_tol=1e-12)
