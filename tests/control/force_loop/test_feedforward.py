"""The applied target and what the reversal remembers where it leaves its ramp: a loss, a swap, another mode."""

from dataclasses import replace

import pytest

from gateway.bsfm import FALLING, RISING, Bsfm
from gateway.control import CalibrationInUse, Controller
from gateway.control.force_loop.feedforward import Feedforward
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
