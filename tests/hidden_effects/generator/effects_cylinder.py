"""Nine causes in the cylinder: eight in its friction, one between gauge and chamber. Only `asymmetric-friction` needed a
thought: a level that differs by direction is an offset, one that differs in proportion to the load is a gain plus a
load-dependent friction, so the part that can be seen at all is the one that grows with speed: a lip that drags while the
piston extends."""

from dataclasses import replace

import numpy as np
from generator.friction import Extra, Friction
from generator.plant import Effect, World
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Both = tuple[Friction, Extra]


def coulomb(both: Both, level_n: float, _world: World) -> Both:
    """The whole of it: the rig under this effect has none of its own, and the base model is told so."""
    return replace(both[0], rising_n=level_n, falling_n=level_n), both[1]


def stribeck(both: Both, peak_n: float, world: World) -> Both:
    slow = float(world.rng("stribeck-friction").uniform(0.5e-3, 3.0e-3))
    return replace(both[0], stribeck_n=peak_n, stribeck_m_per_s=slow), both[1]


def viscous(both: Both, n_s_per_m: float, _world: World) -> Both:
    return replace(both[0], viscous_n_s_per_m=both[0].viscous_n_s_per_m + n_s_per_m), both[1]


def presliding(both: Both, distance_m: float, _world: World) -> Both:
    """The seals give way by this distance before they slide."""
    level = 0.5 * (both[0].rising_n + both[0].falling_n)
    return replace(both[0], bristle_n_per_m=level / (level / both[0].bristle_n_per_m + distance_m)), both[1]


def load_dependent(both: Both, per_n: float, _world: World) -> Both:
    return replace(both[0], load=both[0].load + per_n), both[1]


def asymmetric(both: Both, n_s_per_m: float, _world: World) -> Both:
    return replace(both[0], rising_viscous_n_s_per_m=n_s_per_m), both[1]


def dwell_stiction(both: Both, growth_n: float, world: World) -> Both:
    forget_m = float(world.rng("dwell-stiction").uniform(4.0e-5, 1.2e-4))
    return replace(both[0], growth_n=growth_n, forget_m=forget_m), both[1]


def worn_place(both: Both, most_n: float, world: World) -> Both:
    """A tube that is scored at one end or in the middle of its stroke, or bent: there the seals rub more, in both directions
    or in one of them only."""
    place, rng = world.fine("position_mm"), world.rng("position-dependent-friction")
    share = (place - place.min()) / max(float(np.ptp(place)), 1e-9)
    far = float(rng.uniform(1.0, 2.0))
    where = (share**far, (1.0 - share) ** far, 4.0 * share * (1.0 - share))[int(rng.integers(3))]
    up, down = ((1.0, 1.0), (1.0, 0.0), (0.0, 1.0))[int(rng.choice(3, p=(0.5, 0.25, 0.25)))]
    return both[0], replace(both[1], rising_n=up * most_n * where, falling_n=down * most_n * where)


def throttled(pressure: Floats, lag_s: float, world: World) -> Floats:
    """A hose between the gauge and the chamber: one lag more, which the gauge does not show."""
    return world.lagged(pressure, lag_s)


EFFECTS = (
    Effect("coulomb-friction", "friction", coulomb, 0.5, "N", most=8.0),
    Effect("stribeck-friction", "friction", stribeck, 0.5, "N", most=20.0),
    Effect("viscous-friction", "friction", viscous, 300.0, "N s/m"),
    Effect("presliding", "friction", presliding, 2.0e-5, "m", bristle=True, most=2.0e-3),
    Effect("load-dependent-friction", "friction", load_dependent, 0.02, "N/N", most=0.3),
    Effect("asymmetric-friction", "friction", asymmetric, 300.0, "N s/m"),
    Effect("dwell-stiction", "friction", dwell_stiction, 1.0, "N", most=30.0),
    Effect("position-dependent-friction", "friction", worn_place, 0.5, "N", needs=("position_mm",), most=20.0),
    Effect("pressure-lag", "chamber", throttled, 0.01, "s", needs=("pressure_kpa",)),
)
