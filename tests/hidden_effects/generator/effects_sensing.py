"""Fourteen causes between the force and its number in the file."""

import numpy as np
from generator.plant import Effect, World
from numpy.typing import NDArray

Floats = NDArray[np.float64]
FULL_N = 50.0


def warmth(world: World) -> Floats:
    """Kelvin above the mean."""
    return world.columns["temperature_c"] - world.columns["temperature_c"].mean()


def zero_drift(force: Floats, n_per_k: float, world: World) -> Floats:
    return np.asarray(force + n_per_k * warmth(world))


def span_drift(force: Floats, per_k: float, world: World) -> Floats:
    return np.asarray(force * (1.0 + per_k * warmth(world)))


def warm_up(force: Floats, rise_n: float, world: World) -> Floats:
    slow_s = world.rng("warm-up").uniform(5.0, 15.0)
    return np.asarray(force - rise_n * np.exp(-world.time_s / slow_s))


def linear_drift(force: Floats, n_per_min: float, world: World) -> Floats:
    return np.asarray(force + n_per_min * world.time_s / 60.0)


def quadratic(force: Floats, bend_n: float, _world: World) -> Floats:
    return np.asarray(force + bend_n * (force / FULL_N) ** 2)


def cubic(force: Floats, bend_n: float, _world: World) -> Floats:
    return np.asarray(force + bend_n * (force / FULL_N) ** 3)


def mains_hum(force: Floats, swing_n: float, world: World) -> Floats:
    """The mains, a little off its name, or the doubled one of a rectifier, folded by the sampling as it falls."""
    rng = world.rng("mains-hum")
    mains_hz = rng.choice([50.0, 60.0]) + rng.uniform(-0.03, 0.03)
    return np.asarray(force + swing_n * np.sin(2.0 * np.pi * (mains_hz * world.time_s + rng.random())))


def clock_offset(time_s: Floats, late_s: float, _world: World) -> Floats:
    """The cell's clock is behind: what a row shows was felt earlier."""
    return np.asarray(time_s - late_s)


def clock_skew(time_s: Floats, share: float, _world: World) -> Floats:
    """The cell's clock is slow: it is further behind with every second."""
    return np.asarray(time_s * (1.0 - share))


def repeated(force: Floats, share: float, world: World) -> Floats:
    """Now and then the line is silent for 1 .. 8 rows, and the logger writes the last reading again."""
    rng = world.rng("repeated-samples")
    lucky, length = rng.random(force.size), rng.integers(1, 9, force.size)
    silent = np.zeros(force.size, dtype=bool)
    for start in np.flatnonzero(lucky < share / 4.5):
        silent[start : start + length[start]] = True
    silent[0] = False
    last = np.maximum.accumulate(np.where(silent, 0, np.arange(force.size)))
    return np.asarray(force[last])


def outliers(force: Floats, size_n: float, world: World) -> Floats:
    """One row in some hundred is wrong by much, up or down."""
    rng = world.rng("outliers")
    share = rng.uniform(0.003, 0.01)
    hit = rng.random(force.size) < share
    return np.asarray(force + hit * size_n * rng.choice([-1.0, 1.0], force.size) * rng.uniform(0.6, 1.4, force.size))


def quantised(force: Floats, step_n: float, _world: World) -> Floats:
    return np.asarray(np.round(force / step_n) * step_n) if step_n > 0.0 else force


def crosstalk(force: Floats, n_per_v: float, world: World) -> Floats:
    """The valve's line lies beside the cell's: the voltage that holds when the cell is read comes through at once."""
    volts = np.concatenate([world.command_v[:1], world.command_v[:-1]])
    return np.asarray(force + n_per_v * volts)


def sign_lost(force: Floats, zero_n: float, _world: World) -> Floats:
    """A zero that sits too low, and an amplifier that sends no sign."""
    return np.asarray(np.abs(force - zero_n))


EFFECTS = (
    Effect("thermal-zero-drift", "cell", zero_drift, 0.05, "N/K", needs=("temperature_c",)),
    Effect("thermal-span-drift", "cell", span_drift, 0.003, "1/K", needs=("temperature_c",)),
    Effect("warm-up", "cell", warm_up, 0.5, "N"),
    Effect("linear-drift", "cell", linear_drift, 0.3, "N/min"),
    Effect("sensor-quadratic", "cell", quadratic, 1.0, "N"),
    Effect("sensor-cubic", "cell", cubic, 1.0, "N"),
    Effect("mains-hum", "cell", mains_hum, 0.2, "N"),
    Effect("clock-offset", "clock", clock_offset, 0.01, "s"),
    Effect("clock-skew", "clock", clock_skew, 3.0e-4, "s/s"),
    Effect("repeated-samples", "reading", repeated, 0.05, "share", most=0.6),
    Effect("outliers", "reading", outliers, 2.0, "N"),
    Effect("sensor-quantisation", "reading", quantised, 0.3, "N"),
    Effect("valve-crosstalk", "cell", crosstalk, 0.2, "N/V"),
    Effect("sign-loss", "reading", sign_lost, 2.5, "N", most=12.0),
)
