"""What presses on a slide in a replay, before anything moves: thrust, weight and the limit of its friction."""

from dataclasses import dataclass

import numpy as np

from gateway.twin.elementwise import Real
from gateway.twin.friction import ELEMENTS, side_load_n, side_share, two_sided_limit
from gateway.twin.plant import Plant
from gateway.twin.replay.drive import Floats, Strains
from gateway.twin.sections import Friction
from gateway.twin.slide import weight_n
from gateway.twin.surroundings import TwinConditions


@dataclass(frozen=True, slots=True, eq=False)
class Load:
    """What presses on one slide: drive_n and limit_n on the grid, weight and the friction's centre included.

    start: what friction remembers at the first point; None: it came to rest from no pressure.
    """

    plant: Plant
    pressure_pa: Floats
    thrust_n: Floats
    drive_n: Floats
    limit_n: Floats
    start: Strains | None = None

    @property
    def strains(self) -> tuple[float, float, float]:
        """Of the elements at the first point, the stiffest first; no more than the thrust strains: a pad does not pull."""
        assert self.start is not None
        limit_n = float(self.limit_n[0])
        most = float(self.drive_n[0]) / limit_n if limit_n > 0.0 else 1.0
        one, two, three = self.start
        two = 0.5 * (one + two)
        three = (2.0 * two + three) / 3.0
        return min(one, most), min(two, most), min(three, most)

    @property
    def start_force_n(self) -> float:
        """Force at the first point where its strains are given, N."""
        return float(self.drive_n[0]) - float(self.limit_n[0]) * sum(self.strains) / ELEMENTS

    @property
    def has_dry_friction(self) -> bool:
        """Is there dry friction at all?"""
        return bool(np.any(self.limit_n))

    @property
    def is_rigid(self) -> bool:
        friction = self.plant.friction
        return friction.presliding_m == 0.0 and friction.stribeck_n == 0.0 and friction.dwell_stiction_n == 0.0

    @property
    def is_always_pressed(self) -> bool:
        """A drive that never pulls leaves a pad without gap nowhere: friction only holds back what was pushed."""
        contact, reach_m = self.plant.contact, self.plant.cylinder.stroke_m
        bounded = float(self.drive_n.max()) <= contact.pad_stiffness_n_per_m * reach_m
        return contact.gap_m == 0.0 and bounded and float(self.drive_n.min()) >= 0.0


def side_load_on_grid_n(friction: Friction, thrust_n: Floats, conditions: TwinConditions) -> Real:
    """Return the side load on the grid, N; a float where there is none."""
    side: Real = side_load_n(friction, conditions)
    return side + side_share(friction, conditions) * thrust_n if friction.side_load_n_per_n else side


def load_of(plant: Plant, pressure_pa: Floats, conditions: TwinConditions, start: Strains | None = None) -> Load:
    """Thrust and friction limit of a plant under a pressure."""
    friction, contact = plant.friction, plant.contact
    thrust = plant.cylinder.area_m2 * pressure_pa
    limit = (
        friction.coulomb_n
        + side_load_on_grid_n(friction, thrust, conditions)
        + friction.load_dependent_n_per_n * thrust
    )
    drive = thrust + weight_n(contact.mass_kg, contact.tilt_deg) if contact.mass_kg else thrust
    if friction.asymmetry_n != 0.0:
        limit, centre = two_sided_limit(limit, friction.asymmetry_n)
        drive = drive - centre
    return Load(plant, pressure_pa, thrust, drive, limit, start)
