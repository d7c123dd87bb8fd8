"""Dead time and one or two lags that predict step responses best, and how sure they are.

Two lags are taken where they predict the steps that were held out better than one. The interval is that of the estimate
over whole steps (a sandwich estimator, White 1980), because errors within a step are not independent.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.bsfm.response.step_responses import SHORTEST_LAG_S, Floats, Lags, StepResponse, tail_rows

RATIOS: Final = (0.0, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0)  # second lag over first
HUBER: Final = 1.5  # of the noise, beyond which an error counts linearly
ROUNDS: Final = 12
BETTER: Final = 0.985  # held-out error of two lags over one, from which the second is believed
LEAST_SCALE_N: Final = 0.05  # what any model is off on the way


@dataclass(frozen=True, slots=True)
class LagFit:
    """Dead time, sum of both lags in s, and the second over the first; loss: Huber's; rms_n: of the residuals."""

    dead_time_s: float
    lags_s: float
    ratio: float
    loss: float
    rms_n: float

    @property
    def lags(self) -> Lags:
        """Dead time and both lags."""
        return _split_lags(self.dead_time_s, self.lags_s, self.ratio)


def fit_lags(steps: Sequence[StepResponse], ratios: Sequence[float]) -> LagFit:
    """Return the best of these ratios, refined between its neighbours."""
    scale_n, guess, fits = _scale_n(steps), _guess(steps), []
    for ratio in ratios:
        fits.append(_fit_at_ratio(steps, ratio, scale_n, guess))
        guess = (fits[-1].dead_time_s, fits[-1].lags_s)
    best = min(fits, key=lambda fit: fit.loss)
    if len(ratios) > 1:
        best = _refine(steps, ratios, best, scale_n)
    return best


def choose_ratios(steps: Sequence[StepResponse]) -> tuple[float, ...]:
    """Return the ratios to fit: those of two lags where they predict steps better that neither has seen, else of one."""
    scale_n, single, double = _scale_n(steps), 0.0, 0.0
    for fold in range(2):
        training, held_out = steps[fold::2], steps[1 - fold :: 2]
        for ratios in (RATIOS[:1], RATIOS[1:]):
            fit = fit_lags(training, ratios)
            loss = _loss(np.concatenate(_residuals(held_out, fit.lags)), scale_n)
            single, double = (single + loss, double) if ratios == RATIOS[:1] else (single, double + loss)
    return RATIOS[1:] if double < BETTER * single else RATIOS[:1]


def interval(fit: LagFit, steps: Sequence[StepResponse]) -> tuple[Floats, Floats]:
    """Return both ends of the 95 % interval of (dead time, sum of lags), s, the ratio held."""
    place = np.array([fit.dead_time_s, fit.lags_s])
    normal, spread = np.zeros((2, 2)), np.zeros((2, 2))
    for step in steps:
        residual = _residual_at((step,), fit.ratio)
        error_n = residual(place)
        slopes = _slopes(residual, place, error_n)
        score = slopes.T @ error_n
        normal += slopes.T @ slopes
        spread += np.outer(score, score)
    inverse = np.linalg.pinv(normal)
    half = 1.96 * np.sqrt(np.maximum(0.0, np.diag(inverse @ spread @ inverse)))
    return place - half, place + half


def _split_lags(dead_time_s: float, lags_s: float, ratio: float) -> Lags:
    lag_s = lags_s / (1.0 + ratio)
    return Lags(dead_time_s, lag_s, lags_s - lag_s)


def _residuals(steps: Sequence[StepResponse], lags: Lags) -> list[Floats]:
    return [step.force_n - step.expected_n(lags) for step in steps]


def _residual_at(steps: Sequence[StepResponse], ratio: float) -> Callable[[Floats], Floats]:
    """The residuals as a function of (dead time, sum of lags)."""
    return lambda place: np.concatenate(_residuals(steps, _split_lags(float(place[0]), float(place[1]), ratio)))


def _loss(residual_n: Floats, scale_n: float) -> float:
    size = np.abs(residual_n) / scale_n
    return float(np.sum(np.where(size < HUBER, 0.5 * size**2, HUBER * (size - 0.5 * HUBER))))


def _refine(steps: Sequence[StepResponse], ratios: Sequence[float], best: LagFit, scale_n: float) -> LagFit:
    at = list(ratios).index(best.ratio)
    near = (ratios[max(0, at - 1)], ratios[min(len(ratios) - 1, at + 1)])
    for ratio in (0.5 * (near[0] + best.ratio), 0.5 * (near[1] + best.ratio)):
        trial = _fit_at_ratio(steps, ratio, scale_n, (best.dead_time_s, best.lags_s))
        best = trial if trial.loss < best.loss else best
    return best


def _fit_at_ratio(steps: Sequence[StepResponse], ratio: float, scale_n: float, guess: tuple[float, float]) -> LagFit:
    """Dead time and sum of lags at this ratio, by damped Gauss-Newton with Huber weights."""
    place, damping, residual = np.array(guess), 1.0e-3, _residual_at(steps, ratio)
    error_n = residual(place)
    loss = _loss(error_n, scale_n)
    for _ in range(ROUNDS):
        slopes = _slopes(residual, place, error_n)
        weight = np.minimum(1.0, HUBER * scale_n / np.maximum(np.abs(error_n), 1.0e-12))
        normal = (slopes * weight[:, None]).T @ slopes
        step = np.linalg.solve(
            normal + damping * np.diag(np.diag(normal) + 1.0e-12), -(slopes * weight[:, None]).T @ error_n
        )
        trial = np.maximum(place + np.clip(step, -0.1, 0.1), (0.0, 2.0 * SHORTEST_LAG_S))
        trial_n = residual(trial)
        trial_loss = _loss(trial_n, scale_n)
        if trial_loss < loss:
            is_done = loss - trial_loss < 1.0e-5 * loss
            place, error_n, loss, damping = trial, trial_n, trial_loss, 0.3 * damping
            if is_done:
                break
        else:
            damping = 10.0 * max(damping, 1.0e-3)
    return LagFit(float(place[0]), float(place[1]), ratio, loss, float(np.sqrt(np.mean(error_n**2))))


def _slopes(residual: Callable[[Floats], Floats], place: Floats, error_n: Floats) -> Floats:
    by = 1.0e-3
    columns = [(residual(place + by * unit) - error_n) / by for unit in np.eye(2)]
    return np.stack(columns, axis=1)


def _scale_n(steps: Sequence[StepResponse]) -> float:
    """Noise of a reading, from the settled end of the steps; at least what a model is off on the way."""
    tails = [step.force_n[-tail_rows(len(step.force_n)) :] for step in steps]
    spread = [float(np.std(tail)) for tail in tails if len(tail) > 1]
    return max(LEAST_SCALE_N, float(np.median(spread)) if spread else 0.1)


def _guess(steps: Sequence[StepResponse]) -> tuple[float, float]:
    """Dead time and lags by the times of 15 and 63 % of the way, medians over the steps."""
    early: list[float] = []
    late: list[float] = []
    for step in steps:
        start_n = step.path_n[0 if step.changes[-1][1] > 0 else -1]
        way = (step.force_n - start_n) / (step.path_n[-1] - step.path_n[0])
        since_s = step.time_s - step.changes[-1][0]
        for share, times in ((0.15, early), (0.63, late)):
            passed = np.flatnonzero(np.abs(way) >= share)
            times.append(float(since_s[passed[0]]) if len(passed) else float(since_s[-1]))
    rise_s = max(0.01, float(np.median(late)) - float(np.median(early)))
    return max(0.0, float(np.median(early)) - 0.2 * rise_s), 1.1 * rise_s
