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

from typing import Final

import numpy as np

from gateway.twin.elementwise import Real, clip, larger, sign
from gateway.twin.plant import Friction

ELEMENTS: Final = 3
RIGID_M: Final = 1.0e-9


class Elements:
    """Strains of the elements and the constants that solve them. None at all when the friction is null."""

    def __init__(self, friction: Friction, step_s: float, zero: Real) -> None:
        self._friction = friction
        self._stribeck_travel_m = friction.stribeck_speed_m_per_s * step_s
        self._stribeck = bool(np.any(friction.stribeck_n))
        dry = self._stribeck or np.any(friction.coulomb_n) or np.any(friction.load_dependent_n_per_n)
        count = (ELEMENTS if np.any(friction.presliding_m) else 1) if dry else 0
        yields_m = [larger(friction.presliding_m * ((j + 1) / count), RIGID_M) for j in range(count)]
        self._inverse_per_m = [1.0 / yield_m for yield_m in yields_m]
        tails = [sum(self._inverse_per_m[j:], start=zero) for j in range(count + 1)]
        self._stuck_slope_per_m, self._slopes_per_m = tails[0], tails[1:]
        self._part = 1.0 / count if count else 0.0
        self._total = zero
        self.strains: list[Real] = [zero] * count

    def limit_n(self, thrust_n: Real, last_travel_m: Real) -> Real:
        """Largest friction at this thrust (never negative), N; the speed that shapes it is the last step's."""
        friction = self._friction
        limit = friction.coulomb_n + friction.load_dependent_n_per_n * thrust_n
        if self._stribeck:
            ratio = last_travel_m / self._stribeck_travel_m
            limit = limit + friction.stribeck_n / (1.0 + ratio * ratio)
        return limit

    def travel_m(self, drive_n: Real, stiffness_n_per_m: Real, limit: Real) -> Real:
        """How far `drive_n` moves the slide against a spring and this friction."""
        if not self.strains:
            return drive_n / stiffness_n_per_m
        share = limit * self._part
        held = drive_n - share * self._total
        direction = sign(held)
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

    @property
    def mean(self) -> Real:
        """Friction as a share of its limit, -1..1; positive against motion outward."""
        return self._total * self._part
