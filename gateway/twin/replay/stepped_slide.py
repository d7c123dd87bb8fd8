"""Any slide in a replay: the twin's own, without mass and damping, step by step; in floats, or all lanes together.

For what the shorter ways do not take: Stribeck's curve and stiction after a rest, which depend on the motion itself, a
gap, a stop, a drive that pulls. Where steps differ, the slide is told the length of each: its drag, Stribeck's speed and
the growth of stiction follow it.
"""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.twin.elementwise import Real, exponential, larger
from gateway.twin.friction import ELEMENTS, FREE_N_PER_M, Elements
from gateway.twin.plant import Plant, stack
from gateway.twin.replay.drive import Floats
from gateway.twin.replay.grid import Grid
from gateway.twin.replay.load import Load, side_load_on_grid_n
from gateway.twin.replay.parts import march_in_parts, split_lanes, stack_lanes
from gateway.twin.slide import SlideState, weight_n

_SINGLY: Final = 1  # lanes that are faster one by one in floats
_BEFORE_STRAINS: Final = 3  # numbers of a state: place, travel, stiction
_LENGTH_M: Final = 1.0e-4  # unit of positions and travels where states are compared


class _Elements(Elements):
    """Elements in steps that differ."""

    def set_step(self, step_s: Real, last_s: Real) -> None:
        """Set the length of the coming step, and of the one in which the slide made its last travel, s."""
        self.set_drag(step_s)
        self._stribeck_travel_m = self._friction.stribeck_speed_m_per_s * last_s
        if self.ages:
            self._rest_share = 1.0 - exponential(-step_s / self._friction.dwell_stiction_s)


class _Slide(SlideState):
    """A slide without inertia in steps that differ."""

    def __init__(self, plant: Plant, step_s: float, zero: Real) -> None:
        SlideState.__init__(self, plant, step_s, zero)
        self._elements: _Elements = _Elements(plant.friction, step_s, zero)

    def set_step(self, step_s: Real, last_s: Real) -> None:
        """As for the elements; not needed where all steps are as long as the first."""
        self._elements.set_step(step_s, last_s)
        drag_n_per_m = self._elements.drag_n_per_m
        self._free_n_per_m = larger(drag_n_per_m, FREE_N_PER_M)
        self._pressed_n_per_m = drag_n_per_m + self._pad_n_per_m


def stepped_forces(loads: list[Load], grid: Grid) -> list[Floats]:
    """Return the force of each load on the grid, N."""
    if len(loads) <= _SINGLY:
        return [_single(load, grid) for load in loads]
    plants = [load.plant for load in loads]
    pressure = stack_lanes([load.pressure_pa for load in loads])
    side = stack_lanes([np.broadcast_to(_sideways_n(load, grid), grid.points) for load in loads])
    steps = [np.repeat(lengths[:, None], len(loads), axis=1) for lengths in _lengths(grid)]
    slide = _slide(plants, grid.step_s)
    slide.set_side_load(side[0])
    slide.settle(pressure[0])
    first, state = slide.force_n, _state_scale(slide)
    for lane, load in enumerate(loads):
        if _is_given(load):
            first[lane] = load.start_force_n
            state[:, lane] = _initial_state(load, state.shape[0])

    def march(which: NDArray[np.intp], series: list[Floats], state: Floats, forces: Floats) -> None:
        _march(_slide([plants[lane] for lane in which], grid.step_s), series, state, forces)

    force = march_in_parts(march, [pressure[1:], side[1:], *steps], state, _guess(loads, state))
    return split_lanes(np.concatenate([first[None], force]))


def _sideways_n(load: Load, grid: Grid) -> Real:
    return side_load_on_grid_n(load.plant.friction, load.thrust_n, grid.conditions)


def _lengths(grid: Grid) -> list[Floats]:
    """Of each step and of the one before it, s; none where they are alike."""
    steps_s = grid.steps_s
    return [] if type(steps_s) is float else [steps_s, np.concatenate([steps_s[:1], steps_s[:-1]])]


def _slide(plants: list[Plant], step_s: float) -> _Slide:
    """Lanes of slides that have their weight but no inertia; a single one in floats."""
    plant = plants[0] if len(plants) == 1 else stack(plants)
    zero: Real = 0.0 if len(plants) == 1 else np.zeros(len(plants))
    contact = replace(plant.contact, mass_kg=zero, pad_damping_n_s_per_m=zero)
    slide = _Slide(replace(plant, contact=contact), step_s, zero)
    slide.set_disturbance(weight_n(plant.contact.mass_kg, plant.contact.tilt_deg))
    return slide


def _single(load: Load, grid: Grid) -> Floats:
    """One lane, in floats."""
    slide, side_n = _slide([load.plant], grid.step_s), _sideways_n(load, grid)
    sides = None if isinstance(side_n, float) else side_n.tolist()
    lengths = list(zip(*(column.tolist() for column in _lengths(grid)), strict=True))
    first, *pressures = load.pressure_pa.tolist()
    if sides is not None:
        slide.set_side_load(sides[0])
    slide.settle(first)
    found, step = [slide.force_n], slide.step
    if _is_given(load):
        position, *rest = _initial_state(load, len(slide.state()))
        slide.resume([position * _LENGTH_M, *rest])
        found = [load.start_force_n]
    for point, pressure in enumerate(pressures):
        if sides is not None:
            slide.set_side_load(sides[point + 1])
        if lengths:
            slide.set_step(*lengths[point])
        found.append(step(pressure))
    return np.array(found)


def _is_given(load: Load) -> bool:
    """Are the strains to begin with given, and is the pad pressed there?"""
    return load.start is not None and load.has_dry_friction and load.start_force_n > 0.0


def _initial_state(load: Load, size: int) -> list[float]:
    """The state that these strains belong to: place on the pad, no travel, no stiction, as many strains as it has."""
    contact, count = load.plant.contact, size - _BEFORE_STRAINS
    strains = load.strains if count == ELEMENTS else [sum(load.strains) / ELEMENTS] * count
    return [(contact.gap_m + load.start_force_n / contact.pad_stiffness_n_per_m) / _LENGTH_M, 0.0, 0.0, *strains]


def _state_scale(slide: SlideState) -> Floats:
    state = np.stack(slide.state())
    state[:2] /= _LENGTH_M
    return state


def _guess(loads: list[Load], state: Floats) -> Floats:
    """State ahead of each step but the first, if the slide slid on in the direction that the drive had."""
    drive, limit = stack_lanes([load.drive_n for load in loads]), stack_lanes([load.limit_n for load in loads])
    rising = np.where(np.diff(drive, axis=0) >= 0.0, 1.0, -1.0)
    stiffness = np.array([load.plant.contact.pad_stiffness_n_per_m for load in loads])
    gap_m = np.array([load.plant.contact.gap_m for load in loads])
    guess = np.zeros((state.shape[0], *rising.shape))
    guess[0] = (gap_m + np.maximum(drive[:-1] - limit[:-1] * rising, 0.0) / stiffness) / _LENGTH_M
    guess[3:] = rising
    return guess


def _march(slide: _Slide, series: list[Floats], state: Floats, forces: Floats) -> None:
    """Step through (steps, lanes) of pressure, side load and lengths from a state; advances it and fills the forces."""
    pressure, side, *lengths = series
    if state.shape[1] == 1:  # floats, as the slide of one lane has them
        pressure, side, *lengths = (column[:, 0].tolist() for column in series)
        slide.resume([state[0, 0] * _LENGTH_M, state[1, 0] * _LENGTH_M, *state[2:, 0].tolist()])
    else:
        slide.resume([state[0] * _LENGTH_M, state[1] * _LENGTH_M, *state[2:].copy()])
    changes = bool(np.any(side))
    for point in range(len(pressure)):
        if changes:
            slide.set_side_load(side[point])
        if lengths:
            slide.set_step(lengths[0][point], lengths[1][point])
        forces[point] = slide.step(pressure[point])
    state[:] = _state_scale(slide).reshape(state.shape)
