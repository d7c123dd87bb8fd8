"""One recording from one wish: rig, command, columns, noise and amounts are drawn from its seed and nothing else."""

import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from generator.catalogue import effect
from generator.covariates import COLUMNS, GAUGE, covariates
from generator.excitation import excitation
from generator.friction import Friction
from generator.noise import noise
from generator.plant import Effect, Parts, Rig, World, gauge_pressure, readings
from generator.sizing import LAG, UnreachableError, amount_for, sensitivities
from numpy.typing import NDArray

Floats = NDArray[np.float64]
ROW_S = 0.005
TRIES = 5


@dataclass(frozen=True, slots=True)
class Wish:
    """What to generate. None: drawn from the seed. effects: names, of the catalogue or outside it.

    size: RMS that each effect leaves after the base refit, in units of the noise. columns: exactly these covariates
    (ValueError when an effect needs another one). colour: white, lorentzian, resonance.
    """

    effects: tuple[str, ...] = ()
    size: float = 1.0
    seed: int = 0
    excitation: str = "rich"
    duration_s: float = 60.0
    noise_n: float | None = None
    colour: str | None = None
    jitter: bool | None = None
    columns: tuple[str, ...] | None = None
    family: str | None = None  # dahl, bristle, lugre or smooth


@dataclass(frozen=True, slots=True)
class Recording:
    """Columns of the contract in their order, and the truth about them, which no diagnosis may see."""

    wish: Wish
    time_s: Floats
    force_n: Floats
    command_v: Floats
    covariates: dict[str, Floats]
    amounts: dict[str, float]
    noise_n: float
    colour: str
    rig: Rig
    without: tuple[str, ...] = ()  # effects of the base model that are to be switched off

    @property
    def jitters(self) -> bool:
        return bool(np.ptp(np.diff(self.time_s)) > 1.0e-5)

    @property
    def name(self) -> str:
        what = "+".join(self.wish.effects) or "null"
        return f"{what}-{self.wish.excitation}-{self.wish.size:g}x-{self.wish.seed}"


def make(wish: Wish) -> Recording:
    """ValueError on unknown names or a missing column; UnreachableError where the size cannot be had."""
    effects = [effect(name) for name in wish.effects]
    rng = np.random.default_rng([wish.seed, zlib.crc32("+".join(wish.effects).encode())])
    columns_wanted = wanted_columns(rng, wish, effects)
    rig = drawn_rig(rng, wish, effects)
    step = drawn_steps(rng, wish, rig.dt_s)
    time_s = np.round(step * rig.dt_s, 6)
    level_n = float(rng.uniform(0.05, 0.2)) if wish.noise_n is None else wish.noise_n
    colour = wish.colour or str(rng.choice(["white", "lorentzian", "lorentzian", "resonance"]))
    world = World(
        seed=wish.seed,
        rig=rig,
        step=step,
        command_v=excitation(wish.excitation, rng, time_s),
        columns=covariates(rng, time_s, tuple(name for name in columns_wanted if name != GAUGE)),
        noise_n=level_n * noise(rng, time_s.size, 1.0 / ROW_S, colour),
    )
    without = tuple(name for name in wish.effects if name == "coulomb-friction")
    hidden = {*without, *(LAG for name in columns_wanted if name == GAUGE)}
    world, parts = sized(world, effects, wish.size * level_n, frozenset(hidden))
    gauges = {GAUGE: gauge_kpa(world, parts)} if GAUGE in columns_wanted else {}
    return Recording(
        wish=wish,
        time_s=time_s,
        force_n=np.round(readings(world, parts), 5),
        command_v=world.command_v,
        covariates=world.columns | gauges,
        amounts={one.name: amount for one, amount in parts},
        noise_n=level_n,
        colour=colour,
        rig=rig,
        without=without,
    )


def gauge_kpa(world: World, parts: Parts) -> Floats:
    """A transducer's readings, noise 0.3 kPa and steps of 0.1 kPa; each when the force is read."""
    noise_kpa = 0.3 * world.rng(GAUGE).standard_normal(world.step.size)
    return np.round(gauge_pressure(world, parts)[world.step] / 1.0e3 + noise_kpa, 1)


def sized(
    world: World, effects: Sequence[Effect], wanted_n: float, hidden: frozenset[str]
) -> tuple[World, list[tuple[Effect, float]]]:
    """Each effect alone leaves the wanted RMS. Where no amount does, because it jumps, with other luck for the effect."""
    base = sensitivities(world, hidden) if effects else np.empty((0, 0))
    for again in range(TRIES):
        lucky = replace(world, seed=world.seed + 1000 * again)
        try:
            return lucky, [(one, amount_for(one, wanted_n, lucky, base)) for one in effects]
        except UnreachableError:
            if again == TRIES - 1:
                raise
    raise AssertionError("TRIES is not positive")


def wanted_columns(rng: np.random.Generator, wish: Wish, effects: Sequence[Effect]) -> tuple[str, ...]:
    """Those that the effects need, and each other one by the toss of a coin."""
    needed = {name for one in effects for name in one.needs}
    if wish.columns is None:
        tossed = rng.random(len(COLUMNS)) < 0.45
        known = tuple(name for name, heads in zip(COLUMNS, tossed, strict=True) if heads or name in needed)
        return (*known, *(needed & {GAUGE}))
    if missing := needed - set(wish.columns):
        raise ValueError(f"{', '.join(wish.effects)} needs the column {', '.join(sorted(missing))}")
    return wish.columns


def drawn_steps(rng: np.random.Generator, wish: Wish, dt_s: float) -> NDArray[np.int64]:
    """Fine step of each row: 200 Hz, with jitter up to 1.5 ms either way."""
    count, each = round(wish.duration_s / ROW_S), round(ROW_S / dt_s)
    step = np.arange(count, dtype=np.int64) * each
    if (rng.random() < 0.4) if wish.jitter is None else wish.jitter:
        most = int(0.0015 / dt_s)
        step[1:] += rng.integers(-most, most + 1, count - 1)
    return step


def drawn_rig(rng: np.random.Generator, wish: Wish, effects: Sequence[Effect]) -> Rig:
    coulomb_n = 0.0 if "coulomb-friction" in wish.effects else float(rng.uniform(0.5, 2.0))
    families = ["dahl", "bristle", "lugre", "smooth"]
    family = wish.family or str(rng.choice(families[:3] if any(one.bristle for one in effects) else families))
    return Rig(
        lag_s=float(rng.uniform(0.03, 0.12)),
        area_m2=float(rng.uniform(85.0e-6, 110.0e-6)),
        offset_n=float(rng.uniform(-0.5, 0.5)),
        friction=drawn_friction(rng, family, coulomb_n),
        dt_s=float(rng.choice([0.125e-3, 0.25e-3, 0.25e-3])),
    )


def drawn_friction(rng: np.random.Generator, family: str, coulomb_n: float) -> Friction:
    """The bristles are 80 to 200 times stiffer than the pad: presliding of a few micrometres, far below the noise."""
    pad = float(rng.uniform(2.0e4, 8.0e4))
    stiff = pad * float(rng.uniform(80.0, 200.0))
    damping = float(rng.uniform(20.0, 80.0)) if family == "lugre" else 0.0
    shape = float(rng.uniform(0.6, 1.6)) if family == "bristle" else 1.0
    kind = "smooth" if family == "smooth" else "bristle"
    return Friction(kind, pad, coulomb_n, coulomb_n, stiff, damping, shape)


def lines(recording: Recording) -> Iterator[str]:
    """CSV of the contract; not a word about the truth."""
    yield f"# description: recording {recording.wish.seed}"
    names = ["time_s", "command_v", "force_n", *recording.covariates]
    yield ",".join(names)
    arrays = [recording.time_s, recording.command_v, recording.force_n, *recording.covariates.values()]
    for row in zip(*(array.tolist() for array in arrays), strict=True):
        yield ",".join(f"{value:.10g}" for value in row)


def write_csv(recording: Recording, folder: Path) -> Path:
    """One file, named by its truth so that a person can find it."""
    file = folder / f"{recording.name}.csv"
    file.write_text("\n".join(lines(recording)) + "\n", encoding="utf-8")
    return file
