"""Replay, stage 1: pressure on the grid for each different regulator.

What does not depend on time (map, steps, dead band, play, supply) runs over the rows where the command changes. Lags and
slew limit follow from command to command (replay_lags.py), the delay looks at what they gave earlier: a command
between two points, and a delay of any length, act smoothly, and are exact. Only a regulator without any lag jumps:
there the target is averaged over each step of the grid, through its integral, which the delay shifts.
"""

from collections.abc import Sequence
from dataclasses import fields
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from gateway.defaults import UNLIMITED
from gateway.twin.effects.regulator import add_droop, add_hunting, apply_leak
from gateway.twin.effects.term import is_switched_on
from gateway.twin.regulator import target_pa
from gateway.twin.replay.cache import Cache
from gateway.twin.replay.drive import Drive, Floats
from gateway.twin.replay.grid import Grid, common_step_s
from gateway.twin.replay.lags import filter_even_rows, has_lags, is_linear, pressure_after, states_at_commands
from gateway.twin.sections import Regulator

_LAGGING = ("slew_pa_per_s", "lag_s", "second_lag_s", "fill_slowdown")
_AFTERWARDS = ("delay_s", "ceiling_pa", "leak_flow_pa", "hunting_pa", "hunting_hz", "hunting_phase_rad")
_HELD = tuple(entry.name for entry in fields(Regulator) if entry.name not in (*_LAGGING, *_AFTERWARDS))
"""Fields that shape the held target."""
_DELAYS = 64  # that are remembered


class Pressures:
    """Pressure on the grid by regulator, Pa; where the recording has no command, its own pressure for all."""

    def __init__(self, drive: Drive, grid: Grid) -> None:
        self._drive, self._grid = drive, grid
        self._targets, self._states, self._pressures = Cache(), Cache(), Cache()
        self._seen = lru_cache(_DELAYS)(partial(commands_seen, drive.time_s, grid.time_s))
        self._held_s = common_step_s(np.concatenate([[0.0], np.diff(drive.time_s)]), 1)
        self._row_s = np.concatenate([np.diff(drive.time_s), [grid.step_s + grid.time_s[-1] - drive.time_s[-1]]])

    def of(self, regulators: Sequence[Regulator]) -> tuple[list[Floats], NDArray[np.intp]]:
        """Return (the different pressures, which of them each regulator has)."""
        if self._drive.command_v is None:
            return [self._measured()], np.zeros(len(regulators), dtype=np.intp)
        places: dict[Regulator, int] = {}
        which = np.array([places.setdefault(regulator, len(places)) for regulator in regulators], dtype=np.intp)
        return [self._pressure(regulator) for regulator in places], which

    def _measured(self) -> Floats:
        found = self._pressures.get("measured")
        if found is None:
            assert self._drive.pressure_pa is not None
            found = self._pressures.put(
                "measured", self._grid.from_rows(np.array(self._drive.pressure_pa, dtype=float))
            )
        return found

    def _pressure(self, regulator: Regulator) -> Floats:
        found = self._pressures.get(regulator)
        return self._pressures.put(regulator, self._followed(regulator)) if found is None else found

    def _followed(self, regulator: Regulator) -> Floats:
        """What lags and delay make of the target, then ceiling, leak and hunting."""
        pressure = self._delayed(regulator)
        if regulator.ceiling_pa < UNLIMITED:
            pressure = np.minimum(pressure, regulator.ceiling_pa)
        if regulator.leak_flow_pa != 0.0:
            pressure = apply_leak(regulator, pressure)
        if regulator.hunting_pa != 0.0:
            pressure = add_hunting(regulator, pressure, self._grid.time_s)
        return pressure

    def _delayed(self, regulator: Regulator) -> Floats:
        """What lags and delay make of the target."""
        if not has_lags(regulator):
            return self._averaged(regulator)
        if self._grid.is_rows and type(self._held_s) is float and is_linear(regulator):
            return filter_even_rows(regulator, self._target(regulator), self._held_s)
        return self._lagged(regulator)

    def _lagged(self, regulator: Regulator) -> Floats:
        """The last target that is seen at each point, and how far the pressure has come towards it."""
        target = self._target(regulator)
        key = tuple(getattr(regulator, name) for name in (*_HELD, *_LAGGING))
        state = self._states.get(key)
        if state is None:
            state = self._states.put(key, states_at_commands(regulator, target, self._held_s))
        last, since_s = self._seen(regulator.delay_s)
        return pressure_after(regulator, state[:, last], target[last], since_s)

    def _averaged(self, regulator: Regulator) -> Floats:
        """Mean of the delayed target over the step before each point; at point 0 the target long before."""
        grid, time_s, target = self._grid, self._drive.time_s, self._target(regulator)
        long_ago_s = regulator.delay_s + 1.0 + grid.step_s
        knots_s = np.concatenate([[-long_ago_s], time_s, [time_s[-1] + self._row_s[-1]]])
        integral = np.concatenate([[-target[0] * long_ago_s, 0.0], np.cumsum(target[1:] * self._row_s)])
        at_points = np.interp(grid.time_s - regulator.delay_s, knots_s, integral)
        return np.concatenate([target[:1], np.diff(at_points) / grid.steps_s])

    def _target(self, regulator: Regulator) -> Floats:
        key = tuple(getattr(regulator, name) for name in _HELD)
        found = self._targets.get(key)
        return self._targets.put(key, self._held(regulator)) if found is None else found

    def _held(self, regulator: Regulator) -> Floats:
        """Mean target from each row to the next, behind the one before all rows, (1 + rows,)."""
        command = self._drive.command_v
        assert command is not None
        before_v = command[0] if self._drive.before_v is None else self._drive.before_v
        target, changed = held_targets(regulator, np.concatenate([[before_v], command]))
        if regulator.leak_per_s != 0.0:
            target[1:] *= self._kept(regulator.leak_per_s, changed[1:])
        supply_kpa = self._grid.row_conditions.supply_kpa
        if supply_kpa is not None and is_switched_on(regulator, ("droop_pa_per_pa", "droop_share_per_pa")):
            target = add_droop(regulator, target, np.concatenate([supply_kpa[:1], supply_kpa]))
        return target

    def _kept(self, leak_per_s: float, changed: NDArray[np.bool_]) -> Floats:
        """Mean share of the target that a leak since the last change of the command has left, from row to row."""
        row_s = self._drive.time_s
        last = np.maximum.accumulate(np.where(changed, np.arange(row_s.size), 0))
        since_s = row_s - row_s[last]
        share: Floats = np.exp(-leak_per_s * since_s) * -np.expm1(-leak_per_s * self._row_s)
        return share / (leak_per_s * self._row_s)


def commands_seen(row_s: Floats, time_s: Floats, delay_s: float) -> tuple[NDArray[np.intp], Floats]:
    """Return, at each time: how many commands were seen behind this delay, and for how long the last one has been, s.

    A command that arrives just now is not seen yet. np.interp is three times as fast as np.searchsorted, for both rise.
    """
    moment_s = time_s - delay_s
    count = np.ceil(np.interp(moment_s, row_s, np.arange(row_s.size))).astype(np.intp)
    count[moment_s > row_s[-1]] = row_s.size
    return count, np.maximum(moment_s - row_s[np.maximum(count - 1, 0)], 0.0)


def held_targets(regulator: Regulator, command_v: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Return (target of each command, Pa; whether it was noticed as a change), by map, steps, dead band, play and supply.

    The state before the first command is that of rest at 0. Equal commands after one another count as one.
    """
    asked = target_pa(regulator, command_v, is_switched_on(regulator, ("command_bow", "command_s")))
    news = np.concatenate([[True], asked[1:] != asked[:-1]])
    places = np.cumsum(news) - 1
    values = asked[news]
    if regulator.dead_band_pa > 0.0:
        values = np.array(_apply_dead_band(values.tolist(), regulator.dead_band_pa))
    changed = np.zeros(asked.size, dtype=bool)
    changed[news] = np.concatenate([[True], values[1:] != values[:-1]])
    if regulator.hysteresis_pa > 0.0:
        values = np.array(_apply_play(values.tolist(), 0.5 * regulator.hysteresis_pa))
    held = np.minimum(np.maximum(values, 0.0), regulator.supply_pa)
    return held[places], changed


def _apply_dead_band(targets: list[float], dead_band: float) -> list[float]:
    """regulator.apply_dead_band over a list."""
    held, found = 0.0, []
    for target in targets:
        if abs(target - held) > dead_band:
            held = target
        found.append(held)
    return found


def _apply_play(targets: list[float], half_width: float) -> list[float]:
    """regulator.apply_play over a list."""
    state, found = 0.0, []
    for target in targets:
        least, most = target - half_width, target + half_width
        state = least if state < least else most if state > most else state
        found.append(state)
    return found
