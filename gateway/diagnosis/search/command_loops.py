"""The compiled loops of the search for steps of the command: what a step makes of the force, in volts.

A command that was rounded goes through the regulator's lag, then through rigid friction, a play; so does the command as it
was sent; their difference is the step's column. A row sees the command of the row before, from 0 V at the first.
"""

import math
from typing import NamedTuple

import numpy as np

from gateway.compiled import loop, step
from gateway.diagnosis.measurement import Floats
from gateway.twin.play_and_lags import apply_play

_TURN = 2.0 * math.pi


class ForceChain(NamedTuple):
    """Between command and force. share: of the way that the lag goes in a row; play_v: full width of the friction's loop."""

    share: float
    play_v: float


@step
def sine_of_turns(turns: float) -> float:
    """Return the sine of an angle in turns, to 6e-8: a polynomial, of which a compiled loop does several at once."""
    part = turns - math.floor(turns + 0.5)
    way = abs(part)
    angle = _TURN * min(way, 0.5 - way)
    square = angle * angle
    sine = angle * (
        1.0
        + square
        * (-1.0 / 6 + square * (1.0 / 120 + square * (-1.0 / 5040 + square * (1.0 / 362880 - square / 39916800))))
    )
    return sine if part > 0.0 else -sine


@step
def fill_force_v(given_v: Floats, chain: ForceChain, force_v: Floats) -> None:
    """Fill in what lag and play make of a command, all (rows,)."""
    late_v = state = 0.0
    for row in range(given_v.size):
        state = apply_play(state, late_v, chain.play_v)
        force_v[row] = state
        late_v += chain.share * (given_v[row] - late_v)


@step
def correlate_force(
    given_v: Floats, sent_v: Floats, target: Floats, chain: ForceChain, force_v: Floats
) -> tuple[float, float]:
    """Return how the force of a command goes with `target`, beside that of the command as it was sent, and the squares of the
    difference about its mean. force_v: filled in on the way."""
    fill_force_v(given_v, chain, force_v)
    total = squares = alike = target_sum = 0.0
    for row in range(sent_v.size):
        column_v = force_v[row] - sent_v[row]
        total += column_v
        squares += column_v * column_v
        alike += target[row] * column_v
        target_sum += target[row]
    mean_v = total / sent_v.size
    return alike - target_sum * mean_v, squares - total * mean_v


@loop
def fill_first_waves(
    command_v: Floats, target: Floats, steps_v: Floats, chain: ForceChain, found: tuple[Floats, Floats]
) -> None:
    """Fill in, for each step, how its wave goes with `target` (rows,), and the wave's own sum of squares about its mean.

    The wave: what it makes of the force that teeth are rounded off which are their first harmonic only.
    """
    rows = command_v.size
    given_v, sent_v, force_v = np.empty(rows), np.empty(rows), np.empty(rows)
    fill_force_v(command_v, chain, sent_v)
    for k in range(steps_v.size):
        per_v, size_v = 1.0 / steps_v[k], steps_v[k] / math.pi
        for row in range(rows):
            given_v[row] = command_v[row] - size_v * sine_of_turns(command_v[row] * per_v)
        found[0][k], found[1][k] = correlate_force(given_v, sent_v, target, chain, force_v)


@loop
def correlate_roundings(
    command_v: Floats, target: Floats, steps_v: Floats, chain: ForceChain, found: tuple[Floats, Floats]
) -> None:
    """Fill in, for each step, how what its rounding makes of the force goes with `target` (rows,), and its squares."""
    rows = command_v.size
    given_v, sent_v, force_v = np.empty(rows), np.empty(rows), np.empty(rows)
    fill_force_v(command_v, chain, sent_v)
    for k in range(steps_v.size):
        size_v = steps_v[k]
        for row in range(rows):
            given_v[row] = np.rint(command_v[row] / size_v) * size_v
        found[0][k], found[1][k] = correlate_force(given_v, sent_v, target, chain, force_v)


@loop
def correlate_dead_bands(
    command_v: Floats, target: Floats, bands_v: Floats, chain: ForceChain, found: tuple[Floats, Floats]
) -> None:
    """Fill in, for each dead band, how what it makes of the force goes with `target` (rows,), and its squares."""
    rows = command_v.size
    given_v, sent_v, force_v = np.empty(rows), np.empty(rows), np.empty(rows)
    fill_force_v(command_v, chain, sent_v)
    for k in range(bands_v.size):
        noticed_v = 0.0
        for row in range(rows):
            if abs(command_v[row] - noticed_v) > bands_v[k]:
                noticed_v = command_v[row]
            given_v[row] = noticed_v
        found[0][k], found[1][k] = correlate_force(given_v, sent_v, target, chain, force_v)


@loop
def fill_rounding_errors(command_v: Floats, steps_v: Floats, chain: ForceChain, columns_v: Floats) -> None:
    """Fill in what it makes of the force that the command was rounded to each step, (steps, rows)."""
    rows = command_v.size
    given_v, sent_v = np.empty(rows), np.empty(rows)
    fill_force_v(command_v, chain, sent_v)
    for k in range(steps_v.size):
        size_v = steps_v[k]
        for row in range(rows):
            given_v[row] = np.rint(command_v[row] / size_v) * size_v
        fill_force_v(given_v, chain, columns_v[k])
        for row in range(rows):
            columns_v[k, row] -= sent_v[row]
