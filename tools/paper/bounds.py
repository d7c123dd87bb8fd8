"""What no law can beat on this rig, measure by measure, as a share of what the paper's law reaches where that can be computed.

Dead time bounds whatever moves, the regulator's range and lags bound settling, the spindle's shaking is faster than air, and
where all is at rest the load cell's noise is what is left to hear.
"""

from math import pi, sin

import numpy as np

from paper.comparison import Comparison
from paper.experiments import exercises
from paper.experiments.exercises import PACE_N_PER_S, PATH_LENGTH_M
from paper.experiments.rigs import paper_plant
from paper.experiments.trials import settled_s
from paper.paper_values import SETTLING_S, TRACKING_FEEDS_M_PER_S
from paper.study import Study


def bound(study: Study, comparison: Comparison) -> str:
    """Return what no law can beat, as text: `0.33: dead time, 0.40 N`: of the paper's figure, unless it says of what."""
    name, paper = comparison.name, comparison.means["bsfm"]
    if "time to stay" in name:
        return f"{allowed_ratio(study, band_of(comparison)):.2f}: the fastest command there is"
    if "reciprocating" in name:
        late_n = PACE_N_PER_S * delay_s()
        return f"{late_n / paper:.2f}: dead time, {late_n:.2f} N"
    if name.endswith("spindle on: largest error"):
        shaken = shaken_n(study)
        return f"{shaken / paper:.2f}: 65 Hz alone, {shaken:.2f} N"
    if "tracking" in name:
        feed = min(TRACKING_FEEDS_M_PER_S) if "off, 5 mm/s" in name else max(TRACKING_FEEDS_M_PER_S)
        return f"{unheard_share(feed):.2f} of the path's waves pass in the dead time"
    return f"the cell's noise, {paper_plant().cell.noise_n:.2f} N a reading"


def band_of(comparison: Comparison) -> float:
    """Return the band of a settling time, N."""
    return next(band for band in SETTLING_S if f"within {band:g} N" in comparison.name)


def allowed_ratio(study: Study, band_n: float) -> float:
    """Return the fastest command over the paper's law on the paper's rig, mean over the targets at which the latter
    settles.
    """
    times_s = study.steps.score(settled_s(band_n), "bsfm")[0]
    best_s = np.array([row.settled_s for row in study.limits if row.band_n == band_n])
    settles = ~np.isnan(times_s)
    return float(np.mean(best_s[settles]) / np.mean(times_s[settles]))


def shaken_n(study: Study) -> float:
    """Return the largest error faster than 50 ms with the spindle on, under the paper's constant command: mean over the
    seeds.
    """
    cases = [case for case, condition in enumerate(exercises.CONDITIONS) if condition[2]]
    seeds = range(len(study.tracking.seeds))
    return float(np.mean([max(_fast_n(study, seed_at, case) for case in cases) for seed_at in seeds]))


def _fast_n(study: Study, seed_at: int, case: int) -> float:
    error_n = exercises.feeding(study.tracking.of("bsfm", seed_at, case).error_n[:, 0], case)
    return float(np.max(np.abs(error_n[25:-24] - exercises.slow_part(error_n))))


def unheard_share(feed_m_per_s: float) -> float:
    """Return what is left of the path's waves by a law that cancels all it measures, once the dead time is over: |1 -
    exp(-i w T)|.
    """
    return 2.0 * sin(pi * feed_m_per_s / PATH_LENGTH_M * delay_s())


def delay_s() -> float:
    """Return the dead time of the paper's rig, s."""
    return paper_plant().regulator.delay_s
