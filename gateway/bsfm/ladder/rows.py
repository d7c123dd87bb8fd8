"""The rows of a ladder's table, before anything is made of them: which columns, which rows, which unit.

Refused or repaired, each with a sentence. What can be known from the table alone is repaired (rows that are no reading, a
unit that is written down); what would have to be guessed is refused with the way out.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.bsfm.fit.projected_problem import Floats
from gateway.bsfm.ladder.ladder_error import LadderError, LadderFlaw
from gateway.robust import LARGEST_VALUE
from gateway.units import NEWTON_PER_UNIT

FORCE_UNITS: Final = {unit.lower(): factor for unit, factor in NEWTON_PER_UNIT.items()} | {
    "kgf": NEWTON_PER_UNIT["kg"],
    "gf": NEWTON_PER_UNIT["g"],
    "lbf": NEWTON_PER_UNIT["lb"],
}
"""Newtons in one unit, by lower-case name."""
FEWEST_ROWS: Final = 12  # four stairs each way, three times nothing
LARGEST_BAD_SHARE: Final = 0.2
OVERLOADED: Final = 1.5  # quality 2 is an overload, 1 an unsteady reading
LARGEST_COMMAND_V: Final = 10.5
REGULAR_SHARE: Final = 0.5  # values seen before, as those of a staircase are
NO_COMMAND_V: Final = 50.0  # here and there, that stands for no value (-9999, 32767); in many rows it is another unit
FAR: Final = 5.0  # times the largest force that a command usually makes
FAR_SHARE: Final = 0.2  # of the rows of one command: more of them are the force of that command


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Finite rows in order of time; force in N. unit_known: the table says its unit; row: number in the table."""

    time_s: Floats
    command_v: Floats
    force_n: Floats
    pressure_kpa: Floats | None
    row: NDArray[np.int64]
    unit_known: bool
    notes: tuple[str, ...]


def usable_rows(columns: Mapping[str, Floats], facts: Mapping[str, object], force_unit: str | None = None) -> Rows:
    """Return the rows that can be used. force_unit: what the caller says the force is in. LadderError where there are none."""
    force_name, factor, unit_known, notes = _force_column(columns, facts, force_unit)
    missing = [name for name in ("time_s", "command_v") if name not in columns]
    if missing:
        raise LadderError(
            LadderFlaw.COLUMNS,
            f"no column {' and '.join(missing)}: a ladder has time_s, command_v and force_n; {_there(columns)}",
        )
    time_s, command_v, force = (columns[name] for name in ("time_s", "command_v", force_name))
    if len(time_s) < FEWEST_ROWS:
        raise LadderError(
            LadderFlaw.TOO_SHORT,
            f"{len(time_s)} rows: a ladder goes up and down in stairs, {FEWEST_ROWS} rows are the least",
        )
    keep, dropped = _select_rows(columns, time_s, command_v, force)
    pressure = columns.get("pressure_kpa")
    rows = Rows(
        time_s[keep],
        command_v[keep],
        force[keep] * factor,
        None if pressure is None else pressure[keep],
        np.flatnonzero(keep).astype(np.int64),
        unit_known,
        (*notes, *dropped),
    )
    _check_roles(rows)
    return rows


def _there(columns: Mapping[str, Floats]) -> str:
    return f"there: {', '.join(columns)}"


def _force_column(
    columns: Mapping[str, Floats], facts: Mapping[str, object], force_unit: str | None
) -> tuple[str, float, bool, list[str]]:
    """Name of the force's column, factor to newton, whether the unit is written down, and what to say about it."""
    names = [
        name for name in columns if name.startswith("force_") and name.removeprefix("force_").lower() in FORCE_UNITS
    ]
    if not names:
        raise LadderError(
            LadderFlaw.COLUMNS, f"no column force_n (or force_kgf, force_g, force_lbf); {_there(columns)}"
        )
    name = "force_n" if "force_n" in names else names[0]
    written = force_unit or facts.get("force_unit") or (None if name == "force_n" else name.removeprefix("force_"))
    if written is None:
        return name, 1.0, False, []
    unit = str(written).strip()
    if unit.lower() not in FORCE_UNITS:
        raise LadderError(LadderFlaw.UNIT, f"force unit {unit!r} is none of {', '.join(FORCE_UNITS)}")
    factor = FORCE_UNITS[unit.lower()]
    notes = [] if factor == 1.0 else [f"forces are in {unit} and were turned into newtons (1 {unit} = {factor:.5g} N)"]
    return name, factor, True, notes


def _select_rows(
    columns: Mapping[str, Floats], time_s: Floats, command_v: Floats, force: Floats
) -> tuple[NDArray[np.bool_], list[str]]:
    """Which rows are readings, and a sentence for each kind that is not."""
    finite = np.isfinite(time_s) & np.isfinite(command_v) & (np.abs(force) <= LARGEST_VALUE)
    latest = np.maximum.accumulate(np.where(finite, time_s, -np.inf))
    forward = np.append(True, time_s[1:] > latest[:-1])
    overloaded = columns["quality"] >= OVERLOADED if "quality" in columns else np.zeros(len(finite), dtype=bool)
    no_command = finite & (np.abs(command_v) > NO_COMMAND_V)
    no_command &= bool(no_command.mean() <= LARGEST_BAD_SHARE)
    no_force = _far_forces(command_v, force, finite & ~no_command)
    notes = []
    for bad, what in (
        (~finite, "without a usable number in time, command or force"),
        (no_command, f"with a command beyond {NO_COMMAND_V:g} V, as a logger writes for no value"),
        (no_force, "with a force far beyond all others at the same command, as a logger writes for no value"),
        (finite & overloaded, "with the load cell overloaded or another bad quality"),
        (finite & ~overloaded & ~forward, "whose time does not advance (repeated or out of order)"),
    ):
        if bad.any():
            first = int(np.flatnonzero(bad)[0]) + 1
            notes.append(f"{int(bad.sum())} of {len(bad)} rows {what}, the first is data row {first}: left out")
    keep = finite & forward & ~overloaded & ~no_command & ~no_force
    if (~finite).mean() > LARGEST_BAD_SHARE:
        raise LadderError(
            LadderFlaw.NOT_FINITE, f"{notes[0].removesuffix(': left out')}: too many to guess around; record again"
        )
    if int(keep.sum()) < FEWEST_ROWS:
        raise LadderError(LadderFlaw.TOO_SHORT, f"{int(keep.sum())} usable rows are left: {'; '.join(notes)}")
    return keep, notes


def _far_forces(command_v: Floats, force: Floats, known: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which forces are none: one such reading in a stair's mean was told as a cell in kgf, or with its sign inverted."""
    far = np.zeros(len(force), dtype=bool)
    if not known.any():
        return far
    commands, of, count = np.unique(np.round(command_v[known], 3), return_inverse=True, return_counts=True)
    order = np.lexsort((force[known], of))
    usual = force[known][order[np.cumsum(count) - count + count // 2]]  # the median at each command
    far[known] = np.abs(force[known]) > FAR * np.abs(usual).max()
    share = np.bincount(of, weights=far[known], minlength=len(commands)) / count
    far[known] &= share[of] < FAR_SHARE
    return far


def _check_roles(rows: Rows) -> None:
    """Command and force swapped, or nothing moving."""
    low_v, high_v = float(rows.command_v.min()), float(rows.command_v.max())
    if _look_swapped(rows.command_v, rows.force_n):
        raise LadderError(
            LadderFlaw.SWAPPED,
            f"command_v ({low_v:.3g} .. {high_v:.3g}) looks like a force and force_n ({rows.force_n.min():.3g} .. "
            f"{rows.force_n.max():.3g}) like the stairs of a command: columns swapped; change the two names in the header",
        )
    if high_v - low_v < 0.1:
        raise LadderError(
            LadderFlaw.COMMAND_CONSTANT,
            f"command_v stays within {low_v:.3f} .. {high_v:.3f} V: nothing was tried, so nothing can be fitted",
        )
    if high_v > LARGEST_COMMAND_V or low_v < -0.5:
        raise LadderError(
            LadderFlaw.COLUMNS,
            f"command_v runs from {low_v:.3g} to {high_v:.3g}: 0 .. 10 V is a command; millivolts, percent, or the force?",
        )


def _look_swapped(command: Floats, force: Floats) -> bool:
    """Stairs take few values and take them again; a measured force does not, and leaves the range of a command."""
    force_is_command = force.min() >= -0.5 and force.max() <= LARGEST_COMMAND_V
    command_is_not = command.max() > LARGEST_COMMAND_V or command.min() < -0.5
    regular, irregular = _repeat_share(force) > REGULAR_SHARE, _repeat_share(command) < 0.5 * REGULAR_SHARE
    return bool(
        force_is_command
        and ((command_is_not and _repeat_share(force) > _repeat_share(command)) or (regular and irregular))
    )


def _repeat_share(values: Floats) -> float:
    """Share of the values that were seen before."""
    return 1.0 - len(np.unique(np.round(values, 6))) / len(values)
