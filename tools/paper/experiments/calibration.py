"""Ladder, minor loops and fits of every copy of the rig, as the paper does them: 0-5-0 V by 0.1 V, ten groups.

A group starts where the one before ended, and the friction remembers no more than a full cycle, so on a quiet twin every
group after the first is the same (a test says so). The copies therefore run one group after a conditioning cycle and
read it ten times with new noise; the paper's rig itself (Figs. 4-6) runs all 1010 stairs.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.bsfm.branches import Branches
from gateway.bsfm.fit.branch_fit import fit, fit_orders
from gateway.bsfm.fit.result import FitResult
from gateway.bsfm.ladder.measured_ladder import Ladder, LadderPlan, ladder_plan
from gateway.bsfm.model import Bsfm
from gateway.bsfm.slip.problem import Walk
from gateway.bsfm.slip.slip_fit import fit_joint, walk_of
from gateway.twin import Plant, Twin
from gateway.twin.experiment import Dwell, Floats, staircase
from gateway.twin.plant import with_value
from paper.experiments.rigs import Twins
from paper.paper_values import GROUPS, LADDER_STEP_V, LADDER_TOP_V

READ_ONCE: Final = Dwell(readings=1)
TURNS_V: Final = (
    0.0,
    4.5,
    1.5,
    3.5,
    2.0,
    3.0,
    0.75,
    4.0,
    2.25,
    3.75,
    0.5,
    1.75,
    1.0,
    2.0,
)  # partial reversals of all sizes
STAIR_V: Final = 0.15
MINOR_READINGS: Final = 5  # per stair, averaged
FORMS: Final = {"pfm": "tied", "bfm": "tied", "psfm": "free", "bsfm": "tied"}
"""The paper's forms: PSFM is piecewise (each direction its own ends), BSFM continuous (shared ends)."""


@dataclass(frozen=True, slots=True)
class Calibrated:
    """What one copy of the rig gave: its ladder and the models fitted to it."""

    seed: int
    plant: Plant
    ladder: Ladder
    psfm: Branches
    psfm_same_order: Branches
    bsfm: Branches
    ours: Bsfm  # branches and slip stops of one fit to ladder and minor loops, as `force-gateway fit` chooses it


def condition(twin: Twin | Twins) -> None:
    """Run one full cycle: what the friction remembers afterwards is the ladder's own past."""
    for voltage_v in (LADDER_TOP_V, 0.0):
        twin.command(voltage_v)
        twin.advance(1.5)


def quiet_twin(plant: Plant) -> Twin:
    """Return the rig after a full cycle, without noise."""
    twin = Twin(with_value(plant, "cell", "noise_n", 0.0), 0)
    condition(twin)
    return twin


def noise_n(plant: Plant, seed: int, count: int) -> Floats:
    """Return noise of single readings on the ladder, N: (count,)."""
    return np.asarray(np.random.default_rng([seed, 2, 1]).standard_normal(count) * plant.cell.noise_n)


def ladder_of(plan: LadderPlan, force_n: Floats) -> Ladder:
    """Return the readings at a plan's stairs as a ladder."""
    return Ladder(np.array(plan.voltage_v), force_n, np.array(plan.direction), np.array(plan.group))


def paper_ladder(plant: Plant, seed: int, groups: int = GROUPS) -> Ladder:
    """Climb all stairs of all groups on one rig."""
    plan = ladder_plan(LADDER_TOP_V, LADDER_STEP_V, groups)
    force_n = staircase(quiet_twin(plant), plan.voltage_v, READ_ONCE)
    return ladder_of(plan, force_n + noise_n(plant, seed, len(plan)))


def stairs_between(turns_v: Sequence[float], step_v: float) -> list[float]:
    """Return even stairs from turn to turn."""
    stairs = [turns_v[0]]
    for turn_v in turns_v[1:]:
        count = max(1, round(abs(turn_v - stairs[-1]) / step_v))
        stairs += [float(v) for v in np.linspace(stairs[-1], turn_v, count + 1)[1:]]
    return stairs


def calibrate(plant: Plant, seed: int) -> Calibrated:
    """Run ladder and minor loops of one copy, and fit."""
    one, whole = (ladder_plan(LADDER_TOP_V, LADDER_STEP_V, groups) for groups in (1, GROUPS))
    twin, minor_v = quiet_twin(plant), stairs_between(TURNS_V, STAIR_V)
    group_n, minor_n = (staircase(twin, voltages_v, READ_ONCE) for voltages_v in (one.voltage_v, minor_v))
    noise = noise_n(plant, seed, len(whole) + len(minor_v))
    ladder = ladder_of(whole, np.tile(group_n, GROUPS) + noise[: len(whole)])
    bsfm = fit(ladder, "bsfm", 2, FORMS["bsfm"]).branches
    psfm, same = (fit(ladder, "psfm", order, FORMS["psfm"]).branches for order in (3, 2))
    walk_n = minor_n + noise[len(whole) :] / np.sqrt(MINOR_READINGS)
    ours = fit_joint(bsfm, [walk_of(ladder), Walk(np.array(minor_v), walk_n)]).model
    return Calibrated(seed, plant, ladder, psfm, same, bsfm, ours)


def sweep(ladder: Ladder, orders: Sequence[int]) -> dict[str, list[FitResult]]:
    """Return fits of all four models, by name, orders ascending (Figs. 4, 5, 6)."""
    return {name: fit_orders(ladder, name, orders, ties) for name, ties in FORMS.items()}
