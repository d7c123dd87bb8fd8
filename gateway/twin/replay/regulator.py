"""Replay, stage 1: pressure on the grid for each different regulator.

What does not depend on time (map, steps, dead band, play, supply) runs over the rows where the command changes; lags, slew
limit and delay run over the points of the grid. A command between two points, and a delay of any length, act smoothly, and
are exact.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gateway.defaults import UNLIMITED
from gateway.twin.effects.regulator import add_droop, add_hunting, apply_leak
from gateway.twin.effects.term import is_switched_on
from gateway.twin.regulator import lags_of, target_pa
from gateway.twin.replay.cache import Cache
from gateway.twin.replay.drive import AT_REST, Drive, Floats, StartState
from gateway.twin.replay.grid import Grid
from gateway.twin.replay.loops import hold_targets, march_pressure
from gateway.twin.sections import Regulator


class Pressures:
    """Pressure on the grid by regulator, Pa; where the recording has no command, its own pressure for all."""

    def __init__(self, drive: Drive, grid: Grid) -> None:
        self._drive, self._grid = drive, grid
        self._pressures = Cache()
        self._lasts_s = np.concatenate([np.diff(drive.time_s), [grid.step_s + grid.time_s[-1] - drive.time_s[-1]]])

    def of(
        self, regulators: Sequence[Regulator], starts: Sequence[StartState]
    ) -> tuple[list[Floats], NDArray[np.intp]]:
        """Return (the different pressures, which of them each regulator has)."""
        if self._drive.command_v is None:
            return [self._measured_pressure()], np.zeros(len(regulators), dtype=np.intp)
        places: dict[tuple[Regulator, StartState], int] = {}
        each = ((one, _of_pressure(start)) for one, start in zip(regulators, starts, strict=True))
        which = np.array([places.setdefault(one, len(places)) for one in each], dtype=np.intp)
        return self._pressures.get_all(list(places), self._follow_target), which

    def _measured_pressure(self) -> Floats:
        pressure = self._pressures.get("measured")
        if pressure is not None:
            return pressure
        assert self._drive.pressure_pa is not None
        column = np.array(self._drive.pressure_pa, dtype=float)
        return self._pressures.put("measured", self._grid.from_rows(column))

    def _follow_target(self, key: tuple[Regulator, StartState]) -> Floats:
        """What lags and delay make of the target, then ceiling, leak and hunting."""
        regulator, start = key
        pressure, lags = np.empty(self._grid.points), lags_of(regulator)
        arrives_s = self._drive.time_s + regulator.delay_s
        target = self._target(regulator)
        first_pa = max(float(target[0]) + start.ahead_pa, 0.0)
        start_pa = (first_pa, max(first_pa + start.second_ahead_pa, 0.0))
        target[0] += start.coming_pa
        march_pressure(lags, lags.are_none, start_pa, (target, arrives_s, self._grid.time_s), pressure)
        if regulator.ceiling_pa < UNLIMITED:
            pressure = np.minimum(pressure, regulator.ceiling_pa)
        if regulator.leak_flow_pa != 0.0:
            pressure = apply_leak(regulator, pressure)
        if regulator.hunting_pa != 0.0:
            pressure = add_hunting(regulator, pressure, self._grid.time_s)
        return pressure

    def _target(self, regulator: Regulator) -> Floats:
        """Mean target from each row to the next, behind the one before all rows, (1 + rows,)."""
        command = self._drive.command_v
        assert command is not None
        before_v = command[0] if self._drive.before_v is None else self._drive.before_v
        asked = target_pa(regulator, np.concatenate([[before_v], command]))
        shape = (regulator.dead_band_pa, regulator.hysteresis_pa, regulator.supply_pa, regulator.leak_per_s)
        target: Floats = np.empty_like(asked)
        hold_targets(asked, self._drive.time_s, self._lasts_s, shape, target)
        supply_kpa = self._grid.row_conditions.supply_kpa
        if supply_kpa is not None and is_switched_on(regulator, ("droop_pa_per_pa", "droop_share_per_pa")):
            return np.asarray(add_droop(regulator, target, np.concatenate([supply_kpa[:1], supply_kpa])))
        return target


def _of_pressure(start: StartState) -> StartState:
    """The same as far as the pressure feels it."""
    return AT_REST._replace(ahead_pa=start.ahead_pa, second_ahead_pa=start.second_ahead_pa, coming_pa=start.coming_pa)
