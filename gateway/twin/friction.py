"""Friction with presliding, solved in closed form.

Maxwell slip: ELEMENTS springs in parallel, element j slides after d_j = presliding_m x j/ELEMENTS of travel and then
carries an equal share of the limit. Its state z_j in [-1, 1] is a strain, z_j += travel / d_j, clipped; the force is
limit x mean(z). So the limit may depend on load and speed while the memory of reversals (return points) stays in the
strains. Without presliding d_j is RIGID_M, one nanometre: rigid Coulomb friction to 4e-5 N on the pad. Rejected:
Dahl and LuGre, whose minor loops drift.

The step is implicit: the travel D of a step satisfies  stiffness D + limit mean(clip(z + D/d)) = drive.  Away from
rest the friction is concave in |D| with one kink per element, in the order of d_j whatever the history (the distance
to sliding is d_j - z_j d_j, and a play operator moves by less than its width does). A concave piecewise linear
function is the smallest of its pieces, so D is the largest of their ELEMENTS + 1 solutions: no iteration, no
tolerance, stable for any step.
"""

import math
from typing import Final

from gateway.compiled import step
from gateway.twin.effects.term import is_switched_on
from gateway.twin.elementwise import Real, exponential, positive_part, sine
from gateway.twin.sections import Friction
from gateway.twin.surroundings import TwinConditions

_RADIAN_PER_DEGREE: Final = math.pi / 180.0
_DRAGGED_MM_PER_S: Final = 1.0
ELEMENTS: Final = 3
RIGID_M: Final = 1.0e-9
FREE_N_PER_M: Final = 1.0e-3  # stands for no stiffness at all, where a slide without mass and drag moves freely
BREAKAWAY_M: Final = 2.0e-5  # motion after which a rest is forgotten, where presliding is shorter
PLACE_FIELDS: Final = ("place_n_per_mm", "place_n_per_mm2", "place_asymmetry_n_per_mm", "place_asymmetry_n_per_mm2")


def side_load_n(friction: Friction, conditions: TwinConditions) -> Real:
    """Return what a side-load adds to the friction's limit by feed, tilt and place, N; an unknown column adds nothing."""
    load: Real = 0.0
    if conditions.feed_mm_s is not None:
        load = load + friction.side_load_n_s_per_mm * abs(conditions.feed_mm_s)
    if conditions.tilt_deg is not None:
        load = load + friction.side_load_tilt_n * abs(sine(conditions.tilt_deg * _RADIAN_PER_DEGREE))
    if conditions.aside_mm is not None:
        load = load + friction.side_load_n_per_mm * abs(conditions.aside_mm)
    return load


def has_place(friction: Friction) -> bool:
    """Return whether friction depends on the place in the stroke."""
    return is_switched_on(friction, PLACE_FIELDS)


def place_limit_n(friction: Friction, conditions: TwinConditions) -> Real:
    """Return what the place in the stroke adds to the limit in both directions, N (position-dependent-friction)."""
    if conditions.aside_mm is None:
        return 0.0
    return (friction.place_n_per_mm + friction.place_n_per_mm2 * conditions.aside_mm) * conditions.aside_mm


def place_asymmetry_n(friction: Friction, conditions: TwinConditions) -> Real:
    """Return what the place adds to the limit moving out and takes moving in, N (position-dependent-friction by direction)."""
    if conditions.aside_mm is None:
        return 0.0
    slope, curvature = friction.place_asymmetry_n_per_mm, friction.place_asymmetry_n_per_mm2
    return (slope + curvature * conditions.aside_mm) * conditions.aside_mm


def side_share(friction: Friction, conditions: TwinConditions) -> Real:
    """Return the friction that the surface's grip adds per thrust as soon as the tool is dragged, N/N (side-load)."""
    if conditions.feed_mm_s is None:
        return 0.0
    return friction.side_load_n_per_n * (1.0 - exponential(-abs(conditions.feed_mm_s) / _DRAGGED_MM_PER_S))


def yield_travels_m(presliding_m: float) -> tuple[float, float, float]:
    """Return the travel from rest after which each element slides, the stiffest first, m."""
    one, two, three = (max(presliding_m * (j / ELEMENTS), RIGID_M) for j in range(1, ELEMENTS + 1))
    return one, two, three


def directional_drags(friction: Friction) -> tuple[float, float]:
    """Return the viscous drag (moving out, moving in), N s/m, neither below 0 (asymmetric-friction by speed)."""
    viscous, more_out = friction.viscous_n_s_per_m, friction.asymmetry_n_s_per_m
    return max(viscous + more_out, 0.0), max(viscous - more_out, 0.0)


@step
def two_sided_limit(limit: Real, asymmetry_n: Real) -> tuple[Real, Real]:
    """Return (limit, centre) of a friction that is larger moving out than moving in, N, neither below 0 (asymmetric-friction).

    Friction is then centre + limit x strain. Rejected: a limit that jumps with the direction, which chatters at rest.
    """
    out, back = positive_part(limit + asymmetry_n), positive_part(limit - asymmetry_n)
    return 0.5 * (out + back), 0.5 * (out - back)


@step
def stribeck_limit_n(stribeck_n: Real, speed_ratio: Real) -> Real:
    """Return what standing adds to sliding, at a speed given as a multiple of its scale (stribeck-friction)."""
    return stribeck_n / (1.0 + speed_ratio * speed_ratio)


@step
def age_stiction(stiction_n: float, full_n: float, rest: float, travel: float) -> tuple[float, float]:
    """Return (what rest adds to a stiction, the stiction after rest and motion), N: dwell-stiction.

    A rest brings it towards `full_n`, motion takes it away.

    rest: length of the step as a multiple of its time constant. travel: of the step, as a multiple of the breakaway.
    """
    grown_n = (full_n - stiction_n) * (1.0 - math.exp(-rest))
    return grown_n, (stiction_n + grown_n) * math.exp(-abs(travel))


@step
def relax_strain(strain: float, towards: float, travel: float) -> float:
    """Return the strain of an element that a motion leads towards that of sliding.

    travel: of the step, as a multiple of the element's yield travel.
    """
    return towards + (strain - towards) * math.exp(-travel)


@step
def strain_elements(
    strains: tuple[float, float, float], travel_m: float, inverse_per_m: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Return the strains after a travel. Written out: the running twin does this a thousand times a second."""
    z1, z2, z3 = strains
    i1, i2, i3 = inverse_per_m
    z1 += travel_m * i1
    z2 += travel_m * i2
    z3 += travel_m * i3
    return (
        -1.0 if z1 < -1.0 else 1.0 if z1 > 1.0 else z1,
        -1.0 if z2 < -1.0 else 1.0 if z2 > 1.0 else z2,
        -1.0 if z3 < -1.0 else 1.0 if z3 > 1.0 else z3,
    )


@step
def travel_against_friction(
    drive_n: float,
    stiffness: tuple[float, float],
    share_n: float,
    strains: tuple[float, float, float],
    inverse_per_m: tuple[float, float, float],
) -> float:
    """Return how far `drive_n` moves the slide in one step, m.

    stiffness: what works against the travel besides friction, N/m: the mean of both directions, and what moving out has
    more. share_n: limit of one element. strains and 1/d of the elements, the stiffest first.
    """
    z1, z2, z3 = strains
    _, i2, i3 = inverse_per_m
    held = drive_n - share_n * (z1 + z2 + z3)
    way = 1.0 if held >= 0.0 else -1.0
    free = stiffness[0] + way * stiffness[1]
    free = FREE_N_PER_M if free < FREE_N_PER_M else free
    left = way * held
    travel = left / (free + share_n * (inverse_per_m[0] + i2 + i3))
    left += share_n * (way * z1 - 1.0)  # the stiffest slides from here on
    further = left / (free + share_n * (i2 + i3))
    if further > travel:
        travel = further
        left += share_n * (way * z2 - 1.0)
        further = left / (free + share_n * i3)
        if further > travel:
            travel = further
            further = (left + share_n * (way * z3 - 1.0)) / free
            if further > travel:
                travel = further
    return way * travel
