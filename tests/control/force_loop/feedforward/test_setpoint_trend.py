"""A setpoint that moves steadily is continued; one that jumps, stands or comes seldom is taken as it is."""

from collections.abc import Callable
from math import pi, sin
from random import Random

import pytest

from gateway.control.force_loop.feedforward import AHEAD_N, Feedforward
from gateway.control.force_loop.setpoint_trend import JUMP_N, LONGEST_S, MOST_N, SetpointTrend
from gateway.profiles import load_calibration, load_rig

TICK_S = 0.01
AHEAD_S = 0.15


def trend_after(setpoint: Callable[[float], float], every_s: float, until_s: float) -> SetpointTrend:
    """A master writes every every_s, control steps every tick."""
    trend, written_n = SetpointTrend(), setpoint(0.0)
    ticks_per_write = round(every_s / TICK_S)
    for tick in range(round(until_s / TICK_S) + 1):
        if tick % ticks_per_write == 0:
            written_n = setpoint(tick * TICK_S)
        trend.advance(written_n, TICK_S)
    return trend


@pytest.mark.parametrize("every_s", [0.01, 0.02, 0.04, 0.05])
@pytest.mark.parametrize("at_s", [0.6, 1.1, 1.6, 2.1])
def test_a_sine_is_foreseen_three_times_better_than_it_is_awaited(every_s: float, at_s: float) -> None:
    def wanted_n(now_s: float) -> float:
        return round(20.0 + 8.0 * sin(pi * now_s), 2)

    trend = trend_after(wanted_n, every_s, at_s)
    last_s = at_s - round(at_s / TICK_S) % round(every_s / TICK_S) * TICK_S
    error_n = wanted_n(last_s) + trend.ahead_n(AHEAD_S) - wanted_n(at_s + AHEAD_S)
    awaited_n = max(abs(wanted_n(last_s) - wanted_n(at_s + AHEAD_S)), 1.5)
    assert abs(error_n) < 0.35 * awaited_n


def test_a_steady_ramp_is_continued_exactly() -> None:
    assert trend_after(lambda now_s: 10.0 * now_s, 0.02, 1.0).ahead_n(AHEAD_S) == pytest.approx(1.5, abs=0.01)


@pytest.mark.parametrize("size_n", [0.5, 3.0, 20.0])
def test_a_step_is_taken_as_it_is(size_n: float) -> None:
    assert trend_after(lambda now_s: 10.0 + size_n * (now_s >= 0.5), 0.02, 0.5).ahead_n(AHEAD_S) == 0.0


def test_values_that_come_seldom_are_steps() -> None:
    assert trend_after(lambda now_s: 5.0 * now_s, LONGEST_S + 0.04, 2.0).ahead_n(AHEAD_S) == 0.0


def test_a_path_that_stops_is_followed_no_further_once_a_value_is_overdue() -> None:
    moving = trend_after(lambda now_s: 10.0 * min(now_s, 1.0), 0.02, 1.0)
    stopped = trend_after(lambda now_s: 10.0 * min(now_s, 1.0), 0.02, 1.06)
    assert moving.ahead_n(AHEAD_S) > 1.0
    assert stopped.ahead_n(AHEAD_S) == 0.0


def test_what_is_added_is_bounded() -> None:
    assert trend_after(lambda now_s: 49.0 * JUMP_N * now_s, 0.02, 0.5).ahead_n(1.0) == MOST_N


@pytest.mark.parametrize("period", [3, 12])
@pytest.mark.parametrize("every_s", [0.0, 0.0002, 0.0015])
def test_a_burst_of_values_is_no_path(every_s: float, period: int) -> None:
    """As a network hands over what it has held back: 0.02 N to and fro in no time were continued by 4 N."""
    trend = SetpointTrend()
    for _ in range(50):
        trend.advance(12.0, TICK_S)
    added_n = [0.0]
    for k in range(300 if period == 3 else period):
        trend.advance(12.0 + 0.01 * (k % period), every_s)
        added_n.append(abs(trend.ahead_n(AHEAD_S)))
    assert max(added_n) == 0.0


@pytest.mark.parametrize("size_n", [0.01, 0.1, 1.0])
@pytest.mark.parametrize("every_s", [0.01, 0.02, 0.05])
def test_a_setpoint_that_goes_to_and_fro_is_not_continued(every_s: float, size_n: float) -> None:
    """An analog input, or a master that regulates by itself: 12 and 13 N in turn, 20 times a second, made 15 N."""
    for until_s in (1.0, 1.01, 1.02, 1.03):
        trend = trend_after(lambda now_s: 12.0 + size_n * (round(now_s / every_s) % 2), every_s, until_s)
        assert trend.ahead_n(AHEAD_S) == 0.0


@pytest.mark.parametrize("every_s", [0.01, 0.02])
@pytest.mark.parametrize("noise_n", [0.02, 0.1])
def test_the_noise_of_a_setpoint_is_hardly_continued(every_s: float, noise_n: float) -> None:
    """Of 0.1 N it made 4 N to and fro, and of a held force 1.6 N too little."""
    rng = Random(5)
    trend, added_n, written_n = SetpointTrend(), [], 12.0
    for tick in range(2000):
        if tick % round(every_s / TICK_S) == 0:
            written_n = round(12.0 + rng.gauss(0.0, noise_n), 2)
        trend.advance(written_n, TICK_S)
        added_n.append(trend.ahead_n(AHEAD_S))
    assert sum(one * one for one in added_n) / len(added_n) < (5.0 * noise_n) ** 2


def test_a_restart_forgets_the_path() -> None:
    trend = trend_after(lambda now_s: 10.0 * now_s, 0.02, 1.0)
    trend.restart()
    assert trend.ahead_n(AHEAD_S) == 0.0


@pytest.mark.parametrize("rate_n_per_s", [5.0, 20.0, 100.0, 200.0])
def test_a_ramp_of_ours_runs_ahead_and_remains_a_ramp(rate_n_per_s: float) -> None:
    """The aim leads by what the force is late, and no fast ramp becomes a jump; a release is not led at all."""
    dead_s, lag_s = 0.1, 0.05
    law = Feedforward(load_calibration("demo").model(), load_rig("demo").control.limits, lag_s, dead_s, dead_s + 0.01)
    law.take_over(26.0)
    law.advance(2.0, rate_n_per_s, TICK_S)
    led_n = law.applied_n - law.aimed_n
    assert led_n == pytest.approx(min(rate_n_per_s * (dead_s + 0.01), max(AHEAD_N, rate_n_per_s * lag_s)))
    assert led_n <= 0.4 * 26.0
    law.advance(0.0, rate_n_per_s, TICK_S)
    assert law.aimed_n == law.applied_n
