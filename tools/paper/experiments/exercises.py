"""The paper's exercises: validation (Fig. 7), steps (Fig. 8), tracking (Fig. 9), and one of ours: partial reversals.

What the paper does not say is chosen here, and marked assumed: the pace of the validation, the shape of the surface,
the unbalance of the spindle.
"""

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from gateway.twin import Plant
from gateway.twin.experiment import Floats
from paper.experiments.calibration import Calibrated
from paper.experiments.closed_loop import Surroundings
from paper.experiments.laws import LAW_NAMES, TICK_S
from paper.experiments.rigs import drift_months, lift_pad
from paper.experiments.trials import Lane, Trial, TrialConditions, trial
from paper.paper_values import SPINDLE_HZ, TARGETS_N, TRACKING_FEEDS_M_PER_S, TRACKING_FORCES_N

RANGES_N: Final = ((1.5, 38.0), (8.0, 30.0))  # the whole ladder of every copy, and reversals inside the loop
PACE_N_PER_S: Final = 5.0  # assumed: the paper's text gives its reciprocating command neither range nor pace
RECIPROCATING_S, QUICK_RECIPROCATING_S = 30.0, 16.0
FIRST_S: Final = 2.0  # the first step to the lower end does not count

STEP_S: Final = 2.0
UNLOADED_S: Final = 1.2

HOLDS, QUICK_HOLDS, HOLD_S, SETTLED_S = 24, 10, 1.5, 0.3

FEED_FROM_S: Final = 1.5
TRAVEL_M: Final = 0.06
BOW_M, PATH_M, MARKS_M = 1.5e-4, 3.0e-5, 3.0e-6  # assumed: plate, robot path, milling marks under a 25 mm pad
BOW_LENGTH_M, PATH_LENGTH_M, MARKS_LENGTH_M = 0.15, 0.03, 0.002
UNBALANCE_N: Final = 1.0  # assumed: 6 g mm at 65 Hz
CONDITIONS: Final = tuple(
    (force_n, feed, spinning)
    for feed in TRACKING_FEEDS_M_PER_S
    for spinning in (False, True)
    for force_n in TRACKING_FORCES_N
)


def ticks(duration_s: float) -> int:
    """Return how many ticks a duration takes."""
    return round(duration_s / TICK_S)


# -- Fig. 7


def reciprocating_n(low_n: float, high_n: float, duration_s: float) -> Floats:
    """Return a triangle between two forces, after FIRST_S at the lower one."""
    half_s = (high_n - low_n) / PACE_N_PER_S
    turns = np.arange(ticks(duration_s)) * TICK_S / half_s
    triangle = low_n + (high_n - low_n) * (1.0 - np.abs(turns % 2.0 - 1.0))
    return np.concatenate([np.full(ticks(FIRST_S), low_n), triangle])


def validation(copies: Sequence[Calibrated], quick: bool) -> Trial:
    """Run the reciprocating command of Fig. 7. Cases are RANGES_N."""
    duration_s = QUICK_RECIPROCATING_S if quick else RECIPROCATING_S
    return trial(copies, LAW_NAMES, [_between(*ends_n, duration_s) for ends_n in RANGES_N], TrialConditions(7))


def _between(low_n: float, high_n: float, duration_s: float) -> Callable[[int], Floats]:
    return lambda seed: reciprocating_n(low_n, high_n, duration_s)


def without_first_step(series: Floats) -> Floats:
    """Return a series without the first step."""
    return series[round(FIRST_S * 1000) :]


# -- Fig. 8


def steps(copies: Sequence[Calibrated]) -> Trial:
    """Run the steps of Fig. 8, one fresh start per target: no load, the pad lifted."""
    wishes = [_constant(target_n) for target_n in TARGETS_N]
    return trial(copies, LAW_NAMES, wishes, TrialConditions(8, conditioned=False, changed=_lift_pad))


def _lift_pad(plant: Plant, case: int) -> Plant:
    return lift_pad(plant)


def _constant(target_n: float, duration_s: float = STEP_S) -> Callable[[int], Floats]:
    return lambda seed: np.full(ticks(duration_s), target_n)


def steps_in_contact(copies: Sequence[Calibrated], laws: tuple[str, ...] = LAW_NAMES) -> Trial:
    """Run all targets in one go, 0 V between them; the pad stays on the workpiece."""
    load, rest = np.ones(ticks(STEP_S)), np.zeros(ticks(UNLOADED_S))
    wish_n = np.concatenate([np.concatenate([target_n * load, rest]) for target_n in TARGETS_N])
    return trial(copies, laws, [lambda seed: wish_n], TrialConditions(9))


def each_step(series: Floats) -> Floats:
    """Cut a run in contact, (steps, ...), into (targets, milliseconds of the loaded part, ...)."""
    per_target = series.reshape(len(TARGETS_N), -1, *series.shape[1:])
    return per_target[:, : round(STEP_S * 1000)]


# -- ours


def partial_reversals(copies: Sequence[Calibrated], quick: bool) -> Trial:
    """Hold random forces one after the other, a series of its own for each seed. Case 0: as calibrated, case 1: months
    later.
    """
    wish = _hold_wish(holds(quick))
    conditions = TrialConditions(10, changed=lambda plant, case: drift_months(plant) if case else plant)
    return trial(copies, LAW_NAMES, [wish, wish], conditions)


def holds(quick: bool) -> int:
    """Return how many forces are held."""
    return QUICK_HOLDS if quick else HOLDS


def _hold_wish(count: int) -> Callable[[int], Floats]:
    def wish(seed: int) -> Floats:
        return np.repeat(np.random.default_rng([seed, 3]).uniform(3.0, 37.0, count), ticks(HOLD_S))

    return wish


def ends_of_holds(series: Floats) -> Floats:
    """Return the end of each hold but the first, joined."""
    parts = series.reshape(-1, round(HOLD_S * 1000))
    return parts[1:, -round(SETTLED_S * 1000) :].ravel()


# -- Fig. 9


def tracking(copies: Sequence[Calibrated], laws: tuple[str, ...] = ("bsfm", "ours")) -> Trial:
    """Make contact from the lifted pad, then feed along the plate (Fig. 9). Cases are CONDITIONS."""
    longest_s = FEED_FROM_S + TRAVEL_M / min(TRACKING_FEEDS_M_PER_S)
    wishes = [_constant(force_n, longest_s) for force_n, _, _ in CONDITIONS]
    return trial(copies, laws, wishes, TrialConditions(11, conditioned=False, changed=_lift_pad, around=moving_surface))


def moving_surface(lanes: list[Lane]) -> Surroundings:
    """Return the height of the plate under the pad and the spindle's shaking, each lane with its seed's phases."""
    phases = np.array(
        [np.random.default_rng([lane.calibrated.seed, 4]).uniform(0.0, 2.0 * np.pi, 3) for lane in lanes]
    ).T
    feed = np.array([CONDITIONS[lane.case][1] for lane in lanes])
    shaking_n = UNBALANCE_N * np.array([float(CONDITIONS[lane.case][2]) for lane in lanes])

    def height_m(time_s: float) -> Floats:
        at_m = np.clip((time_s - FEED_FROM_S) * feed, 0.0, TRAVEL_M)
        return surface_m(at_m, phases) - surface_m(0.0 * at_m, phases)

    def force_n(time_s: float) -> Floats:
        return np.asarray(shaking_n * np.sin(2.0 * np.pi * SPINDLE_HZ * time_s + phases[2]))

    return Surroundings(height_m, force_n)


def surface_m(at_m: Floats, phases: Floats) -> Floats:
    """Return the height of the plate at places along it, m."""
    bow = BOW_M * np.sin(np.pi * at_m / BOW_LENGTH_M)
    path = PATH_M * np.sin(2.0 * np.pi * at_m / PATH_LENGTH_M + phases[0])
    marks = MARKS_M * np.sin(2.0 * np.pi * at_m / MARKS_LENGTH_M + phases[1])
    return np.asarray(bow + path + marks)


def feeding(series: Floats, case: int) -> Floats:
    """Return the part of a run in which the plate moves under the pad."""
    first = round(FEED_FROM_S * 1000)
    return series[first : first + round(TRAVEL_M / CONDITIONS[case][1] * 1000)]


def slow_part(series: Floats) -> Floats:
    """Return the mean over 50 ms, the ends left out."""
    return np.convolve(series, np.full(50, 0.02), mode="valid")


def shaking_n(error_n: Floats) -> float:
    """Return the RMS of what is faster than 50 ms, N."""
    return float(np.sqrt(np.mean((error_n[25:-24] - slow_part(error_n)) ** 2)))
