"""The fit of dead time and lags to steps that are known: where few readings lie on the way, a wrong minimum is not taken."""

from random import Random

import numpy as np
import pytest
from scipy.optimize import minimize

from gateway.bsfm.response.lag_fit import (
    ONE_LAG,
    RINGING,
    TWO_LAGS,
    Shapes,
    _compute_held_out_loss,
    _loss,
    _residual_at,
    _scale_n,
    choose_shapes,
    fit_lags,
    interval,
)
from gateway.bsfm.response.response_model import JoinedSteps, Lags, StepResponse, missing_share
from gateway.bsfm.response.second_order import SecondOrder

TRUE = Lags(0.064, 0.092, 0.028)


def step(rng: Random, lags: Lags, rate_hz: float, noise_n: float) -> StepResponse:
    """A step of 1 to 3 V on a straight plant of 8 N/V, the first reading late."""
    up_v = rng.choice([-1.0, 1.0]) * rng.uniform(1.0, 3.0)
    ends_v = np.sort([3.0, 3.0 + up_v])
    time_s = (
        rng.uniform(0.9, 1.0) / rate_hz + np.arange(round(1.5 * rate_hz)) / rate_hz
    )  # the guess takes lags for dead time
    nothing = np.zeros(2)
    blank = StepResponse(
        time_s, nothing, ((0.0, up_v),), 3.0 + up_v, ends_v, 8.0 * ends_v, np.array([0.0, 9.0]), nothing
    )
    force_n = blank.expected_n(lags) + [rng.gauss(0.0, noise_n) for _ in time_s]
    return StepResponse(time_s, force_n, blank.changes, blank.end_v, ends_v, 8.0 * ends_v, blank.back_v, nothing)


@pytest.mark.parametrize("seed", range(3))
def test_ten_readings_a_second_are_enough_for_many_steps(seed):
    rng = Random(seed)
    steps = [step(rng, TRUE, 10.0, 0.02) for _ in range(30)]
    fit = fit_lags(steps, TWO_LAGS)
    assert fit.dead_time_s == pytest.approx(TRUE.dead_time_s, abs=0.006)
    assert fit.lags_s == pytest.approx(TRUE.lag_s + TRUE.second_lag_s, abs=0.01)
    assert choose_shapes(steps) == TWO_LAGS


@pytest.mark.parametrize("pair", [SecondOrder(0.1, 0.04), SecondOrder(0.05, 0.05, 0.6), SecondOrder(0.03, 0.03, 0.3)])
def test_what_is_left_of_a_step_is_what_the_states_of_the_same_plant_say(pair):
    since_s = np.linspace(0.0, 0.8, 60)
    left = missing_share(since_s, pair.lag_s, pair.second_lag_s, pair.damping)
    for at_s, share in zip(since_s.tolist(), left.tolist(), strict=True):
        moved = pair.after(at_s)
        assert moved.sf + moved.ss == pytest.approx(share, abs=1.0e-9)
    once, twice = pair.after(0.07), pair.after(0.14)
    assert once.sf * once.ff + once.ss * once.sf == pytest.approx(twice.sf)
    assert once.sf * once.fs + once.ss * once.ss == pytest.approx(twice.ss)


def bent_step(rng: Random) -> StepResponse:
    """A step in several changes, of a plant whose path is bent, with readings at times of their own."""
    way = rng.choice([-1.0, 1.0])
    changes = tuple((0.01 * k + rng.uniform(0.0, 0.005), way * rng.uniform(0.1, 0.8)) for k in range(rng.randint(1, 7)))
    end_v = rng.uniform(3.0, 6.0)
    from_v = end_v - sum(by_v for _, by_v in changes[-3:])  # of the others a part may still be on its way
    path_v = np.sort([from_v, end_v, *(rng.uniform(*sorted((from_v, end_v))) for _ in range(5))])
    path_n = np.sort([rng.uniform(0.0, 40.0) for _ in path_v])
    time_s = np.sort([rng.uniform(-0.05, 0.6) for _ in range(rng.randint(4, 30))])
    back_v, back_n = np.array([0.0, 0.3, 0.9]), np.array([0.0, 1.0, 6.0])
    return StepResponse(time_s, 0.5 * time_s, changes, end_v, path_v, path_n, back_v, back_n)


def force_of_one_n(step: StepResponse, lags: Lags) -> list[float]:
    """Reading by reading, change by change."""
    arrived_v = [
        step.end_v
        - sum(
            by_v * float(missing_share(np.array([now_s - at_s - lags.dead_time_s]), *sorted_lags(lags))[0])
            for at_s, by_v in step.changes
        )
        for now_s in step.time_s.tolist()
    ]
    on_way_n = np.interp(arrived_v, step.path_v, step.path_n)
    return (step.with_overshoot(np.array(arrived_v), on_way_n) if lags.damping else on_way_n).tolist()


def sorted_lags(lags: Lags) -> tuple[float, float, float]:
    return lags.lag_s, lags.second_lag_s, lags.damping


@pytest.mark.parametrize("lags", [TRUE, Lags(0.02, 0.08), Lags(0.0, 0.05, 0.05), Lags(0.04, 0.06, 0.06, 0.4)])
def test_many_steps_at_once_give_each_the_force_that_it_has_alone(lags: Lags) -> None:
    rng = Random(5)
    steps = [bent_step(rng) for _ in range(25)]
    joined = JoinedSteps(steps)
    alone_n = [force_n for step in steps for force_n in force_of_one_n(step, lags)]
    assert joined.expected_n(lags).tolist() == pytest.approx(alone_n, abs=1e-9)
    assert joined.force_n.tolist() == [force_n for step in steps for force_n in step.force_n.tolist()]


def test_shapes_are_judged_by_steps_that_their_fit_has_not_seen() -> None:
    """Every other step of another plant: each half fits its own without an error, and the other half not at all."""
    rng, equal, apart = Random(2), Lags(0.02, 0.05, 0.05), Lags(0.02, 0.19, 0.01)
    of_two = [step(rng, lags, 50.0, 0.0) for _ in range(4) for lags in (equal, apart)]
    held_out = _compute_held_out_loss(of_two, TWO_LAGS)
    seen = sum(fit_lags(half, TWO_LAGS).loss for half in (of_two[::2], of_two[1::2]))
    assert held_out.loss > 10.0 * seen and not held_out.are_equal
    of_one = _compute_held_out_loss([step(rng, equal, 50.0, 0.0) for _ in range(8)], TWO_LAGS)
    assert of_one.loss < 0.01 * held_out.loss and of_one.are_equal


def test_the_interval_is_as_wide_as_nineteen_in_twenty_fits_scatter() -> None:
    found, half = [], []
    for seed in range(24):
        rng = Random(seed)
        steps = [step(rng, Lags(0.05, 0.1), 50.0, 0.3) for _ in range(12)]
        fit = fit_lags(steps, ONE_LAG)
        low, high = interval(fit, steps)
        found.append(fit.place)
        half.append(0.5 * (high - low))
    scatter = np.std(found, axis=0, ddof=1)
    assert np.mean(half, axis=0) == pytest.approx(1.96 * scatter, rel=0.35)


@pytest.mark.parametrize("dead_time_s", [0.0, 0.004, 0.08])
def test_steps_without_noise_give_their_lags_back_and_no_answer_comes_before_its_cause(dead_time_s: float) -> None:
    lags = Lags(dead_time_s, 0.13)
    exact = fit_lags([step(Random(seed), lags, 50.0, 0.0) for seed in range(8)], ONE_LAG)
    assert exact.dead_time_s == pytest.approx(dead_time_s, abs=2e-4)
    assert exact.lags_s == pytest.approx(0.13, abs=2e-4)
    for seed in range(8):
        noisy = fit_lags([step(Random(seed), lags, 50.0, 2.0) for _ in range(2)], ONE_LAG)
        assert noisy.dead_time_s >= 0.0


@pytest.mark.parametrize(("lags", "shapes"), [(Lags(0.02, 0.1, 0.1, 0.3), RINGING), (Lags(0.1, 0.9, 0.8), TWO_LAGS)])
def test_a_fit_goes_on_until_no_other_dead_time_or_lag_is_better(lags: Lags, shapes: Shapes) -> None:
    steps = [step(Random(seed), lags, 50.0, 0.05) for seed in range(6)]
    fit, scale_n = fit_lags(steps, shapes), _scale_n(steps)
    residual = _residual_at(steps, fit.shape)
    best = minimize(lambda place: _loss(residual(np.maximum(place, 0.0)), scale_n), fit.place, method="Nelder-Mead")
    assert fit.loss <= 1.001 * best.fun
