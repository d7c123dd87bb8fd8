"""What is commanded: a rich minute, the paper's ladder, or one constant force. Volts per row, 0 .. 6 V, in millivolts."""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
TOP_V = 6.0
RNG = np.random.Generator


def excitation(kind: str, rng: RNG, time_s: Floats) -> Floats:
    """Command at each row, V. kind: rich, ladder or constant; ValueError on any other."""
    kinds: dict[str, Callable[[RNG, Floats], Floats]] = {"rich": rich, "ladder": ladder, "constant": constant}
    if kind not in kinds:
        raise ValueError(f"no excitation {kind!r}, there are {', '.join(kinds)}")
    return np.round(np.clip(kinds[kind](rng, time_s), 0.0, TOP_V), 3)


def constant(rng: RNG, time_s: Floats) -> Floats:
    """One force for the whole recording, from its first second on."""
    return np.where(time_s < 1.0, 0.0, rng.uniform(1.5, 5.0))


def ladder(_rng: RNG, time_s: Floats) -> Floats:
    """The paper's: 0 -> 5 -> 0 V in steps of 0.1 V, spread evenly over the recording."""
    stairs = np.concatenate([np.arange(0, 51), np.arange(49, -1, -1)]) * 0.1
    place = np.floor(time_s / (time_s[-1] + 1e-9) * stairs.size).astype(int)
    return np.asarray(stairs[np.clip(place, 0, stairs.size - 1)])


def rich(rng: RNG, time_s: Floats) -> Floats:
    """Steps, ramps, sines, small steps, holds and rests at 0 V, in an order of chance; each kind comes at least once
    in a minute, and the first half second and the last second are at 0 V."""
    end_s, dt = time_s[-1], float(np.median(np.diff(time_s)))
    pieces = [np.zeros(rows(0.5, dt))]
    level, length_s = 0.0, 0.0
    for make in order(rng):
        piece = make(rng, level, dt)
        pieces.append(piece)
        level, length_s = float(piece[-1]), length_s + piece.size * dt
        if length_s > end_s:
            break
    volts = np.concatenate(pieces)[: time_s.size]
    volts[time_s > end_s - 1.0] = 0.0
    return volts


def order(rng: RNG) -> Iterator[Callable[[RNG, float, float], Floats]]:
    """Once each kind (about 50 s), shuffled, beginning with steps; then steps and sines for ever."""
    kinds = [rest, steps, ramps, sines, small_steps, chirp, hold, ramps]
    yield steps
    for place in rng.permutation(len(kinds)):
        yield kinds[place]
    while True:
        yield steps
        yield sines


def rows(duration_s: float, dt: float) -> int:
    return max(1, round(duration_s / dt))


def rest(rng: RNG, _level: float, dt: float) -> Floats:
    return np.zeros(rows(rng.uniform(5.0, 8.0), dt))


def hold(rng: RNG, _level: float, dt: float) -> Floats:
    return np.full(rows(rng.uniform(4.0, 6.0), dt), rng.uniform(2.0, 5.5))


def steps(rng: RNG, level: float, dt: float) -> Floats:
    """Up and down, large and small, dwells from shorter than the lag to long; now and then back to 0 V."""
    pieces, left_s = [], rng.uniform(6.0, 8.0)
    while left_s > 0.0:
        far = rng.uniform(0.2, TOP_V) if rng.random() < 0.6 else level + rng.uniform(-1.0, 1.0)
        level = 0.0 if rng.random() < 0.1 else float(np.clip(far, 0.0, TOP_V))
        dwell_s = float(np.exp(rng.uniform(np.log(0.15), np.log(1.8))))
        pieces.append(np.full(rows(dwell_s, dt), level))
        left_s -= dwell_s
    return np.concatenate(pieces)


def small_steps(rng: RNG, _level: float, dt: float) -> Floats:
    """A walk of 0.01 .. 0.15 V about one level: what a dead band swallows."""
    count = int(rng.integers(16, 24))
    walk = np.cumsum(rng.choice([-1.0, 1.0], count) * np.exp(rng.uniform(np.log(0.01), np.log(0.15), count)))
    return np.repeat(np.clip(rng.uniform(1.5, 4.5) + walk, 0.0, TOP_V), rows(0.25, dt))


def ramps(rng: RNG, level: float, dt: float) -> Floats:
    """From turn to turn at speeds that differ tenfold."""
    pieces, left_s = [], rng.uniform(5.0, 7.0)
    while left_s > 0.0:
        target, duration_s = rng.uniform(0.0, TOP_V), float(np.exp(rng.uniform(np.log(0.4), np.log(4.0))))
        pieces.append(np.linspace(level, target, rows(duration_s, dt)))
        level, left_s = target, left_s - duration_s
    return np.concatenate(pieces)


def sines(rng: RNG, _level: float, dt: float) -> Floats:
    """Four sines of 0.1 .. 3 Hz about a level."""
    time_s = np.arange(rows(rng.uniform(5.0, 7.0), dt)) * dt
    middle = rng.uniform(1.5, 4.0)
    waves = np.zeros_like(time_s)
    for frequency_hz in np.exp(rng.uniform(np.log(0.1), np.log(3.0), 4)):
        waves += rng.uniform(0.1, 0.6) * np.sin(2.0 * np.pi * (frequency_hz * time_s + rng.random()))
    return np.asarray(np.clip(middle + waves, 0.0, TOP_V))


def chirp(rng: RNG, _level: float, dt: float) -> Floats:
    time_s = np.arange(rows(rng.uniform(4.0, 6.0), dt)) * dt
    rate = rng.uniform(3.0, 5.0) / time_s[-1]
    return np.asarray(rng.uniform(2.0, 4.0) + rng.uniform(0.5, 1.5) * np.sin(np.pi * (0.4 + rate * time_s) * time_s))
