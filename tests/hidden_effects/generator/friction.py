"""A piston with friction against a pad: the contact force that a drive force causes.

Deliberately not the twin's model (Maxwell slip, mass, 1 ms): no mass, so the balance drive = pad + friction holds in each
fine step and is solved for the velocity, implicitly in the pad and the bristle, explicitly in the friction's limit.
Two families. Bristle: one deflection z with dz/dx = (1 - z/z_limit)^shape, Dahl (1968) without and LuGre (Canudas de Wit
1995) with bristle damping. Smooth: Coulomb regularised over a tiny velocity, limit * v / (|v| + v0), no memory at all.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import repeat
from math import exp, log1p, sqrt

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

RESTS_M_PER_S = 2.0e-5  # slower than this is rest: 0.8 N/s on a pad of 4e4 N/m


@dataclass(frozen=True, slots=True)
class Friction:
    """The piston's friction; rising and falling are the Coulomb levels while the force rises and falls.

    load: friction per newton of contact force. growth_n: stiction per natural unit of log(1 + rest/1 s), forgotten after
    slipping `forget_m`. rising_viscous acts while the force rises only.
    """

    family: str
    pad_n_per_m: float
    rising_n: float
    falling_n: float
    bristle_n_per_m: float = 1.0e6
    bristle_damping_n_s_per_m: float = 0.0
    shape: float = 1.0
    smooth_m_per_s: float = 2.0e-9
    viscous_n_s_per_m: float = 0.0
    rising_viscous_n_s_per_m: float = 0.0
    load: float = 0.0
    stribeck_n: float = 0.0
    stribeck_m_per_s: float = 1.5e-3
    growth_n: float = 0.0
    forget_m: float = 6.0e-5


def contact_force(drive_n: Floats, dt_s: float, friction: Friction, extra: "Extra | None" = None) -> Floats:
    """Force on the pad at each fine step, N; the piston starts at rest on a pad without load."""
    steps = bristle_steps if friction.family == "bristle" else smooth_steps
    extra = extra or Extra()
    return np.fromiter(steps(drive_n.tolist(), dt_s, friction, extra), np.float64, drive_n.size)


@dataclass(frozen=True, slots=True)
class Extra:
    """What changes the friction from step to step: factor on the Coulomb level, friction per newton of contact, and
    newtons that are added while the force rises and while it falls."""

    factor: Floats | None = None
    load: Floats | None = None
    rising_n: Floats | None = None
    falling_n: Floats | None = None

    def rows(self) -> Iterable[tuple[float, float, float, float]]:
        """Of each step; endless where nothing changes."""
        usual = ((self.factor, 1.0), (self.load, 0.0), (self.rising_n, 0.0), (self.falling_n, 0.0))
        return zip(*(repeat(alone) if values is None else values.tolist() for values, alone in usual), strict=False)


def more_at_rest(friction: Friction, speed_m_per_s: float, rest_s: float) -> float:
    """Friction above the Coulomb level: Stribeck's peak at low speed and what a dwell has added, N."""
    more = friction.growth_n * log1p(rest_s)
    if friction.stribeck_n:
        more += friction.stribeck_n * exp(-((speed_m_per_s / friction.stribeck_m_per_s) ** 2))
    return more


def rested(rest_s: float, speed: float, dt_s: float, forget_m: float) -> float:
    """Rest grows with time and is forgotten with the distance slipped."""
    return rest_s + dt_s if speed < RESTS_M_PER_S else rest_s * exp(-speed * dt_s / forget_m)


def bristle_steps(drive: list[float], dt: float, own: Friction, extra: Extra) -> Iterable[float]:
    """One loop, few names: the cost of a recording is here."""
    k, s0, s1, shape = own.pad_n_per_m, own.bristle_n_per_m, own.bristle_damping_n_s_per_m, own.shape
    up_n, down_n, base_load = own.rising_n, own.falling_n, own.load
    up_c, down_c = own.viscous_n_s_per_m + own.rising_viscous_n_s_per_m, own.viscous_n_s_per_m
    remembers, slow = bool(own.growth_n), bool(own.growth_n or own.stribeck_n)
    pad = grip = v = rest = 0.0
    for d, (factor, load, more_up, more_down) in zip(drive, extra.rows(), strict=False):
        yield pad
        push = d - pad - grip
        rising = push > 0.0
        limit = (
            (up_n * factor + more_up if rising else down_n * factor + more_down) + (base_load + load) * abs(pad) + 1e-9
        )
        if slow:
            limit += more_at_rest(own, v, rest)
        free = 1.0 - (grip if rising else -grip) / limit
        free = 0.0 if free <= 0.0 else (free if shape == 1.0 else min(free**shape, 2.0))
        v = push / ((k + s0 * free) * dt + s1 * free + (up_c if rising else down_c))
        pad += k * v * dt
        grip = min(max(grip + s0 * free * v * dt, -limit), limit)
        if remembers:
            rest = rested(rest, abs(v), dt, own.forget_m)


def smooth_steps(drive: list[float], dt: float, own: Friction, extra: Extra) -> Iterable[float]:
    """push = (k dt + c) v + limit v/(v + v0), a quadratic in v; without memory but the dwell."""
    k, v0, up_n, down_n, base_load = own.pad_n_per_m, own.smooth_m_per_s, own.rising_n, own.falling_n, own.load
    up_a = k * dt + own.viscous_n_s_per_m + own.rising_viscous_n_s_per_m
    down_a = k * dt + own.viscous_n_s_per_m
    remembers, slow = bool(own.growth_n), bool(own.growth_n or own.stribeck_n)
    pad = v = rest = 0.0
    for d, (factor, load, more_up, more_down) in zip(drive, extra.rows(), strict=False):
        yield pad
        push = d - pad
        rising = push > 0.0
        limit = (up_n * factor + more_up if rising else down_n * factor + more_down) + (base_load + load) * abs(pad)
        if slow:
            limit += more_at_rest(own, v, rest)
        a, size = (up_a, push) if rising else (down_a, -push)
        b = a * v0 + limit - size
        root = sqrt(b * b + 4.0 * a * size * v0)
        v = 2.0 * size * v0 / (b + root) if b > 0.0 else (root - b) / (2.0 * a)
        if not rising:
            v = -v
        pad += k * v * dt
        if remembers:
            rest = rested(rest, abs(v), dt, own.forget_m)
