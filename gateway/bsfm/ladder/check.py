"""Is this a ladder that a calibration may be made from? Judged from the data, before any fit.

Each flaw is refused (LadderError) or repaired, with a sentence that says what was seen and why it matters; a repair goes
into `notes`. Refused is what would have to be guessed (a unit, a sign, a swapped column): a guess that is wrong presses
with ten times the force. Repaired is what the data themselves decide (rows without numbers, a group cut short, stairs on
which the cell was saturated).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.bsfm.fit.projected_problem import Floats
from gateway.bsfm.ladder.labels import Labels, LabelSplit, split_by_labels
from gateway.bsfm.ladder.ladder_error import LadderError, LadderFlaw
from gateway.bsfm.ladder.measured_ladder import FALLING, RISING, Ladder
from gateway.bsfm.ladder.rows import Rows, usable_rows
from gateway.bsfm.ladder.settled_points import Points, find_settled_points
from gateway.bsfm.ladder.sweeps import SweepSplit, split_by_sweeps
from gateway.bsfm.model import Bsfm
from gateway.units import STANDARD_GRAVITY_M_PER_S2

LEAST_FORCE_SPAN_N: Final = 1.0
KGF_SLACK: Final = 1.35  # plants of one kind differ by this much, not by 9.81
FAR_RATIO: Final = 2.0
CLIPPED_N: Final = 0.02  # stairs of a saturated cell agree to a count
FEWEST_CLIPPED: Final = 3
FEWEST_CLIPPED_RISING: Final = 2  # the top stair always is
BEYOND_CELL: Final = 1.1  # times its saturation: no cell reads so much
DIP_SHARE: Final = 0.02  # of the force range: a stair this far below an earlier one is no noise
NOISE_AT: Final = 5.0
NOISY_DIP: Final = 2.0  # times the noise of a reading: means of a few readings differ by that
UNSETTLED_SHARE: Final = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Expectation:
    """What is known beside the table. reference: a model of this rig to compare scale and sign with; named: by which name;
    area_mm2: of the cylinder, for tables with a pressure; rig: the one asked for, None for any; saturation_n: of the
    cell."""

    reference: Bsfm | None = None
    named: str = ""
    area_mm2: float | None = None
    rig: str | None = None
    saturation_n: float | None = None
    force_unit: str | None = None


NOTHING_KNOWN: Final = Expectation()


@dataclass(frozen=True, slots=True, eq=False)
class CheckedLadder:
    """What a fit may use. minor_v, minor_n: the walk of partial reversals, empty where there was none. noise_n: of one
    reading, nan where the table does not show it."""

    ladder: Ladder
    minor_v: Floats
    minor_n: Floats
    noise_n: float
    slope_n_per_v: float
    notes: tuple[str, ...]
    closed: bool = True  # the loop's top is in it, where both branches meet
    only_walk: bool = False  # its ladder is the coarse cycle of a resumed run to which only the reversal part was left


def check_ladder(
    columns: Mapping[str, Floats], facts: Mapping[str, object], expected: Expectation = NOTHING_KNOWN
) -> CheckedLadder:
    """Return the ladder in a table of the recording contract. LadderError with one sentence if it must not be fitted."""
    notes = _check_rig(facts, expected)
    rows = usable_rows(columns, facts, expected.force_unit)
    labels = Labels.of(columns)
    labels = labels.part(rows.row) if labels else None
    points = _points(rows, labels)
    slope_n_per_v = _slope(points)
    notes += [*rows.notes, *points.notes]
    _check_moves(points)
    _check_sign(slope_n_per_v)
    walk = split_by_labels(points, labels, by_check=_is_only_walk(facts)) if labels else split_by_sweeps(points)
    ladder = _whole_groups(walk)
    notes += [*walk.left_out, *_check_scale(rows, slope_n_per_v, expected)]
    ladder, clipped = _without_saturated(ladder, expected.saturation_n)
    notes += [*clipped, *_warn_of_unsettled(points)]
    _check_increasing(ladder, points.noise_n)
    return CheckedLadder(
        ladder,
        walk.minor_v,
        walk.minor_n,
        points.noise_n,
        slope_n_per_v,
        tuple(notes),
        not clipped,
        _is_only_walk(facts),
    )


def join_ladders(parts: Sequence[CheckedLadder]) -> CheckedLadder:
    """Return the groups of several recordings as one ladder; walk, noise and slope are the last one's."""
    ladders = [part.ladder for part in parts if not part.only_walk]
    if not ladders:
        sentence = "only the reversal part of a resumed run: the recordings with its groups must lie beside it"
        raise LadderError(LadderFlaw.CUT_SHORT, sentence)
    if len(parts) == 1:
        return parts[0]
    firsts = np.cumsum([0, *(int(ladder.group.max()) + 1 for ladder in ladders[:-1])])
    whole = Ladder(
        np.concatenate([ladder.voltage_v for ladder in ladders]),
        np.concatenate([ladder.force_n for ladder in ladders]),
        np.concatenate([ladder.direction for ladder in ladders]),
        np.concatenate([ladder.group + first for ladder, first in zip(ladders, firsts, strict=True)]),
    )
    closed = all(part.closed for part in parts)
    notes = tuple(dict.fromkeys(note for part in parts for note in part.notes))
    return replace(parts[-1], ladder=whole, notes=notes, closed=closed)


def _check_rig(facts: Mapping[str, object], expected: Expectation) -> list[str]:
    recorded = str(facts.get("rig", "")).strip()
    if expected.rig and recorded and recorded != expected.rig:
        raise LadderError(
            LadderFlaw.OTHER_RIG,
            f"recorded on rig {recorded}, asked for rig {expected.rig}: another cylinder makes another force from the same "
            f"voltage; give --rig {recorded} if that is the one meant",
        )
    return [] if recorded else ["the table does not say on which rig it was recorded (`# rig: NAME`)"]


def _is_only_walk(facts: Mapping[str, object]) -> bool:
    """By the plan in the recording's header: the group to go on from is beyond the last one."""
    plan = facts.get("ladder")
    return isinstance(plan, Mapping) and plan.get("first_group", 0) >= plan.get("groups", 1)


def _points(rows: Rows, labels: Labels | None) -> Points:
    try:
        return find_settled_points(rows.time_s, rows.command_v, rows.force_n, labels.stair if labels else None)
    except ValueError as error:
        raise LadderError(LadderFlaw.NO_STAIRS, str(error)) from error


def _slope(points: Points) -> float:
    away_v = points.voltage_v - points.voltage_v.mean()
    spread = float(away_v @ away_v)
    return float(away_v @ points.force_n) / spread if spread else 0.0


def _check_moves(points: Points) -> None:
    low_n, high_n = np.quantile(points.force_n, [0.05, 0.95])
    noise_n = points.noise_n if np.isfinite(points.noise_n) else 0.0
    if high_n - low_n < max(LEAST_FORCE_SPAN_N, NOISE_AT * noise_n):
        raise LadderError(
            LadderFlaw.FORCE_CONSTANT,
            f"force stays within {low_n:.2f} .. {high_n:.2f} N while the command runs over {points.voltage_v.min():.2f} .. "
            f"{points.voltage_v.max():.2f} V: no air, no contact, or a dead load cell",
        )


def _check_sign(slope_n_per_v: float) -> None:
    if slope_n_per_v < 0.0:
        raise LadderError(
            LadderFlaw.SIGN,
            f"A302 force falls by {-slope_n_per_v:.2f} N per volt: the cell's sign is inverted; set sign: -1 in the rig file "
            "(or swap the signal wires) and record again, or turn the sign of the column",
        )


def _whole_groups(walk: SweepSplit | LabelSplit) -> Ladder:
    if walk.ladder is not None:
        return walk.ladder
    if isinstance(walk, SweepSplit) and min(walk.rising, walk.falling) < 3:
        raise LadderError(
            LadderFlaw.ONE_DIRECTION,
            f"one direction only: {walk.rising} rising and {walk.falling} falling stairs; friction makes two branches, so a "
            "ladder goes up and comes down again",
        )
    raise LadderError(LadderFlaw.CUT_SHORT, f"no whole group: {'; '.join(walk.left_out) or 'no full way up and down'}")


def _check_scale(rows: Rows, slope_n_per_v: float, expected: Expectation) -> list[str]:
    """Against the plant where pressure was recorded, else against the reference model."""
    by_pressure = _pressure_ratio(rows, expected.area_mm2)
    if by_pressure is not None:
        return _judge_ratio(by_pressure, f"pressure on {expected.area_mm2:.0f} mm2 makes", rows.unit_known)
    if expected.reference is None:
        return []
    (low_v, high_v), (low_n, high_n) = expected.reference.voltage_range_v, expected.reference.force_range_n
    ratio = slope_n_per_v / ((high_n - low_n) / (high_v - low_v))
    return _judge_ratio(ratio, f"calibration {expected.named} has", rows.unit_known)


def _pressure_ratio(rows: Rows, area_mm2: float | None) -> float | None:
    """Measured slope of force against pressure over the plant's; None where there is nothing to tell."""
    if rows.pressure_kpa is None or area_mm2 is None:
        return None
    good = np.isfinite(rows.pressure_kpa)
    pressure_kpa = rows.pressure_kpa[good]
    if good.sum() < 10 or np.ptp(pressure_kpa) < 20.0:
        return None
    slope_n_per_kpa = float(np.polyfit(pressure_kpa, rows.force_n[good], 1)[0])
    return slope_n_per_kpa / (area_mm2 * 1.0e-3)


def _judge_ratio(ratio: float, against: str, unit_known: bool) -> list[str]:
    gravity = STANDARD_GRAVITY_M_PER_S2
    for factor, words, unit in ((1.0 / gravity, "a tenth", "kgf"), (gravity, "ten times", "N read as kgf")):
        if factor / KGF_SLACK <= ratio <= factor * KGF_SLACK and not unit_known:
            raise LadderError(
                LadderFlaw.UNIT,
                f"A303 the force is {words} of what {against} (factor {ratio:.3g}): this looks like {unit}, off by 9.81; name "
                "the unit (--force-unit kgf, or a column force_kgf), or say --force-unit N if it really is newtons",
            )
    if not 1.0 / FAR_RATIO <= ratio <= FAR_RATIO:
        return [f"the force is {ratio:.2g} times what {against}: another plant, or a wrong span?"]
    return []


def _without_saturated(ladder: Ladder, saturation_n: float | None) -> tuple[Ladder, list[str]]:
    """Stairs at which the force stands still at its highest value, in the way a saturated cell (or supply) does: on the way up,
    too. On the way down alone it is friction that holds."""
    top_n = float(ladder.force_n.max())
    level_n = top_n - CLIPPED_N if saturation_n is None else min(top_n - CLIPPED_N, 0.98 * saturation_n)
    clipped = ladder.force_n >= level_n
    apart, rising = (
        np.unique(np.round(ladder.voltage_v[each], 3)) for each in (clipped, clipped & (ladder.direction == RISING))
    )
    is_at_end = saturation_n is not None and top_n > 0.98 * saturation_n
    if len(apart) < FEWEST_CLIPPED or (len(rising) < FEWEST_CLIPPED_RISING and not is_at_end):
        return ladder, []
    clipped = ladder.voltage_v >= apart[0] - 1.0e-9  # the falling branch above that voltage starts from the clipped one
    note = _clipped_sentence(top_n, apart, saturation_n)
    ways = [int(((ladder.direction == way) & ~clipped).sum()) for way in (RISING, FALLING)]
    if clipped.mean() > 0.5 or min(ways) < 6:
        raise LadderError(
            LadderFlaw.SATURATED, f"{note}: too little is left to fit; lower --v-max or use a larger cell"
        )
    usable = ladder.part(~clipped)
    return usable, [f"{note}: these stairs are left out, the calibration ends at {usable.voltage_v.max():.2f} V"]


def _clipped_sentence(top_n: float, apart: Floats, saturation_n: float | None) -> str:
    """apart: voltages of these stairs. No cell gives more than it saturates at: such a force is none of this one's."""
    stairs = f"on {len(apart)} stairs from {apart[0]:.2f} V up"
    if saturation_n is not None and top_n > BEYOND_CELL * saturation_n:
        ends = f"the rig's load cell ends at {saturation_n:g} N"
        return f"force goes up to {top_n:.6g} N {stairs}, {ends}: another unit, zero or cell"
    return f"force stands at {top_n:.2f} N {stairs}: saturated load cell, or no more supply pressure"


def _warn_of_unsettled(points: Points) -> list[str]:
    if not np.isfinite(points.noise_n):
        return []
    limit_n = max(0.3, 4.0 * points.noise_n)
    moving = np.abs(points.drift_n) > limit_n
    if moving.mean() < UNSETTLED_SHARE:
        return []
    warning = (
        f"on {int(moving.sum())} of {len(points)} stairs the force still moved by more than {limit_n:.1f} N at the end: "
        "dwells too short, the branches look further apart than they are"
    )
    return [warning]


def _check_increasing(ladder: Ladder, noise_n: float) -> None:
    """A branch whose mean falls on the way up describes no inverse, whatever is fitted to it."""
    limit_n = max(0.5, DIP_SHARE * float(np.ptp(ladder.force_n)))
    for way, words in ((RISING, "up"), (FALLING, "down")):
        voltage_v, mean_n = _mean_by_stair(ladder, ladder.direction == way)
        highest_n = np.maximum.accumulate(mean_n)
        worst = int(np.argmax(highest_n - mean_n))
        dip_n = float(highest_n[worst] - mean_n[worst])
        if dip_n > limit_n:
            peak = int(np.argmax(mean_n[: worst + 1]))
            raise LadderError(
                LadderFlaw.NOT_INCREASING,
                f"on the way {words} {mean_n[peak]:.2f} N at {voltage_v[peak]:.2f} V but only {mean_n[worst]:.2f} N at "
                f"{voltage_v[worst]:.2f} V: a force that is not increasing with voltage has no inverse; "
                f"{_cause_of_dip(dip_n, noise_n)}",
            )


def _cause_of_dip(dip_n: float, noise_n: float) -> str:
    if dip_n < NOISY_DIP * noise_n:
        return f"single readings spread by {noise_n:.2f} N, which may hide the steps: longer stairs, more groups"
    return "slipping tool, contact or air lost on the way, leak, or a jam at one place"


def _mean_by_stair(ladder: Ladder, mask: NDArray[np.bool_]) -> tuple[Floats, Floats]:
    """Voltages and mean forces of one branch, by rising voltage."""
    voltages, index = np.unique(np.round(ladder.voltage_v[mask], 3), return_inverse=True)
    totals = np.bincount(index, weights=ladder.force_n[mask])
    return voltages, totals / np.bincount(index)
