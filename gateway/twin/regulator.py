"""The electro-pneumatic regulator: command steps, dead band, hysteresis, supply limit, delay, two lags, slew.

Order of the terms: what does not depend on time (steps, dead band, play, supply) acts when the command arrives, and
what does (delay, lags, slew) acts while it stands. The two commute - a rate-independent operator does not care when its
input comes - and a held command then costs nothing but the lags. These are exact under a target u that is held for a time h:
    p1' = u + e1 (p1 - u),  p2' = u + e2 (p2 - u) + K (p1 - u),  K = t1 (e1 - e2) / (t1 - t2),  e = exp(-h / t).
A delay shifts the moment at which a target is seen, by any time: a step in which one arrives is cut there. Only a regulator
without any lag jumps: there the pressure of a step is the mean of the targets that it saw.
"""

import math
from collections import deque
from functools import lru_cache
from typing import NamedTuple

from gateway.compiled import step
from gateway.defaults import UNLIMITED
from gateway.twin.effects.regulator import add_droop, add_hunting, apply_leak, bend_command
from gateway.twin.effects.term import is_switched_on
from gateway.twin.elementwise import Real, clip, quantise, smaller
from gateway.twin.play_and_lags import apply_play
from gateway.twin.sections import Regulator


def target_pa(regulator: Regulator, voltage_v: Real) -> Real:
    """Return the pressure that a command asks for, in the command's own steps."""
    stepped_v = quantise(clip(voltage_v, 0.0, regulator.full_scale_v), regulator.command_step_v)
    if is_switched_on(regulator, ("command_bow", "command_s")):
        stepped_v = bend_command(regulator, stepped_v)
    return smaller(stepped_v, regulator.full_scale_v) * (regulator.full_scale_pa / regulator.full_scale_v)


class HeldTarget(NamedTuple):
    """The target while a command stands, Pa: as it was noticed, and behind the play and the supply's limit."""

    noticed_pa: float = 0.0
    play_pa: float = 0.0
    held_pa: float = 0.0


@step
def notice_target(
    target: HeldTarget, asked_pa: float, dead_band_pa: float, play_pa: float, supply_pa: float
) -> HeldTarget:
    """Return the target after another one was asked for; a change within the dead band passes unnoticed."""
    noticed_pa = asked_pa if abs(asked_pa - target.noticed_pa) > dead_band_pa else target.noticed_pa
    behind_pa = apply_play(target.play_pa, noticed_pa, play_pa)
    return HeldTarget(noticed_pa, behind_pa, min(max(behind_pa, 0.0), supply_pa))


@step
def leaked_share(leak_per_s: float, since_s: float, held_s: float) -> float:
    """Return the mean share of a target that a leak has left, over the next `held_s`, `since_s` after it was noticed."""
    return math.exp(-leak_per_s * since_s) * -math.expm1(-leak_per_s * held_s) / (leak_per_s * held_s)


class PressureLags(NamedTuple):
    """What delays the pressure. filling_s: the first lag while the pressure rises."""

    emptying_s: float
    filling_s: float
    second_s: float
    slew_pa_per_s: float

    @property
    def are_none(self) -> bool:
        """Tell whether the pressure takes no time at all: it jumps with the target."""
        return self.emptying_s == 0.0 and self.second_s == 0.0 and self.slew_pa_per_s >= UNLIMITED


class LagShares(NamedTuple):
    """What is kept over a time: (e1, K) while the pressure rises and while it falls, and e2. most_pa: the slew lets through."""

    filling: tuple[float, float]
    emptying: tuple[float, float]
    second: float
    most_pa: float


class PressureState(NamedTuple):
    """Pressure behind the first lag, behind the second, and behind the slew limit, Pa."""

    first_pa: float = 0.0
    second_pa: float = 0.0
    slewed_pa: float = 0.0


def lags_of(regulator: Regulator) -> PressureLags:
    """Return what delays the pressure of a regulator."""
    filling_s = regulator.lag_s * (1.0 + regulator.fill_slowdown)
    return PressureLags(regulator.lag_s, filling_s, regulator.second_lag_s, regulator.slew_pa_per_s)


@step
def couple_lags(first_s: float, second_s: float, held_s: float) -> tuple[float, float]:
    """Return (e1, K) of the module's text; lags of 0 are none."""
    kept_1 = math.exp(-held_s / first_s) if first_s > 0.0 else 0.0
    if second_s == 0.0:
        return kept_1, kept_1
    kept_2 = math.exp(-held_s / second_s)
    if abs(first_s - second_s) > 1.0e-3 * max(first_s, second_s):
        return kept_1, (kept_1 - kept_2) * (first_s / (first_s - second_s))
    between = held_s * ((first_s - second_s) / (first_s * second_s))
    growth = 1.0 + between * (0.5 + between / 6.0)  # expm1(x) / x, also at 0
    return kept_1, held_s / second_s * kept_2 * growth


@step
def lag_shares(lags: PressureLags, held_s: float) -> LagShares:
    """Return what is kept over a time."""
    emptying = couple_lags(lags.emptying_s, lags.second_s, held_s)
    filling = emptying if lags.filling_s == lags.emptying_s else couple_lags(lags.filling_s, lags.second_s, held_s)
    second = math.exp(-held_s / lags.second_s) if lags.second_s > 0.0 else 0.0
    return LagShares(filling, emptying, second, lags.slew_pa_per_s * held_s)


_kept_lag_shares = lru_cache(maxsize=16)(lag_shares)  # a delay cuts its steps at the same place again and again


@step
def follow_target(state: PressureState, target_pa: float, shares: LagShares) -> PressureState:
    """Return the state after the time of the shares under one target."""
    ahead_pa = state.first_pa - target_pa
    kept, across = shares.filling if ahead_pa < 0.0 else shares.emptying
    second_pa = target_pa + shares.second * (state.second_pa - target_pa) + across * ahead_pa
    least_pa, most_pa = state.slewed_pa - shares.most_pa, state.slewed_pa + shares.most_pa
    slewed_pa = least_pa if second_pa < least_pa else most_pa if second_pa > most_pa else second_pa
    return PressureState(target_pa + kept * ahead_pa, second_pa, slewed_pa)


class RegulatorState:
    """The moving part: `command` when a voltage arrives, `step` every step."""

    def __init__(self, regulator: Regulator, step_s: float) -> None:
        self._step_s, self._voltage_v = step_s, 0.0
        self._take(regulator)
        self._target, self._state = HeldTarget(), PressureState()
        self._followed: tuple[object, ...] = ()  # state, target and shares that the last state was computed from
        self._since_s = 0.0
        self._now, self._seen_pa = 0, 0.0
        self._arriving: deque[tuple[float, float]] = deque()
        self.pressure_pa = 0.0
        self.air = True
        self.supply_kpa: float | None = None

    def _take(self, regulator: Regulator) -> None:
        self._regulator = regulator
        self._lags = lags_of(regulator)
        self._shares = lag_shares(self._lags, self._step_s)
        self._delay = round(regulator.delay_s / self._step_s, 9)  # in steps, as all moments here
        self._droops = is_switched_on(regulator, ("droop_pa_per_pa", "droop_share_per_pa"))
        self._changes = self._droops or regulator.leak_per_s != 0.0

    def change_regulator(self, regulator: Regulator) -> None:
        """Go on as another regulator under the same command; what is on its way arrives no later than what comes after it."""
        self._take(regulator)
        latest = self._now + self._delay
        self._arriving = deque((min(moment, latest), target) for moment, target in self._arriving)
        if not self._delay:
            self._arriving.clear()  # what is seen now is sent again
        self.command(self._voltage_v)

    def command(self, voltage_v: float) -> None:
        """Take a new command, V."""
        regulator, before = self._regulator, self._target
        self._voltage_v = voltage_v
        self._target = notice_target(
            before,
            target_pa(regulator, voltage_v),
            regulator.dead_band_pa,
            regulator.hysteresis_pa,
            regulator.supply_pa,
        )
        if self._target.noticed_pa != before.noticed_pa:
            self._since_s = 0.0
        if not self._changes:
            self._send(self._target.held_pa)

    def step(self) -> float:
        """Return the pressure at the end of one step, Pa."""
        if self._changes:
            self._send(self._held_pa())
        has_arrival = self._arriving and self._arriving[0][0] < self._now + 1
        pressure = self._follow() if has_arrival else self._advance(self._step_s)
        self._now += 1
        regulator = self._regulator
        if pressure > regulator.ceiling_pa:
            pressure = regulator.ceiling_pa
        if regulator.leak_flow_pa != 0.0:
            pressure = apply_leak(regulator, pressure)
        if regulator.hunting_pa != 0.0:
            pressure = add_hunting(regulator, pressure, self._now * self._step_s)
        self.pressure_pa = pressure
        return pressure

    def _send(self, target_pa: float) -> None:
        if self._delay:
            self._arriving.append((self._now + self._delay, target_pa))
        else:
            self._seen_pa = target_pa

    def _follow(self) -> float:
        """One step in which targets arrive."""
        at, total = float(self._now), 0.0
        while self._arriving and self._arriving[0][0] < self._now + 1:
            moment, target = self._arriving.popleft()
            total += (moment - at) * self._advance((moment - at) * self._step_s)
            at, self._seen_pa = moment, target
        left = self._now + 1 - at
        pressure = self._advance(left * self._step_s)
        return total + left * pressure if self._lags.are_none else pressure

    def _advance(self, held_s: float) -> float:
        """Live under the target that is seen now."""
        target = self._seen_pa if self.air else 0.0
        shares = self._shares if held_s == self._step_s else _kept_lag_shares(self._lags, held_s)
        if (held := (self._state, target, shares)) != self._followed:  # else it changes nothing, like the one before
            self._followed, self._state = held, follow_target(*held)
        return self._state.slewed_pa

    def _held_pa(self) -> float:
        """The target over the next step, with what happens to it while the command stands: leak and droop."""
        pressure, regulator = self._target.held_pa, self._regulator
        if regulator.leak_per_s != 0.0:
            pressure *= leaked_share(regulator.leak_per_s, self._since_s, self._step_s)
            self._since_s += self._step_s
        if self._droops and self.supply_kpa is not None:
            pressure = add_droop(regulator, pressure, self.supply_kpa)
        return pressure
