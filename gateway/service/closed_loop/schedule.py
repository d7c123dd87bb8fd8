"""What a master asks for in the closed loop, and what happens around the tool meanwhile; both drawn from a seed.

Steps up and down over 5..40 N, partial reversals, a slow ramp up and down. Tilt, temperature, feed and the rest move only
where the plant has an effect that feels them, so that the two runs of a pair meet the same world. Judged is the force from
SETTLED_S after each change on: before that no rig of this kind has arrived: its pressure
and its pad need some 0.5 s (README, "How well it holds").
"""

from dataclasses import dataclass
from math import floor, pi, sin
from typing import Final

from numpy.random import default_rng

from gateway.catalogue.all_effects import EFFECTS
from gateway.profiles.rigs.compensated_effects import differing_treatments
from gateway.twin import Plant, surroundings
from gateway.twin.surroundings import Surroundings

STEPS_N: Final = (5.0, 20.0, 40.0, 25.0, 10.0, 30.0, 15.0, 35.0)
REVERSALS: Final = 6
HOLD_S: Final = 1.2
SETTLED_S: Final = 0.6
RAMP_N_PER_S: Final = 2.0
RAMP_ENDS_N: Final = (14.0, 18.0)
QUIET_S: Final = 1.7  # until the first force is held nothing moves around the tool
EASING_S: Final = 1.0
LARGEST_N: Final = 40.0
"""Of the schedule; all forces shrink with it where a rig is smaller."""

WARMER_K: Final = 12.0
FEED_MM_S: Final = 10.0
TILTED_DEG: Final = 60.0
COLUMNS: Final = {
    effect.name: effect.columns[0]
    for effect in EFFECTS
    if len(effect.columns) == 1 and effect.columns[0] in surroundings.COLUMNS
}
"""What has to move around the tool for an effect to show, by its name: the one column that it depends on."""


@dataclass(frozen=True, slots=True)
class SetpointSegment:
    """From start_s on: from_n to to_n in even steps over hold_s (equal: a step, held)."""

    start_s: float
    hold_s: float
    from_n: float
    to_n: float

    @property
    def is_step(self) -> bool:
        """Decide whether the setpoint jumps and is held."""
        return self.from_n == self.to_n

    def force_n(self, time_s: float) -> float:
        """Return the commanded force at a time within the segment, N."""
        share = min(1.0, (time_s - self.start_s) / self.hold_s)
        return self.from_n + share * (self.to_n - self.from_n)


@dataclass(frozen=True, slots=True)
class ReferenceConditions:
    """Surroundings in which the plant's effects are nothing."""

    temperature_c: float
    tilt_deg: float
    supply_kpa: float


@dataclass(frozen=True, slots=True)
class SetpointSchedule:
    """One run. columns: what moves around the tool; phase: of its movement."""

    wishes: tuple[SetpointSegment, ...]
    columns: frozenset[str]
    phase: float
    reference: ReferenceConditions

    def around(self, time_s: float) -> Surroundings:
        """Return the surroundings at this time.
        The rig was tared at the reference temperature, where the tool's weight does not press; both move from there."""
        moving_s, columns, reference = max(0.0, time_s - QUIET_S), self.columns, self.reference
        turn, eased = 2.0 * pi * moving_s, min(1.0, moving_s / EASING_S)
        forth = 0.0 if moving_s == 0.0 else 1.0 if floor(moving_s / 2.5 + self.phase) % 2 else -1.0
        all_known = {
            "tilt_deg": reference.tilt_deg + eased * TILTED_DEG * sin(turn / 9.0 + self.phase),
            "temperature_c": reference.temperature_c + WARMER_K * min(1.0, time_s / 12.0),
            "feed_mm_s": FEED_MM_S * forth * (0.5 if sin(turn / 7.0) > 0.0 else 1.0),
            "supply_kpa": reference.supply_kpa + eased * 60.0 * sin(turn / 8.0 + self.phase),
            "spindle_rpm": 3900.0,
            "position_mm": eased * 30.0 * sin(turn / 10.0 + self.phase),
            "distance_m": 0.01 * time_s,
        }
        return Surroundings(**{name: value for name, value in all_known.items() if name in columns})


def columns_of(base: Plant, extended: Plant) -> frozenset[str]:
    """Return what has to move so that the extension is felt."""
    names = {treatment.name for treatment in differing_treatments(base, extended)}
    columns = {column for name, column in COLUMNS.items() if name in names}
    friction, before = extended.friction, base.friction
    for field, column in (
        ("side_load_n_s_per_mm", "feed_mm_s"),
        ("side_load_n_per_n", "feed_mm_s"),
        ("side_load_tilt_n", "tilt_deg"),
        ("side_load_n_per_mm", "position_mm"),
    ):
        if getattr(friction, field) != getattr(before, field):
            columns.add(column)
    return frozenset(columns)


def draw_schedule(base: Plant, extended: Plant, seed: int, force_max_n: float) -> SetpointSchedule:
    """Return the wishes of a seed. force_max_n: the largest that rig and model allow."""
    rng = default_rng([seed, 11])
    scale = min(1.0, force_max_n / LARGEST_N)
    partial = rng.uniform(8.0, 38.0, REVERSALS).tolist()
    wishes: list[SetpointSegment] = []
    for force_n in (*STEPS_N, *partial):
        wishes.append(SetpointSegment(_end_s(wishes), HOLD_S, scale * force_n, scale * force_n))
    low_n, high_n = (scale * end_n for end_n in RAMP_ENDS_N)
    wishes.append(SetpointSegment(_end_s(wishes), HOLD_S, low_n, low_n))
    for from_n, to_n in ((low_n, high_n), (high_n, low_n)):
        wishes.append(SetpointSegment(_end_s(wishes), abs(to_n - from_n) / RAMP_N_PER_S, from_n, to_n))
    phase = float(rng.uniform(0.0, 2.0 * pi))
    reference = ReferenceConditions(
        temperature_c=extended.cell.reference_c,
        tilt_deg=extended.contact.tilt_zero_deg + 90.0,
        supply_kpa=extended.regulator.droop_reference_pa * 1.0e-3,
    )
    return SetpointSchedule(tuple(wishes), columns_of(base, extended), phase, reference)


def _end_s(wishes: list[SetpointSegment]) -> float:
    return wishes[-1].start_s + wishes[-1].hold_s if wishes else 0.5
