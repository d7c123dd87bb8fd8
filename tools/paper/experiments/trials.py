"""The closed-loop experiments as trials: which law meets which wish on which copy of the rig, all as lanes of one run."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from gateway.twin import Plant
from gateway.twin.experiment import Floats, settling_time_s
from paper.experiments.calibration import Calibrated, condition
from paper.experiments.closed_loop import NOTHING, Record, Surroundings, run
from paper.experiments.laws import law
from paper.experiments.rigs import rig_lanes


@dataclass(frozen=True, slots=True)
class Lane:
    """One lane of a trial. case: a number of the trial's own, such as the target's."""

    calibrated: Calibrated
    law: str
    case: int


@dataclass(frozen=True, slots=True)
class Trial:
    """A record with the meaning of its lanes: the axes are seed, case, law."""

    seeds: tuple[int, ...]
    cases: int
    laws: tuple[str, ...]
    record: Record

    def of(self, name: str, seed_at: int = 0, case: int = 0) -> Record:
        """Return one lane, as a record with one column."""
        return self.record.lanes([(seed_at * self.cases + case) * len(self.laws) + self.laws.index(name)])

    def score(self, measure: Callable[[Floats, Floats], Floats], name: str) -> Floats:
        """Apply `measure(force_n, desired_n)` to each lane of a law, every millisecond: (seeds, cases, ...)."""
        desired_n = np.repeat(self.record.desired_n, 10, axis=0)
        lanes = range(self.laws.index(name), desired_n.shape[1], len(self.laws))
        values = np.array([measure(self.record.force_n[:, lane], desired_n[:, lane]) for lane in lanes])
        return values.reshape(len(self.seeds), self.cases, *values.shape[1:])


@dataclass(frozen=True, slots=True)
class TrialConditions:
    """How a trial differs from a plain run. part: which noise; conditioned: the friction remembers a full cycle, as on the
    ladder; changed: the plant here, by case; around: inputs from outside, given the lanes.
    """

    part: int
    conditioned: bool = True
    changed: Callable[[Plant, int], Plant] = lambda plant, case: plant
    around: Callable[[list[Lane]], Surroundings] = lambda lanes: NOTHING


def trial(
    copies: Sequence[Calibrated],
    laws: tuple[str, ...],
    wishes: Sequence[Callable[[int], Floats]],
    conditions: TrialConditions,
) -> Trial:
    """Run every law on every copy. wishes: one per case, seed -> desired force per tick."""
    lanes = [Lane(copy, name, case) for copy in copies for case in range(len(wishes)) for name in laws]
    plants = [conditions.changed(lane.calibrated.plant, lane.case) for lane in lanes]
    rig = rig_lanes(plants, [lane.calibrated.seed for lane in lanes], conditions.part)
    if conditions.conditioned:
        condition(rig.twin)
    desired_n = np.stack([wishes[lane.case](lane.calibrated.seed) for lane in lanes], axis=1)
    record = run(rig, [law(lane.law, lane.calibrated) for lane in lanes], desired_n, conditions.around(lanes))
    return Trial(tuple(copy.seed for copy in copies), len(wishes), laws, record)


def largest_n(force_n: Floats, desired_n: Floats) -> Floats:
    """Return the largest error, N."""
    return np.asarray(np.max(np.abs(force_n - desired_n)))


def rms_n(force_n: Floats, desired_n: Floats) -> Floats:
    """Return the RMS error, N."""
    return np.asarray(np.sqrt(np.mean((force_n - desired_n) ** 2)))


def settled_s(band_n: float) -> Callable[[Floats, Floats], Floats]:
    """Return the time to stay within the band, s; nan when it never does."""
    return lambda force_n, desired_n: np.asarray(settling_time_s(force_n, float(desired_n[0]), band_n))
