"""Runs laws on rigs: every lane has its own plant, law and noise; force every millisecond, law and cell every ten."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.progress import advance
from gateway.twin.experiment import Floats
from paper.experiments.laws import OFF_TICKS, TICK_S, Law
from paper.experiments.rigs import RigLanes

STEP_S: Final = 1.0e-3
_TOLD_TICKS: Final = 50  # between two words on how far it is
STEPS: Final = round(TICK_S / STEP_S)
LEAD_IN_S: Final = (OFF_TICKS + 10) * TICK_S  # nothing is wanted yet; laws that listen to the cell wake up


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What acts on the rig from outside. Inputs from outside at a time, (lanes,) or one float for all: surface height m,
    force on the slide N.
    """

    height_m: Callable[[float], Floats] | None = None
    force_n: Callable[[float], Floats] | None = None


NOTHING: Final = Surroundings()


@dataclass(frozen=True, slots=True)
class Record:
    """What a run was and did. desired_n, measured_n, command_v: (ticks, lanes); force_n: the true contact force, (ticks x
    10, lanes).
    """

    desired_n: Floats
    measured_n: Floats
    command_v: Floats
    force_n: Floats

    @property
    def tick_s(self) -> Floats:
        """Time of each tick, s."""
        return np.arange(len(self.desired_n)) * TICK_S

    @property
    def step_s(self) -> Floats:
        """End of each step, s."""
        return (np.arange(len(self.force_n)) + 1) * STEP_S

    @property
    def error_n(self) -> Floats:
        """True force minus wanted force, every millisecond: (steps, lanes)."""
        return np.asarray(self.force_n - np.repeat(self.desired_n, STEPS, axis=0))

    def lanes(self, chosen: Sequence[int] | Floats) -> "Record":
        """Return the record of some lanes."""
        index = np.asarray(chosen)
        return Record(*(getattr(self, name)[:, index] for name in ("desired_n", "measured_n", "command_v", "force_n")))


def run(rig: RigLanes, laws: Sequence[Law], desired_n: Floats, around: Surroundings = NOTHING) -> Record:
    """Run every lane's law on its rig. desired_n: (ticks, lanes), after a lead-in of nothing, which the record leaves out."""
    idle = round(LEAD_IN_S / TICK_S)
    wanted = np.concatenate([np.zeros((idle, len(laws))), desired_n])
    noise = rig.readings(len(wanted))
    measured, command, force = np.zeros_like(wanted), np.zeros_like(wanted), np.zeros((len(wanted) * STEPS, len(laws)))
    for tick, row in enumerate(wanted):
        if tick % _TOLD_TICKS == 0:
            advance(tick, len(wanted))
        measured[tick] = rig.twin.read() + noise[tick]
        wishes_and_readings = zip(laws, row.tolist(), measured[tick].tolist(), strict=True)
        command[tick] = [law.command_v(want, measured_n) for law, want, measured_n in wishes_and_readings]
        rig.twin.command(command[tick])
        for step in range(tick * STEPS, (tick + 1) * STEPS):
            _surround(rig, around, step * STEP_S - LEAD_IN_S)
            rig.twin.advance(STEP_S)
            force[step] = rig.twin.force_n
    return Record(desired_n, measured[idle:], command[idle:], force[idle * STEPS :])


def _surround(rig: RigLanes, around: Surroundings, time_s: float) -> None:
    if around.height_m is not None:
        rig.twin.set_surface(around.height_m(time_s))
    if around.force_n is not None:
        rig.twin.set_disturbance(around.force_n(time_s))
