"""Causes that are not in the catalogue: a diagnosis must describe them and not give them a wrong name."""

from dataclasses import replace

import numpy as np
from generator.effects_sensing import warmth
from generator.friction import Extra, Friction
from generator.plant import Effect, World
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def swing(world: World, name: str) -> Floats:
    values = world.columns[name] - world.columns[name].mean()
    return np.asarray(values / max(values.std(), 1e-9))


def humid(force: Floats, per_one_n: float, world: World) -> Floats:
    return np.asarray(force + per_one_n * swing(world, "humidity_pct"))


def humid_span(force: Floats, share: float, world: World) -> Floats:
    return np.asarray(force * (1.0 + share * swing(world, "humidity_pct")))


def after_column(force: Floats, per_one_n: float, world: World) -> Floats:
    """Depends on a column of some name, by its square."""
    return np.asarray(force + per_one_n * swing(world, "aux_1") ** 2)


def gain_jump(force: Floats, share: float, world: World) -> Floats:
    return np.asarray(force * np.where(world.time_s < moment(world, "gain-jump"), 1.0, 1.0 + share))


def offset_step(force: Floats, step_n: float, world: World) -> Floats:
    return np.asarray(force + step_n * (world.time_s >= moment(world, "offset-step")))


def moment(world: World, name: str) -> float:
    return float(world.rng(name).uniform(0.25, 0.75) * world.time_s[-1])


def wandering_zero(force: Floats, size_n: float, world: World) -> Floats:
    walk = np.cumsum(world.rng("random-walk-zero").standard_normal(force.size))
    return np.asarray(force + size_n * (walk - walk.mean()) / walk.std())


def neighbour(force: Floats, swing_n: float, world: World) -> Floats:
    """A machine next door at 7.3 Hz that stops halfway."""
    runs = world.time_s < moment(world, "neighbour-line")
    return np.asarray(force + swing_n * runs * np.sin(2.0 * np.pi * 7.3 * world.time_s))


def chirping(force: Floats, swing_n: float, world: World) -> Floats:
    """A pump that runs down from 14 to 4 Hz."""
    share = world.time_s / world.time_s[-1]
    return np.asarray(force + swing_n * np.sin(2.0 * np.pi * (14.0 * share - 5.0 * share**2) * world.time_s[-1]))


def heat_squared(force: Floats, per_k2: float, world: World) -> Floats:
    return np.asarray(force + per_k2 * warmth(world) ** 2)


def clockwork_friction(both: tuple[Friction, Extra], share: float, world: World) -> tuple[Friction, Extra]:
    """Friction that swells and shrinks with the time of day (here: in tens of seconds)."""
    rng = world.rng("friction-by-time")
    wave = np.sin(2.0 * np.pi * (world.fine_s / rng.uniform(20.0, 45.0) + rng.random()))
    return both[0], replace(both[1], factor=np.maximum(1.0 + share * wave, 0.0))


def knocked(force: Floats, size_n: float, world: World) -> Floats:
    """Somebody leans against the bench, a dozen times."""
    rng = world.rng("knocks")
    knocks = np.zeros_like(force)
    for start_s in rng.uniform(0.0, world.time_s[-1], 12):
        since = np.maximum(world.time_s - start_s, 0.0)
        knocks += rng.uniform(0.5, 1.5) * (since > 0.0) * np.exp(-since / 0.3) * np.cos(2.0 * np.pi * 5.0 * since)
    return np.asarray(force + size_n * knocks)


def late_column(force: Floats, per_one_n: float, world: World) -> Floats:
    """A column's effect through a lag of four seconds."""
    values = world.fine("air_flow_l_min")
    late = world.lagged(values - values[0], 4.0)[world.step]
    late = (late - late.mean()) / max(late.std(), 1e-9)
    return np.asarray(force + per_one_n * late)


def of_two(force: Floats, per_one_n: float, world: World) -> Floats:
    """The product of two columns, neither of which matters alone."""
    return np.asarray(force + per_one_n * swing(world, "humidity_pct") * swing(world, "current_a"))


EFFECTS = (
    Effect("humidity-zero", "cell", humid, 0.1, "N", needs=("humidity_pct",), outside=True),
    Effect("humidity-span", "cell", humid_span, 0.005, "1", needs=("humidity_pct",), outside=True),
    Effect("unknown-column-squared", "cell", after_column, 0.1, "N", needs=("aux_1",), outside=True),
    Effect("gain-jump", "cell", gain_jump, 0.01, "1", outside=True),
    Effect("offset-step", "cell", offset_step, 0.3, "N", outside=True),
    Effect("random-walk-zero", "cell", wandering_zero, 0.2, "N", outside=True),
    Effect("neighbour-line", "cell", neighbour, 0.3, "N", outside=True),
    Effect("running-down-pump", "cell", chirping, 0.2, "N", outside=True),
    Effect("temperature-squared", "cell", heat_squared, 0.02, "N/K^2", needs=("temperature_c",), outside=True),
    Effect("friction-by-time", "friction", clockwork_friction, 0.3, "1", outside=True, most=3.0),
    Effect("knocks", "cell", knocked, 0.5, "N", outside=True),
    Effect("late-column", "cell", late_column, 0.1, "N", needs=("air_flow_l_min",), outside=True),
    Effect("product-of-columns", "cell", of_two, 0.1, "N", needs=("humidity_pct", "current_a"), outside=True),
)
