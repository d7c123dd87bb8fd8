"""The load cell's own noise: white, or white with a Lorentzian (an AR(1) process), or with a resonance (AR(2))."""

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

Floats = NDArray[np.float64]
COLOURS = ("white", "lorentzian", "resonance")


def noise(rng: np.random.Generator, count: int, rate_hz: float, colour: str) -> Floats:
    """Unit standard deviation, shape (count,). colour: one of COLOURS; ValueError on any other."""
    white = rng.standard_normal(count)
    if colour == "white":
        return white
    if colour not in COLOURS:
        raise ValueError(f"no noise of colour {colour!r}, there are {', '.join(COLOURS)}")
    share = rng.uniform(0.3, 0.8)  # of the variance that is coloured
    drive = rng.standard_normal(count + 4000)
    slow = lorentzian(rng, drive, rate_hz) if colour == "lorentzian" else resonance(rng, drive, rate_hz)
    return np.sqrt(1.0 - share) * white + np.sqrt(share) * slow[-count:]


def lorentzian(rng: np.random.Generator, drive: Floats, rate_hz: float) -> Floats:
    """Unit variance, corner 0.3 .. 6 Hz."""
    corner_hz = float(np.exp(rng.uniform(np.log(0.3), np.log(6.0))))
    keep = np.exp(-2.0 * np.pi * corner_hz / rate_hz)
    return np.asarray(lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], drive))


def resonance(rng: np.random.Generator, drive: Floats, rate_hz: float) -> Floats:
    """Unit variance, a broad peak at 8 .. 40 Hz: a frame that rings."""
    angle, radius = 2.0 * np.pi * rng.uniform(8.0, 40.0) / rate_hz, rng.uniform(0.85, 0.95)
    a1, a2 = -2.0 * radius * np.cos(angle), radius**2
    variance = (1.0 + a2) / ((1.0 - a2) * ((1.0 + a2) ** 2 - a1**2))
    return np.asarray(lfilter([1.0 / np.sqrt(variance)], [1.0, a1, a2], drive))
