"""What control derives from a measured response: margins that hold for errors of every number, and who rules."""

from dataclasses import replace
from itertools import product
from math import pi

import numpy as np
import pytest

from gateway.bsfm.model import Response
from gateway.control import CalibrationInUse, LineStatus, Trim
from gateway.control.force_loop.force_loop import ForceLoop
from gateway.control.force_loop.lag_inverse import LagInverse
from gateway.control.force_loop.response_timing import timing_of
from gateway.control.settings import ResponseSource
from tests.control.bench import Bench, bsfm, settings

RESPONSES = [
    Response(dead_time_s=d, lag_s=a, second_lag_s=b)
    for d, a, b in product((0.02, 0.08, 0.15), (0.03, 0.1, 0.3), (0.0, 0.03))
]
HELD_S = 0.02  # a tick and a sample, as further dead time
FREQUENCIES = np.geomspace(0.05, 300.0, 4000)


def loop(response: Response, off: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> np.ndarray:
    """Of the trim with its predictor, over FREQUENCIES, on a plant whose gain, dead time and lags are off by these factors."""
    timing = timing_of(response, settings()).timing
    assert timing
    push, s = (
        LagInverse(timing.lags, settings().limits),
        1j * FREQUENCIES,
    )
    bend_s2 = push.horizon_s**2 if timing.lags.second_lag_s else 0.0
    landed = 1.0 / (s * s * bend_s2 + s * push.landing_s + 1.0)
    predicted = landed * np.exp(-s * timing.dead_time_s)
    plant = off[0] * landed * np.exp(-s * (off[1] * response.dead_time_s + HELD_S))
    for lag_s in (timing.lags.lag_s, timing.lags.second_lag_s):
        plant *= lag_s * s + 1.0
    for lag_s in (response.lag_s, response.second_lag_s):
        plant /= off[2] * lag_s * s + 1.0
    return timing.integral_per_s / (s + timing.integral_per_s * (1.0 - predicted)) * plant


def margin(found: np.ndarray) -> float:
    """Gain margin: the smallest over all frequencies at which the phase passes -180 degrees."""
    phases = np.unwrap(np.angle(found))
    passes = np.flatnonzero((phases[:-1] > -pi) & (phases[1:] <= -pi))
    return float(min((1.0 / abs(found[k]) for k in passes), default=9.0))


@pytest.mark.parametrize("response", RESPONSES)
def test_the_loop_of_the_trim_has_a_gain_margin_of_three(response):
    assert margin(loop(response)) >= 3.0
    assert float(np.max(1.0 / np.abs(1.0 + loop(response)))) <= 1.62


@pytest.mark.parametrize("response", RESPONSES)
def test_it_keeps_a_margin_when_everything_is_off_by_thirty_percent(response):
    assert min(margin(loop(response, off)) for off in product((0.7, 1.3), repeat=3)) >= 1.5


def test_everything_follows_from_the_response():
    slow = timing_of(Response(dead_time_s=0.12, lag_s=0.2, second_lag_s=0.1), settings())
    quick = timing_of(Response(dead_time_s=0.03, lag_s=0.05), settings())
    assert slow.timing
    assert quick.timing
    assert slow.timing.integral_per_s < 0.6 * quick.timing.integral_per_s
    assert slow.supervision.response_lag_s == pytest.approx(0.42)
    assert slow.supervision.unreachable_s == pytest.approx(2.1)
    assert quick.supervision.unreachable_s == settings().supervision.unreachable_s > 1.0, "a person has to see it, too"
    assert (slow.lead.lag_s, slow.lead.second_lag_s) == (0.2, 0.1)
    assert slow.limits == settings().limits
    assert slow.trim == settings().trim


@pytest.mark.parametrize(
    ("lags_ms", "dead_ms", "left_ms"),
    [((87, 9), 132, (87, 0)), ((120, 33), 156, (120, 0)), ((38, 36), 123, (38, 36)), ((250, 60), 123, (250, 60))],
)
def test_a_second_lag_that_no_setting_can_brake_counts_as_dead_time(lags_ms, dead_ms, left_ms):
    """Of a single lag the steps' fit makes two, with cell, wire and ticks; to invert the second overruns each way down."""
    lag_s, second_lag_s = (ms * 1e-3 for ms in lags_ms)
    timing = timing_of(Response(dead_time_s=0.123, lag_s=lag_s, second_lag_s=second_lag_s), settings()).timing
    assert timing
    assert timing.dead_time_s == pytest.approx(dead_ms * 1e-3)
    assert (timing.lags.lag_s, timing.lags.second_lag_s) == pytest.approx([ms * 1e-3 for ms in left_ms])


def test_a_plant_that_rings_keeps_both_of_its_lags():
    """They say where its pair of poles is, and not how long two lags are."""
    rings = Response(dead_time_s=0.02, lag_s=0.1, second_lag_s=0.01, damping=0.5)
    timing = timing_of(rings, settings()).timing
    assert timing and (timing.dead_time_s, timing.lags.delay_s, timing.lags.damping) == (0.02, 0.11, 0.5)


def test_without_a_response_or_by_the_rigs_word_nothing_changes():
    response, rig = Response(dead_time_s=0.1, lag_s=0.1), replace(settings(), response=ResponseSource.RIG)
    assert timing_of(None, settings()) == settings()
    assert timing_of(response, rig) == rig


def pressing(response: Response | None, seed: int = 1, **plant: float) -> Bench:
    bench = Bench(settings(), seed=seed, **plant)
    bench.controller.use(CalibrationInUse(bsfm(), 1, response))
    bench.run(0.1)
    bench.enable(20.0)
    bench.run(2.0)
    return bench


def test_a_response_is_taken_into_use_and_out_of_it_without_a_bump():
    own = Response(dead_time_s=0.03, lag_s=0.08, second_lag_s=0.015)
    bench = pressing(None, gain_n_per_v=7.0)
    for response in (own, None, own):
        before_v = bench.last.voltage_v
        bench.controller.use(CalibrationInUse(bsfm(), 2, response))
        assert bench.step().voltage_v == pytest.approx(before_v, abs=0.03)
        first = len(bench.history)
        bench.run(1.5)
        assert max(abs(record.force_n - 20.0) for record in bench.history[first:]) < 0.8


@pytest.mark.parametrize("seed", range(4))
def test_a_model_that_is_nearly_the_same_moves_nothing(seed):
    """The correction goes on where it stood, and no noise is followed by a trim that would have to learn it anew."""
    own = Response(dead_time_s=0.03, lag_s=0.08, second_lag_s=0.015)
    left, swapped = (pressing(own, gain_n_per_v=6.6, noise_n=0.15, seed=seed) for _ in range(2))
    for bench in (left, swapped):
        bench.run(3.0)
    swapped.controller.use(CalibrationInUse(bsfm(1.0001), 2, own))
    first = len(left.history)
    for bench in (left, swapped):
        bench.run(0.5)
    assert abs(left.history[first].output.trim_v) > 0.01, "there is a correction that could be lost"
    both = zip(left.history[first:], swapped.history[first:], strict=True)
    assert max(abs(one.output.voltage_v - other.output.voltage_v) for one, other in both) < 0.002


def test_a_trim_of_gain_nothing_stays_off():
    off = replace(settings(), trim=Trim())
    bench = Bench(off, gain_n_per_v=6.8)
    bench.controller.use(CalibrationInUse(bsfm(), 1, Response(dead_time_s=0.03, lag_s=0.08)))
    bench.run(0.1)
    bench.enable(20.0)
    bench.run(3.0)
    assert all(record.output.trim_v == 0.0 for record in bench.history)


def test_what_the_trim_takes_of_an_error_is_taken_off_what_is_still_expected_of_it():
    bench, told_n = pressing(Response(dead_time_s=0.03, lag_s=0.08), gain_n_per_v=6.6), []
    trim, estimate = bench.controller._loop._trim, bench.controller._loop._transient
    bench.force(30.0)
    bench.run(0.3)
    correct, before_n = estimate.correct, trim.value_n
    estimate.correct = lambda change_n: (told_n.append(change_n), correct(change_n))
    bench.run(1.0)
    assert abs(trim.value_n - before_n) > 0.1
    assert sum(told_n) == pytest.approx(trim.value_n - before_n)


def test_what_is_still_within_a_long_dead_time_is_not_learned():
    bench = Bench(settings(), gain_n_per_v=7.12, delay_s=0.25, lag_s=0.05, noise_n=0.03)
    bench.controller.use(CalibrationInUse(bsfm(), 1, Response(dead_time_s=0.265, lag_s=0.05)))
    bench.run(0.1)
    bench.enable(20.0)
    bench.run(3.0)
    for force_n in (23.0, 26.0, 29.0, 26.0, 23.0):
        bench.history.clear()
        bench.force(force_n)
        bench.run(0.5)
        assert max(abs(record.output.trim_v) for record in bench.history) < 0.2
        bench.run(1.0)


def test_a_response_that_comes_later_is_expected_as_one_from_the_start():
    timed = timing_of(Response(dead_time_s=0.2, lag_s=0.3), settings())
    later, first = ForceLoop(settings(), bsfm()), ForceLoop(timed, bsfm())
    later.use(bsfm(), 0.0, timed)
    for loop in (later, first):
        for _ in range(10):
            loop.drive_run(4.0, 1.0)
            loop.elapse(0.01, LineStatus())
    assert 0.0 < first.expected_n < 0.5 * bsfm().force_n(2.0, 1.0)
    assert later.expected_n == first.expected_n
