"""Replay, stage 2: the slide's force on the grid for each different combination of pressure, cylinder, friction and pad.

Four ways to the same closed form of friction.py, the cheapest that a plant allows:
    - rigid friction (no presliding) is a play of the force between thrust - limit and thrust + limit (replay_play.py);
    - presliding where the pad is never left and no stop is met: all lanes at once (replay_elastic.py);
    - rigid friction with Stribeck's curve or stiction, on the pad: a play of varying width (replay_sticking.py);
    - anything else (a gap, a stop, presliding with these): the twin's own slide, step by step (replay_stepped.py).
Measured motion leaves the pad out (replay_measured.py).
"""

from collections.abc import Callable, Hashable, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from gateway.twin.effects.term import is_switched_on
from gateway.twin.friction import DRY
from gateway.twin.plant import Plant
from gateway.twin.replay.cache import Cache
from gateway.twin.replay.drive import Drive, Floats, Strains
from gateway.twin.replay.grid import Grid
from gateway.twin.replay.load import Load, load_of
from gateway.twin.replay.measured_motion import Motions
from gateway.twin.replay.presliding import presliding_forces
from gateway.twin.replay.rigid_friction import rigid_forces
from gateway.twin.replay.stepped_slide import stepped_forces
from gateway.twin.replay.sticking_friction import sticking_forces

Way: TypeAlias = Callable[[list[Load], Grid], list[Floats]]


class Slides:
    """The slide's force on the grid by plant, N."""

    def __init__(self, drive: Drive, grid: Grid) -> None:
        self._grid = grid
        self._motions = None if drive.motion == "inferred" else Motions(drive, grid)
        self._driven = drive.command_v is not None
        self._forces = Cache()
        self._first = int(np.searchsorted(grid.time_s, drive.settled_s)) if drive.settled_s > 0.0 else 0

    def of(
        self,
        plants: Sequence[Plant],
        pressures: Sequence[Floats],
        which: NDArray[np.intp],
        starts: Sequence[Strains | None],
    ) -> list[Floats]:
        """Return one force per plant; equal ones are the same array."""
        keys: list[Hashable] = [(self._key(plant), start) for plant, start in zip(plants, starts, strict=True)]
        known = {key: found for key in keys if (found := self._forces.get(key)) is not None}
        missing: dict[Hashable, Load] = {}
        for key, plant, place, start in zip(keys, plants, which, starts, strict=True):
            if key not in known and key not in missing:
                missing[key] = load_of(plant, self._settled(pressures[place]), self._grid.conditions, start)
        fresh = dict(zip(missing, self._computed(list(missing.values())), strict=True))
        for key, force in fresh.items():  # a long recording's series push each other out, and those known before
            self._forces.put(key, force)
        return [fresh[key] if key in fresh else known[key] for key in keys]

    def _settled(self, pressure_pa: Floats) -> Floats:
        """The pressure, until it is sure that of the moment from which it is."""
        if not self._first:
            return pressure_pa
        return np.concatenate([np.full(self._first, pressure_pa[self._first]), pressure_pa[self._first :]])

    def _key(self, plant: Plant) -> Hashable:
        contact = plant.contact
        pad = (contact.pad_stiffness_n_per_m, contact.gap_m, contact.mass_kg, contact.tilt_deg)
        return (plant.regulator if self._driven else None, plant.cylinder, plant.friction, pad)

    def _computed(self, loads: list[Load]) -> list[Floats]:
        if self._motions is not None:
            return [self._motions.force_n(load) for load in loads]
        found: dict[int, Floats] = {}
        batches: dict[tuple[Way, tuple[bool, ...]], list[Load]] = {}
        for load in loads:
            way = self._way(load)
            batches.setdefault((way, _memories(load) if way is stepped_forces else ()), []).append(load)
        for (way, _), batch in batches.items():
            found |= zip(map(id, batch), way(batch, self._grid), strict=True)
        return [found[id(load)] for load in loads]

    @staticmethod
    def _way(load: Load) -> Way:
        contact, friction = load.plant.contact, load.plant.friction
        drags = friction.viscous_n_s_per_m != 0.0 or friction.asymmetry_n_s_per_m != 0.0
        if load.is_rigid and (contact.gap_m == 0.0 or not drags):
            return rigid_forces
        if not load.is_always_pressed:
            return stepped_forces
        if friction.presliding_m == 0.0:
            return sticking_forces
        moved = friction.stribeck_n or friction.dwell_stiction_n or friction.asymmetry_n_s_per_m
        return stepped_forces if moved else presliding_forces


def _memories(load: Load) -> tuple[bool, ...]:
    """What a slide remembers: lanes that step together, and any part of them, must have as many elements."""
    friction = load.plant.friction
    others = (friction.presliding_m, friction.dwell_stiction_n, friction.asymmetry_n, friction.asymmetry_n_s_per_m)
    return (is_switched_on(friction, DRY), *(value != 0.0 for value in others))
