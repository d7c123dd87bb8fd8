"""The fit of dead time and lags to steps that are known: where few readings lie on the way, a wrong minimum is not taken."""

from random import Random

import numpy as np
import pytest

from gateway.bsfm.response.lag_fit import TWO_LAGS, choose_shapes, fit_lags
from gateway.bsfm.response.second_order import SecondOrder
from gateway.bsfm.response.step_responses import Lags, StepResponse, missing_share

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
