"""The voltage-force model of a plant, identified on its twin as a ladder would identify it on a rig.

One conditioning cycle, one quiet staircase up and down, a walk of partial reversals, then the product's own fit and its own
choice of reversal: friction is compensated by the model that was made for it, not by a second formula. Quick: readings
without noise, no transport delay and a short lag, since only where the force comes to rest is asked for. The lag is kept
above zero, for a pressure that jumps lets the pad overshoot, and friction remembers that.
"""

from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache
from typing import Final

import numpy as np

from gateway.bsfm import Bsfm
from gateway.bsfm.branches import Branches
from gateway.bsfm.fit.branch_fit import FitSettings, fit_orders
from gateway.bsfm.fit.projected_problem import Floats
from gateway.bsfm.ladder.measured_ladder import Ladder, ladder_plan
from gateway.bsfm.slip.reversal_choice import choose_reversal
from gateway.control.compensation.compensation import Compensation
from gateway.control.runs.ladder_stairs import TURNS
from gateway.twin import Contact, Friction, LoadCell, Plant, Regulator, Twin
from gateway.twin.experiment import Dwell, staircase

ORDERS: Final = (2, 3)
ORDER_TOLERANCE: Final = 2.0  # of the best order's error: a lower order within it is taken
TURN_STAIRS: Final = 8  # that may be left out after each turn
STAIRS: Final = 40
MINOR_STAIRS: Final = 32  # of the whole range, per way

REGULATOR: Final = (
    "full_scale_v",
    "full_scale_pa",
    "command_step_v",
    "command_bow",
    "command_s",
    "dead_band_pa",
    "hysteresis_pa",
    "supply_pa",
    "ceiling_pa",
)
FRICTION: Final = (
    "coulomb_n",
    "load_dependent_n_per_n",
    "asymmetry_n",
    "presliding_m",
    "viscous_n_s_per_m",
    "asymmetry_n_s_per_m",
)
CONTACT: Final = (
    "pad_stiffness_n_per_m",
    "pad_damping_n_s_per_m",
    "gap_m",
    "mass_kg",
    "tilt_deg",
    "backlash_n",
    "lost_n",
    "hardening",
)
CELL: Final = ("zero_n", "range_n", "quadratic_per_n", "cubic_per_n2", "crosstalk_n_per_v", "sign_lost")
"""Numbers of a plant that decide where the force comes to rest."""

QUICK_LAG_S: Final = 0.02
CONDITIONING_S: Final = 0.6
DWELL: Final = Dwell(least_s=0.1, most_s=0.6, check_s=0.02, readings=1)


def quasi_static(plant: Plant) -> Plant:
    """Return the same plant without what passes and without what the surroundings bring.

    Noise, time, delays, tilt and warmth go. The rest says where the force settles, and plants that settle alike become one.
    """
    return replace(
        plant,
        regulator=replace(Regulator(), lag_s=QUICK_LAG_S, **_section_values(plant.regulator, REGULATOR)),
        friction=replace(Friction(), **_section_values(plant.friction, FRICTION)),
        contact=replace(Contact(), **_section_values(plant.contact, CONTACT)),
        cell=replace(LoadCell(), **_section_values(plant.cell, CELL)),
    )


def _section_values(section: object, names: tuple[str, ...]) -> dict[str, float]:
    return {name: getattr(section, name) for name in names}


def remove_compensated(plant: Plant, compensation: Compensation) -> Plant:
    """Return what the model has to describe once control takes its part: a straight command map, a straight cell."""
    cell, regulator = plant.cell, plant.regulator
    if compensation.cell:
        cell = replace(cell, quadratic_per_n=0.0, cubic_per_n2=0.0, crosstalk_n_per_v=0.0)
    if compensation.command:
        regulator = replace(regulator, command_bow=0.0, command_s=0.0)
    return replace(plant, cell=cell, regulator=regulator)


def identify_model(plant: Plant, top_v: float) -> Bsfm:
    """Return the model over 0 .. top_v. ValueError with a sentence where the plant has none (no force, a branch that falls)."""
    return _identify(quasi_static(plant), top_v)


@lru_cache(maxsize=16)
def _identify(still: Plant, top_v: float) -> Bsfm:
    plan = ladder_plan(top_v, top_v / STAIRS, 1)
    force_n = staircase(condition_twin(still, top_v), plan.voltage_v, DWELL)
    ladder = Ladder(np.array(plan.voltage_v), force_n, np.array(plan.direction), np.array(plan.group))
    ladder, branches = _usable_branches(ladder)
    foot_v = branches.rising.x0
    minor_v = _stairs_between([foot_v + turn * (top_v - foot_v) for turn in TURNS], top_v / MINOR_STAIRS)
    minor_n = staircase(condition_twin(still, top_v), minor_v, DWELL)
    choice = choose_reversal(branches, ladder, minor_v, minor_n)
    if choice is None:
        raise ValueError("the walk of partial reversals is too short for a model")
    return choice.model


def _usable_branches(ladder: Ladder) -> tuple[Ladder, Branches]:
    """The lowest order that may drive a plant, and the ladder that it was fitted to: where needed without the stairs right
    after each turn, at which a valve's play or a seal still holds the force and no branch could increase."""
    steps_v = np.unique(ladder.voltage_v)
    for cut in range(TURN_STAIRS + 1):
        reversal = (ladder.direction < 0) & (ladder.voltage_v > steps_v[-1 - cut])
        part = ladder.part((ladder.voltage_v >= steps_v[cut]) & ~reversal)
        for ties in ("tied", "free"):
            usable = [fit for fit in fit_orders(part, "bsfm", ORDERS, ties, _full_range(ladder)) if fit.verdicts.usable]
            if usable:
                least_n = ORDER_TOLERANCE * min(fit.overall.rms_n for fit in usable)
                return part, next(fit.branches for fit in usable if fit.overall.rms_n <= least_n)
    raise ValueError("no order gives branches that increase and do not cross")


def _full_range(ladder: Ladder) -> FitSettings:
    """Return the curves span the whole ladder, also where stairs were left out."""
    return FitSettings(voltage_range_v=(float(ladder.voltage_v.min()), float(ladder.voltage_v.max())))


def condition_twin(plant: Plant, top_v: float, seed: int = 0) -> Twin:
    """Return a twin whose friction remembers a full cycle: where a ladder starts, and a rig that has worked before."""
    twin = Twin(plant, seed)
    for voltage_v in (top_v, 0.0):
        twin.command(voltage_v)
        twin.advance(CONDITIONING_S)
    return twin


def _stairs_between(turns_v: Iterable[float], step_v: float) -> Floats:
    stairs: list[float] = []
    for turn_v in turns_v:
        start_v = stairs[-1] if stairs else turn_v
        count = max(1, round(abs(turn_v - start_v) / step_v))
        stairs += [start_v + (turn_v - start_v) * (i + 1) / count for i in range(count)]
    return np.array(stairs)
