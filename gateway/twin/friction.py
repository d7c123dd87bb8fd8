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
from collections.abc import Sequence
from typing import Final

import numpy as np

from gateway.twin.effects.term import is_switched_on
from gateway.twin.elementwise import Real, clip, exponential, larger, sign, sine
from gateway.twin.sections import Friction
from gateway.twin.surroundings import TwinConditions

_RADIAN_PER_DEGREE: Final = math.pi / 180.0
_DRAGGED_MM_PER_S: Final = 1.0
ELEMENTS: Final = 3
RIGID_M: Final = 1.0e-9
FREE_N_PER_M: Final = 1.0e-3  # stands for no stiffness at all, where a slide without mass and drag moves freely
BREAKAWAY_M: Final = 2.0e-5  # motion after which a rest is forgotten, where presliding is shorter
DRY: Final = (
    "coulomb_n",
    "load_dependent_n_per_n",
    "asymmetry_n",
    "stribeck_n",
    "dwell_stiction_n",
    "side_load_n_s_per_mm",
    "side_load_n_per_n",
    "side_load_tilt_n",
    "side_load_n_per_mm",
)
"""Fields without which there is no dry friction at all."""


def side_load_n(friction: Friction, conditions: TwinConditions) -> Real:
    """side-load: what the surroundings add to the limit, N; a column that is not known adds nothing."""
    load: Real = 0.0
    if conditions.feed_mm_s is not None:
        load = load + friction.side_load_n_s_per_mm * abs(conditions.feed_mm_s)
    if conditions.tilt_deg is not None:
        load = load + friction.side_load_tilt_n * abs(sine(conditions.tilt_deg * _RADIAN_PER_DEGREE))
    if conditions.aside_mm is not None:
        load = load + friction.side_load_n_per_mm * abs(conditions.aside_mm)
    return load


def side_share(friction: Friction, conditions: TwinConditions) -> Real:
    """side-load: the surface's grip grows with the thrust as soon as the tool is dragged, N/N."""
    if conditions.feed_mm_s is None:
        return 0.0
    return friction.side_load_n_per_n * (1.0 - exponential(-abs(conditions.feed_mm_s) / _DRAGGED_MM_PER_S))


def two_sided_limit(limit: Real, asymmetry_n: Real) -> tuple[Real, Real]:
    """asymmetric-friction: (limit, centre) of a friction that is larger moving out than moving in, neither below 0.

    Friction is then centre + limit x strain. Rejected: a limit that jumps with the direction, which chatters at rest.
    """
    out, back = larger(limit + asymmetry_n, 0.0), larger(limit - asymmetry_n, 0.0)
    return 0.5 * (out + back), 0.5 * (out - back)


def directional_drags(friction: Friction) -> tuple[Real, Real]:
    """asymmetric-friction by speed: viscous drag (moving out, moving in), N s/m, neither below 0."""
    viscous, more_out = friction.viscous_n_s_per_m, friction.asymmetry_n_s_per_m
    return larger(viscous + more_out, 0.0), larger(viscous - more_out, 0.0)


def travel_share(drag_n_s_per_m: Real, stiffness_n_per_m: Real, step_s: Real) -> Real:
    """Return how much of its way a slide behind a spring goes in one step against viscous drag (implicit Euler)."""
    return stiffness_n_per_m / (stiffness_n_per_m + drag_n_s_per_m / step_s)


def rest_stiction(stiction_n: Real, full_n: Real, share: Real) -> Real:
    """dwell-stiction grows towards `full_n` by this share of what is missing."""
    return stiction_n + share * (full_n - stiction_n)


def relieve_stiction(stiction_n: Real, travel_m: Real, breakaway_m: Real) -> Real:
    """Return what motion leaves of the stiction."""
    return stiction_n * exponential(-abs(travel_m) / breakaway_m)


class Elements:
    """Strains of the elements and the constants that solve them. None at all when the friction is null."""

    def __init__(self, friction: Friction, step_s: float, zero: Real) -> None:
        self._friction = friction
        self._stribeck_travel_m = friction.stribeck_speed_m_per_s * step_s
        self._stribeck = bool(np.any(friction.stribeck_n))
        dry = is_switched_on(friction, DRY)
        self._coulomb_n, self._per_n = friction.coulomb_n, friction.load_dependent_n_per_n
        self.asymmetric, self.ages = bool(np.any(friction.asymmetry_n)), bool(np.any(friction.dwell_stiction_n))
        self._rest_share = 1.0 - exponential(-step_s / friction.dwell_stiction_s)
        self._breakaway_m = larger(friction.presliding_m, BREAKAWAY_M)
        self._stiction_n = zero
        count = (ELEMENTS if np.any(friction.presliding_m) else 1) if dry else 0
        yields_m = [larger(friction.presliding_m * ((j + 1) / count), RIGID_M) for j in range(count)]
        self._inverse_per_m = [1.0 / yield_m for yield_m in yields_m]
        self._lopsided = bool(np.any(friction.asymmetry_n_s_per_m))
        self.set_drag(step_s)
        tails = [sum(self._inverse_per_m[j:], start=zero) for j in range(count + 1)]
        self._stuck_slope_per_m, self._slopes_per_m = tails[0], tails[1:]
        self._part = 1.0 / count if count else 0.0
        self._total = zero
        self.strains: list[Real] = [zero] * count

    def limit_n(self, thrust_n: Real, last_travel_m: Real) -> Real:
        """Largest friction at this thrust (never negative), N; the speed that shapes it is the last step's."""
        limit = self._coulomb_n + self._per_n * thrust_n
        if self._stribeck:
            ratio = last_travel_m / self._stribeck_travel_m
            limit = limit + self._friction.stribeck_n / (1.0 + ratio * ratio)
        if self.ages:
            limit = limit + self._stiction_n
        return limit

    def load_sideways(self, load_n: Real, share: Real) -> None:
        """Raise the limit by a side load and by a share of the thrust, until the next one."""
        self._coulomb_n = self._friction.coulomb_n + load_n
        self._per_n = self._friction.load_dependent_n_per_n + share

    def age(self, travel_m: Real, limit: Real) -> None:
        """Rest raises the limit, motion lowers it again. What a rising limit holds it does not push: the strains give."""
        kept = self._stiction_n
        grown = rest_stiction(kept, self._friction.dwell_stiction_n, self._rest_share)
        ratio = larger(limit, 1.0e-12) / larger(limit + (grown - kept), 1.0e-12)
        self._stiction_n = relieve_stiction(grown, travel_m, self._breakaway_m)
        self.strains = [strain * ratio for strain in self.strains]
        self._total = self._total * ratio

    def set_drag(self, step_s: Real) -> None:
        """Set the mean of the drags in both directions, and half of what they differ, as stiffness of a step, N/m."""
        out, back = directional_drags(self._friction)
        self.drag_n_per_m, self._more_out_n_per_m = 0.5 * (out + back) / step_s, 0.5 * (out - back) / step_s

    def travel_m(self, drive_n: Real, stiffness_n_per_m: Real, limit: Real) -> Real:
        """Return how far `drive_n` moves the slide against a spring, the mean drag and this friction."""
        share = limit * self._part
        held = drive_n - share * self._total
        direction = sign(held)
        if self._lopsided:
            stiffness_n_per_m = larger(stiffness_n_per_m + direction * self._more_out_n_per_m, FREE_N_PER_M)
        if not self.strains:
            return drive_n / stiffness_n_per_m
        left, along = direction * held, direction * share
        furthest = left / (stiffness_n_per_m + share * self._stuck_slope_per_m)
        for strain, slope in zip(self.strains, self._slopes_per_m, strict=True):
            left = left + along * strain - share  # this element slides from here on
            furthest = larger(furthest, left / (stiffness_n_per_m + share * slope))
        return direction * furthest

    def move(self, travel_m: Real) -> None:
        """Strain the elements by a travel."""
        strains = [
            clip(strain + travel_m * inverse, -1.0, 1.0)
            for strain, inverse in zip(self.strains, self._inverse_per_m, strict=True)
        ]
        if strains:
            self.strains, self._total = strains, sum(strains[1:], start=strains[0])

    def become(self, other: "Elements") -> None:
        """Take over the strains of another slide at rest; nothing when its elements are others."""
        if self.strains and len(other.strains) == len(self.strains):
            self.strains, self._total = other.strains, other._total

    def state(self) -> list[Real]:
        """Return what the elements remember: the stiction after a rest, and the strains."""
        return [self._stiction_n, *self.strains]

    def resume(self, state: Sequence[Real]) -> None:
        """Go on from what `state` gave."""
        self._stiction_n, *self.strains = state
        self._total = sum(self.strains[1:], start=self.strains[0]) if self.strains else self._total

    def bear(self, other: "Elements") -> None:
        """Take over the side load of another slide."""
        self._coulomb_n, self._per_n = other._coulomb_n, other._per_n

    @property
    def mean(self) -> Real:
        """Friction as a share of its limit, -1..1; positive against motion outward."""
        return self._total * self._part
