"""Laws of the slip stops: round trip, continuity, calm under chatter, and the memory of return points."""

import math
from itertools import accumulate, pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.bsfm import Branches, Bsfm, LinearBlend, Memory, RationalBezier, SlipStops
from gateway.bsfm.slip.slip_stops import STIFFEST, half_width_bound_v, middle_and_half
from tests.gate.budgets import examples

MANY = settings(derandomize=True, deadline=None, max_examples=examples(150))
RISING = RationalBezier(0.0, 5.0, (0.5, 14.0, 38.0), (1.0, 0.9, 1.2))
FALLING = RationalBezier(0.0, 5.0, (0.5, 24.0, 42.0), (1.0, 1.1, 1.2))
BRANCHES = Branches(RISING, FALLING)
STOPS = SlipStops((0.4, 0.7, 1.1, 1.6), (0.2, 0.35, 0.25, 0.2))
MODEL = Bsfm(BRANCHES, STOPS)
LOW_N, HIGH_N = MODEL.force_range_n
WIDEST_V = half_width_bound_v(BRANCHES)
GENTLEST_N_PER_V = min(RISING.minimum_slope(), FALLING.minimum_slope())

forces = st.floats(0.5, 38.0)
paths = st.lists(forces, min_size=1, max_size=25)


@st.composite
def stop_sets(draw: st.DrawFn) -> SlipStops:
    """Any radii and shares that BRANCHES allow."""
    widths = draw(st.lists(st.floats(0.01, 1.0), min_size=1, max_size=6))
    parts = draw(st.lists(st.floats(0.01, 1.0), min_size=len(widths), max_size=len(widths)))
    first_v = 1.06 * WIDEST_V / STIFFEST  # no stop alone is too stiff, so no set is
    return SlipStops(tuple(first_v + width for width in accumulate(widths)), tuple(p / sum(parts) for p in parts))


def memory_along(model: Bsfm, path: list[float], memory: Memory | None = None, from_n: float = LOW_N) -> Memory:
    memory = memory or model.reversal.start()
    for force_n in path:
        memory, from_n = model.memory_after(memory, from_n, force_n), force_n
    return memory


def voltage_v(model: Bsfm, memory: Memory, force_n: float) -> float:
    return model.voltage_v(force_n, model.branch_share(memory))[0]


@MANY
@given(stop_sets(), paths)
def test_the_voltage_solves_its_own_equation(stops, path):
    """V = m + s(V) h: the stops have moved by the very change of the voltage that they make."""
    model, memory, last_n = Bsfm(BRANCHES, stops), stops.start(), LOW_N
    last_v = voltage_v(model, memory, last_n)
    for force_n in path:
        memory, before = model.memory_after(memory, last_n, force_n), memory
        volts, last_n = voltage_v(model, memory, force_n), force_n
        followed = stops.advance(before, volts - last_v)
        assert memory == pytest.approx(followed, abs=1e-9)
        middle_v, half_v = middle_and_half(BRANCHES, force_n)
        assert math.isclose(volts, middle_v + stops.branch_share(memory) * half_v, abs_tol=1e-12)
        last_v = volts


@MANY
@given(stop_sets(), paths)
def test_force_to_voltage_to_force_is_a_round_trip(stops, path):
    model = Bsfm(BRANCHES, stops)
    memory = memory_along(model, path)
    volts = voltage_v(model, memory, path[-1])
    assert math.isclose(model.settled_n(volts, model.branch_share(memory)), path[-1], abs_tol=1e-9)


@MANY
@given(stop_sets(), st.lists(st.floats(-100.0, 100.0), min_size=1, max_size=30))
def test_every_stop_and_the_share_stay_within_one(stops, path):
    model, memory, last_n = Bsfm(BRANCHES, stops), stops.start(), LOW_N
    for force_n in path:
        memory, last_n = model.memory_after(memory, last_n, force_n), force_n
        assert all(-1.0 <= place <= 1.0 for place in memory)
        assert -1.0 <= model.branch_share(memory) <= 1.0


@MANY
@given(stop_sets(), paths, st.floats(-0.5, 0.5))
def test_the_voltage_is_continuous_in_the_force_and_grows_with_it(stops, path, delta_n):
    """dV/df is positive and at most that of the gentler branch over 1 - h sum c/r."""
    model = Bsfm(BRANCHES, stops)
    memory, force_n = memory_along(model, path), path[-1]
    there_n = min(max(force_n + delta_n, LOW_N), HIGH_N)
    rise_v = voltage_v(model, memory_along(model, [there_n], memory, force_n), there_n) - voltage_v(
        model, memory, force_n
    )
    steepest = 1.0 / GENTLEST_N_PER_V / (1.0 - WIDEST_V * stops.stiffness_per_v)
    assert -1e-12 <= rise_v * math.copysign(1.0, there_n - force_n) <= abs(there_n - force_n) * steepest + 1e-12


@MANY
@given(paths, forces, st.integers(1, 40))
def test_cutting_a_movement_into_steps_changes_nothing(path, target_n, steps):
    before, from_n = memory_along(MODEL, path), path[-1]
    parts = [from_n + (target_n - from_n) * (k + 1) / steps for k in range(steps - 1)]
    whole, cut = (memory_along(MODEL, way, before, from_n) for way in ([target_n], [*parts, target_n]))
    assert cut == pytest.approx(whole, abs=1e-9)


@MANY
@given(paths, forces, forces, st.integers(1, 4))
def test_a_closed_minor_loop_comes_back_to_the_same_memory_and_voltage(path, first_n, turn_n, rounds):
    """Return points: after one round between two forces the next rounds repeat it, and nothing else is changed."""
    before = memory_along(MODEL, [*path, first_n])
    once = memory_along(MODEL, [turn_n, first_n], before, first_n)
    again = memory_along(MODEL, [turn_n, first_n] * rounds, once, first_n)
    assert again == pytest.approx(once, abs=1e-9)
    assert math.isclose(voltage_v(MODEL, again, first_n), voltage_v(MODEL, once, first_n), abs_tol=1e-9)


@MANY
@given(st.lists(st.tuples(forces, st.floats(0.0, 1.0)), min_size=1, max_size=6), st.booleans())
def test_a_loop_inside_a_movement_is_wiped_out_when_it_closes(turns, rising):
    """Nested excursions that return to where they left the way do not change where the way leads."""
    start_n, end_n = (LOW_N, HIGH_N) if rising else (HIGH_N, LOW_N)
    memory = memory_along(MODEL, [HIGH_N, LOW_N, start_n])
    straight, detours, here_n = memory_along(MODEL, [end_n], memory, start_n), memory, start_n
    for leave_n, depth in sorted(turns, reverse=not rising):
        back_n = leave_n + depth * (start_n - leave_n)
        detours, here_n = memory_along(MODEL, [leave_n, back_n, leave_n], detours, here_n), leave_n
    assert memory_along(MODEL, [end_n], detours, here_n) == pytest.approx(straight, abs=1e-9)


@pytest.mark.parametrize("chatter_n", [1e-6, 0.05, 1.0])
def test_ten_thousand_small_reversals_neither_drift_nor_widen(chatter_n):
    memory = memory_along(MODEL, [20.0, 20.0 - chatter_n, 20.0])
    first_v = voltage_v(MODEL, memory, 20.0)
    later = memory_along(MODEL, [20.0 - chatter_n, 20.0] * 5000, memory, 20.0)
    assert math.isclose(voltage_v(MODEL, later, 20.0), first_v, abs_tol=1e-9)
    low_v = voltage_v(MODEL, memory_along(MODEL, [20.0 - chatter_n], later, 20.0), 20.0 - chatter_n)
    assert 0.0 < first_v - low_v <= chatter_n / GENTLEST_N_PER_V / (1.0 - WIDEST_V * STOPS.stiffness_per_v)


@MANY
@given(stop_sets(), paths)
def test_a_full_traverse_reaches_each_branch_whatever_came_before(stops, path):
    wide = Branches(
        RationalBezier(0.0, 50.0, (0.0, 300.0), (1.0, 1.0)), RationalBezier(0.0, 50.0, (4.0, 304.0), (1.0, 1.0))
    )
    model = Bsfm(wide, stops)
    memory = memory_along(model, [*path, 290.0])
    assert model.branch_share(memory) == pytest.approx(1.0, abs=1e-12)
    assert voltage_v(model, memory, 290.0) == pytest.approx(wide.rising.inverse(290.0)[0])
    memory = memory_along(model, [10.0], memory, 290.0)
    assert model.branch_share(memory) == pytest.approx(-1.0, abs=1e-12)
    assert voltage_v(model, memory, 10.0) == pytest.approx(wide.falling.inverse(10.0)[0])


@MANY
@given(st.floats(0.5, 6.0), st.floats(0.01, 3.0), st.lists(st.floats(20.0, 280.0), min_size=1, max_size=30))
def test_one_stop_between_parallel_lines_is_the_linear_blend(width_n, beyond_v, path):
    """Of k N/V and half width h V, a stop of radius r V is a play of the force over 2 (r - h) k N."""
    slope = 6.0
    rising = RationalBezier(0.0, 50.0, (0.0, 50.0 * slope), (1.0, 1.0))
    falling = RationalBezier(0.0, 50.0, (width_n, 50.0 * slope + width_n), (1.0, 1.0))
    half_v = 0.5 * width_n / slope
    radius_v = 1.1 * half_v / STIFFEST + beyond_v
    slip = Bsfm(Branches(rising, falling), SlipStops((radius_v,), (1.0,)))
    blend = Bsfm(Branches(rising, falling), LinearBlend(2.0 * (radius_v - half_v) * slope))
    memories = {model: model.reversal.at(-1.0) for model in (slip, blend)}
    for before_n, force_n in pairwise([path[0], *path]):
        memories = {model: model.memory_after(memory, before_n, force_n) for model, memory in memories.items()}
        slip_v, blend_v = (voltage_v(model, memory, force_n) for model, memory in memories.items())
        assert math.isclose(slip_v, blend_v, abs_tol=1e-9)


@MANY
@given(forces, st.floats(-1.0, 1.0))
def test_the_settled_force_is_the_inverse_of_the_voltage_at_any_share(force_n, share):
    volts, _ = MODEL.voltage_v(force_n, share)
    assert math.isclose(MODEL.settled_n(volts, share), force_n, abs_tol=1e-9)
