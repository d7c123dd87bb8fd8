"""Rigid friction in a replay: the force is dragged along between drive - limit and drive + limit.

In travel terms: the slide stands until the drive leaves the band about the pad's force, and then follows its edge. Viscous
drag lets it come only part of the way in a step (implicit Euler, as in slide.py). A pad that is left, or a stop that is
met, bounds the force; with a gap, what lies beyond the pad counts as a negative force, which no band holds: there is
nothing that the drive could rest on.
"""

from itertools import repeat
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gateway.twin.elementwise import Real
from gateway.twin.friction import directional_drags, travel_share
from gateway.twin.replay.drive import Floats
from gateway.twin.replay.grid import Grid
from gateway.twin.replay.load import Load
from gateway.twin.replay.parts import march_in_parts, split_lanes, stack_lanes

Band: TypeAlias = tuple[Floats, Floats, float, Real, Real, float]
"""Lower edge, upper edge, force at the back stop (negative beyond a gap), N; share of the way out that a step goes, and of
the way in: one for all steps, or one for each; force to begin with, N."""

_SINGLY: Final = 12  # lanes that are faster one by one in floats than together in numpy


def rigid_forces(loads: list[Load], grid: Grid) -> list[Floats]:
    """Return the force of each load on the grid, N."""
    bands = [_band(load, grid.steps_s) for load in loads]
    found = {
        lane: low
        for lane, (low, high, _, *shares, _) in enumerate(bands)
        if low is high and all(map(_is_whole, shares))
    }
    dragged = [lane for lane in range(len(loads)) if lane not in found]
    if len(dragged) <= _SINGLY:
        found |= {lane: _single(bands[lane]) for lane in dragged}
    else:
        found |= zip(dragged, _march_lanes([bands[lane] for lane in dragged]), strict=True)
    return [np.maximum(found[lane], 0.0) if band[2] < 0.0 else found[lane] for lane, band in enumerate(bands)]


def _is_whole(share: Real) -> bool:
    """Without drag a slide goes all of its way."""
    return type(share) is float and share == 1.0


def _band(load: Load, steps_s: Real) -> Band:
    """Where the force may stand; both edges are the same array without friction."""
    contact, stroke_m = load.plant.contact, load.plant.cylinder.stroke_m
    back_n = -contact.pad_stiffness_n_per_m * contact.gap_m
    most_n = contact.pad_stiffness_n_per_m * (stroke_m - contact.gap_m)
    low, high = (load.drive_n, load.drive_n)
    if load.has_dry_friction:
        low, high = load.drive_n - load.limit_n, load.drive_n + load.limit_n
    if back_n < 0.0:
        low, high = np.where(low > 0.0, low, back_n), np.where(high >= 0.0, high, back_n)
    out, back = (
        _share(drag, contact.pad_stiffness_n_per_m, steps_s) for drag in directional_drags(load.plant.friction)
    )
    start_n = back_n if load.start is None or back_n < 0.0 else load.start_force_n
    return (*_bound_between_stops(low, high, back_n, most_n), back_n, out, back, start_n)


def _share(drag_n_s_per_m: Real, stiffness_n_per_m: float, steps_s: Real) -> Real:
    """One number where there is no drag, whatever the steps are."""
    return travel_share(drag_n_s_per_m, stiffness_n_per_m, steps_s) if drag_n_s_per_m > 0.0 else 1.0


def _bound_between_stops(low: Floats, high: Floats, back_n: float, most_n: float) -> tuple[Floats, Floats]:
    """The band between the stops, N."""
    same = low is high
    if high.min() < back_n:
        high = np.maximum(high, back_n)
    if high.max() > most_n:
        low, high = np.minimum(low, most_n), np.minimum(high, most_n)
    return (high, high) if same else (low, high)


def _single(band: Band) -> Floats:
    """One lane in floats."""
    low, high, _, out, back, start_n = band
    force = min(max(start_n, float(low[0])), float(high[0]))
    found, least_n, most_n = [force], low[1:].tolist(), high[1:].tolist()
    if _is_whole(out) and _is_whole(back):
        for least, most in zip(least_n, most_n, strict=True):
            force = least if force < least else most if force > most else force
            found.append(force)
        return np.array(found)
    outs, backs = (repeat(share, low.size - 1) if type(share) is float else share.tolist() for share in (out, back))
    for least, most, goes_out, goes_back in zip(least_n, most_n, outs, backs, strict=True):
        if force < least:
            force += goes_out * (least - force)
        elif force > most:
            force += goes_back * (most - force)
        found.append(force)
    return np.array(found)


def _march_lanes(bands: list[Band]) -> list[Floats]:
    """All lanes at once, and parts of the recording beside each other."""
    low, high = stack_lanes([band[0] for band in bands]), stack_lanes([band[1] for band in bands])
    start = np.clip(np.array([band[5] for band in bands]), low[0], high[0])
    guess = np.where(low[1:] >= low[:-1], low[:-1], high[:-1])
    ways = [[band[way] for band in bands] for way in (3, 4)]
    dragged = not all(_is_whole(share) for shares in ways for share in shares)
    own = [stack_lanes([np.broadcast_to(share, low.shape[0] - 1) for share in shares]) for shares in ways if dragged]

    def march(which: NDArray[np.intp], series: list[Floats], state: Floats, forces: Floats) -> None:
        low, high, *shares = series
        _march(shares, low, high, state, forces)

    force = march_in_parts(march, [low[1:], high[1:], *own], start[None], guess[None])
    return split_lanes(np.concatenate([start[None], force]))


def _march(shares: list[Floats], low: Floats, high: Floats, state: Floats, forces: Floats) -> None:
    """Step through (steps, lanes) of the band and of the shares; advances the state (1, lanes) and fills the forces."""
    force = state[0]
    if not shares:
        for least, most, out in zip(low, high, forces, strict=True):
            np.maximum(force, least, out=out)
            np.minimum(out, most, out=out)
            force = out
    else:
        for least, most, goes_out, goes_back, out in zip(low, high, *shares, forces, strict=True):
            np.maximum(force, least, out=out)
            np.minimum(out, most, out=out)
            way = out - force
            np.multiply(way, np.where(way > 0.0, goes_out, goes_back), out=way)
            np.add(force, way, out=out)
            force = out
    state[0] = force
