"""The generator's own rig: command held between rows -> one lag -> pressure -> area -> friction on a pad -> cell.

Fine steps of 0.1 .. 0.25 ms; each row falls on a fine step, so that no rounding of times looks like a delay. Effects act
at the stage that they name. Nothing here is taken from gateway.twin.
"""

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from generator.friction import Extra, Friction, contact_force
from numpy.typing import NDArray
from scipy.signal import lfilter

Floats = NDArray[np.float64]
PA_PER_V = 0.9e6 / 10.0
STAGES = ("command", "setpoint", "pressure", "chamber", "friction", "contact", "clock", "cell", "reading")
BEFORE_CONTACT = STAGES[: STAGES.index("contact")]


@dataclass(frozen=True, slots=True)
class Effect:
    """One cause. act(value, amount, world) -> value, where value is what its stage handles:

    command: V per row; setpoint, pressure (what a gauge shows) and chamber: Pa per fine step;
    friction: (Friction, Extra); contact: N per fine step;
    clock: the times at which the force of each row is truly read, s; cell: N per row without noise; reading: with noise.
    start: an amount that is not absurd, in the effect's unit. needs: columns without which nobody could see it.
    """

    name: str
    stage: str
    act: Callable[[Any, float, "World"], Any]
    start: float
    unit: str
    needs: tuple[str, ...] = ()
    bristle: bool = False  # acts on a friction with a deflection only
    most: float = np.inf
    outside: bool = False


@dataclass(frozen=True, slots=True)
class Rig:
    """What a base model may refit (lag, area, offset, Coulomb), and the fine step."""

    lag_s: float
    area_m2: float
    offset_n: float
    friction: Friction
    dt_s: float


@dataclass(frozen=True)
class World:
    """A rig, its command and its columns; `step` is each row's fine step. The same seed gives each effect the same luck
    at any amount, or no amount could be searched for."""

    seed: int
    rig: Rig
    step: NDArray[np.int64]
    command_v: Floats
    columns: dict[str, Floats]
    noise_n: Floats
    kept: dict[str, Floats] = field(default_factory=dict)

    @cached_property
    def time_s(self) -> Floats:
        return np.asarray(np.round(self.step * self.rig.dt_s, 6))

    @cached_property
    def fine_s(self) -> Floats:
        return np.asarray(np.arange(int(self.step[-1]) + 1) * self.rig.dt_s)

    def rng(self, name: str) -> np.random.Generator:
        return np.random.default_rng([self.seed, zlib.crc32(name.encode())])

    def fine(self, name: str) -> Floats:
        """A column at the fine steps, straight lines between rows."""
        return np.interp(self.fine_s, self.time_s, self.columns[name])

    def held(self, per_row: Floats) -> Floats:
        """Each row's value from its step until the next row's."""
        return np.repeat(per_row, np.diff(self.step, append=self.step[-1] + 1))

    def lagged(self, fine: Floats, lag_s: float) -> Floats:
        """First-order lag from a state of 0; the state of a step does not know the input of that step."""
        keep = np.exp(-self.rig.dt_s / lag_s)
        return np.asarray(lfilter([0.0, 1.0 - keep], [1.0, -keep], fine))


Parts = Sequence[tuple[Effect, float]]


def acted(value: Any, stage: str, parts: Parts, world: World) -> Any:
    for effect, amount in parts:
        if effect.stage == stage:
            value = effect.act(value, amount, world)
    return value


def gauge_pressure(world: World, parts: Parts) -> Floats:
    """Pressure behind the regulator at each fine step, Pa: what a gauge shows."""
    volts = acted(world.command_v, "command", parts, world)
    setpoint = acted(world.held(volts) * PA_PER_V, "setpoint", parts, world)
    return np.asarray(acted(world.lagged(setpoint, world.rig.lag_s), "pressure", parts, world))


def drive_force(world: World, parts: Parts) -> Floats:
    """The chamber's pressure times area at each fine step, N."""
    return np.asarray(world.rig.area_m2 * acted(gauge_pressure(world, parts), "chamber", parts, world))


def pad_force(world: World, parts: Parts) -> Floats:
    """Contact force at each fine step; kept, where no effect acts before the contact."""
    upstream = [part for part in parts if part[0].stage in BEFORE_CONTACT]
    if not upstream and "pad" in world.kept:
        return world.kept["pad"]
    friction, extra = acted((world.rig.friction, Extra()), "friction", upstream, world)
    force = contact_force(drive_force(world, upstream), world.rig.dt_s, friction, extra)
    if not upstream:
        world.kept["pad"] = force
    return force


def clean_force(world: World, parts: Parts) -> Floats:
    """What a cell without noise would show in each row, N."""
    fine = acted(pad_force(world, parts), "contact", parts, world)
    at_s = acted(world.time_s, "clock", parts, world)
    rows = fine[world.step] if at_s is world.time_s else np.interp(at_s, world.fine_s, fine)
    return np.asarray(acted(rows + world.rig.offset_n, "cell", parts, world))


def readings(world: World, parts: Parts) -> Floats:
    """What the recording says, N."""
    return np.asarray(acted(clean_force(world, parts) + world.noise_n, "reading", parts, world))
