"""Which column of a foreign table is which column of the contract, and in which unit: `--columns time_s=1:ms,force_n=7:n`.

NAME=SOURCE[:UNIT]: NAME as in the contract, or that of a covariate; SOURCE a column's number from 1 or its header;
UNIT what the numbers are in, by default what NAME ends with, with a minus where their sign is turned (`:-n`). Columns
that are not mentioned keep their header's name; one without a header's name is left out, for nobody could ask for it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Final

from gateway.recording.errors import RecordingError
from gateway.recording.tables.column_names import CONTRACT
from gateway.units import LINEAR, linear_conversion

EXAMPLE: Final = "--columns time_s=1:ms,command_v=2:mv,force_n=3:n"


@dataclass(frozen=True, slots=True)
class ColumnSource:
    """Column `name` comes from column number `source` (from 1), or from the one with that header; unit None: its own."""

    name: str
    source: int | str
    unit: str | None = None


@dataclass(frozen=True, slots=True)
class ColumnMapping:
    """Which column of a foreign table is which of ours, and in which unit."""

    sources: tuple[ColumnSource, ...]

    @classmethod
    def parse(cls, text: str) -> "ColumnMapping":
        """Return the mapping that a text means, such as `time_s=1:ms,force_n=7:n`. RecordingError in the user's words."""
        entries: dict[str, str] = {}
        for part in filter(None, (piece.strip() for piece in text.split(","))):
            name, equals, source = (piece.strip() for piece in part.partition("="))
            if not (equals and name and source):
                raise RecordingError(f"--columns: {part!r} is not NAME=COLUMN or NAME=COLUMN:UNIT, such as time_s=1:ms")
            if name in entries:
                raise RecordingError(f"--columns: {name} stands twice")
            entries[name] = source
        return cls.of(entries)

    @classmethod
    def of(cls, entries: Mapping[str, int | str]) -> "ColumnMapping":
        """Return the mapping from name -> number, header, `number:unit` or `header:unit`.
        RecordingError for a unit that is none."""
        if not entries:
            raise RecordingError(f"--columns: no column is named; {EXAMPLE}")
        return cls(tuple(_source(name, str(entry).strip()) for name, entry in entries.items()))


@dataclass(frozen=True, slots=True)
class SelectedColumn:
    """One column to read: its place in the table (from 0), its name from now on, and value = factor x number + offset."""

    index: int
    name: str
    factor: float = 1.0
    offset: float = 0.0

    @property
    def is_contract(self) -> bool:
        """Decide whether the column is one that every recording has."""
        return self.name in CONTRACT


def quantity_of(name: str) -> tuple[str, str] | None:
    """Return the (quantity, unit) that a column's name ends with, None when it ends with none.
    `oil_temperature_c`, `feed_mm_s`."""
    matches = [
        (len(unit), quantity, unit)
        for quantity, units in LINEAR.items()
        for unit in units
        if name.lower().endswith(f"_{unit}")
    ]
    return max(matches)[1:] if matches else None


def _source(name: str, text: str) -> ColumnSource:
    head, colon, unit = text.rpartition(":")
    source, unit = (head.strip(), unit.strip().lower()) if colon else (text, "")
    if not source:
        raise RecordingError(f"--columns: {name}={text} names no column; a number from 1, or a header")
    if colon:
        _check_unit(name, unit)
    return ColumnSource(name, int(source) if source.isdecimal() else source, unit or None)


def _check_unit(name: str, unit: str) -> None:
    quantity = quantity_of(name)
    if quantity is None:
        raise RecordingError(
            f"--columns: {name} ends with no unit, so :{unit} cannot be turned into one; leave it out, or name the "
            "column as the contract does (time_s, force_n, pressure_kpa, ...)"
        )
    if unit.removeprefix("-") not in LINEAR[quantity[0]]:
        allowed = ", ".join(LINEAR[quantity[0]])
        raise RecordingError(f"--columns: {unit!r} is no unit for {name}; allowed: {allowed}")


def select_columns(names: Sequence[str], mapping: ColumnMapping | None, file: str) -> tuple[SelectedColumn, ...]:
    """Return what is read from a table with these headers ("" where there is none).
    RecordingError when a column is not there."""
    mapped = [_select_column(source, names, file) for source in mapping.sources] if mapping else []
    used = {pick.index for pick in mapped}
    claimed = {pick.name for pick in mapped}
    own = [SelectedColumn(k, name) for k, name in enumerate(names) if name and k not in used and name not in claimed]
    names_in_use = [pick.name for pick in own]
    for name in names_in_use:
        if names_in_use.count(name) > 1:
            raise RecordingError(f"{file}: a column name stands twice in the header: {name}; pick one with --columns")
    return (*mapped, *own)


def _select_column(source: ColumnSource, names: Sequence[str], file: str) -> SelectedColumn:
    index = _index(source, names, file)
    quantity = quantity_of(source.name)
    if source.unit is None or quantity is None:
        return SelectedColumn(index, source.name)
    factor, offset = linear_conversion(quantity[0], source.unit.removeprefix("-"), quantity[1])
    return SelectedColumn(
        index, source.name, *((-factor, -offset) if source.unit.startswith("-") else (factor, offset))
    )


def _index(source: ColumnSource, names: Sequence[str], file: str) -> int:
    if isinstance(source.source, int):
        if not 1 <= source.source <= len(names):
            raise RecordingError(f"{file}: {source.name}={source.source}: the table has the columns 1 .. {len(names)}")
        return source.source - 1
    if source.source in names:
        return list(names).index(source.source)
    near = get_close_matches(source.source, [name for name in names if name], n=1, cutoff=0.6)
    suggestion = f"; did you mean {near[0]}?" if near else f"; there: {join_names([name for name in names if name])}"
    raise RecordingError(f"{file}: {source.name}={source.source}: no such header{suggestion}")


def join_names(words: Sequence[str], most: int = 12) -> str:
    """Return `a, b, c and 9 more`; `none` for nothing."""
    more = len(words) - most
    return ", ".join(words[:most]) + (f" and {more} more" if more > 0 else "") or "none"
