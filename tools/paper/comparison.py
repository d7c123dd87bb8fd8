"""Ours beside the paper's law: the same copies, the same noise, as ratios with intervals.

One ratio per seed; their geometric mean (a ratio of 2 and one of 1/2 cancel), with the 95 % percentile bootstrap over
seeds. "ours" is the gateway's controller as shipped.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.twin.experiment import Floats, settling_time_s
from paper.experiments import exercises
from paper.experiments.closed_loop import Record
from paper.experiments.trials import Trial, largest_n, rms_n, settled_s
from paper.paper_values import SETTLING_S, TARGETS_N, TRACKING_FEEDS_M_PER_S

RESAMPLES: Final = 4000
ERROR_GOAL, SETTLING_GOAL = 0.5, 0.7
LAWS: Final = ("bsfm", "ours")


@dataclass(frozen=True, slots=True)
class Interval:
    """A geometric mean and where 95 % of its resamples lie."""

    mean: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Comparison:
    """One measure: mean over seeds per law, and each law's ratio to the paper's BSFM. goal: the ratio wanted, if any."""

    name: str
    unit: str
    means: dict[str, float]
    ratios: dict[str, Interval]
    goal: float | None = None

    def meets(self, law: str) -> bool:
        """Return whether the whole interval is within the goal."""
        return self.goal is not None and self.ratios[law].high <= self.goal


def interval(ratios: Floats) -> Interval:
    """Return the geometric mean of ratios, one per seed, with its 95 % bootstrap interval."""
    logs = np.log(ratios)
    picks = np.random.default_rng(0).integers(0, len(logs), (RESAMPLES, len(logs)))
    low, high = np.percentile(np.mean(logs[picks], axis=1), [2.5, 97.5])
    return Interval(*(float(np.exp(value)) for value in (np.mean(logs), low, high)))


def compare_scores(name: str, unit: str, scores: dict[str, Floats], goal: float | None = None) -> Comparison:
    """Compare each law's scores with the paper's. scores: per law one number per seed."""
    ratios = {law: interval(scores[law] / scores["bsfm"]) for law in scores if law != "bsfm"}
    return Comparison(name, unit, {law: float(np.mean(values)) for law, values in scores.items()}, ratios, goal)


def errors(name: str, trial: Trial, part: Callable[[Floats], Floats], case: int = 0) -> list[Comparison]:
    """Compare largest and RMS error of the part of a run that counts, in one case."""
    rows = []
    for kind, measure, goal in (("largest error", largest_n, ERROR_GOAL), ("RMS error", rms_n, None)):
        scores = {law: trial.score(lambda f, d, m=measure: m(part(f), part(d)), law)[:, case] for law in LAWS}
        rows.append(compare_scores(f"{name}: {kind}", "N", scores, goal))
    return rows


def settling(name: str, times_s: dict[str, Floats], bands_n: tuple[float, ...]) -> list[Comparison]:
    """Compare settling times: the mean over the targets at which every law settles, per seed. times_s: per law (seeds,
    targets, bands).
    """
    rows = []
    for at, band_n in enumerate(bands_n):
        grids = {law: times[:, :, at] for law, times in times_s.items()}
        everywhere = ~np.any([np.isnan(grid) for grid in grids.values()], axis=0)
        scores = {
            law: np.sum(np.where(everywhere, grid, 0.0), axis=1) / everywhere.sum(axis=1) for law, grid in grids.items()
        }
        rows.append(compare_scores(f"{name}: time to stay within {band_n:g} N", "s", scores, SETTLING_GOAL))
    return rows


def steps_from_no_load(trial: Trial) -> list[Comparison]:
    """Compare the steps of Fig. 8."""
    bands_n = tuple(SETTLING_S)
    times_s = {law: np.stack([trial.score(settled_s(band), law) for band in bands_n], axis=-1) for law in LAWS}
    rest = {law: trial.score(lambda f, d: largest_n(f[-300:], d[-300:]), law).max(axis=1) for law in LAWS}
    title = "steps from no load (Fig. 8)"
    return [
        *settling(title, times_s, bands_n),
        compare_scores(f"{title}: largest error at rest", "N", rest, ERROR_GOAL),
    ]


def steps_in_contact(trial: Trial) -> list[Comparison]:
    """Compare the steps that begin with the pad on the workpiece."""
    bands_n = tuple(SETTLING_S)

    def per_target(force_n: Floats, desired_n: Floats) -> Floats:
        pairs = zip(exercises.each_step(force_n), TARGETS_N, strict=True)
        return np.array([[settling_time_s(part, target_n, band) for band in bands_n] for part, target_n in pairs])

    def at_rest(force_n: Floats, desired_n: Floats) -> Floats:
        return largest_n(exercises.each_step(force_n)[:, -300:], exercises.each_step(desired_n)[:, -300:])

    times_s = {law: trial.score(per_target, law)[:, 0] for law in LAWS}
    rest = {law: trial.score(at_rest, law)[:, 0] for law in LAWS}
    title = "steps in contact, unloading between"
    return [
        *settling(title, times_s, bands_n),
        compare_scores(f"{title}: largest error at rest", "N", rest, ERROR_GOAL),
    ]


def tracking(trial: Trial) -> list[Comparison]:
    """Compare the largest error while the plate is fed: at both forces; with the spindle on, at both feeds, too."""
    slow, fast = TRACKING_FEEDS_M_PER_S
    title = "tracking (Fig. 9), spindle"
    rows = [
        fed_errors(
            trial,
            f"{title} off, {feed * 1000:g} mm/s",
            lambda condition, f=feed: condition[1:] == (f, False),
            np.asarray,
        )
        for feed in (slow, fast)
    ]
    rows.append(fed_errors(trial, f"{title} on", lambda condition: condition[2], np.asarray))
    rows.append(
        fed_errors(trial, f"{title} on, slower than 50 ms", lambda condition: condition[2], exercises.slow_part)
    )
    return rows


def fed_errors(
    trial: Trial, name: str, chosen: Callable[[tuple[float, float, bool]], bool], part: Callable[[Floats], Floats]
) -> Comparison:
    """Return the worst of the chosen conditions, of a part of each error."""
    cases = [case for case, condition in enumerate(exercises.CONDITIONS) if chosen(condition)]
    scores = {}
    for law in LAWS:
        worst = [
            [_fed(trial.of(law, seed_at, case), case, part) for case in cases] for seed_at in range(len(trial.seeds))
        ]
        scores[law] = np.max(worst, axis=1)
    return compare_scores(f"{name}: largest error", "N", scores, ERROR_GOAL)


def _fed(record: Record, case: int, part: Callable[[Floats], Floats]) -> float:
    return float(np.max(np.abs(part(exercises.feeding(record.error_n[:, 0], case)))))
