"""Replay, stage 2: the slide's force on the grid for each different combination of pressure, cylinder, friction and pad."""

from collections.abc import Hashable, Sequence

import numpy as np
from numpy.typing import NDArray

from gateway.twin.elementwise import Real
from gateway.twin.friction import (
    ELEMENTS,
    has_place,
    place_asymmetry_n,
    place_limit_n,
    side_load_n,
    side_share,
    two_sided_limit,
)
from gateway.twin.plant import Plant
from gateway.twin.replay.cache import Cache
from gateway.twin.replay.drive import Drive, Floats, StartState
from gateway.twin.replay.grid import Grid
from gateway.twin.replay.loops import march_lag, march_slide
from gateway.twin.replay.measured_motion import Motions
from gateway.twin.slide import Slide, SlideState, slide_of, without_mass, without_motion


class Slides:
    """The slide's force on the grid by plant, N."""

    def __init__(self, drive: Drive, grid: Grid) -> None:
        self._grid = grid
        self._motions = None if drive.motion == "inferred" else Motions(drive, grid)
        self._driven = drive.command_v is not None
        self._forces = Cache()

    def of(
        self,
        plants: Sequence[Plant],
        pressures: Sequence[Floats],
        which: NDArray[np.intp],
        starts: Sequence[StartState],
    ) -> list[Floats]:
        """Return one force per plant; equal ones are the same array."""
        each = zip(plants, starts, strict=True)
        keys = [(self._key(plant), start._replace(creep_n=0.0)) for plant, start in each]
        first = {key: place for place, key in reversed(list(enumerate(keys)))}

        def move(key: tuple[Hashable, StartState]) -> Floats:
            place = first[key]
            return self._quasi_static_force_n(plants[place], pressures[which[place]], starts[place])

        different = list(dict.fromkeys(keys))
        forces = dict(zip(different, self._forces.get_all(different, move), strict=True))
        return [forces[key] for key in keys]

    def _key(self, plant: Plant) -> Hashable:
        contact = plant.contact
        pad = (contact.pad_stiffness_n_per_m, contact.gap_m, contact.mass_kg, contact.tilt_deg)
        return (plant.regulator if self._driven else None, plant.cylinder, plant.friction, pad)

    def _quasi_static_force_n(self, plant: Plant, pressure_pa: Floats, start: StartState) -> Floats:
        """The force of the quasi-static slide, by its own motion or by the measured one."""
        slide = without_mass(slide_of(plant))
        thrust_n = slide.area_m2 * self._in_chamber(plant, pressure_pa)
        side_n, more_out_n = self._side_loads_n(plant, thrust_n)
        loads_n = (thrust_n, self._as_series(side_n), self._as_series(more_out_n))
        if self._motions is not None:
            return self._motions.force_n(slide, plant.friction, loads_n)
        state = start_state(slide, start, [float(load[0]) for load in loads_n])
        force_n = np.empty_like(thrust_n)
        march_slide((slide, without_motion(slide)), state, loads_n, self._grid.steps_s, force_n)
        return force_n

    def _in_chamber(self, plant: Plant, pressure_pa: Floats) -> Floats:
        """pressure-lag: the chamber's pressure behind the gauge's."""
        if plant.cylinder.chamber_lag_s == 0.0:
            return pressure_pa
        late_pa = np.empty_like(pressure_pa)
        march_lag(plant.cylinder.chamber_lag_s, pressure_pa[0], pressure_pa, self._grid.steps_s, late_pa)
        return late_pa

    def _as_series(self, load_n: Real) -> Floats:
        return np.ascontiguousarray(np.broadcast_to(load_n, (self._grid.points,)))

    def _side_loads_n(self, plant: Plant, thrust_n: Floats) -> tuple[Real, Real]:
        """What surroundings add to the friction's limit, and what of it moving out has more, on the grid."""
        friction, conditions = plant.friction, self._grid.conditions
        side: Real = side_load_n(friction, conditions)
        if friction.side_load_n_per_n:
            side = side + side_share(friction, conditions) * thrust_n
        if not has_place(friction):
            return side, 0.0
        return side + place_limit_n(friction, conditions), place_asymmetry_n(friction, conditions)


def start_state(slide: Slide, start: StartState, loads_n: Sequence[float]) -> SlideState:
    """Return the state of a slide with these strains; without a force where there is none to begin with.

    loads_n: thrust, what surroundings add to the friction's limit, and what of it moving out has more. No element is
    strained by more than the thrust: a pad does not pull. Rigid friction has their mean.
    """
    thrust_n, side_n, more_out_n = loads_n
    stiction_n = start.stiction_share * slide.stiction_n
    limit_n, centre_n = two_sided_limit(
        slide.coulomb_n + side_n + slide.load_dependent_n_per_n * thrust_n + stiction_n, slide.asymmetry_n + more_out_n
    )
    drive_n = thrust_n + slide.weight_n - centre_n
    if start.strains is None or limit_n <= 0.0:
        return SlideState()
    most = drive_n / limit_n
    one, two, three = start.strains
    two = 0.5 * (one + two)
    three = (2.0 * two + three) / 3.0
    strains = (min(one, most), min(two, most), min(three, most))
    mean = sum(strains) / ELEMENTS
    force_n = drive_n - limit_n * mean
    if force_n <= 0.0:
        return SlideState()
    is_rigid = slide.inverse_per_m[0] == slide.inverse_per_m[-1]
    position_m = slide.gap_m + force_n / slide.pad_n_per_m
    return SlideState(
        position_m, stiction_n=stiction_n, strains=(mean, mean, mean) if is_rigid else strains, force_n=force_n
    )
