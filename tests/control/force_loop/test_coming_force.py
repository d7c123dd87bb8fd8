"""What is on its way: thrust until it has passed lags and dead time, and as much force as friction lets through."""

from dataclasses import replace
from itertools import pairwise

import pytest

from gateway.bsfm import Branches, Bsfm, RationalBezier
from gateway.bsfm.model import Response
from gateway.bsfm.response.second_order import SecondOrder
from gateway.bsfm.slip.slip_stops import SlipStops
from gateway.control import CalibrationInUse, Controller, Limits
from gateway.control.force_loop.coming_thrust import ComingThrust
from gateway.control.force_loop.feedforward import Feedforward
from gateway.control.force_loop.lag_inverse import LinearizedLagInverse
from gateway.control.settings import Defaults
from gateway.registers.words import ControlBit, Mode
from tests.control.bench import Bench, bsfm, settings

LIMITS = Limits(force_max_n=50.0, over_force_n=75.0)
N_PER_V, HALF_N = 8.0, 4.0


def rubbing() -> Bsfm:
    """Half a volt of friction each way, which gives way within 1.5 V."""
    rising = RationalBezier(0.0, 8.0, (-HALF_N, 8.0 * N_PER_V - HALF_N), (1.0, 1.0))
    falling = RationalBezier(0.0, 8.0, (HALF_N, 8.0 * N_PER_V + HALF_N), (1.0, 1.0))
    return Bsfm(Branches(rising, falling), SlipStops((0.6, 1.5), (0.5, 0.5)))


def pressed(force_n: float, correction_n: float = 0.0) -> Feedforward:
    law = Feedforward(rubbing(), LIMITS, 0.1)
    law.advance(force_n, 1.0e6, 1.0)
    law.correct(0.0, 0.0)
    law.correct(correction_n, 0.0)
    return law


def test_along_a_branch_all_that_comes_is_force():
    assert pressed(25.0).yielded_share(0.5) == pytest.approx(1.0, abs=0.01)


def test_behind_a_turn_friction_takes_most_of_what_comes():
    stiffness_per_v = 0.5 / 0.6 + 0.5 / 1.5
    left = 1.0 - HALF_N / N_PER_V * stiffness_per_v
    assert pressed(25.0).yielded_share(-0.5) == pytest.approx(left, abs=0.02)
    assert pressed(25.0, -0.5).yielded_share(-0.5) == pytest.approx(left, abs=0.02)
    assert pressed(25.0, -20.0).yielded_share(-0.5) == pytest.approx(1.0, abs=0.02)


def test_thrust_comes_until_it_has_passed_the_lags_and_then_the_dead_time():
    lead, coming = LinearizedLagInverse(SecondOrder(0.1, 0.02), LIMITS, rubbing()), ComingThrust()
    coming.retime(0.05)
    courses_n = []
    for _ in range(800):
        lead.advance(2.0, 0.001)
        coming.elapse(lead, 0.001)
        courses_n.append(coming.coming_n(lead, 2.0))
    assert courses_n[48] == pytest.approx(2.0 * N_PER_V, abs=0.01), "nothing has arrived within the dead time"
    assert all(later <= before + 1.0e-9 for before, later in pairwise(courses_n))
    assert courses_n[-1] == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("pause", ["off", "at 0 N", "in voltage mode"])
def test_what_had_arrived_before_a_pause_is_not_taken_for_what_comes_behind_it(pause: str):
    """As long as the dead time lasts nothing of the new force has been felt: a trim that learned from that would press more.
    Friction keeps the tool in contact, and the force before was as large as the one that is asked for now."""
    control = settings(response_lag_s=0.5)
    bench = Bench(replace(control, defaults=Defaults(force_ramp_n_per_s=2000.0)), delay_s=0.3, noise_n=0.02)
    bench.controller = Controller(bench.settings, CalibrationInUse(bsfm(), 1, Response(dead_time_s=0.3, lag_s=0.08)))
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + 1.0)
    bench.run(0.5)
    bench.enable(30.0)
    bench.run(4.0)
    {"off": bench.disable, "at 0 N": lambda: bench.force(0.0), "in voltage mode": lambda: bench.voltage(1.0)}[pause]()
    bench.run(6.0)
    bench.history.clear()
    bench.write(control_word=ControlBit.ENABLE, mode=Mode.FORCE, force_setpoint_n=25.0, voltage_setpoint_v=0.0)
    bench.run(2.0)
    assert max(one.output.trim_v for one in bench.history) < 0.05
    assert max(one.force_n for one in bench.history) < 26.0
