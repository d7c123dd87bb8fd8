"""Copies of the paper's rig side by side, as lanes: each a twin with its own small deviations and its own noise.

Seed 0 is the shipped plant itself. Every other seed is another copy: friction, presliding, pad and lags differ by 10 %
(one standard deviation), the machined bore by 0.3 %. Assumed: nobody has measured ten such slides. Without a spread, an
interval over seeds would only tell how much noise the load cell has.

The noise of a lane comes from a stream of its own, added to a quiet twin, so that lanes may share it whatever drives them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.random import Generator, default_rng

from gateway.profiles import load_plant
from gateway.twin import Plant, Twin
from gateway.twin.experiment import Floats
from gateway.twin.plant import with_value

SPREAD: Final = {
    ("friction", "coulomb_n"): 0.1,
    ("friction", "load_dependent_n_per_n"): 0.1,
    ("friction", "viscous_n_s_per_m"): 0.1,
    ("friction", "presliding_m"): 0.1,
    ("contact", "pad_stiffness_n_per_m"): 0.1,
    ("regulator", "lag_s"): 0.1,
    ("regulator", "second_lag_s"): 0.1,
    ("regulator", "hysteresis_pa"): 0.1,
    ("cylinder", "area_m2"): 0.003,
}
DRIFT: Final = {
    ("friction", "coulomb_n"): 1.25,
    ("friction", "load_dependent_n_per_n"): 1.25,
    ("cylinder", "area_m2"): 0.985,
}
"""What months do to a rig that was calibrated when new: dry seals, and a supply gauge 1.5 % off. Assumed."""
LIFTED_M: Final = 5.0e-4  # the pad before a step from no load


def paper_plant() -> Plant:
    """Return the shipped plant of the paper's rig."""
    return load_plant("paper-slide").plant


def copy_of(seed: int) -> Plant:
    """Return the copy of the paper's rig with this seed; 0 is the rig itself."""
    plant, rng = paper_plant(), default_rng([seed, 1])
    for (section, name), spread in SPREAD.items() if seed else ():
        value = getattr(getattr(plant, section), name)
        plant = with_value(plant, section, name, value * float(np.exp(spread * rng.standard_normal())))
    return plant


def drift_months(plant: Plant) -> Plant:
    """Return the same rig, months later."""
    for (section, name), factor in DRIFT.items():
        plant = with_value(plant, section, name, getattr(getattr(plant, section), name) * factor)
    return plant


def lift_pad(plant: Plant) -> Plant:
    """Return the same rig with the pad off the workpiece."""
    return with_value(plant, "contact", "gap_m", LIFTED_M)


class Twins:
    """Twins side by side: what one takes or gives as a float is here an array, (lanes,), or one float for all."""

    def __init__(self, plants: Sequence[Plant]) -> None:
        self._twins = [Twin(plant, 0) for plant in plants]

    def command(self, voltage_v: Floats) -> None:
        """Apply a command voltage, V."""
        for twin, own_v in self._each(voltage_v):
            twin.command(own_v)

    def set_surface(self, height_m: Floats | float) -> None:
        """Set the workpiece under the pad, m towards the tool."""
        for twin, own_m in self._each(height_m):
            twin.set_surface(own_m)

    def set_disturbance(self, force_n: Floats | float) -> None:
        """Set an outside force on the slide, N."""
        for twin, own_n in self._each(force_n):
            twin.set_disturbance(own_n)

    def advance(self, dt_s: float) -> None:
        """Let time pass."""
        for twin in self._twins:
            twin.advance(dt_s)

    def read(self) -> Floats:
        """Return a reading of each load cell, N."""
        return np.array([twin.read() for twin in self._twins])

    @property
    def force_n(self) -> Floats:
        """Return the true contact forces, N."""
        return np.array([twin.force_n for twin in self._twins])

    def _each(self, value: Floats | float) -> Iterator[tuple[Twin, float]]:
        return zip(self._twins, np.broadcast_to(value, len(self._twins)).tolist(), strict=True)


@dataclass(frozen=True, slots=True)
class RigLanes:
    """Quiet twins, one per lane, and the noise of each lane's cell."""

    twin: Twins
    noise_n: Floats  # standard deviation, (lanes,)
    streams: tuple[Generator, ...]

    def readings(self, count: int) -> Floats:
        """Draw noise of `count` readings of every cell, N: (count, lanes)."""
        columns = [stream.standard_normal(count) for stream in self.streams]
        return np.stack(columns, axis=1) * self.noise_n


def rig_lanes(plants: Sequence[Plant], seeds: Sequence[int], part: int) -> RigLanes:
    """Return one lane per plant. Lanes with the same seed and `part` (of the experiment) read the same noise, whatever
    drives them.
    """
    noise_n = np.array([plant.cell.noise_n for plant in plants])
    quiet = [with_value(plant, "cell", "noise_n", 0.0) for plant in plants]
    return RigLanes(Twins(quiet), noise_n, tuple(default_rng([seed, 2, part]) for seed in seeds))
