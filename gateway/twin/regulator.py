"""The electro-pneumatic regulator: command steps, dead band, hysteresis, supply limit, delay, two lags, slew.

Order of the terms: what does not depend on time (steps, dead band, play, supply) acts when the command arrives, and
what does (delay, lags, slew) acts in each step. The two commute - a rate-independent operator does not care when its
input comes - and a held command then costs nothing but the lags. The lags are exact for a held input:
p += (1 - exp(-dt/tau)) (u - p), stable for any dt. The delay may be a fraction of a step (interpolated, never early),
so that its sensitivity can be computed.
"""

from typing import Any

import numpy as np

from gateway.defaults import UNLIMITED
from gateway.twin.effects.regulator import add_droop, add_hunting, apply_leak, bend_command
from gateway.twin.effects.term import is_switched_on
from gateway.twin.elementwise import Real, choose, clip, exponential, larger, quantise, smaller, where
from gateway.twin.sections import Regulator


def lag_factor(lag_s: Real, step_s: float) -> Real:
    """Return the share of the remaining difference that a first-order lag covers in one step; 1 without a lag."""
    present = larger(lag_s, 1.0e-12)
    return where(lag_s > 0.0, 1.0 - exponential(-step_s / present), lag_s * 0.0 + 1.0)


def filling_factor(regulator: Regulator, step_s: float) -> Real:
    """Return lag_factor while the pressure rises."""
    return lag_factor(regulator.lag_s * (1.0 + regulator.fill_slowdown), step_s)


def half_decay(decay: Real) -> Real:
    """Return a leak's decay over half a step: the first step after a command counts at its middle."""
    return np.sqrt(decay) if isinstance(decay, np.ndarray) else decay**0.5


def target_pa(regulator: Regulator, voltage_v: Real, bends: bool = False) -> Real:
    """Return the pressure that a command asks for, in the command's own steps. bends: is its map other than straight?"""
    stepped_v = quantise(clip(voltage_v, 0.0, regulator.full_scale_v), regulator.command_step_v)
    if bends:
        stepped_v = bend_command(regulator, stepped_v)
    return smaller(stepped_v, regulator.full_scale_v) * (regulator.full_scale_pa / regulator.full_scale_v)


def apply_dead_band(target: Real, held: Real, dead_band: Real) -> Real:
    """Return the target that the regulator works on: a change within the dead band passes unnoticed."""
    return where(abs(target - held) > dead_band, target, held)


def apply_play(state: Real, value: Real, width: Real) -> Real:
    """Apply a play of full width `width`: the state is dragged along, half a width behind."""
    return clip(state, value - 0.5 * width, value + 0.5 * width)


class DelayLine:
    """What was put in `delay_s` ago, one `put` per step. One ring for all lanes; lanes may have different delays."""

    def __init__(self, delay_s: Real, step_s: float, start: Real) -> None:
        steps = np.round(np.asarray(delay_s) / step_s, 9)
        whole = np.floor(steps).astype(int)
        self._fraction = float(steps - whole) if steps.ndim == 0 else steps - whole
        self._interpolates = bool(np.any(steps != whole))
        self._same = bool(np.all(whole == whole.flat[0]))
        self._whole, self._first = whole, int(whole.flat[0])
        self._length = int(whole.max()) + 2
        self._lanes = np.arange(whole.size)
        self._ring: Any = [start] * self._length if self._same else np.zeros((self._length, whole.size))
        self._at = 0

    def put(self, value: Real) -> Real:
        """Store this step's value and return the one that is due."""
        self._at = at = (self._at + 1) % self._length
        self._ring[at] = value
        if not self._interpolates:
            return self._look_back(at)
        later, earlier = self._look_back(at), self._look_back(at - 1)
        return later + self._fraction * (earlier - later)

    def _look_back(self, at: int) -> Real:
        if self._same:
            return self._ring[(at - self._first) % self._length]
        return self._ring[(at - self._whole) % self._length, self._lanes]


class RegulatorState:
    """The moving part: `command` when a voltage arrives, `step` every step."""

    def __init__(self, regulator: Regulator, step_s: float, zero: Real) -> None:
        self._regulator = regulator
        self._noticed_pa = self._play_pa = self._target_pa = self._slewed_pa = self._first_pa = zero
        self._zero, self._step_s = zero, step_s
        self.pressure_pa: Real = zero
        self.air = True
        self.supply_kpa: Real = None
        self._bends = is_switched_on(regulator, ("command_bow", "command_s"))
        self._delay = DelayLine(regulator.delay_s, step_s, zero) if np.any(regulator.delay_s) else None
        self._slew_pa = regulator.slew_pa_per_s * step_s if np.any(regulator.slew_pa_per_s < UNLIMITED) else None
        self._lag = lag_factor(regulator.lag_s, step_s) if np.any(regulator.lag_s) else None
        self._fill_lag = filling_factor(regulator, step_s) if np.any(regulator.fill_slowdown) else None
        self._second_lag = lag_factor(regulator.second_lag_s, step_s) if np.any(regulator.second_lag_s) else None
        self._decay = exponential(-regulator.leak_per_s * step_s) if np.any(regulator.leak_per_s) else None
        self._kept: Real = zero + 1.0
        self._droops = is_switched_on(regulator, ("droop_pa_per_pa", "droop_share_per_pa"))
        self._extra = self._decay is not None or self._droops
        self._caps = bool(np.any(regulator.ceiling_pa < UNLIMITED))
        self._leaks = bool(np.any(regulator.leak_flow_pa))
        self._hunts = bool(np.any(regulator.hunting_pa))
        self._steps, self._smooth_pa = 0, zero

    def command(self, voltage_v: Real) -> None:
        """Take a new command, V (one for all lanes, or one per lane)."""
        regulator, before = self._regulator, self._noticed_pa
        target = target_pa(regulator, voltage_v, self._bends)
        self._noticed_pa = apply_dead_band(target, before, regulator.dead_band_pa)
        self._play_pa = apply_play(self._play_pa, self._noticed_pa, regulator.hysteresis_pa)
        self._target_pa = smaller(larger(self._play_pa, 0.0), regulator.supply_pa) + self._zero
        if self._decay is not None:
            self._kept = choose(self._noticed_pa != before, half_decay(self._decay), self._kept)

    def step(self) -> Real:
        """Return the pressure at the end of one step, Pa."""
        pressure = self._target_pa if not self._extra else self._held_pa()
        if self._delay is not None:
            pressure = self._delay.put(pressure)
        if not self.air:
            pressure = self._zero
        if self._lag is not None:
            lag = self._lag
            if self._fill_lag is not None:
                lag = choose(pressure > self._first_pa, self._fill_lag, lag)
            self._first_pa = pressure = self._first_pa + lag * (pressure - self._first_pa)
        if self._second_lag is not None:
            pressure = self._smooth_pa + self._second_lag * (pressure - self._smooth_pa)
        self._smooth_pa = pressure
        if self._slew_pa is not None:
            last = self._slewed_pa
            self._slewed_pa = pressure = clip(pressure, last - self._slew_pa, last + self._slew_pa)
        if self._caps:
            pressure = smaller(pressure, self._regulator.ceiling_pa)
        if self._leaks:
            pressure = apply_leak(self._regulator, pressure)
        self.pressure_pa = pressure
        if self._hunts:
            self._steps += 1
            self.pressure_pa = add_hunting(self._regulator, pressure, self._steps * self._step_s)
        return self.pressure_pa

    def _held_pa(self) -> Real:
        """The target with what happens to it while the command stands: leak and droop."""
        pressure = self._target_pa
        if self._decay is not None:
            pressure = pressure * self._kept
            self._kept = self._kept * self._decay
        if self._droops and self.supply_kpa is not None:
            pressure = add_droop(self._regulator, pressure, self.supply_kpa)
        return pressure
