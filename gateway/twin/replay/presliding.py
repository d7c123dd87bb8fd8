"""Presliding in a replay, where the pad is never left: Maxwell-slip elements, all lanes at once.

The closed form of friction.py, arranged for few numpy calls. State Y = (F, z3, z2, z1) with rows of lanes: the pad's
force and the strains, stiffest element last. With share s = limit / 3, running sums A of (F, s z3, s z2, s z1) give what
is left of the drive when 3, 2, 1 and 0 elements slide, so that the travel outward would be the largest and inward the
smallest of
    (drive -+ s sliding - A) / (stiffness + s sum of 1/d of those that stick).
Whichever direction is not taken gives just the last of these, all sticking: the travel is largest + smallest - last.
A lane or two are faster in floats, element by element, as friction.py does it.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.twin.elementwise import Real
from gateway.twin.friction import ELEMENTS, RIGID_M
from gateway.twin.replay.drive import Floats
from gateway.twin.replay.grid import Grid
from gateway.twin.replay.load import Load
from gateway.twin.replay.parts import march_in_parts, split_lanes, stack_lanes

_CHUNK: Final = 32  # steps prepared at a time: small enough for the cache
_SINGLY: Final = 4
_SLIDING: Final = np.arange(ELEMENTS, -1.0, -1.0)[:, None]


@dataclass(frozen=True, slots=True, eq=False)
class PreslidingLanes:
    """What the steps need of every lane; shapes (lanes,) and, by rows of the state, (4, lanes)."""

    stiffness: Floats  # pad and drag, N/m; (steps, lanes) where the drag differs from step to step
    sticking: Floats  # sum of 1/d of the elements that stick, per row
    gain: Floats  # change of the state per travel: pad stiffness, 1/d3, 1/d2, 1/d1

    @classmethod
    def of(cls, loads: list[Load], steps_s: Real) -> "PreslidingLanes":
        pad = np.array([load.plant.contact.pad_stiffness_n_per_m for load in loads])
        drag = np.array([load.plant.friction.viscous_n_s_per_m for load in loads])
        if np.any(drag):
            drag = drag / (steps_s if type(steps_s) is float else steps_s[:, None])
        presliding = np.array([load.plant.friction.presliding_m for load in loads])
        inverse = np.stack([1.0 / np.maximum(presliding * (j / ELEMENTS), RIGID_M) for j in range(ELEMENTS, 0, -1)])
        sticking = np.concatenate([np.zeros((1, pad.size)), np.cumsum(inverse, axis=0)])
        return cls(pad + drag, sticking, np.concatenate([pad[None], inverse]))

    def select(self, lanes: NDArray[np.intp], *stiffness: Floats) -> "PreslidingLanes":
        """Some lanes. stiffness: in the steps that are taken, where it is not that of all."""
        (own,) = stiffness or (self.stiffness[lanes],)
        return PreslidingLanes(own, self.sticking[:, lanes], self.gain[:, lanes])

    def at_rest(self) -> "PreslidingLanes":
        """Without drag."""
        return PreslidingLanes(self.gain[0], self.sticking, self.gain)


def presliding_forces(loads: list[Load], grid: Grid) -> list[Floats]:
    """Return the force of each load on the grid, N."""
    lanes = PreslidingLanes.of(loads, grid.steps_s)
    drive = stack_lanes([load.drive_n for load in loads])
    share = stack_lanes([load.limit_n for load in loads]) * (1.0 / ELEMENTS)
    state, found = np.zeros((ELEMENTS + 1, len(loads))), np.empty_like(drive)
    _march(lanes.at_rest(), drive[:1], share[:1], state, found[:1])
    for lane, load in enumerate(loads):
        if load.start is not None:
            state[:, lane] = load.start_force_n, *reversed(load.strains)
            found[0, lane] = load.start_force_n
    if len(loads) <= _SINGLY:
        for lane in range(len(loads)):
            found[1:, lane] = _single(lanes, lane, _steps_of_lane(lanes.stiffness, drive[1:], share[1:], lane), state)
        return split_lanes(found)

    def march(which: NDArray[np.intp], series: list[Floats], state: Floats, forces: Floats) -> None:
        drive, share, *stiffness = series
        _march(lanes.select(which, *stiffness), drive, share, state, forces)

    stiffness = [lanes.stiffness] if lanes.stiffness.ndim == 2 else []
    found[1:] = march_in_parts(march, [drive[1:], share[1:], *stiffness], state, _guess(drive, share))
    return split_lanes(found)


def _guess(drive: Floats, share: Floats) -> Floats:
    """State ahead of each step but the first, if the slide slid on in the direction that the drive had."""
    rising = np.where(np.diff(drive, axis=0) >= 0.0, 1.0, -1.0)
    force = drive[:-1] - ELEMENTS * share[:-1] * rising
    return np.stack([force, *[rising] * ELEMENTS])


def _steps_of_lane(stiffness: Floats, drive: Floats, share: Floats, lane: int) -> Iterator[tuple[float, ...]]:
    """For each step of a lane: stiffness, drive and share as floats."""
    stiffness = np.broadcast_to(stiffness, drive.shape)
    return zip(*(column[:, lane].tolist() for column in (stiffness, drive, share)), strict=True)


def _single(lanes: PreslidingLanes, lane: int, loads: Iterable[tuple[float, ...]], start: Floats) -> list[float]:
    """One lane in floats; the elements slide one after another, and most steps end before the first does."""
    force, z3, z2, z1 = start[:, lane].tolist()
    _, stick3, stick2, stick1 = lanes.sticking[:, lane].tolist()
    pad, inverse3, inverse2, inverse1 = lanes.gain[:, lane].tolist()
    found = []
    for stiffness, drive, share in loads:
        left = drive - force - share * (z1 + z2 + z3)
        way = 1.0 if left >= 0.0 else -1.0
        left *= way
        travel = left / (stiffness + share * stick1)
        left += share * (way * z1 - 1.0)
        further = left / (stiffness + share * stick2)
        if further > travel:
            travel = further
            left += share * (way * z2 - 1.0)
            further = left / (stiffness + share * stick3)
            if further > travel:
                travel = further
                further = (left + share * (way * z3 - 1.0)) / stiffness
                if further > travel:
                    travel = further
        travel *= way
        force += pad * travel
        z1, z2, z3 = z1 + travel * inverse1, z2 + travel * inverse2, z3 + travel * inverse3
        z1 = -1.0 if z1 < -1.0 else 1.0 if z1 > 1.0 else z1
        z2 = -1.0 if z2 < -1.0 else 1.0 if z2 > 1.0 else z2
        z3 = -1.0 if z3 < -1.0 else 1.0 if z3 > 1.0 else z3
        found.append(force)
    return found


def _march(lanes: PreslidingLanes, drive: Floats, share: Floats, state: Floats, found: Floats) -> None:
    """Step through (steps, lanes) of drive and share, N; advances the state (4, lanes) and fills the forces."""
    buffers = [np.empty((_CHUNK, *state.shape)) for _ in range(4)]
    for first in range(0, drive.shape[0], _CHUNK):
        part = slice(first, first + _CHUNK)
        stiffness = lanes.stiffness[part, None] if lanes.stiffness.ndim == 2 else lanes.stiffness
        _run_steps(
            _prepare_steps((stiffness, lanes.sticking), drive[part, None], share[part, None], buffers),
            found[part],
            lanes.gain,
            state,
        )


def _prepare_steps(
    stiffness: tuple[Floats, Floats], drive: Floats, share: Floats, buffers: list[Floats]
) -> Iterator[tuple[Floats, ...]]:
    """For each step: limits of the travel outward and inward, 1/stiffness by row, and the scale of the state."""
    outward, inward, inverse, scale = (buffer[: drive.shape[0]] for buffer in buffers)
    scale[:, :1], scale[:, 1:] = 1.0, share
    free, sticking = stiffness
    np.multiply(share, sticking, inverse)
    inverse += free
    np.divide(1.0, inverse, inverse)
    np.multiply(share, _SLIDING, inward)
    np.subtract(drive, inward, outward)
    inward += drive
    outward *= inverse
    inward *= inverse
    return zip(outward, inward, inverse, scale, strict=True)


def _run_steps(prepared: Iterable[tuple[Floats, ...]], found: Floats, gain: Floats, state: Floats) -> None:
    """The steps themselves: everything in place, one numpy call per line."""
    add, multiply, subtract, maximum, minimum = np.add, np.multiply, np.subtract, np.maximum, np.minimum
    left, out, back, change = (np.empty_like(state) for _ in range(4))
    pair, travel, other = np.empty_like(state[:2]), np.empty_like(state[0]), np.empty_like(state[0])
    left0, left1, left2, left3 = left
    out_a, out_b, back_a, back_b, last = out[:2], out[2:], back[:2], back[2:], out[3]
    pair_a, pair_b = pair
    force, strains = state[0], state[1:]
    least, most = np.full_like(strains, -1.0), np.full_like(strains, 1.0)
    for (outward, inward, inverse, scale), force_out in zip(prepared, found, strict=True):
        multiply(state, scale, left)
        add(left0, left1, left1)
        add(left1, left2, left2)
        add(left2, left3, left3)
        multiply(left, inverse, left)
        subtract(outward, left, out)
        subtract(inward, left, back)
        maximum(out_a, out_b, out=pair)
        maximum(pair_a, pair_b, out=travel)
        minimum(back_a, back_b, out=pair)
        minimum(pair_a, pair_b, out=other)
        add(travel, other, travel)
        subtract(travel, last, travel)
        multiply(gain, travel, change)
        add(state, change, state)
        maximum(strains, least, out=strains)
        minimum(strains, most, out=strains)
        force_out[:] = force
