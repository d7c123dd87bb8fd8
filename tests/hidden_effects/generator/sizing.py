"""How much of an effect: the page's definition of its size is the RMS left after gain, offset, lag and Coulomb friction
are refitted, in units of the noise. The refit is linear here: a projection on this rig's own sensitivities."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
from generator.plant import Effect, Parts, World, clean_force, readings
from numpy.typing import NDArray

Floats = NDArray[np.float64]
LAG = "lag"  # hidden where a gauge shows it, so that the force alone cannot have it
CLOSE = 0.04  # of the wanted size
JUMPS = 0.2  # what is good enough of an effect whose size jumps with its amount (a dead band swallows a step or not)


class UnreachableError(ValueError):
    """No amount of this effect leaves so much in this recording."""


def sensitivities(world: World, hidden: frozenset[str] = frozenset()) -> Floats:
    """Orthonormal columns, shape (rows, 2 to 4): offset, gain, lag and Coulomb friction, unless hidden."""
    rig, force = world.rig, clean_force(world, ())
    columns = [np.ones_like(force), force]
    if LAG not in hidden:
        slower = replace(rig, lag_s=rig.lag_s * 1.03)
        columns.append(clean_force(replace(world, rig=slower, kept={}), ()) - force)
    if "coulomb-friction" not in hidden:
        friction = rig.friction
        rougher = replace(friction, rising_n=friction.rising_n * 1.1, falling_n=friction.falling_n * 1.1)
        columns.append(clean_force(replace(world, rig=replace(rig, friction=rougher), kept={}), ()) - force)
    return np.linalg.qr(np.stack([column / max(float(np.linalg.norm(column)), 1e-12) for column in columns], axis=1))[0]


def left(values: Floats, base: Floats) -> Floats:
    """What the base columns do not explain."""
    return np.asarray(values - base @ (base.T @ values))


def rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def left_rms(world: World, parts: Parts, base: Floats) -> float:
    """RMS in newtons that these effects leave. Where one acts on readings with noise in them, what it adds to the noise."""
    if any(effect.stage == "reading" for effect, _amount in parts):
        quiet = clean_force(world, ())
        with_it, without = (rms(left(readings(world, some) - quiet, base)) for some in (parts, ()))
        return math.sqrt(max(with_it**2 - without**2, 0.0))
    return rms(left(clean_force(world, parts) - clean_force(world, ()), base))


def amount_for(effect: Effect, wanted_n: float, world: World, base: Floats) -> float:
    """The amount that leaves the wanted RMS, within 4 % (20 % where it jumps). UnreachableError where there is none."""

    @cache
    def size(amount: float) -> float:
        return left_rms(world, [(effect, amount)], base)

    low, high = bracket(size, wanted_n, min(effect.start, effect.most), effect.most)
    for _turn in range(14):
        amount = between(size, low, high, wanted_n)
        if abs(size(amount) / wanted_n - 1.0) < CLOSE:
            return amount
        low, high = (amount, high) if size(amount) < wanted_n else (low, amount)
    best = min((low, high), key=lambda amount: abs(size(amount) - wanted_n))
    if abs(size(best) / wanted_n - 1.0) < JUMPS:
        return best
    raise UnreachableError(f"{effect.name}: {size(best):.3f} N at {best:.3g} {effect.unit}, wanted {wanted_n:.3f} N")


def bracket(size: Callable[[float], float], wanted_n: float, start: float, most: float) -> tuple[float, float]:
    """(an amount that leaves less, one that leaves more); 0 leaves nothing."""
    low, high = 0.0, start
    for _turn in range(12):
        found = size(high)
        if found >= wanted_n:
            return low, high
        if high >= most:
            break
        low, high = high, min(most, high * min(max(1.15 * wanted_n / max(found, 1e-6), 1.2), 8.0))
    raise UnreachableError(f"{size(high):.3f} N at the most, wanted {wanted_n:.3f} N")


def between(size: Callable[[float], float], low: float, high: float, wanted_n: float) -> float:
    """Straight line between the ends, kept away from them, where it would converge from one side for ever."""
    small, large = (size(low) if low > 0.0 else 0.0), size(high)
    share = (wanted_n - small) / max(large - small, 1e-12)
    return low + (high - low) * min(max(share, 0.02), 0.98)
