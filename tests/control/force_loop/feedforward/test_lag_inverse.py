"""The push: near what two limits allow, never beyond them, nothing left standing past the wish, at peace with a slow wire."""

from math import exp
from random import Random

import numpy as np
import pytest

from gateway.bsfm.response.second_order import SecondOrder
from gateway.control import Limits
from gateway.control.force_loop.lag_inverse import LagInverse
from gateway.control.limits import VoltageLimiter
from tests.control.foreign.course import _settled_s
from tests.control.foreign.machine import Machine

LIMITS = Limits(force_max_n=50.0, over_force_n=60.0, voltage_max_v=8.5)
LAGS = [(0.072, 0.072), (0.15, 0.05), (0.3, 0.3), (0.25, 0.0), (0.1, 0.0), (0.03, 0.03)]
RINGING = [(0.036, 0.036, 0.6), (0.072, 0.072, 0.6), (0.04, 0.04, 0.4)]  # both lags, damping
BAND_V = 0.0625  # half a newton on a plant of 8 N/V


class Loop:
    """LagInverse, output stage and wire, and two lags behind them. off: of the lags that the push believes in."""

    def __init__(self, lags: tuple[float, ...], at_v: float = 0.0, wire_s: float = 0.03, off: float = 1.0) -> None:
        lag_s, second_lag_s, *_ = lags
        self.ringing = SecondOrder(*lags) if len(lags) > 2 else None
        self.push = LagInverse(SecondOrder(off * lag_s, off * second_lag_s, *lags[2:]), LIMITS)
        self.push.set_wire_time(wire_s)
        self.stage = VoltageLimiter(LIMITS)
        self.push.first_v = self.push.second_v = self.stage.voltage_v = at_v
        self.first_v = self.second_v = self.sent_v = at_v
        self.shares = [1.0 - exp(-0.001 / max(lag, 1.0e-9)) for lag in (lag_s, second_lag_s)]
        self.wire_ms, self.free_ms, self.ms = round(wire_s * 1000), 0, 0
        self.given_v: list[float] = []

    def run(self, wanted_v: float, seconds: float) -> np.ndarray:
        """Where the second lag is, each millisecond."""
        course = []
        for _ in range(round(seconds * 1000)):
            if self.ms % 5 == 0:
                self.stage.earn(0.005)
                self.stage.drive(self.push.compensated_v(wanted_v, self.stage.voltage_v))
                self.given_v.append(self.stage.voltage_v)
            if self.ms >= self.free_ms and self.stage.voltage_v != self.sent_v:
                self.sent_v, self.free_ms = self.stage.voltage_v, self.ms + self.wire_ms
            self.push.advance(self.sent_v, 0.001)
            self._follow()
            course.append(self.second_v)
            self.ms += 1
        return np.array(course)

    def _follow(self) -> None:
        if self.ringing:
            speed = (self.first_v - self.second_v) / self.ringing.second_lag_s
            for _ in range(10):
                speed += 1.0e-4 * (self.sent_v - self.second_v - self.ringing.delay_s * speed) / self.ringing.bend_s2
                self.second_v += 1.0e-4 * speed
            self.first_v = self.second_v + self.ringing.second_lag_s * speed
            return
        self.first_v += self.shares[0] * (self.sent_v - self.first_v)
        self.second_v += self.shares[1] * (self.first_v - self.second_v)


def settled_s(course_v: np.ndarray, wanted_v: float) -> float:
    outside = np.flatnonzero(np.abs(course_v - wanted_v) > BAND_V)
    return 1.0e-3 * float(outside[-1] + 1) if len(outside) else 0.0


def bound_s(lags: tuple[float, ...], from_v: float, to_v: float) -> float:
    """The best bang-bang command."""
    lag_s, second_lag_s, *damping = lags
    if damping:
        lag_s = second_lag_s = lag_s / damping[0]  # natural time
    longest_s = 4.0 * (lag_s + second_lag_s) + 0.2
    pushes, brakes = np.meshgrid(np.arange(0.004, longest_s, 0.02), np.arange(0.0, 0.4 * longest_s, 0.03))
    ends = (8.5, 0.0) if to_v > from_v else (0.0, 8.5)
    machine = Machine(lag_s=lag_s, second_lag_s=second_lag_s, damping=damping[0] if damping else 1.0)
    return float(_settled_s(machine, (pushes.ravel(), brakes.ravel()), (from_v, *ends, to_v), BAND_V, 100.0).min())


@pytest.mark.sampled
@pytest.mark.parametrize("lags", LAGS + RINGING)
@pytest.mark.parametrize(("from_v", "to_v"), [(0.0, 1.0), (0.0, 4.0), (2.0, 2.6), (5.0, 3.0)])
def test_it_comes_near_to_the_best_bang_bang_command_and_does_not_pass_the_wish(lags, from_v, to_v):
    course_v = Loop(lags, at_v=from_v).run(to_v, 2.0)
    way = 1.0 if to_v > from_v else -1.0
    assert (
        settled_s(course_v, to_v) <= 1.3 * bound_s(lags, from_v, to_v) + 0.07
    )  # two settings and a decision that waits
    assert max(way * (course_v - to_v)) < BAND_V


@pytest.mark.parametrize("lags", [(0.075, 0.02), (0.12, 0.02)])
@pytest.mark.parametrize(("from_v", "to_v"), [(6.5, 4.6), (3.2, 1.7)])
def test_a_way_down_hardly_passes_the_wish_where_the_shorter_lag_ends_before_a_setting_does(lags, from_v, to_v):
    """Friction would keep what has gone too far."""
    course_v = Loop(lags, at_v=from_v, wire_s=0.03).run(to_v, 1.0)
    assert to_v - min(course_v) < 0.04 * (from_v - to_v)


@pytest.mark.sampled
@pytest.mark.parametrize("lags", LAGS + RINGING)
def test_lags_that_are_a_tenth_off_make_no_more_than_a_tenth_of_the_step(lags):
    for off in (0.9, 1.1):
        course_v = Loop(lags, at_v=1.0, off=off).run(3.0, 2.0)
        assert max(course_v) < 3.0 + 0.1 * 2.0
        assert course_v[-1] == pytest.approx(3.0, abs=0.01)


@pytest.mark.parametrize("seed", range(6))
def test_whatever_is_wished_range_and_slew_hold_and_the_model_knows_what_was_sent(seed):
    rng = Random(seed)
    loop = Loop(rng.choice(LAGS + RINGING), wire_s=rng.choice([0.0, 0.01, 0.03]))
    for _ in range(30):
        loop.run(rng.uniform(0.0, 8.0), rng.uniform(0.01, 0.4))
    given_v = np.array(loop.given_v)
    assert given_v.min() >= 0.0
    assert given_v.max() <= LIMITS.voltage_max_v
    assert np.diff(given_v).max() <= LIMITS.voltage_slew_v_per_s * 0.015 + 1.0e-9
    assert loop.push.second_v == pytest.approx(loop.second_v, abs=0.02)


@pytest.mark.parametrize("lags", LAGS)
def test_at_rest_the_wish_itself_is_asked_for_and_one_beyond_the_range_passes(lags):
    loop = Loop(lags)
    loop.run(4.0, 4.0)
    assert loop.stage.voltage_v == 4.0
    assert loop.push.compensated_v(9.5, loop.stage.voltage_v) == 9.5
