"""`diagnose --before A --after B`: what a change has gained in commanded force, from two real runs.

A reading that was straightened by the plant in use is not the reading of before. So both runs are compared as the plant of
the one and as the plant of the other has the cell; where the two answers differ, only another cell could tell.
"""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Any, Final

from gateway.cli.errors import CliError
from gateway.cli.recordings.named_recording import recording_path
from gateway.control.compensation.cell_map import CellMap
from gateway.diagnosis.force_error import ForceChange, GainVerdict, compare_runs
from gateway.plants.recorded_force import RecordedForce, read_recorded_force
from gateway.processes import exit_codes
from gateway.recording import read_table
from gateway.recording.tables.mapping_file import column_mapping

_ANOTHER_CELL: Final = (
    "with the cell as the other plant has it the answer is another one: only a second load cell can tell"
)


@dataclass(frozen=True, slots=True)
class BeforeAfter:
    """The comparison of two runs: of all rows, of held forces alone, and of the ways between them."""

    before: RecordedForce
    after: RecordedForce
    whole: ForceChange
    held: ForceChange
    moving: ForceChange


def read_run(name: str, *, rig: str | None, columns: str | None, state: Path | None) -> RecordedForce:
    """Read one run, by number or file. CliError (65) where nobody knows what was asked in it."""
    path = recording_path(name, rig, state)
    try:
        return read_recorded_force(read_table(path, column_mapping(columns)))
    except ValueError as error:
        why = f"{path}: {error}; force-gateway record writes setpoint_n: the force that the master asked for"
        raise CliError(f"E403 {why}", exit_codes.DATA) from None


def compare_before_after(before: RecordedForce, after: RecordedForce) -> BeforeAfter:
    """Return what the later run gained. `cannot be told` where it depends on which plant is right about the cell."""
    views = [_compare_through(before, after, cell) for cell in dict.fromkeys((after.cell, before.cell))]
    whole, held, moving = (_agreed([getattr(view, part) for view in views]) for part in ("whole", "held", "moving"))
    return replace(views[0], whole=whole, held=held, moving=moving)


def _agreed(views: Sequence[ForceChange]) -> ForceChange:
    """What one cell makes of a part; `cannot be told` where another cell makes something else of it."""
    if len({view.verdict for view in views}) == 1:
        return views[0]
    return replace(views[0], verdict=GainVerdict.UNKNOWN, why=_ANOTHER_CELL)


def _compare_through(before: RecordedForce, after: RecordedForce, cell: CellMap | None) -> BeforeAfter:
    runs = (before.blocks(cell), after.blocks(cell))
    held, moving = ([[b for b in run if b.settled is settled] for run in runs] for settled in (True, False))
    return BeforeAfter(before, after, compare_runs(*runs), compare_runs(*held), compare_runs(*moving))


def document(found: BeforeAfter) -> dict[str, Any]:
    """Return the comparison as JSON has it (format 1); numbers that are not known are null."""
    runs = {
        when: {"recording": run.name, "plant": run.plant}
        for when, run in (("before", found.before), ("after", found.after))
    }
    parts = {"force_error": found.whole, "held": found.held, "moving": found.moving}
    return {"format": 1, **runs, "verdict": found.whole.verdict.value} | {
        name: _facts(part) for name, part in parts.items()
    }


def _facts(change: ForceChange) -> dict[str, Any]:
    return {name: _known_or_none(value) for name, value in asdict(change).items()}


def _known_or_none(value: Any) -> Any:
    if isinstance(value, tuple):
        known = [_known_or_none(each) for each in value]
        return None if None in known else known
    return None if isinstance(value, float) and not isfinite(value) else value


def answer_sentence(found: BeforeAfter) -> str:
    """Return the answer, for terminal and page."""
    whole = found.whole
    if whole.verdict is GainVerdict.UNKNOWN:
        return f"Whether the force is held better cannot be told: {whole.why}"
    low, high = whole.gain_ci95
    word, sign = ("gained", 1.0) if whole.verdict is GainVerdict.BETTER else ("lost", -1.0)
    ends = sorted((sign * low, sign * high))
    return (
        f"The commanded force is held {whole.verdict.value}: {whole.before_rms_n:.2f} N before, {whole.after_rms_n:.2f} N "
        f"after, {sign * whole.gain_n:.2f} N {word} (95 % interval {ends[0]:.2f} .. {ends[1]:.2f} N)"
    )


def comparable_sentence(found: BeforeAfter) -> str:
    """Return how much of the runs could be compared."""
    whole = found.whole
    shares = " and ".join(f"{share:.0%}" for share in whole.comparable_share)
    stretches = f"{whole.blocks[0]} and {whole.blocks[1]} stretches"
    return f"Compared where the same was asked of both: {shares} of their rows, in {stretches}"


def sentences(found: BeforeAfter) -> Iterator[str]:
    """Yield the comparison in lines for a terminal, the answer first."""
    yield answer_sentence(found)
    yield comparable_sentence(found)
    yield f"error of the commanded force: {_run(found.before)} -> {_run(found.after)}"
    for name, part in (("all", found.whole), ("held", found.held), ("on the way", found.moving)):
        yield f"  {name:<11}{_line(part)}"


def _run(run: RecordedForce) -> str:
    return f"{run.name} ({f'plant {run.plant}' if run.plant else 'no plant in use'})"


def _line(change: ForceChange) -> str:
    if not isfinite(change.ratio):
        return "nothing to compare"
    interval = (
        f", 95 % interval {change.ratio_ci95[0]:.2f} .. {change.ratio_ci95[1]:.2f}"
        if isfinite(change.ratio_ci95[0])
        else ""
    )
    numbers = f"{change.before_rms_n:.2f} -> {change.after_rms_n:.2f} N RMS"
    return f"{numbers}, after / before {change.ratio:.2f}{interval}: {change.verdict.value}"


def run(before: str, after: str, columns: str | None, rig: str | None, state: Path | None) -> BeforeAfter:
    """Read both runs and compare them."""
    first, second = (read_run(name, rig=rig, columns=columns, state=state) for name in (before, after))
    return compare_before_after(first, second)
