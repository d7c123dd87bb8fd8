"""All of it in order: ladder and fits of the paper's rig, calibrations of all copies, the exercises, the limit, the ratios."""

import time
from dataclasses import dataclass
from typing import Final

from gateway.bsfm.fit.result import FitResult
from gateway.bsfm.ladder.measured_ladder import Ladder
from gateway.progress import report, reported
from paper import comparison
from paper.comparison import Comparison
from paper.experiments import exercises
from paper.experiments.calibration import Calibrated, calibrate, paper_ladder, sweep
from paper.experiments.limit import Fastest, limits
from paper.experiments.rigs import copy_of, paper_plant
from paper.experiments.trials import Trial
from paper.paper_values import GROUPS, ORDERS, SETTLING_S, TARGETS_N

FEW_ORDERS: Final = (1, 2, 3, 4, 5, 15)
FEW_SEEDS: Final = 2
FEW_GROUPS: Final = 2


@dataclass(frozen=True, slots=True)
class Study:
    """Everything the report is made from. Seed 0 of every trial is the paper's rig itself."""

    seeds: tuple[int, ...]
    ladder: Ladder
    fits: dict[str, list[FitResult]]
    copies: list[Calibrated]
    validation: Trial
    steps: Trial
    in_contact: Trial
    tracking: Trial
    limits: list[Fastest]
    comparisons: list[Comparison]
    quick: bool
    took_s: float


def study(seed_count: int, quick: bool) -> Study:
    """Run all of it in virtual time. quick: fewer groups and orders."""
    started_s, seeds = time.monotonic(), tuple(range(seed_count))
    report("ladder of the paper's rig, fits of all orders (1/4)")
    ladder = paper_ladder(paper_plant(), 0, FEW_GROUPS if quick else GROUPS)
    fits = sweep(ladder, FEW_ORDERS if quick else ORDERS)
    copies = [calibrate(copy_of(seed), seed) for seed in reported("calibrating copies (2/4)", seeds)]
    report("validation, steps, tracking (3/4)")
    validation, steps = exercises.validation(copies, quick), exercises.steps(copies)
    in_contact, tracking = exercises.steps_in_contact(copies), exercises.tracking(copies)
    report("partial reversals, the regulator's limit (4/4)")
    reversals = exercises.partial_reversals(copies, quick)
    comparisons = compare(validation, reversals, steps, in_contact, tracking)
    fastest = limits(paper_plant(), TARGETS_N, tuple(SETTLING_S))
    took_s = time.monotonic() - started_s
    return Study(
        seeds, ladder, fits, copies, validation, steps, in_contact, tracking, fastest, comparisons, quick, took_s
    )


def compare(validation: Trial, reversals: Trial, steps: Trial, in_contact: Trial, tracking: Trial) -> list[Comparison]:
    """Return every measure, in the order of the figures."""
    rows = []
    for case, (low_n, high_n) in enumerate(exercises.RANGES_N):
        name = f"reciprocating {low_n:g} .. {high_n:g} N at {exercises.PACE_N_PER_S:g} N/s"
        rows += comparison.errors(name, validation, exercises.without_first_step, case)
    for case, name in enumerate(("partial reversals, settled", "the same, months after the calibration")):
        rows += comparison.errors(name, reversals, exercises.ends_of_holds, case)
    rows += comparison.steps_from_no_load(steps) + comparison.steps_in_contact(in_contact)
    return rows + comparison.tracking(tracking)
