"""A recording cut into parts that run side by side, as further lanes: numpy takes hundreds of lanes for little more than one.

Each part starts from a guessed state. Parts whose start turns out to differ from the end of the part before run again, until
none does: the result is that of one run from the beginning to the end, to within _SAME. Friction forgets its past at
every reversal that slides through, so two rounds settle most parts; the worst case, a recording at rest, costs as many
rounds as there are parts, but these are narrow and together no longer than one run.
"""

from collections.abc import Callable
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gateway.twin.replay.drive import Floats

March: TypeAlias = Callable[[NDArray[np.intp], list[Floats], Floats, Floats], None]
"""(which lanes, series (steps, lanes) each, state (rows, lanes), forces (steps, lanes)): advances state, fills forces."""

_WIDTH: Final = 1024
_MOST: Final = 32
_SHORTEST: Final = 64  # steps of one part
_SAME: Final = 1.0e-9  # of strains, of forces in N, of lengths in units of their scale


def march_in_parts(march: March, series: list[Floats], state: Floats, guess: Floats) -> Floats:
    """Return forces (steps, lanes) under series of the same shape.

    state: (rows, lanes) at the beginning. guess: (rows, steps, lanes) of what it may be ahead of each step.
    """
    steps, width = series[0].shape
    parts = max(1, min(_WIDTH // width, _MOST, steps // _SHORTEST))
    length = -(-steps // parts)
    beside = [_beside(column, parts, length) for column in series]
    found = np.empty_like(beside[0])
    starts = guess[:, np.minimum(np.arange(parts) * length, steps - 1)].reshape(state.shape[0], -1)
    starts[:, :width] = state
    _settle(march, beside, starts, found, width)
    return np.ascontiguousarray(found.reshape(length, parts, width).transpose(1, 0, 2)).reshape(-1, width)[:steps]


def _settle(march: March, beside: list[Floats], starts: Floats, found: Floats, width: int) -> None:
    """Run all parts, and those again that began in a wrong state."""
    ends = starts.copy()
    march(np.arange(starts.shape[1]) % width, beside, ends, found)
    while True:
        wrong = np.flatnonzero(np.any(np.abs(ends[:, :-width] - starts[:, width:]) > _SAME, axis=0))
        if not wrong.size:
            return
        todo = wrong + width
        starts[:, todo] = state = np.ascontiguousarray(ends[:, wrong])
        forces = np.empty((found.shape[0], todo.size))
        march(todo % width, [np.ascontiguousarray(column[:, todo]) for column in beside], state, forces)
        ends[:, todo], found[:, todo] = state, forces


def _beside(series: Floats, parts: int, length: int) -> Floats:
    """(steps, lanes) cut into parts that stand side by side: (length, parts x lanes); the last value fills up."""
    steps, width = series.shape
    if parts == 1:
        return series
    filled = np.concatenate([series, np.repeat(series[-1:], parts * length - steps, axis=0)])
    return np.ascontiguousarray(filled.reshape(parts, length, width).transpose(1, 0, 2)).reshape(length, -1)


def stack_lanes(series: list[Floats]) -> Floats:
    """Return lanes side by side, of one series each, (steps, lanes)."""
    return np.ascontiguousarray(np.stack(series).T)


def split_lanes(series: Floats) -> list[Floats]:
    """Return one contiguous series per lane: the contrary of stack_lanes."""
    return [np.ascontiguousarray(lane) for lane in series.T]
