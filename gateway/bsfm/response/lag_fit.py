"""Dead time and one or two lags, or a pair of complex poles, that predict step responses best, and how sure they are.

Two lags are taken where they predict the steps that were held out better than one, a pair where it does so better than both.
The interval is that of the estimate
over whole steps (a sandwich estimator, White 1980), because errors within a step are not independent.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from gateway.bsfm.response.response_model import SHORTEST_LAG_S, Floats, JoinedSteps, Lags, StepResponse
from gateway.bsfm.response.step_responses import tail_rows


class Shape(NamedTuple):
    """What is held while dead time and the sum of the lags are fitted. ratio: second lag over first; damping: of a pair of
    complex poles, 0 for real lags."""

    ratio: float
    damping: float = 0.0


Shapes = tuple[Shape, ...]
ONE_LAG: Final[Shapes] = (Shape(0.0),)
TWO_LAGS: Final[Shapes] = tuple(Shape(ratio) for ratio in (0.1, 0.2, 0.35, 0.5, 0.7, 1.0))
RINGING: Final[Shapes] = tuple(Shape(1.0, damping) for damping in (0.2, 0.3, 0.5, 0.7, 0.85))
STARTS: Final = (0.15, 0.45, 0.75)  # dead time as a share of the whole, from which the fit starts besides its guess
HUBER: Final = 1.5  # of the noise, beyond which an error counts linearly
ROUNDS: Final = 12
BETTER: Final = 0.985  # held-out error of two lags over one, from which the second is believed
NEARLY_EQUAL: Final = 0.8  # ratio of two lags, from which the poles may be complex
MUCH_BETTER: Final = 0.9  # the same of a pair over lags: friction at a turn looks a little like ringing
RINGS_BEYOND: Final = 0.05  # of a step, passed at its peak: a damping below 0.7
PEAK_ROWS: Final = 3  # whose mean tells a peak from noise
LEAST_SCALE_N: Final = 0.05  # what any model is off on the way


@dataclass(frozen=True, slots=True)
class LagFit:
    """Dead time, sum of both lags in s, and their shape; loss: Huber's; rms_n: of the residuals."""

    dead_time_s: float
    lags_s: float
    shape: Shape
    loss: float
    rms_n: float

    @property
    def lags(self) -> Lags:
        """Dead time and both lags."""
        return _split_lags(self.dead_time_s, self.lags_s, self.shape)

    @property
    def place(self) -> Floats:
        """Dead time and sum of the lags, s, as the fit moves them."""
        return np.array([self.dead_time_s, self.lags_s])


def fit_lags(steps: Sequence[StepResponse], shapes: Shapes) -> LagFit:
    """Return the best of these shapes, refined between its neighbours."""
    scale_n, fits = _scale_n(steps), []
    guess = _best_start(steps, shapes[-1], scale_n)
    for shape in reversed(shapes):
        fits.append(_fit_at_shape(steps, shape, scale_n, guess))
        guess = (fits[-1].dead_time_s, fits[-1].lags_s)
    best = min(fits, key=lambda fit: fit.loss)
    if len(shapes) > 1:
        best = _refine(steps, shapes, best, scale_n)
    return best


def choose_shapes(steps: Sequence[StepResponse]) -> Shapes:
    """Return the shapes to fit: those that predict steps best that the fit has not seen. The simpler ones first: two lags
    have to be better than one, and a pair of complex poles, asked for where the best lags are equal or the force passes its
    end, much better than both."""
    one, two = (_compute_held_out_loss(steps, shapes) for shapes in (ONE_LAG, TWO_LAGS))
    may_ring = two.are_equal or _share_beyond_end(steps) > RINGS_BEYOND
    if may_ring and _compute_held_out_loss(steps, RINGING).loss < MUCH_BETTER * min(one.loss, two.loss):
        return RINGING
    return TWO_LAGS if two.loss < BETTER * one.loss else ONE_LAG


def _share_beyond_end(steps: Sequence[StepResponse]) -> float:
    """Median share of a step by which the force passes its settled end, noise averaged out."""
    shares = []
    for step in steps:
        beyond_n = step.way * (step.force_n - step.path_n[-1 if step.way > 0.0 else 0])
        mean_n = np.convolve(beyond_n, np.full(PEAK_ROWS, 1.0 / PEAK_ROWS), mode="valid")
        shares.append(float(mean_n.max(initial=0.0)) / float(np.ptp(step.path_n)))
    return float(np.median(shares))


class _HeldOut(NamedTuple):
    """Huber's loss of each half of the steps by the fit of the other; whether both fits took equal lags."""

    loss: float
    are_equal: bool


def _compute_held_out_loss(steps: Sequence[StepResponse], shapes: Shapes) -> _HeldOut:
    halves = steps[::2], steps[1::2]
    fits = [fit_lags(half, shapes) for half in halves]
    scale_n = _scale_n(steps)
    loss = sum(
        _loss(_residual_at(half, fit.shape)(fit.place), scale_n) for half, fit in zip(halves, fits[::-1], strict=True)
    )
    return _HeldOut(loss, all(fit.shape.ratio > NEARLY_EQUAL for fit in fits))


def interval(fit: LagFit, steps: Sequence[StepResponse]) -> tuple[Floats, Floats]:
    """Return both ends of the 95 % interval of (dead time, sum of lags), s, the shape held."""
    place = fit.place
    normal, spread = np.zeros((2, 2)), np.zeros((2, 2))
    for step in steps:
        residual = _residual_at((step,), fit.shape)
        error_n = residual(place)
        slopes = _slopes(residual, place, error_n)
        score = slopes.T @ error_n
        normal += slopes.T @ slopes
        spread += np.outer(score, score)
    inverse = np.linalg.pinv(normal)
    half = 1.96 * np.sqrt(np.maximum(0.0, np.diag(inverse @ spread @ inverse)))
    return place - half, place + half


def _split_lags(dead_time_s: float, lags_s: float, shape: Shape) -> Lags:
    lag_s = lags_s / (1.0 + shape.ratio)
    return Lags(dead_time_s, lag_s, lags_s - lag_s, shape.damping)


def _residual_at(steps: Sequence[StepResponse], shape: Shape) -> Callable[[Floats], Floats]:
    """The residuals as a function of (dead time, sum of lags)."""
    joined = JoinedSteps(steps)
    return lambda place: joined.force_n - joined.expected_n(_split_lags(float(place[0]), float(place[1]), shape))


def _loss(residual_n: Floats, scale_n: float) -> float:
    size = np.abs(residual_n) / scale_n
    return float(np.sum(np.where(size < HUBER, 0.5 * size**2, HUBER * (size - 0.5 * HUBER))))


def _refine(steps: Sequence[StepResponse], shapes: Shapes, best: LagFit, scale_n: float) -> LagFit:
    at = shapes.index(best.shape)
    for near in (shapes[max(0, at - 1)], shapes[min(len(shapes) - 1, at + 1)]):
        between = Shape(0.5 * (near.ratio + best.shape.ratio), 0.5 * (near.damping + best.shape.damping))
        trial = _fit_at_shape(steps, between, scale_n, (best.dead_time_s, best.lags_s))
        best = trial if trial.loss < best.loss else best
    return best


def _best_start(steps: Sequence[StepResponse], shape: Shape, scale_n: float) -> tuple[float, float]:
    """Where the fit starts: the best of a guess and of other ways to share the same whole between dead time and lags. With few
    readings on the way the guess may lie at a wrong minimum."""
    guess = _guess(steps)
    whole_s, residual = sum(guess), _residual_at(steps, shape)
    starts = [guess, *((share * whole_s, (1.0 - share) * whole_s) for share in STARTS)]
    return min(starts, key=lambda start: _loss(residual(np.array(start)), scale_n))


def _fit_at_shape(steps: Sequence[StepResponse], shape: Shape, scale_n: float, guess: tuple[float, float]) -> LagFit:
    """Dead time and sum of lags at this shape, by damped Gauss-Newton with Huber weights."""
    place, damping, residual = np.array(guess), 1.0e-3, _residual_at(steps, shape)
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
    return LagFit(float(place[0]), float(place[1]), shape, loss, float(np.sqrt(np.mean(error_n**2))))


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
