"""The force law with slip stops: the same laws as with the branch_share, and the memory that the branch_share does not have."""

import pytest

from gateway.bsfm import Branches, Bsfm, SlipStops
from gateway.bsfm.curve import elevate_order
from gateway.control import CalibrationInUse, Controller
from gateway.control.force_loop.feedforward import Feedforward
from tests.control.bench import Bench, bsfm, settings


def slip() -> Bsfm:
    return Bsfm(bsfm().branches, SlipStops((0.5, 0.9, 1.4), (0.4, 0.4, 0.2)))


def enabled(**plant: float) -> Bench:
    bench = Bench(seed=2, **plant)
    bench.controller = Controller(bench.settings, CalibrationInUse(slip(), 1))
    bench.run(0.1)
    bench.enable(0.0)
    return bench


def law(model: Bsfm) -> Feedforward:
    return Feedforward(model, settings().limits, 0.1)


def go(law: Feedforward, *goals_n: float) -> float:
    for goal_n in goals_n:
        while law.applied_n != goal_n:
            law.advance(goal_n, 100.0, 0.01)
    return law.compute_voltage(0.0)[0]


@pytest.mark.parametrize("friction_n", [1.0, 2.0, 3.0])
def test_steps_and_partial_reversals_settle_within_a_newton(friction_n):
    bench = enabled(friction_n=friction_n)
    for target_n in (5.0, 15.0, 30.0, 40.0, 25.0, 20.0, 12.0, 15.0, 13.0, 30.0, 26.0, 28.0, 10.0, 5.0):
        bench.force(target_n)
        bench.run(1.3)
        assert abs(bench.plant.force_n - target_n) < 1.0


def test_a_closed_minor_loop_ends_at_the_voltage_where_it_began():
    force_law = law(slip())
    first_v = go(force_law, 30.0, 15.0, 20.0)
    assert go(force_law, 17.0, 20.0) == pytest.approx(first_v, abs=1e-9)
    assert go(force_law, 16.0, 18.0, 17.0, 20.0) == pytest.approx(first_v, abs=1e-9)


def test_a_vented_tool_forgets_and_a_tool_that_lost_contact_rises():
    force_law = law(slip())
    first_v = go(force_law, 5.0)
    go(force_law, 30.0, 8.0)
    assert go(force_law, 0.0, 5.0) == pytest.approx(first_v, abs=1e-9)
    force_law.fall_back(2.0)
    assert force_law.branch_share == 1.0


def test_changing_the_reversal_makes_no_bump():
    force_law = law(bsfm())
    before_v = go(force_law, 30.0, 18.0)
    force_law.use(slip(), 0.0)
    assert force_law.compute_voltage(0.0)[0] == pytest.approx(before_v, abs=1e-12)


def test_an_equal_model_swapped_in_leaves_the_memory_of_every_stop():
    """The share alone would give the same voltage now and another one after the next reversal."""
    swapped, kept = law(slip()), law(slip())
    for each in (swapped, kept):
        go(each, 30.0, 15.0, 20.0)
    swapped.use(slip(), 0.0)
    assert [go(swapped, force_n) for force_n in (18.0, 24.0, 16.0)] == [
        go(kept, force_n) for force_n in (18.0, 24.0, 16.0)
    ]


def test_tilting_the_payload_turns_the_stops_as_the_same_way_of_the_slide_does():
    """At one target the slide gives the less the more the weight gives, and friction holds against its turns."""
    tilted, straight = law(slip()), law(slip())
    for each in (tilted, straight):
        go(each, 30.0, 18.0)
    for gravity_n in (0.0, 2.0, 5.0, 0.0):
        tilted.advance(18.0, 1000.0, 0.01, gravity_n)
        straight.advance(18.0 - gravity_n, 1000.0, 0.01)
    assert tilted.branch_share == pytest.approx(straight.branch_share, abs=1e-9)
    assert tilted.compute_voltage(0.0)[0] == pytest.approx(straight.compute_voltage(0.0)[0], abs=1e-9)


def test_the_trim_hears_how_far_the_slide_moves_and_not_the_target():
    """Its memory of either branch turns with friction, which a tilt turns too."""
    force_law = law(slip())
    go(force_law, 30.0, 18.0)
    assert force_law.advance(20.0, 1000.0, 0.01, 5.0) == pytest.approx(2.0 - 5.0)
    assert force_law.advance(20.0, 1000.0, 0.01, 5.0) == 0.0


def test_a_weight_that_changes_in_free_air_turns_nothing():
    """A tool that has lost contact slides outwards, on the rising branch, whichever way it is tilted."""
    bench = enabled()
    bench.write(payload_kg=0.3)
    bench.force(20.0)
    bench.run(1.0)
    bench.plant.contact = False
    bench.run(1.0)
    shares = []
    for tilt_rad in (1.5, 3.0, 1.5, 0.0):
        bench.write(tilt_angle_rad=tilt_rad)
        bench.run(0.1)
        shares.append(bench.controller._loop.feedforward.branch_share)
    assert shares == [1.0, 1.0, 1.0, 1.0]


def test_chatter_of_the_setpoint_does_not_leave_the_band():
    bench = enabled()
    bench.force(20.0)
    bench.run(1.0)
    for index in range(100):
        bench.force(20.0 + (0.05 if index % 2 else -0.05))
        bench.run(0.02)
    assert abs(bench.plant.force_n - 20.0) < 1.0


def test_a_held_force_costs_no_inversion_and_a_moving_one_a_single_one_per_branch():
    """Newton is what a step spends most on: memory and voltage ask for the same forces."""
    flat = slip().branches
    branches = Branches(elevate_order(flat.rising), elevate_order(flat.falling))
    force_law = law(Bsfm(branches, slip().reversal))
    go(force_law, 30.0, 20.0)

    def inversions_of_a_step_to(goal_n: float) -> list[int]:
        before = [curve.inverse.cache_info().misses for curve in (branches.rising, branches.falling)]
        force_law.advance(goal_n, 100.0, 0.01)
        force_law.compute_voltage(0.0)
        after = [curve.inverse.cache_info().misses for curve in (branches.rising, branches.falling)]
        return [now - then for now, then in zip(after, before, strict=True)]

    assert inversions_of_a_step_to(20.0) == [0, 0]
    assert inversions_of_a_step_to(15.0) == [1, 1]
    assert inversions_of_a_step_to(15.0) == [1, 1]
