"""Rigid friction whose limit follows the motion, in a replay: Stribeck's curve and stiction after a rest, on the pad.

The play of replay_play.py with a band whose width is the last step's doing; the state is force, last travel and stiction,
as in friction.py. Several times faster than the slide step by step (replay_stepped.py), which the other cases need.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.twin.friction import BREAKAWAY_M, directional_drags, travel_share
from gateway.twin.replay.drive import Floats
from gateway.twin.replay.grid import Grid
from gateway.twin.replay.load import Load
from gateway.twin.replay.parts import march_in_parts, split_lanes, stack_lanes

_LENGTH_M: Final = 1.0e-4  # unit of travels where states are compared


@dataclass(frozen=True, slots=True, eq=False)
class StickingLanes:
    """What the steps need of every lane, (lanes,)."""

    pad_n_per_m: Floats
    out_n_s_per_m: Floats
    back_n_s_per_m: Floats
    stribeck_n: Floats
    stribeck_m_per_s: Floats
    stiction_n: Floats
    stiction_s: Floats

    @classmethod
    def of(cls, loads: list[Load]) -> "StickingLanes":
        frictions = [load.plant.friction for load in loads]
        both = np.array([directional_drags(friction) for friction in frictions])
        return cls(
            np.array([load.plant.contact.pad_stiffness_n_per_m for load in loads]),
            both[:, 0],
            both[:, 1],
            np.array([friction.stribeck_n for friction in frictions]),
            np.array([friction.stribeck_speed_m_per_s for friction in frictions]),
            np.array([friction.dwell_stiction_n for friction in frictions]),
            np.array([friction.dwell_stiction_s for friction in frictions]),
        )

    def select(self, lanes: NDArray[np.intp]) -> "StickingLanes":
        return StickingLanes(*(getattr(self, name)[lanes] for name in self.__slots__))


def sticking_forces(loads: list[Load], grid: Grid) -> list[Floats]:
    """Return the force of each load on the grid, N."""
    lanes = StickingLanes.of(loads)
    drive, limit = stack_lanes([load.drive_n for load in loads]), stack_lanes([load.limit_n for load in loads])
    state = np.zeros((3, len(loads)))
    begins = [0.0 if load.start is None else load.start_force_n for load in loads]
    state[0] = first = np.clip(begins, drive[0] - limit[0], drive[0] + limit[0])
    rising = np.where(np.diff(drive, axis=0) >= 0.0, 1.0, -1.0)
    guess = np.zeros((3, *rising.shape))
    guess[0] = np.maximum(drive[:-1] - limit[:-1] * rising, 0.0)
    steps_s = np.broadcast_to(np.asarray(grid.steps_s), grid.points - 1)
    lengths = [np.repeat(column[:, None], len(loads), axis=1) for column in (steps_s, np.r_[steps_s[:1], steps_s[:-1]])]

    def march(which: NDArray[np.intp], series: list[Floats], state: Floats, forces: Floats) -> None:
        _march(lanes.select(which), series, state, forces)

    force = march_in_parts(march, [drive[1:], limit[1:], *lengths], state, guess)
    return split_lanes(np.concatenate([first[None], force]))


def _march(lanes: StickingLanes, series: list[Floats], state: Floats, forces: Floats) -> None:
    """Step through (steps, lanes) of drive, limit and lengths; advances the state (3, lanes) and fills the forces."""
    drives, limits, steps, lasts = series
    grows = 1.0 - np.exp(-steps / lanes.stiction_s)
    speeds = 1.0 / (lanes.stribeck_m_per_s * lasts)
    outs, backs = (travel_share(drag, lanes.pad_n_per_m, steps) for drag in (lanes.out_n_s_per_m, lanes.back_n_s_per_m))
    per_n, forget = 1.0 / lanes.pad_n_per_m, -1.0 / BREAKAWAY_M
    force, travel, stiction = state[0].copy(), state[1] * _LENGTH_M, state[2].copy()
    curved, ages = bool(np.any(lanes.stribeck_n)), bool(np.any(lanes.stiction_n))
    drags_at_all = bool(np.any(lanes.out_n_s_per_m)) or bool(np.any(lanes.back_n_s_per_m))
    for point in range(len(drives)):
        width = limits[point] + stiction
        if curved:
            width += lanes.stribeck_n / (1.0 + np.square(travel * speeds[point]))
        way = np.maximum(force, drives[point] - width)
        np.minimum(way, drives[point] + width, out=way)
        way -= force
        if drags_at_all:
            way *= np.where(way > 0.0, outs[point], backs[point])
        force = force + way
        travel = way * per_n
        if ages:
            stiction += grows[point] * (lanes.stiction_n - stiction)
            stiction *= np.exp(np.abs(travel) * forget)
        forces[point] = force
    state[0], state[1], state[2] = force, travel / _LENGTH_M, stiction
