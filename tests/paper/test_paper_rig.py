"""Laws of the reproduction's rig: copies, noise, the ladder's groups, and what the regulator allows."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
from paper.experiments import exercises, limit, rigs
from paper.experiments.calibration import READ_ONCE, Calibrated, calibrate, condition, paper_ladder, quiet_twin
from paper.experiments.closed_loop import Surroundings, run
from paper.experiments.laws import LAW_NAMES, Ours, Switched, law
from paper.experiments.limit import Fastest
from paper.experiments.rigs import copy_of, lift_pad, paper_plant, rig_lanes
from paper.experiments.trials import Lane
from paper.verdicts import validation_and_steps

from gateway.bsfm.ladder.measured_ladder import ladder_plan
from gateway.twin.experiment import staircase
from gateway.twin.regulator import RegulatorState


@cache
def rig_itself() -> Calibrated:
    return calibrate(paper_plant(), 0)


@cache
def fastest() -> list[Fastest]:
    return limit.limits(paper_plant(), (10.0, 30.0), (2.0, 1.0))


def test_seed_0_is_the_papers_rig_and_every_other_seed_another_copy_of_it() -> None:
    assert copy_of(0) == paper_plant()
    assert copy_of(3) == copy_of(3)
    assert len({copy_of(seed).friction.coulomb_n for seed in range(6)}) == 6
    assert copy_of(3).regulator.delay_s == paper_plant().regulator.delay_s


def test_on_a_quiet_rig_every_group_of_the_ladder_repeats_the_first() -> None:
    """So the copies may run one group and read it ten times."""
    plan = ladder_plan(5.0, 0.5, 3)
    groups = staircase(quiet_twin(paper_plant()), plan.voltage_v, READ_ONCE).reshape(3, -1)
    assert np.max(np.abs(groups - groups[0])) < 0.01  # a twelfth of the noise of one reading


def test_the_paper_ladder_has_1010_points_and_the_copies_ladder_is_the_same_experiment() -> None:
    ladder = rig_itself().ladder
    assert len(ladder) == 1010
    short = paper_ladder(paper_plant(), 0, groups=1)
    np.testing.assert_array_equal(short.voltage_v, ladder.voltage_v[:101])
    np.testing.assert_allclose(short.force_n, ladder.force_n[:101], atol=0.02)


def test_lanes_of_one_seed_read_the_same_noise_whatever_drives_them() -> None:
    noise = rig_lanes([paper_plant()] * 3, [4, 4, 5], 7).readings(200)
    np.testing.assert_array_equal(noise[:, 0], noise[:, 1])
    assert np.all(noise[:, 0] != noise[:, 2])
    assert np.any(rig_lanes([paper_plant()], [4], 8).readings(200)[:, 0] != noise[:, 0])


def test_without_a_wish_no_law_moves_the_tool() -> None:
    fresh = [law(name, rig_itself()) for name in LAW_NAMES]
    record = run(rig_lanes([paper_plant()] * len(fresh), [0] * len(fresh), 7), fresh, np.zeros((30, len(fresh))))
    assert np.all(record.command_v == 0.0)
    assert np.all(record.force_n == 0.0)


def test_a_flat_plate_and_a_still_spindle_are_as_good_as_none() -> None:
    wish = np.full((60, 1), 20.0)
    still = Surroundings(lambda time_s: np.zeros(1), lambda time_s: np.zeros(1))
    records = [
        run(rig_lanes([lift_pad(paper_plant())], [0], 7), [Switched(rig_itself().bsfm)], wish, around)
        for around in (still, Surroundings())
    ]
    np.testing.assert_array_equal(records[0].force_n, records[1].force_n)


def test_the_plate_starts_at_its_own_height_and_stands_still_after_the_travel() -> None:
    lanes = [Lane(rig_itself(), "bsfm", case) for case in range(len(exercises.CONDITIONS))]
    height_m = exercises.moving_surface(lanes).height_m
    assert height_m is not None
    np.testing.assert_array_equal(height_m(exercises.FEED_FROM_S), np.zeros(len(lanes)))
    np.testing.assert_array_equal(height_m(100.0), height_m(200.0))
    slow, fast = height_m(100.0)[0], height_m(100.0)[-1]
    assert math.isclose(slow, fast)  # same plate, same end


def test_ours_settles_where_the_open_loop_never_comes_within_a_newton() -> None:
    plants = [lift_pad(paper_plant())] * 2
    wish = np.full((200, 2), 5.0)
    record = run(rig_lanes(plants, [0, 0], 8), [Switched(rig_itself().bsfm), Ours(rig_itself().ours)], wish)
    paper_n, ours_n = np.abs(record.error_n[-300:]).max(axis=0)
    assert 1.0 < paper_n < 2.0
    assert ours_n < 0.3


def test_no_command_within_range_enters_the_band_before_full_voltage_does() -> None:
    """Random commands of 10 ms pulses, drawn to be bold: half of them at the upper bound."""
    rng = np.random.default_rng(5)
    pulses = np.minimum(rng.uniform(0.0, 20.0, (30, 400)), 10.0)
    force_n = limit.responses(paper_plant(), np.repeat(pulses, 10, axis=0))
    for row in fastest():
        inside = np.abs(force_n - row.target_n) <= row.band_n
        first_s = np.where(inside.any(axis=0), np.argmax(inside, axis=0), np.inf) * 1.0e-3
        assert np.min(first_s) >= row.entered_s


def test_the_fastest_command_stays_in_the_band_and_beats_neither_the_bound_nor_the_dead_time() -> None:
    for row in fastest():
        assert row.settled_s >= row.entered_s > paper_plant().regulator.delay_s
        volts = limit.bang_bang_v([(row.up_ms, row.down_ms)], limit.holding_v(paper_plant(), row.target_n))
        force_n = limit.responses(paper_plant(), volts)[:, 0]
        assert np.all(np.abs(force_n[round(row.settled_s * 1000) :] - row.target_n) <= row.band_n)


def test_physics_allows_the_settling_goal_so_it_is_no_excuse() -> None:
    for row in fastest():
        paper_s = {10.0: {2.0: 0.342, 1.0: 0.482}, 30.0: {2.0: 0.399, 1.0: 0.459}}[row.target_n][row.band_n]
        assert row.settled_s < 0.7 * paper_s


def test_conditioning_leaves_the_friction_on_the_falling_branch() -> None:
    rig = rig_lanes([paper_plant()], [0], 1)
    condition(rig.twin)
    assert rigs.paper_plant().friction.coulomb_n * 0.5 < float(rig.twin.force_n[0]) < 2.0


def test_a_steady_climb_comes_as_late_as_the_report_says() -> None:
    """Whatever stands on the way delays a ramp by its own time, and all of them by the sum."""
    plain = replace(paper_plant().regulator, dead_band_pa=0.0, hysteresis_pa=0.0, command_step_v=0.0)
    moved, climb_v_per_s = RegulatorState(plain, 1.0e-3), 0.5
    for step in range(8000):
        moved.command(climb_v_per_s * step * 1.0e-3)
        moved.step()
    late_v = climb_v_per_s * 8.0 - moved.pressure_pa * plain.full_scale_v / plain.full_scale_pa
    assert abs(late_v / climb_v_per_s - validation_and_steps.lag_s()) < 2.0e-3
