"""What else is logged, with or without an effect: temperature, supply, spindle, feed, tilt, places, and things that do
not matter. Each varies forth and back, so that a recording can tell it from mere time."""

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

Floats = NDArray[np.float64]
RNG = np.random.Generator

KNOWN = ("temperature_c", "supply_kpa", "spindle_rpm", "feed_mm_s", "tilt_deg", "position_mm", "distance_m")
DECOYS = ("humidity_pct", "air_flow_l_min", "current_a", "aux_1", "aux_2")
COLUMNS = KNOWN + DECOYS
GAUGE = "pressure_kpa"
"""Where an effect needs it only: with a gauge most causes are told apart by it."""


def covariates(rng: RNG, time_s: Floats, wanted: tuple[str, ...]) -> dict[str, Floats]:
    """The wanted columns, shape as time_s, rounded as a logger does. ValueError on an unknown name."""
    unknown = [name for name in wanted if name not in COLUMNS]
    if unknown:
        raise ValueError(f"no column {', '.join(unknown)}; there are {', '.join(COLUMNS)}")
    makers = {"temperature_c": temperature, "supply_kpa": supply, "spindle_rpm": spindle, "tilt_deg": tilt}
    motion = moved(rng, time_s)
    columns = {name: motion[name] for name in wanted if name in motion}
    for name in wanted:
        if name in makers:
            columns[name] = np.round(makers[name](rng, time_s), 3)
        elif name in DECOYS:
            columns[name] = np.round(wander(rng, time_s), 4)
    return columns


def smooth(rng: RNG, time_s: Floats, slow_s: float) -> Floats:
    """White noise through two lags of slow_s, unit deviation, zero mean."""
    keep = np.exp(-float(np.median(np.diff(time_s))) / slow_s)
    drive = rng.standard_normal(time_s.size + int(4 * slow_s * 200))
    wave = lfilter([1.0], [1.0, -2.0 * keep, keep**2], drive)[-time_s.size :]
    return np.asarray((wave - wave.mean()) / wave.std())


def temperature(rng: RNG, time_s: Floats) -> Floats:
    """Up and down by several kelvin: a sine of less than the recording, with a wander on it."""
    turns = rng.uniform(1.1, 2.2)
    wave = np.sin(2.0 * np.pi * (turns * time_s / time_s[-1] + rng.random()))
    return np.asarray(22.0 + rng.uniform(2.0, 6.0) * wave + 0.5 * smooth(rng, time_s, 4.0))


def supply(rng: RNG, time_s: Floats) -> Floats:
    """A compressor's saw: falls slowly, is pumped up quickly; and dips when a neighbour blows."""
    period_s, swing = rng.uniform(7.0, 16.0), rng.uniform(30.0, 80.0)
    phase = (time_s / period_s + rng.random()) % 1.0
    saw = np.where(phase < 0.75, 1.0 - phase / 0.75, (phase - 0.75) / 0.25)
    level = 680.0 + swing * saw
    for start_s in rng.uniform(0.0, time_s[-1], 4):
        level -= rng.uniform(10.0, 40.0) * ((time_s > start_s) & (time_s < start_s + rng.uniform(0.8, 2.5)))
    return np.asarray(level + rng.uniform(1.0, 4.0) * smooth(rng, time_s, 1.0))


def spindle(rng: RNG, time_s: Floats) -> Floats:
    """Off, 3900 rpm and other speeds, in stretches."""
    return plateaus(rng, time_s, 4.0, (0.0, 3900.0, 0.0, 3900.0, rng.uniform(1500.0, 5400.0)))


def tilt(rng: RNG, time_s: Floats) -> Floats:
    """Degrees from the vertical (90: level, as the paper's rig), moved between postures within half a second."""
    postures = tuple(rng.uniform(35.0, 125.0, 6))
    jumps = plateaus(rng, time_s, 5.0, postures)
    width = 100
    padded = np.concatenate([np.full(width, jumps[0]), jumps])
    return np.convolve(padded, np.full(width, 1.0 / width))[width : width + time_s.size]


def plateaus(rng: RNG, time_s: Floats, typical_s: float, levels: tuple[float, ...]) -> Floats:
    """Stretches of 0.6 .. 1.6 times the typical length, each at another of the levels than the one before."""
    values, start_s, place = np.zeros_like(time_s), 0.0, int(rng.integers(len(levels)))
    while start_s < time_s[-1]:
        values[time_s >= start_s] = levels[place]
        place = (place + int(rng.integers(1, len(levels)))) % len(levels)
        start_s += typical_s * rng.uniform(0.6, 1.6)
    return values


def moved(rng: RNG, time_s: Floats) -> dict[str, Floats]:
    """Forth and back along the surface at 3 .. 20 mm/s with pauses: feed, place and distance belong together."""
    speeds = rng.uniform(3.0, 20.0, 3)
    feed = plateaus(rng, time_s, 3.5, (speeds[0], -speeds[0], 0.0, speeds[1], -speeds[1], 0.0, speeds[2], -speeds[2]))
    if rng.random() < 0.5:  # stands for a while, and distance with it
        start_s = rng.uniform(0.1, 0.5) * time_s[-1]
        feed[(time_s > start_s) & (time_s < start_s + 0.3 * time_s[-1])] = 0.0
    step_s = np.diff(time_s, prepend=time_s[0])
    place = np.cumsum(feed * step_s)
    place -= place.min()
    distance = np.cumsum(np.abs(feed) * step_s) / 1000.0
    return {"feed_mm_s": np.round(feed, 2), "position_mm": np.round(place, 3), "distance_m": np.round(distance, 6)}


def wander(rng: RNG, time_s: Floats) -> Floats:
    """Something that does not matter: a random walk, or a smooth wave, about some level."""
    level = rng.uniform(-20.0, 80.0)
    if rng.random() < 0.5:
        walk = np.cumsum(rng.standard_normal(time_s.size))
        return np.asarray(level + 3.0 * (walk - walk.mean()) / walk.std())
    return level + rng.uniform(0.5, 8.0) * smooth(rng, time_s, float(rng.uniform(0.5, 6.0)))
