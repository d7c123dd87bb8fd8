"""Dead time and lags from the rows of a run: what was put in comes out, whatever the sample rate, noise and static model."""

from functools import cache
from math import exp, inf
from random import Random

import numpy as np
import pytest

from gateway.bsfm import Branches, Bsfm, LinearBlend, RationalBezier
from gateway.bsfm.response.identification import MeasuredResponse, measure_response
from gateway.bsfm.response.response_model import missing_share
from gateway.bsfm.response.step_responses import RecordedRun

STANDS_V = 1.0e-5
"""A voltage that has moved by less moves no force: 75 uN, where the force is found to 230 uN. Half of a run stands so."""
LEVELS_V = (0.0, 2.0, 4.0, 6.0, 2.0, 6.0, 4.0, 2.0, 4.0, 6.0, 2.0, 6.0, 4.0, 2.0)
HELD_S = 2.0


def model(bow_n: float = 0.0) -> Bsfm:
    """0 .. 8 V, 0 .. 60 N, a loop of a few newtons; bow_n: how far off the middle of both branches is."""
    rising = RationalBezier(0.0, 8.0, [0.0, 24.0 + bow_n, 60.0], [1.0, 1.0, 1.0])
    falling = RationalBezier(0.0, 8.0, [0.0, 30.0 + bow_n, 60.0], [1.0, 1.0, 1.0])
    return Bsfm(Branches(rising, falling), LinearBlend(6.0))


class Plant:
    """The model's own force behind a dead time and two lags: return-point memory is the model's, so friction is in it."""

    def __init__(self, dead_time_s: float, lag_s: float, second_lag_s: float, damping: float = 0.0) -> None:
        self.dead_time_s, self.lags_s, self.damping = dead_time_s, (lag_s, second_lag_s), damping
        self.speed = 0.0
        self.first_v = self.second_v = 0.0
        self.asked_v = inf
        self.bsfm = model()
        self.memory, self.force_n = self.bsfm.reversal.start(), self.bsfm.branches.falling.value(0.0)

    def force(self, voltage_v: float, step_s: float) -> float:
        self._follow(voltage_v, step_s)
        if abs(self.second_v - self.asked_v) < STANDS_V:
            return self.force_n
        self.asked_v = self.second_v
        way = 1.0 if voltage_v > self.second_v else -1.0
        if self.damping:
            way = 1.0 if self.speed > 0.0 else -1.0
        target_n = self._settled_n(self.second_v, way)
        if (target_n - self.force_n) * way > 0.0:
            self.memory = self.bsfm.memory_after(self.memory, self.force_n, target_n)
            self.force_n = target_n
        return self.force_n

    def _follow(self, voltage_v: float, step_s: float) -> None:
        first_s, second_s = self.lags_s
        if self.damping:
            natural_s = 0.5 * (first_s + second_s) / self.damping
            self.speed += (
                step_s * ((voltage_v - self.second_v) / natural_s - 2.0 * self.damping * self.speed) / natural_s
            )
            self.second_v += step_s * self.speed
            return
        self.first_v += (1.0 - exp(-step_s / first_s)) * (voltage_v - self.first_v)
        self.second_v += (
            (1.0 - exp(-step_s / second_s)) * (self.first_v - self.second_v)
            if second_s
            else self.first_v - self.second_v
        )

    def _settled_n(self, voltage_v: float, way: float) -> float:
        """The force on the way from here at which the model asks for this voltage, by bisection."""
        near_n, far_n = self.force_n, self.force_n + way * 60.0
        for _ in range(18):
            middle_n = 0.5 * (near_n + far_n)
            share = self.bsfm.branch_share(self.bsfm.memory_after(self.memory, self.force_n, middle_n))
            asked_v, _ = self.bsfm.voltage_v(max(0.0, min(60.0, middle_n)), share)
            near_n, far_n = (middle_n, far_n) if way * (voltage_v - asked_v) > 0.0 else (near_n, middle_n)
        return near_n


@cache
def run(
    dead_time_s: float, lag_s: float, second_lag_s: float, rate_hz: float = 100.0, noise_n: float = 0.1
) -> MeasuredResponse:
    return run_on(Plant(dead_time_s, lag_s, second_lag_s), rate_hz, noise_n)


def run_on(plant: Plant, rate_hz: float = 100.0, noise_n: float = 0.1) -> MeasuredResponse:
    """Steps between three levels, as a run's recording has them; the fit is given another, bent model."""
    rng, step_s, dead_time_s = Random(4), 0.005, plant.dead_time_s
    rows, sent, sample_s, level, changed_s = [], [(0.0, 0.0)], 0.0, 0, 0.0
    for k in range(round(len(LEVELS_V) * HELD_S / step_s)):
        now_s = k * step_s
        heard_v = next(volts for at_s, volts in reversed(sent) if at_s <= max(0.0, now_s - step_s - dead_time_s))
        force_n = plant.force(heard_v, step_s)
        if now_s >= sample_s - 1.0e-9:
            sample_s += 1.0 / rate_hz
            if now_s - changed_s >= HELD_S and level + 1 < len(LEVELS_V):
                level, changed_s = level + 1, now_s
                sent.append((now_s, LEVELS_V[level]))
            rows.append((now_s, LEVELS_V[level], force_n + rng.gauss(0.0, noise_n)))
    table = np.array(rows)
    return measure_response(RecordedRun(table[:, 0], table[:, 1], table[:, 2]), model(bow_n=1.5))


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("dead_time_s", "lag_s", "second_lag_s", "rate_hz", "noise_n"),
    [
        (0.08, 0.07, 0.07, 100.0, 0.1),
        (0.15, 0.3, 0.0, 50.0, 0.3),
        (0.02, 0.1, 0.03, 100.0, 0.02),
        (0.05, 0.2, 0.1, 10.0, 0.05),
    ],
)
def test_what_was_put_in_comes_out_whatever_rate_and_noise(dead_time_s, lag_s, second_lag_s, rate_hz, noise_n):
    response = run(dead_time_s, lag_s, second_lag_s, rate_hz, noise_n).response
    assert response
    whole_s = dead_time_s + lag_s + second_lag_s
    assert response.dead_time_s + response.lag_s + response.second_lag_s == pytest.approx(whole_s, rel=0.04)
    assert response.dead_time_s == pytest.approx(dead_time_s, abs=0.005 + 0.1 / rate_hz + 0.03 * lag_s)
    assert response.lag_s + response.second_lag_s == pytest.approx(lag_s + second_lag_s, rel=0.08)


def test_one_lag_is_not_taken_for_two_and_two_not_for_one():
    one, two = run(0.05, 0.12, 0.0).response, run(0.05, 0.06, 0.06).response
    assert one
    assert one.second_lag_s < 0.15 * one.lag_s
    assert two
    assert two.second_lag_s > 0.5 * two.lag_s


@pytest.mark.parametrize("damping", [0.4, 0.6])
def test_a_plant_that_rings_is_measured_with_its_damping_and_one_of_two_equal_lags_is_not_taken_for_it(damping):
    measured = run_on(Plant(0.05, 0.08 * damping, 0.08 * damping, damping))
    assert measured.response
    assert measured.response.damping == pytest.approx(damping, abs=0.06)
    assert measured.response.dead_time_s == pytest.approx(0.05, abs=0.008)
    assert measured.response.lag_s + measured.response.second_lag_s == pytest.approx(0.16 * damping, rel=0.06)
    assert f"ringing with damping {measured.response.damping:.2f}" in measured.response.source
    equal = run(0.05, 0.06, 0.06).response
    assert equal
    assert equal.damping == 0.0


def test_the_source_tells_from_what_and_how_sure():
    response = run(0.08, 0.07, 0.07, 100.0, 0.1).response  # which has been run
    assert response
    assert response.source.startswith("13 steps of ")
    assert "dead time" in response.source
    assert "[" in response.source


def test_a_record_without_large_steps_gives_no_response_but_a_sentence():
    time_s = np.arange(0.0, 20.0, 0.01)
    command_v = 2.0 + 0.1 * (time_s % 4.0 > 2.0)
    measured = measure_response(RecordedRun(time_s, command_v, 15.0 + command_v), model())
    assert measured.response is None
    assert "not measured: 0 steps" in measured.description


def test_a_force_that_does_not_follow_gives_no_response():
    time_s = np.arange(0.0, 40.0, 0.02)
    command_v = np.where(time_s % 4.0 > 2.0, 5.0, 1.0)
    measured = measure_response(RecordedRun(time_s, command_v, np.full_like(time_s, 12.0)), model())
    assert measured.response is None


def test_the_share_that_is_missing_is_continuous_from_one_lag_to_two_equal_ones():
    since_s = np.linspace(0.0, 1.0, 50)
    almost, equal = missing_share(since_s, 0.1, 0.1 * (1.0 - 1.1e-4)), missing_share(since_s, 0.1, 0.1)
    np.testing.assert_allclose(almost, equal, atol=1.0e-3)
    np.testing.assert_allclose(missing_share(since_s, 0.1, 0.0011), missing_share(since_s, 0.1, 0.0), atol=0.02)
