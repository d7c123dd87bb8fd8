"""Which voltages a calibration staircase visits, in order. No numpy: control walks it.

Defaults: LADDER_STEP_V and LADDER_GROUPS in gateway/defaults.py, by CalibrationPlan in control/runs/ladder_stairs.py.
"""

from dataclasses import dataclass
from math import ceil, isfinite
from typing import Final

RISING, FALLING = 1, -1
RESPONSE_GROUP: Final = -2
"""Group of a large step that tells the response alone: on a plant that rings its settled force is no point of the fit, for
friction has kept a part of the overshoot."""
LABELS: Final = ("phase", "group", "stair")
"""Columns in which a run records where it is: CalibrationPhase, group from 0 (-1 outside the ladder), and stair from 0 of
this run; the row after the last stair has the number of stairs. Read by gateway.bsfm.ladder.labels."""


@dataclass(frozen=True, slots=True)
class LadderPlan:
    """The stairs of a ladder in order: voltages, the direction in which each is reached, and its group (one way up and
    down), from 0.
    """

    voltage_v: tuple[float, ...]
    direction: tuple[int, ...]
    group: tuple[int, ...]

    def __len__(self) -> int:
        return len(self.voltage_v)


def ladder_plan(v_max_v: float, step_v: float, groups: int, v_min_v: float = 0.0) -> LadderPlan:
    """Plan `groups` times v_min -> v_max -> v_min in even steps, shortened if step_v does not divide the way.

    ValueError if that is no ladder.
    """
    if not (isfinite(v_max_v) and isfinite(v_min_v) and 0.0 < step_v <= v_max_v - v_min_v and groups >= 1):
        raise ValueError(f"ladder {v_min_v:g} .. {v_max_v:g} V by {step_v:g} V, {groups} groups: no such ladder")
    steps = ceil((v_max_v - v_min_v) / step_v - 1.0e-9)
    up = [v_min_v + (v_max_v - v_min_v) * i / steps for i in range(steps + 1)]
    voltages = (*up, *up[-2::-1])
    directions = (RISING,) * (steps + 1) + (FALLING,) * steps
    return LadderPlan(voltages * groups, directions * groups, tuple(g for g in range(groups) for _ in voltages))
