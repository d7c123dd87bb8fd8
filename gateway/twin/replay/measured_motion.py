"""A slide whose motion was measured: friction follows the position, and the force is thrust - friction, without a pad.

Without noise, elements are moved by the position's own increments. With noise, rigid friction takes its direction from
the speed, tanh(v / v0) with v0 two fifths of the usual speed and the slope over a 24th of a stroke: in a real cylinder
the friction falls before the rod stands (Zillen's data, 1 bar: 0.55 and 0.27 N left, against 0.81 and 0.44 N by the sign of
the travel). At rest nobody knows where between its limits friction stands; 0 is the middle. Presliding elements follow that
direction over their yield travel, so that presliding grows from nothing without a jump (0.47 and 0.24 N left; by the
position's own increments, which noise makes wide, it did not help at all). The speed, for drag and Stribeck's curve, is the
slope over 50 ms.
"""

from functools import cached_property
from typing import Final

import numpy as np

from gateway.twin.friction import (
    BREAKAWAY_M,
    ELEMENTS,
    RIGID_M,
    directional_drags,
    stribeck_limit_n,
    two_sided_limit,
    yield_travels_m,
)
from gateway.twin.replay.cache import Cache
from gateway.twin.replay.drive import Drive, Floats
from gateway.twin.replay.grid import Grid
from gateway.twin.replay.loops import march_play, march_stiction, march_strain
from gateway.twin.sections import Friction
from gateway.twin.slide import Slide

NOISE_WIDTHS: Final = 4.0
_SLOPE_S: Final = 0.025  # to either side
_DIRECTION_STROKES: Final = 1.0 / 48.0  # to either side
_LONGEST_S: Final = 0.25
_SOFT_SHARE: Final = 0.4  # of the usual speed


class Motions:
    """The measured motion on the grid, and the strains that it makes."""

    def __init__(self, drive: Drive, grid: Grid) -> None:
        assert drive.position_m is not None
        self._grid, self._sign = grid, 1.0 if drive.motion == "measured" else -1.0
        self._noise_m = drive.position_noise_m
        self._position_m = self._sign * grid.from_rows(drive.position_m)
        self._speed_m_per_s = self._slope(_SLOPE_S)
        self._strains = Cache()

    def force_n(self, slide: Slide, friction: Friction, loads_n: tuple[Floats, Floats, Floats]) -> Floats:
        """Return the force on the grid, N: thrust - friction outward, seen from the position's own direction.

        loads_n: thrust, what surroundings add to the friction's limit, and what of it moving out has more.
        """
        thrust_n, side_n, more_out_n = loads_n
        limit = slide.coulomb_n + side_n + slide.load_dependent_n_per_n * thrust_n
        limit, centre = two_sided_limit(limit, slide.asymmetry_n + more_out_n)
        limit, strain = self._moving_limit_n(friction, limit), self._mean_strain(friction.presliding_m)
        out, back = directional_drags(friction)
        speed = self._speed_m_per_s
        drag: Floats = np.where(speed > 0.0, out, back) * speed
        return np.asarray(thrust_n + slide.weight_n - centre - limit * strain - drag)

    def _moving_limit_n(self, friction: Friction, limit: Floats) -> Floats:
        """The limit with what the motion makes of it: Stribeck's curve and stiction after a rest."""
        if friction.stribeck_n != 0.0:
            ratio = self._speed_m_per_s / friction.stribeck_speed_m_per_s
            limit = limit + stribeck_limit_n(friction.stribeck_n, ratio)
        return limit + self._stiction_n(friction) if friction.dwell_stiction_n != 0.0 else limit

    def _stiction_n(self, friction: Friction) -> Floats:
        breakaway_m = max(friction.presliding_m, BREAKAWAY_M, NOISE_WIDTHS * self._noise_m)
        travels, stiction = self._quiet_travels_m() / breakaway_m, np.empty(self._grid.points)
        stiction[0] = 0.0
        march_stiction(friction.dwell_stiction_n, friction.dwell_stiction_s, travels, self._grid.steps_s, stiction)
        return stiction

    def _quiet_travels_m(self) -> Floats:
        """Travel of each step, without the noise of a position at rest (a play of four deviations takes it out)."""
        if self._noise_m == 0.0:
            return np.diff(self._position_m)
        return np.diff(_drag_element(self._position_m, 0.5 * NOISE_WIDTHS * self._noise_m))

    def _mean_strain(self, presliding_m: float) -> Floats:
        found = self._strains.get(presliding_m)
        if found is not None:
            return found
        if self._noise_m > 0.0:
            return self._strains.put(presliding_m, self._smooth_strain(presliding_m))
        widths = yield_travels_m(presliding_m)[: ELEMENTS if presliding_m > 0.0 else 1]
        strains = [(self._position_m - _drag_element(self._position_m, width)) / width for width in widths]
        return self._strains.put(presliding_m, np.clip(sum(strains[1:], start=strains[0]) / len(widths), -1.0, 1.0))

    def _smooth_strain(self, presliding_m: float) -> Floats:
        """The mean strain under a noisy position: each element follows the direction over its yield travel."""
        direction = self._direction
        if presliding_m == 0.0:
            return direction
        travels_m, strains = np.abs(self._speed_m_per_s[1:]) * self._grid.steps_s, []
        for width_m in yield_travels_m(presliding_m):
            strains.append(np.empty_like(direction))
            march_strain(direction, travels_m / width_m, strains[-1])
        return np.asarray(sum(strains[1:], start=strains[0]) / ELEMENTS)

    @cached_property
    def _direction(self) -> Floats:
        """-1 .. 1: the way of the motion, by a speed smooth enough to be sure of it."""
        steady, duration_s = np.abs(self._slope(0.1)), float(self._grid.time_s[-1]) + self._grid.step_s
        strokes = float(np.mean(steady)) * duration_s / max(float(np.ptp(self._position_m)), RIGID_M)
        stroke_s = duration_s / max(strokes, 1.0)
        reach_s = min(max(_DIRECTION_STROKES * stroke_s, _SLOPE_S), _LONGEST_S)
        usual = float(np.median(steady[steady > 0.1 * float(np.max(steady))]))
        return np.asarray(np.tanh(self._slope(reach_s) / max(_SOFT_SHARE * usual, RIGID_M)))

    def _slope(self, reach_s: float) -> Floats:
        grid, position = self._grid, self._position_m
        reach = max(1, round(reach_s / grid.step_s)) if self._noise_m > 0.0 else 1
        point = np.arange(grid.points)
        before, behind = np.maximum(point - reach, 0), np.minimum(point + reach, grid.points - 1)
        slope: Floats = (position[behind] - position[before]) / (grid.time_s[behind] - grid.time_s[before])
        return slope


def _drag_element(position_m: Floats, width_m: float) -> Floats:
    """The far end of an element of this width: the position drags it along."""
    end = np.empty_like(position_m)
    march_play(2.0 * width_m, float(position_m[0]), position_m, end)
    return end
