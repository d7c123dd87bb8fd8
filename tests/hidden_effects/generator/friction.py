"""A piston with friction against a pad: the contact force that a drive force causes.

Deliberately not the twin's model (Maxwell slip, mass, 1 ms): no mass, so the balance drive = pad + friction holds in each
fine step and is solved for the velocity, implicitly in the pad and the bristle, explicitly in the friction's limit.
Two families. Bristle: one deflection z with dz/dx = (1 - z/z_limit)^shape, Dahl (1968) without and LuGre (Canudas de Wit
1995) with bristle damping. Smooth: Coulomb regularised over a tiny velocity, limit * v / (|v| + v0), no memory at all.
Both run as machine code, for the cost of a recording is here: some twenty runs of a quarter million steps.
"""

from collections import namedtuple
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cache
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


Numbers = namedtuple("Numbers", [field.name for field in fields(Friction) if field.name != "family"])
"""A Friction as machine code knows it."""


@dataclass(frozen=True, slots=True)
class Extra:
    """What changes the friction from step to step: factor on the Coulomb level, friction per newton of contact, and
    newtons that are added while the force rises and while it falls."""

    factor: Floats | None = None
    load: Floats | None = None
    rising_n: Floats | None = None
    falling_n: Floats | None = None

    def rows(self, size: int) -> Floats:
        """Shape (4, size): of each of so many steps."""
        usual = ((self.factor, 1.0), (self.load, 0.0), (self.rising_n, 0.0), (self.falling_n, 0.0))
        return np.stack([np.full(size, alone) if values is None else values for values, alone in usual])


def contact_force(drive_n: Floats, dt_s: float, friction: Friction, extra: Extra | None = None) -> Floats:
    """Force on the pad at each fine step, N; the piston starts at rest on a pad without load."""
    march = compiled(march_bristle if friction.family == "bristle" else march_smooth)
    numbers = Numbers(*(float(getattr(friction, name)) for name in Numbers._fields))
    pad_n = np.empty(drive_n.size)
    march(pad_n, np.ascontiguousarray(drive_n), dt_s, numbers, (extra or Extra()).rows(drive_n.size))
    return pad_n


@cache
def compiled(march: Callable[..., None]) -> Callable[..., None]:
    """The loop as machine code, kept beside the bytecode. numba is imported by the first recording, not by whoever collects."""
    from numba import njit
    from numba.extending import register_jitable

    for helper in (more_at_rest, rested):
        register_jitable(helper)
    code: Callable[..., None] = njit(cache=True)(march)
    return code


def more_at_rest(own: Numbers, speed_m_per_s: float, rest_s: float) -> float:
    """Friction above the Coulomb level: Stribeck's peak at low speed and what a dwell has added, N."""
    more = own.growth_n * log1p(rest_s)
    if own.stribeck_n != 0.0:
        more += own.stribeck_n * exp(-((speed_m_per_s / own.stribeck_m_per_s) ** 2))
    return more


def rested(rest_s: float, speed: float, dt_s: float, forget_m: float) -> float:
    """Rest grows with time and is forgotten with the distance slipped."""
    return rest_s + dt_s if speed < RESTS_M_PER_S else rest_s * exp(-speed * dt_s / forget_m)


def march_bristle(pad_n: Floats, drive_n: Floats, dt: float, own: Numbers, extra: Floats) -> None:
    """Fill pad_n, the force before each step; extra: the rows of Extra."""
    factor, load, up_n, down_n = extra
    k, s0, s1, shape = own.pad_n_per_m, own.bristle_n_per_m, own.bristle_damping_n_s_per_m, own.shape
    up_c, down_c = own.viscous_n_s_per_m + own.rising_viscous_n_s_per_m, own.viscous_n_s_per_m
    remembers, is_slow = own.growth_n != 0.0, own.growth_n != 0.0 or own.stribeck_n != 0.0
    pad = grip = v = rest = 0.0
    for i in range(drive_n.size):
        pad_n[i] = pad
        push = drive_n[i] - pad - grip
        rising = push > 0.0
        level = own.rising_n * factor[i] + up_n[i] if rising else own.falling_n * factor[i] + down_n[i]
        limit = level + (own.load + load[i]) * abs(pad) + 1e-9
        if is_slow:
            limit += more_at_rest(own, v, rest)
        free = 1.0 - (grip if rising else -grip) / limit
        free = 0.0 if free <= 0.0 else (free if shape == 1.0 else min(free**shape, 2.0))
        v = push / ((k + s0 * free) * dt + s1 * free + (up_c if rising else down_c))
        pad += k * v * dt
        grip = min(max(grip + s0 * free * v * dt, -limit), limit)
        if remembers:
            rest = rested(rest, abs(v), dt, own.forget_m)


def march_smooth(pad_n: Floats, drive_n: Floats, dt: float, own: Numbers, extra: Floats) -> None:
    """As march_bristle; push = (k dt + c) v + limit v/(v + v0), a quadratic in v, without memory but the dwell."""
    factor, load, up_n, down_n = extra
    k, v0 = own.pad_n_per_m, own.smooth_m_per_s
    up_a = k * dt + own.viscous_n_s_per_m + own.rising_viscous_n_s_per_m
    down_a = k * dt + own.viscous_n_s_per_m
    remembers, is_slow = own.growth_n != 0.0, own.growth_n != 0.0 or own.stribeck_n != 0.0
    pad = v = rest = 0.0
    for i in range(drive_n.size):
        pad_n[i] = pad
        push = drive_n[i] - pad
        rising = push > 0.0
        level = own.rising_n * factor[i] + up_n[i] if rising else own.falling_n * factor[i] + down_n[i]
        limit = level + (own.load + load[i]) * abs(pad)
        if is_slow:
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
