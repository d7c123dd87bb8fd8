"""The applied target and what the reversal remembers where it leaves its ramp: a loss, a swap, another mode."""

from dataclasses import replace
from itertools import pairwise

import pytest

from gateway.bsfm import FALLING, RISING, Bsfm, InverseStatus
from gateway.bsfm.slip.slip_stops import SlipStops
from gateway.control import CalibrationInUse, Controller
from gateway.control.demand import demand_of
from gateway.control.force_loop.feedforward import Approach, Feedforward, ModelError
from gateway.control.force_loop.transport_delay import TransportDelay
from gateway.registers.command import Command
from gateway.registers.words import State
from tests.control.bench import Bench, bsfm, settings
from tests.control.test_rest_forgets import RESPONSE


def pressing(force_n: float, model: Bsfm | None = None) -> Feedforward:
    """At this force, come from above."""
    law = Feedforward(model or bsfm(), settings().limits, 0.1)
    for goal_n in (45.0, force_n):
        for _ in range(200):
            law.advance(goal_n, 100.0, 0.01)
            law.correct(0.0, 0.0)
    return law


def test_a_lost_contact_leaves_the_rising_branch_and_nothing_to_correct() -> None:
    law = pressing(30.0)
    assert law.branch_share == FALLING
    law.correct(1.5, 0.0)
    law.fall_back(2.0)
    law.advance(2.0, 100.0, 0.01)
    law.correct(1.5, 0.0)
    rising = bsfm().branches.rising
    assert (law.applied_n, law.branch_share) == (2.0, RISING)
    assert law.compute_voltage(0.0)[0] == pytest.approx(rising.inverse(2.0)[0])
    assert law.correction_v(0.0) == pytest.approx(rising.inverse(3.5)[0] - rising.inverse(2.0)[0])


def test_where_nothing_is_pressed_there_is_nothing_to_correct() -> None:
    """At rest, and with a force that the rig takes for none: corrected there would be volts that nobody asked for."""
    rest = Feedforward(bsfm(), settings().limits, 0.1)
    assert rest.applied_n == 0.0 and rest.correction_v(0.0) == 0.0
    rest.correct(1.5, 0.0)
    assert rest.correction_v(0.0) == 0.0
    slight = Feedforward(bsfm(), replace(settings().limits, smallest_force_n=3.0), 0.1)
    slight.advance(2.0, 1000.0, 0.01)
    slight.correct(1.5, 0.0)
    assert slight.applied_n == 2.0 and slight.correction_v(0.0) == 0.0


def test_each_calibration_brings_its_own_limit_whatever_the_one_before_had() -> None:
    law, wide, narrow = pressing(10.0), bsfm(), replace(bsfm(1.1), limits_n=(2.0, 20.0))
    taken_n = []
    for model in (narrow, wide, narrow):
        law.use(model, 0.0)
        law.take_over(40.0)
        taken_n.append(law.applied_n)
    assert taken_n == [20.0, 40.0, 20.0]


@pytest.mark.parametrize("response", [None, RESPONSE], ids=["by the rig file", "by a measured response"])
def test_two_calibrations_one_after_the_other_make_no_bump_with_a_trim(response) -> None:
    bench = Bench(gain_n_per_v=6.6)
    bench.controller = Controller(bench.settings, CalibrationInUse(bsfm(), 1, response))
    bench.run(0.3)
    bench.enable(20.0)
    assert bench.run(2.0).state is State.HOLDING and abs(bench.last.trim_v) > 0.05
    for number, scale in enumerate((1.25, 0.8, 1.1), 2):
        before_v = bench.last.voltage_v
        bench.controller.use(CalibrationInUse(bsfm(scale), number, response))
        assert bench.step().voltage_v == pytest.approx(before_v, abs=0.02)
        bench.run(0.05)


@pytest.mark.parametrize("branch_share", [RISING, FALLING, 0.2])
def test_a_force_taken_over_is_where_the_target_its_delay_and_the_slide_are(branch_share: float) -> None:
    law = Feedforward(bsfm(), settings().limits, 0.1, delay_s=0.3)
    law.take_over(25.0, branch_share)
    law.advance(25.0, 100.0, 0.01)
    law.correct(0.0, 0.0)
    assert (law.applied_n, law.aimed_n, law.branch_share) == (25.0, 25.0, branch_share)
    assert law.reference_n == pytest.approx(25.0)
    assert law.correction_v(0.0) == pytest.approx(0.0, abs=1e-9)


def test_another_pace_leaves_what_was_reached() -> None:
    law = Feedforward(bsfm(), settings().limits, 0.1, delay_s=0.05)
    law.take_over(25.0)
    law.retime(0.1, 0.3, 0.0)
    for _ in range(10):
        law.advance(25.0, 100.0, 0.01)
    assert law.reference_n == pytest.approx(25.0)


@pytest.mark.parametrize(("begin_n", "end_n"), [(30.0, 49.5), (12.0, 0.5)])
def test_a_path_is_continued_to_no_force_that_may_not_be_or_cannot_be_commanded(begin_n: float, end_n: float) -> None:
    law, limits = Feedforward(bsfm(), settings().limits, 0.1, ahead_s=0.15), settings().limits
    law.take_over(begin_n)
    aimed_n, goal_n = [], begin_n
    for tick in range(80):
        if tick % 3 == 0:
            goal_n += max(-0.9, min(0.9, end_n - goal_n))
        law.advance(goal_n, 60.0, 0.01)
        aimed_n.append(law.aimed_n)
    assert max(abs(aim_n - goal_n) for aim_n in aimed_n) > 1.0
    assert limits.smallest_force_n <= min(aimed_n) <= max(aimed_n) <= limits.force_max_n


def contact(ramp_s: float, *ticks: tuple[bool, float]) -> list[float]:
    """Goals and rates come from the approach, and the target follows: what is applied after each tick of 10 ms."""
    law, approach, applied_n = Feedforward(bsfm(), settings().limits, 0.1), Approach(), []
    for at, (touching, force_n) in enumerate(ticks):
        demand = demand_of(Command(force_setpoint_n=force_n, contact_ramp_s=ramp_s), settings())
        law.advance(*approach.goal(0.01 * at, demand, touching, law), 0.01)
        applied_n.append(law.applied_n)
    return applied_n


def test_each_contact_has_its_own_ramp_and_none_is_faster_than_the_force_ramp() -> None:
    applied_n = contact(1.0, *[(False, 22.0)] * 20, *[(True, 22.0)] * 51)
    assert applied_n[-1] == pytest.approx((applied_n[19] + 22.0) / 2.0, abs=0.3), "half of the way in half of the time"
    twice = contact(1.0, *[(False, 22.0)] * 20, *[(True, 22.0)] * 90, *[(False, 22.0)] * 200, *[(True, 22.0)] * 51)
    assert twice[-1] == pytest.approx(applied_n[-1], abs=0.3)
    fast = contact(0.05, *[(False, 42.0)] * 20, *[(True, 42.0)] * 60)
    steepest_n = max(later - earlier for earlier, later in pairwise(fast))
    assert steepest_n <= settings().defaults.force_ramp_n_per_s * 0.01 + 1e-9


def test_a_smaller_force_within_the_contact_ramp_is_gone_down_to_by_the_force_ramp() -> None:
    applied_n = contact(2.0, *[(False, 40.0)] * 20, *[(True, 40.0)] * 100, *[(True, 5.0)] * 60)
    assert applied_n[119] > 15.0 and applied_n[-1] == pytest.approx(5.0)
    assert all(later <= earlier for earlier, later in pairwise(applied_n[119:]))


def test_behind_a_reset_nothing_of_the_force_before_is_still_on_its_way() -> None:
    law = Feedforward(bsfm(), settings().limits, 0.1, delay_s=0.1)
    for _ in range(100):
        law.advance(30.0, 100.0, 0.01)
    law.reset()
    expected_n = []
    for _ in range(20):
        law.advance(10.0, 20.0, 0.01)
        expected_n.append(law.reference_n)
    assert max(expected_n) <= law.applied_n and expected_n[9] == 0.0


def test_a_path_ends_with_the_output_that_it_was_for() -> None:
    law, goal_n = Feedforward(bsfm(), settings().limits, 0.1, ahead_s=0.15), 20.0
    for _ in range(30):
        goal_n += 0.1
        law.advance(goal_n, 500.0, 0.01)
    assert law.aimed_n > goal_n + 1.0
    law.reset()
    law.advance(goal_n, 1.0e4, 0.01)
    assert law.aimed_n == pytest.approx(goal_n)


def test_a_path_ends_where_another_mode_drives() -> None:
    law, goal_n = Feedforward(bsfm(), settings().limits, 0.1, ahead_s=0.15), 20.0
    for _ in range(30):
        goal_n += 0.1
        law.advance(goal_n, 500.0, 0.01)
    law.take_over(goal_n)
    law.advance(goal_n, 1.0e4, 0.01)
    assert law.aimed_n == pytest.approx(goal_n)


def test_a_contact_that_is_lost_below_the_pre_contact_force_raises_nothing_at_once() -> None:
    law = Feedforward(bsfm(), settings().limits, 0.1)
    law.advance(40.0, 100.0, 0.01)
    before_n = law.applied_n
    law.fall_back(5.0)
    assert 0.0 < law.applied_n == before_n < 5.0


def test_what_a_swap_carries_over_ends_where_another_mode_drives_and_with_the_output() -> None:
    """It was for a voltage of ours: added to another one's, it would be a bump of its own."""
    laws = [pressing(20.0), pressing(20.0)]
    for law in laws:
        law.use(bsfm(1.3), 0.0)
    laws[0].take_over(20.0, FALLING)
    laws[1].reset()
    laws[1].take_over(20.0, FALLING)
    law = pressing(20.0)
    law.use(bsfm(1.3), 0.0)
    law.reset()
    for _ in range(20):
        law.advance(20.0, 1e3, 0.01)
    falling, rising = bsfm(1.3).branches.falling, bsfm(1.3).branches.rising
    assert [one.compute_voltage(0.0)[0] for one in laws] == pytest.approx([falling.inverse(20.0)[0]] * 2)
    assert law.compute_voltage(0.0)[0] == pytest.approx(rising.inverse(20.0)[0])


def test_a_swap_leaves_the_slide_on_its_branch() -> None:
    law = pressing(20.0)
    law.use(bsfm(1.3), 0.0)
    assert law.branch_share == FALLING
    for _ in range(500):
        law.advance(20.0, 100.0, 0.01)
    assert law.compute_voltage(0.0)[0] == pytest.approx(bsfm(1.3).branches.falling.inverse(20.0)[0], abs=1e-3)


def test_a_swap_to_a_set_that_reverses_otherwise_keeps_the_voltage_beside_a_correction() -> None:
    law = pressing(20.0)
    law.correct(1.5, 0.0)
    before_v = law.compute_voltage(0.0)[0] + law.correction_v(0.0)
    law.use(replace(bsfm(1.1), reversal=SlipStops((0.5, 1.0), (0.5, 0.5))), 0.0, correction_limit_v=1.0)
    assert law.compute_voltage(0.0)[0] + law.correction_v(0.0) == pytest.approx(before_v)


def test_the_payload_s_weight_is_no_correction() -> None:
    law = Feedforward(bsfm(), settings().limits, 0.1)
    for _ in range(200):
        law.advance(30.0, 100.0, 0.01, gravity_n=8.0)
        law.correct(0.0, 8.0)
    assert law.correction_v(8.0) == pytest.approx(0.0, abs=1e-9)


def test_a_target_of_nothing_vents_the_slide_and_the_next_force_begins_there() -> None:
    law = pressing(20.0)
    for _ in range(100):
        law.advance(0.0, 100.0, 0.01)
    assert law.branch_share == law.model.reversal.branch_share(law.model.reversal.start()) == RISING


def test_a_weight_that_takes_over_a_part_of_the_force_lets_the_slide_down() -> None:
    """Not the target has turned, but what the slide gives of it."""
    law = Feedforward(bsfm(), settings().limits, 0.1)
    for _ in range(200):
        law.advance(30.0, 100.0, 0.01)
    assert law.branch_share == RISING
    law.advance(30.0, 100.0, 0.01, gravity_n=8.0)
    assert law.branch_share == FALLING


def test_a_voltage_that_is_no_number_is_the_model_s_fault() -> None:
    class Broken(Bsfm):
        def voltage_v(self, *_: object, **__: object) -> tuple[float, InverseStatus]:  # type: ignore[override]
            return float("nan"), InverseStatus.OK

    law = Feedforward(Broken(bsfm().branches, bsfm().reversal), settings().limits, 0.1)
    law.take_over(20.0)
    with pytest.raises(ModelError, match="nan"):
        law.compute_voltage(0.0)


def test_of_what_came_due_in_one_long_step_the_latest_counts() -> None:
    line = TransportDelay(0.03)
    assert [line.advance(value, 0.01) for value in (1.0, 2.0, 3.0, 4.0)] == [0.0, 0.0, 0.0, 1.0]
    assert line.advance(5.0, 0.05) == 4.0
