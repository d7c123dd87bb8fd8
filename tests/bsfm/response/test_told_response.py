"""What a measured response says of itself, how long it remembers, and the small rules by which steps are fitted."""

from math import exp, pi, sqrt
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gateway.bsfm.response import identification, lag_fit
from gateway.bsfm.response.identification import FEWEST_STEPS, measure_response
from gateway.bsfm.response.lag_fit import (
    HUBER,
    LEAST_SCALE_N,
    ONE_LAG,
    RINGING,
    TWO_LAGS,
    LagFit,
    Shape,
    _guess,
    _HeldOut,
    _loss,
    _scale_n,
    _share_beyond_end,
    choose_shapes,
    interval,
)
from gateway.bsfm.response.response_model import Lags, StepResponse
from gateway.bsfm.response.second_order import SecondOrder


@pytest.mark.parametrize("lags", [(0.1, 0.02), (0.02, 0.1), (0.3, 0.001)])
def test_in_the_decay_time_what_is_left_falls_by_a_factor_e(lags: tuple[float, float]) -> None:
    slow = SecondOrder(*lags)
    assert slow.decay_s == max(lags)
    late, later = slow.after(20.0 * slow.decay_s), slow.after(21.0 * slow.decay_s)
    assert (later.sf + later.ss) / (late.sf + late.ss) == pytest.approx(exp(-1.0), rel=1e-6)


@pytest.mark.parametrize(("lag_s", "damping"), [(0.05, 0.2), (0.03, 0.6), (0.1, 0.95)])
def test_in_the_decay_time_a_swing_falls_by_a_factor_e(lag_s: float, damping: float) -> None:
    pair = SecondOrder(lag_s, lag_s, damping)
    swing_s = 2.0 * pi * pair.natural_s / sqrt(1.0 - damping**2)
    after = pair.after(swing_s)
    left = exp(-swing_s / pair.decay_s)
    assert (after.ff, after.ss) == pytest.approx((left, left))
    assert (after.fs, after.sf) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_poles_that_are_damped_by_one_are_two_equal_lags() -> None:
    assert [SecondOrder(0.1, 0.1, damping).is_ringing for damping in (0.0, 0.01, 0.99, 1.0, 2.0)] == [
        False,
        True,
        True,
        False,
        False,
    ]


def told(monkeypatch: pytest.MonkeyPatch, lags: Lags, lags_s: float, steps: int = FEWEST_STEPS) -> Any:
    """What is said of a fit with these lags."""
    fit = SimpleNamespace(dead_time_s=lags.dead_time_s, lags_s=lags_s, lags=lags, rms_n=0.21)
    step = SimpleNamespace(path_n=np.array([10.0, 25.0]))
    low, high = np.array([0.061, 0.09]), np.array([0.071, 0.15])
    for name, stand_in in {
        "step_responses_of": lambda *_: [step] * steps,
        "choose_shapes": lambda steps: (),
        "fit_lags": lambda steps, shapes: fit,
        "interval": lambda fit, steps: (low, high),
    }.items():
        monkeypatch.setattr(identification, name, stand_in)
    nothing: Any = None
    return measure_response(nothing, nothing, " on 2026-05-01")


@pytest.mark.parametrize(
    ("lags", "words"),
    [
        (Lags(0.066, 0.12), "lag 120 ms, in sum 120 [90, 150], 0.21 N RMS on the way"),
        (Lags(0.066, 0.08, 0.04), "lags 80 and 40 ms, in sum 120 [90, 150], 0.21 N RMS on the way"),
        (Lags(0.066, 0.06, 0.06, 0.35), "lags 60 and 60 ms, in sum 120 [90, 150], ringing with damping 0.35, 0.21 N"),
    ],
)
def test_a_response_tells_its_steps_its_lags_and_how_sure_they_are(
    lags: Lags, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    measured = told(monkeypatch, lags, 0.12)
    response = measured.response
    assert response.source.startswith("6 steps of 15-15 N on 2026-05-01: dead time 66 ms [61, 71], " + words)
    assert measured.description == f"response: {response.source}"
    assert (response.dead_time_s, response.lag_s) == (0.066, lags.lag_s)
    assert (response.second_lag_s, response.damping) == (lags.second_lag_s, lags.damping)


@pytest.mark.parametrize(
    ("lags", "lags_s"),
    [(Lags(2.0, 0.1), 0.1), (Lags(-0.001, 0.1), 0.1), (Lags(0.1, 2.0), 2.0), (Lags(0.1, 1e-3), 1e-3)],
)
def test_times_that_no_plant_has_are_no_response(lags: Lags, lags_s: float, monkeypatch: pytest.MonkeyPatch) -> None:
    measured = told(monkeypatch, lags, lags_s)
    assert measured.response is None
    assert measured.description.endswith("which no plant of this kind has")
    assert f"dead time {lags.dead_time_s * 1e3:.0f} ms" in measured.why_not


def test_too_few_steps_are_told_with_how_many_are_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert told(monkeypatch, Lags(0.1, 0.1), 0.1, FEWEST_STEPS).response is not None
    few = told(monkeypatch, Lags(0.1, 0.1), 0.1, FEWEST_STEPS - 1)
    assert few.description == "the response was not measured: 5 steps of 3 N or more with enough readings, 6 are needed"


def step_of(share: np.ndarray, way: float, at_s: float = 5.0) -> StepResponse:
    """A step of 20 N, 50 readings a second, of which so much has come."""
    start_n, end_n = (10.0, 30.0) if way > 0.0 else (30.0, 10.0)
    time_s = at_s + 0.02 * np.arange(1, share.size + 1)
    ends_v, nothing = np.array([2.0, 4.0]), np.zeros(2)
    end_v = 4.0 if way > 0.0 else 2.0
    changes = ((at_s, 2.0 * way),)
    path_n = np.array([10.0, 30.0])
    return StepResponse(time_s, start_n + share * (end_n - start_n), changes, end_v, ends_v, path_n, nothing, nothing)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_how_far_a_step_passes_its_end_is_its_peak_of_three_readings_whichever_way_it_goes(way: float) -> None:
    beyond = np.concatenate([np.linspace(0.0, 1.0, 20), [1.09, 1.12, 1.09], np.ones(20)])
    single = np.concatenate([np.linspace(0.0, 1.0, 20), [1.3], np.ones(20)])
    assert _share_beyond_end([step_of(beyond, way)]) == pytest.approx(0.1)
    assert _share_beyond_end([step_of(single, way)]) == pytest.approx(0.1)
    assert _share_beyond_end([step_of(np.linspace(0.0, 0.99, 20), way)]) == 0.0
    assert _share_beyond_end([step_of(beyond, way), *[step_of(np.ones(30), -way)] * 2]) == 0.0, "the median"


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_guess_is_near_the_dead_time_and_the_lag_of_a_plain_plant(way: float) -> None:
    since_s = 0.02 * np.arange(1, 101) - 0.1
    dead_time_s, lags_s = _guess([step_of(1.0 - np.exp(-np.maximum(since_s, 0.0) / 0.3), way)] * 3)
    assert dead_time_s == pytest.approx(0.1, abs=0.03)
    assert lags_s == pytest.approx(0.3, abs=0.06)
    at_once = _guess([step_of(np.ones(30), way)])
    assert at_once == (pytest.approx(0.018, abs=1e-9), pytest.approx(0.011))


def test_an_error_counts_by_its_square_up_to_a_bound_and_by_its_size_beyond() -> None:
    assert _loss(np.array([0.2, -0.2]), 0.2) == pytest.approx(1.0)
    far = _loss(np.array([10.0]), 1.0)
    assert far == pytest.approx(HUBER * (10.0 - 0.5 * HUBER))
    assert _loss(np.array([HUBER]), 1.0) == pytest.approx(0.5 * HUBER**2)
    assert _loss(np.array([11.0]), 1.0) - far == pytest.approx(HUBER)


def test_the_noise_of_a_reading_is_that_of_the_settled_ends_and_never_nothing() -> None:
    still = step_of(np.ones(40), 1.0)
    noisy = step_of(np.ones(40) + 0.05 * np.where(np.arange(40) % 2, 1.0, -1.0), 1.0)
    assert _scale_n([still]) == LEAST_SCALE_N
    assert _scale_n([noisy, noisy, still]) == pytest.approx(1.0)


def test_an_interval_holds_the_fit_and_narrows_with_more_steps() -> None:
    rng = np.random.default_rng(3)
    lags, shape = Lags(0.1, 0.2), Shape(0.0)
    fit = LagFit(0.1, 0.2, shape, 0.0, 0.0)
    clean = step_of(np.zeros(60), 1.0)
    expected_n = clean.expected_n(lags)

    def noisy() -> StepResponse:
        return step_of((expected_n + rng.normal(0.0, 0.2, 60) - 10.0) / 20.0, 1.0)

    widths = []
    for count in (8, 128):
        low, high = interval(fit, [noisy() for _ in range(count)])
        assert np.all(low < fit.place) and np.all(fit.place < high)
        widths.append(high - low)
    assert np.all(widths[1] < 0.5 * widths[0])
    assert 1e-4 < widths[1][0] < 0.02


@pytest.mark.parametrize(
    ("two", "are_equal", "beyond", "pair", "chosen"),
    [
        (0.99, False, 0.0, 0.1, ONE_LAG),
        (0.98, False, 0.0, 0.1, TWO_LAGS),
        (0.98, True, 0.0, 0.85, RINGING),
        (0.98, True, 0.0, 0.89, TWO_LAGS),
        (0.99, False, 0.06, 0.85, RINGING),
        (0.99, False, 0.05, 0.1, ONE_LAG),
        (1.2, True, 0.0, 0.89, RINGING),
    ],
)
def test_a_second_lag_and_a_pair_of_poles_must_each_be_better_in_steps_that_they_have_not_seen(
    two: float, are_equal: bool, beyond: float, pair: float, chosen: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    losses = {ONE_LAG: (1.0, False), TWO_LAGS: (two, are_equal), RINGING: (pair, True)}
    monkeypatch.setattr(lag_fit, "_compute_held_out_loss", lambda steps, shapes: _HeldOut(*losses[shapes]))
    monkeypatch.setattr(lag_fit, "_share_beyond_end", lambda steps: beyond)
    assert choose_shapes([]) == chosen
