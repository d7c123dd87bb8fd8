"""The moving slide: thrust, weight, friction, inertia, stops, and the pad on the workpiece.

One implicit step solves  m (D/dt - v)/dt + c D/dt + pad(D) + friction(D) = thrust + weight  for the travel D; pad and
friction are piecewise linear, so the solution is closed (see friction.py). The pad cannot pull: its force is the
larger of 0 and k (x - gap + D) + d D/dt, a convex function, so D is the smaller of the solutions with and without the
pad. The damping d sees the slide's speed only: a surface that passes under the pad at 15 mm/s with a slope of 1 % would
add 6 mN. Implicit Euler damps: at 1 ms the 40 Hz of 0.6 kg on 4e4 N/m get a damping ratio of 0.13 on top of the pad's own.
A null mass gives the quasi-static solution.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gateway.twin.elementwise import Real, any_below, clip, larger, smaller
from gateway.twin.friction import FREE_N_PER_M, Elements, two_sided_limit
from gateway.twin.plant import Plant
from gateway.units import STANDARD_GRAVITY_M_PER_S2

MOVING = ("viscous_n_s_per_m", "asymmetry_n_s_per_m", "stribeck_n", "dwell_stiction_n")
"""Friction that is nothing at rest."""


def weight_n(mass_kg: Real, tilt_deg: Real) -> Real:
    """Return part of the weight that presses towards the workpiece, m g cos(tilt)."""
    upright = np.cos(np.radians(tilt_deg))
    share = np.where(np.abs(upright) < 1.0e-15, 0.0, upright)  # cos(90 deg) is 6e-17 in floats
    weight = mass_kg * STANDARD_GRAVITY_M_PER_S2 * share
    return weight if weight.ndim else float(weight)


def stop_in_reach(plant: Plant, gap_m: Real) -> bool:
    """Can the slide reach a stop while the pad is pressed?

    The end stop: twice the full thrust covers inertial overshoot. The back stop: only a workpiece that stands behind it
    (gap < 0) pushes the slide so far. Where both are out of reach the step need not look for them.
    """
    contact, regulator = plant.contact, plant.regulator
    thrust = plant.cylinder.area_m2 * regulator.full_scale_pa + weight_n(contact.mass_kg, 0.0)
    spring_n = contact.pad_stiffness_n_per_m * (plant.cylinder.stroke_m - gap_m)
    return bool(np.any(spring_n < 2.0 * thrust)) or bool(np.any(np.less(gap_m, 0.0)))


class SlideState:
    """Position, speed and contact force. `step` takes the pressure of a step and returns the contact force, N."""

    def __init__(self, plant: Plant, step_s: float, zero: Real) -> None:
        contact = plant.contact
        self._step_s, self._zero, self._touching = step_s, zero, True
        self._area_m2 = plant.cylinder.area_m2
        self._stroke_m = plant.cylinder.stroke_m
        self._plant = plant
        self._gap_m = contact.gap_m
        self._weight_n = self._steady_n = weight_n(contact.mass_kg, contact.tilt_deg)
        self._inertia_n_per_m = contact.mass_kg / step_s**2
        self._elements = Elements(plant.friction, step_s, zero)
        drag_n_per_m = self._inertia_n_per_m + self._elements.drag_n_per_m
        self._free_n_per_m = larger(drag_n_per_m, FREE_N_PER_M)
        self._pad_n_per_m = contact.pad_stiffness_n_per_m
        self._pad_step_n_per_m = contact.pad_stiffness_n_per_m + contact.pad_damping_n_s_per_m / step_s
        self._pressed_n_per_m = drag_n_per_m + self._pad_step_n_per_m
        self._stop_in_reach = stop_in_reach(plant, contact.gap_m)
        self._limit_n = self._centre_n = zero
        self._travel_m: Real = zero
        self.position_m: Real = zero
        self.force_n: Real = zero

    @property
    def speed_m_per_s(self) -> Real:
        return self._travel_m / self._step_s

    @property
    def friction_n(self) -> Real:
        """Friction on the slide, positive against motion outward."""
        return self._centre_n + self._limit_n * self._elements.mean

    def set_contact(self, on: bool) -> None:
        """Take the workpiece away, or bring it back to where the gap says: the slide is pushed back to touch it."""
        if on and not self._touching:
            self.position_m = smaller(self.position_m, self._gap_m + self._zero)
            self._travel_m = self._zero
        self._touching = on

    def set_surface(self, height_m: Real) -> None:
        """Set by how much the workpiece's surface stands nearer to the tool than the gap says; 0 is null."""
        self._gap_m = self._plant.contact.gap_m - height_m
        self._stop_in_reach = stop_in_reach(self._plant, self._gap_m)

    def set_side_load(self, load_n: Real, share: Real = 0.0) -> None:
        """Set by how much what presses the slide sideways raises its friction, N, and this share of the thrust; 0 is null."""
        self._elements.load_sideways(load_n, share)

    def settle(self, pressure_pa: Real) -> None:
        """Come to rest under this pressure at once: one step without inertia and drag, which are nothing at rest."""
        friction = replace(self._plant.friction, **dict.fromkeys(MOVING, 0.0))
        contact = replace(self._plant.contact, mass_kg=0.0, pad_damping_n_s_per_m=0.0)
        still = SlideState(replace(self._plant, friction=friction, contact=contact), self._step_s, self._zero)
        still._steady_n, still._gap_m, still._touching = self._steady_n, self._gap_m, self._touching
        still._elements.bear(self._elements)
        self.force_n, self.position_m = still.step(pressure_pa), still.position_m
        self._elements.become(still._elements)

    def state(self) -> list[Real]:
        """Return what the slide remembers: position, m, travel of the last step, m, stiction, N, and strains."""
        return [self.position_m, self._travel_m, *self._elements.state()]

    def resume(self, state: Sequence[Real]) -> None:
        """Go on from what `state` gave."""
        self.position_m, self._travel_m, *rest = state
        self._elements.resume(rest)

    def set_disturbance(self, force_n: Real) -> None:
        """Set an outside force on the slide, positive towards the workpiece; 0 is null."""
        self._steady_n = self._weight_n + force_n

    def step(self, pressure_pa: Real) -> Real:
        """Advance one step under this pressure."""
        elements = self._elements
        thrust = self._area_m2 * pressure_pa
        self._limit_n = limit = elements.limit_n(thrust, self._travel_m)
        drive = thrust + self._steady_n + self._inertia_n_per_m * self._travel_m
        if elements.asymmetric:
            self._limit_n, self._centre_n = limit, centre = two_sided_limit(limit, self._plant.friction.asymmetry_n)
            drive = drive - centre
        travel = self._solve(drive, limit)
        elements.move(travel)
        if elements.ages:
            elements.age(travel, limit)
        self.position_m = self.position_m + travel
        self._travel_m = travel
        return self.force_n

    def _solve(self, drive_n: Real, limit: Real) -> Real:
        """Travel of one step; leaves the contact force."""
        if not self._touching:
            self.force_n = self._zero
            return self._between_stops(self._elements.travel_m(drive_n, self._free_n_per_m, limit))
        pad = self._pad_n_per_m * (self.position_m - self._gap_m)
        travel = self._elements.travel_m(drive_n - pad, self._pressed_n_per_m, limit)
        self.force_n = force = pad + self._pad_step_n_per_m * travel
        if self._stop_in_reach or any_below(force, 0.0):
            travel = smaller(travel, self._elements.travel_m(drive_n, self._free_n_per_m, limit))
            travel = self._between_stops(travel)
            self.force_n = larger(pad + self._pad_step_n_per_m * travel, 0.0)
        return travel

    def _between_stops(self, travel_m: Real) -> Real:
        position = self.position_m
        return clip(travel_m, -position, self._stroke_m - position)
