"""Figs. 9 and 10: tracking under feed, and what no software can tell."""

import numpy as np

from gateway.twin.experiment import Floats
from paper import paper_values
from paper.experiments import exercises
from paper.experiments.exercises import CONDITIONS
from paper.experiments.rigs import paper_plant
from paper.study import Study
from paper.verdicts.verdict import OUTSIDE, Verdict, word


def fed_error_n(study: Study, law: str, case: int) -> Floats:
    """Return the error while the plate is fed, on the paper's rig, N."""
    return exercises.feeding(study.tracking.of(law, 0, case).error_n[:, 0], case)


def overshoot_n(study: Study, law: str, case: int) -> float:
    """Return the largest overshoot before the plate is fed, N."""
    first = round(exercises.FEED_FROM_S * 1000)
    return float(np.max(study.tracking.of(law, 0, case).error_n[:first]))


def mean_of(values: dict[int, float], **wanted: object) -> float:
    """Return the mean over the conditions with this feed, or with the spindle on or off."""
    keys = {"feed": 1, "spinning": 2}
    chosen = [v for case, v in values.items() if all(CONDITIONS[case][keys[k]] == w for k, w in wanted.items())]
    return float(np.mean(chosen))


def judge_tracking(study: Study) -> list[Verdict]:
    """Judge the tracking of Fig. 9."""
    slow, fast = paper_values.TRACKING_FEEDS_M_PER_S
    worst = {case: float(np.max(np.abs(fed_error_n(study, "bsfm", case)))) for case in range(len(CONDITIONS))}
    pairs = [mean_of(worst, feed=feed, spinning=False) for feed in (slow, fast)]
    stiff_n = stiff_variation_n()
    soft_n = [
        max(float(np.ptp(fed_error_n(study, "bsfm", case))) for case in worst if CONDITIONS[case][2] is on)
        for on in (False, True)
    ]
    return [
        Verdict(
            "Fig. 9",
            "Steady tracking error within 2 N in all eight runs",
            "≤ 2 N",
            f"{min(worst.values()):.2f} .. {max(worst.values()):.2f} N",
            word(max(worst.values()) <= paper_values.TRACKING_BAND_N),
            "on an assumed plate: 0.15 mm bow over its length, 30 µm robot path, milling marks",
        ),
        Verdict(
            "Abstract",
            "Force control cuts the force variation to less than 2 N",
            "< 2 N",
            f"peak to peak {soft_n[0]:.2f} N, spindle on {soft_n[1]:.2f} N; a rigid tool on the same plate {stiff_n:.1f} N",
            word(max(soft_n) < 2.0 < stiff_n),
            "holds without the spindle; with it the shaking of the assumed unbalance comes on top, far too fast for air. "
            "A rigid tool would feel pad stiffness times the assumed height",
        ),
        Verdict(
            "Fig. 9(c, d)",
            "15 mm/s tracks better than 5 mm/s, with less overshoot and settling time",
            "shown",
            f"mean of largest errors {pairs[0]:.2f} N at 5 mm/s, {pairs[1]:.2f} N at 15 mm/s",
            word(pairs[1] < 0.9 * pairs[0]),
            "the twin has no reason for it: contact comes before the feed, and the same heights pass in a shorter time; "
            "friction broken by sideways motion is not simulated",
        ),
    ]


def stiff_variation_n() -> float:
    """Return the force on a tool that does not give way, peak to peak, N, on seed 0's plate."""
    phases = np.random.default_rng([0, 4]).uniform(0.0, 2.0 * np.pi, 3)
    height_m = exercises.surface_m(np.linspace(0.0, exercises.TRAVEL_M, 2000), phases)
    return float(np.ptp(height_m) * paper_plant().contact.pad_stiffness_n_per_m)


def judge_spindle(study: Study) -> list[Verdict]:
    """Judge what the spindle does to the force."""
    cases = range(len(CONDITIONS))
    shaking = {case: exercises.shaking_n(fed_error_n(study, "bsfm", case)) for case in cases}
    over = {case: overshoot_n(study, "bsfm", case) for case in cases}
    off, on = (
        {kind: mean_of(values, spinning=spinning) for kind, values in (("shake", shaking), ("over", over))}
        for spinning in (False, True)
    )
    return [
        Verdict(
            "Fig. 9(b, d)",
            "More vibration with the spindle on, at either feed",
            "shown",
            f"faster than 50 ms: {off['shake']:.3f} N RMS off, {on['shake']:.2f} N on",
            word(on["shake"] > 3.0 * off["shake"]),
            f"65 Hz, {exercises.UNBALANCE_N:g} N of unbalance (assumed)",
        ),
        Verdict(
            "Fig. 9(b, d)",
            "More overshoot with the spindle on",
            "shown",
            f"highest force above the wanted one: {off['over']:+.2f} N off, {on['over']:+.2f} N on",
            word(on["over"] > off["over"]),
            "open loop from a lifted pad stays below; the vibration adds to it, and works the friction loose",
        ),
    ]


def judge_roughness() -> Verdict:
    """Leave out Fig. 10: roughness of a ground surface is outside software."""
    return Verdict(
        "Fig. 10",
        f"Roughness {paper_values.ROUGHNESS_UM:g} µm after five passes; finer with slower feed and more force",
        f"{paper_values.ROUGHNESS_UM:g} µm",
        "-",
        OUTSIDE,
        "a result of grit, steel and time: no software can reproduce it, and the twin removes no material",
    )
