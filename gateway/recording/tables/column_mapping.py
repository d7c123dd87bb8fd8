"""Which column of a foreign table is which column of the contract, and in which unit: `--columns time_s=1:ms,force_n=7:n`.

NAME=SOURCE[:UNIT]: NAME as in the contract, or that of a covariate; SOURCE a column's number from 1 or its header;
UNIT what the numbers are in, by default what the header says, else what NAME ends with, with a minus where their sign is
turned (`:-n`). Instead of a unit, what a range of theirs means: `pressure_kpa=3:4..20=0..10bar` for a sensor of 4 to 20 mA.
Columns that are not mentioned keep their header's name, or are those of the contract where the header says so with its
unit (`Kraft [kgf]`); one without a header's name is left out, for nobody could ask for it.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Final

from gateway.recording.errors import RecordingError
from gateway.recording.foreign.headers import WORDS, Header, TableHeaders
from gateway.recording.foreign.unit_names import is_unit, unit_of
from gateway.recording.tables.column_names import CONTRACT
from gateway.units import LINEAR, linear_conversion

EXAMPLE: Final = "--columns time_s=1:s,command_v=2:v,force_n=3:n, or :ms, :mv, :kgf"
_NUMBER: Final = r"[-+]?\d*\.?\d+"
_RANGES: Final = re.compile(rf"({_NUMBER})\.\.({_NUMBER})\s*=\s*({_NUMBER})\.\.({_NUMBER})\s*([A-Za-z_]*)")


@dataclass(frozen=True, slots=True)
class ColumnSource:
    """Column `name` comes from column number `source` (from 1), or from the one with that header; unit None: its own.

    scale: value = factor x number + offset in that unit, where a range was said to mean another.
    """

    name: str
    source: int | str
    unit: str | None = None
    scale: tuple[float, float] = (1.0, 0.0)


@dataclass(frozen=True, slots=True)
class ColumnMapping:
    """Which column of a foreign table is which of ours, and in which unit. sheet: of a workbook, name or number."""

    sources: tuple[ColumnSource, ...]
    sheet: str | None = None

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
    source, unit = (head.strip(), unit.strip()) if colon else (text, "")
    if not source:
        raise RecordingError(f"--columns: {name}={text} names no column; a number from 1, or a header")
    place = int(source) if source.isdecimal() else source
    if ".." in unit:
        return _scaled(name, place, unit)
    return ColumnSource(name, place, _checked_unit(name, unit) if colon else None)


def _scaled(name: str, place: int | str, text: str) -> ColumnSource:
    """Return the source of a column of which a range is said to mean another: `4..20=0..10bar`."""
    found = _RANGES.fullmatch(text)
    low, high, low_means, high_means = map(float, found.groups()[:4]) if found else (0.0, 0.0, 0.0, 0.0)
    if found is None or low == high or low_means == high_means:
        raise RecordingError(
            f"--columns: {name}={place}:{text} is not LOW..HIGH=LOW..HIGH[UNIT], such as pressure_kpa=3:4..20=0..10bar"
        )
    factor = (high_means - low_means) / (high - low)
    unit = _checked_unit(name, found[5]) if found[5] else None
    return ColumnSource(name, place, unit or _own_unit(name), (factor, low_means - factor * low))


def _own_unit(name: str) -> str | None:
    quantity = quantity_of(name)
    return quantity[1] if quantity else None


def _checked_unit(name: str, text: str) -> str:
    """Return the unit as LINEAR has it, with its minus. RecordingError where it is none of this column."""
    quantity = quantity_of(name)
    if quantity is None:
        raise RecordingError(
            f"--columns: {name} ends with no unit, so :{text} cannot be turned into one; leave it out, or name the "
            "column as the contract does (time_s, force_n, pressure_kpa, ...)"
        )
    word = text.removeprefix("-")
    unit = word.lower() if word.lower() in LINEAR[quantity[0]] else unit_of(word, quantity[0])
    if unit is None:
        allowed = ", ".join(LINEAR[quantity[0]])
        raise RecordingError(
            f"--columns: {text.lower()!r} is no unit for {name}; allowed: {allowed}, or what a range means: "
            f"{name}=COLUMN:4..20=0..100"
        )
    return "-" * text.startswith("-") + unit


def select_columns(
    names: Sequence[str], mapping: ColumnMapping | None, file: str, headers: TableHeaders | None = None
) -> tuple[SelectedColumn, ...]:
    """Return what is read from a table with these headers ("" where there is none).
    RecordingError when a column is not there. headers: the same with their units, where the table has those."""
    headers = headers or TableHeaders.of(names)
    mapped = [_select_column(source, names, file, headers) for source in mapping.sources] if mapping else []
    used = {pick.index for pick in mapped}
    claimed = {pick.name for pick in mapped}
    understood = {
        place: (name, unit)
        for place, (name, unit) in headers.understood().items()
        if place not in used and name not in claimed
    }
    own = [
        _converted(k, *understood[k]) if k in understood else SelectedColumn(k, name)
        for k, name in enumerate(names)
        if name and k not in used and name not in claimed
    ]
    names_in_use = [pick.name for pick in own]
    for name in names_in_use:
        if names_in_use.count(name) > 1:
            raise RecordingError(f"{file}: a column name stands twice in the header: {name}; pick one with --columns")
    return (*mapped, *own)


def factors_of(picks: Sequence[SelectedColumn]) -> dict[str, float]:
    """Return what the numbers of a column of the contract are multiplied by, where that is not 1."""
    return {pick.name: pick.factor for pick in picks if pick.is_contract and pick.factor != 1.0}


def describe_understood(
    names: Sequence[str], picks: Sequence[SelectedColumn], mapping: ColumnMapping | None
) -> list[str]:
    """Return notes on columns that were taken for one of the contract by their header alone."""
    asked = {source.name for source in mapping.sources} if mapping else set()
    told = [
        f"{names[pick.index]!r} as {pick.name}"
        for pick in picks
        if pick.is_contract and pick.name not in asked and names[pick.index] != pick.name
    ]
    return [f"taken by their headers: {join_names(told)}; --columns says otherwise"] if told else []


def unit_facts(headers: TableHeaders, picks: Sequence[SelectedColumn], mapping: ColumnMapping | None) -> dict[str, str]:
    """Return what is known besides: that the force is in newtons, where a mapping or the header said what it was in."""
    asked = {source.name for source in mapping.sources if source.unit} if mapping else set()
    written = {pick.name for pick in picks if pick.name in WORDS and headers.headers[pick.index].text != pick.name}
    read = {pick.name for pick in picks if headers.headers[pick.index].unit_for(pick.name)}
    return {"force_unit": "N"} if "force_n" in asked | (written & read) else {}


def _select_column(source: ColumnSource, names: Sequence[str], file: str, headers: TableHeaders) -> SelectedColumn:
    index = _index(source, names, file, headers)
    quantity = quantity_of(source.name)
    if quantity is None:
        return SelectedColumn(index, source.name, *source.scale)
    is_named_so = names[index] == source.name
    written = None if is_named_so else headers.headers[index].unit_for(source.name)
    if source.unit is None and written is None and not is_named_so:
        _refuse_other_unit(source, headers.headers[index], file)
    unit = source.unit or written or quantity[1]
    picked = _converted(index, source.name, unit.removeprefix("-"))
    sign = -1.0 if unit.startswith("-") else 1.0
    factor, offset = source.scale
    return SelectedColumn(
        index, source.name, sign * factor * picked.factor, sign * (picked.factor * offset + picked.offset)
    )


def _refuse_other_unit(source: ColumnSource, header: Header, file: str) -> None:
    """Refuse a column whose header says a unit that is none of what it shall be."""
    if source.name in WORDS and header.unit and is_unit(header.unit):
        raise RecordingError(
            f"{file}: {source.name}={source.source}: its header says {header.unit}; say what a range of it means, such as "
            f"{source.name}={source.source}:0..10=0..100, or the unit that it is really in"
        )


def _converted(index: int, name: str, unit: str | None) -> SelectedColumn:
    """Return the column turned from a unit into that which its name ends with; unit None: as it is."""
    quantity = quantity_of(name)
    if unit is None or quantity is None:
        return SelectedColumn(index, name)
    return SelectedColumn(index, name, *linear_conversion(quantity[0], unit, quantity[1]))


def _index(source: ColumnSource, names: Sequence[str], file: str, headers: TableHeaders) -> int:
    if isinstance(source.source, int):
        if not 1 <= source.source <= len(names):
            raise RecordingError(f"{file}: {source.name}={source.source}: the table has the columns 1 .. {len(names)}")
        return source.source - 1
    if source.source in names:
        return list(names).index(source.source)
    for place, (name, _) in headers.understood().items():
        if name == source.source:
            return place
    near = get_close_matches(source.source, [name for name in names if name], n=1, cutoff=0.6)
    suggestion = f"; did you mean {near[0]}?" if near else f"; there: {join_names([name for name in names if name])}"
    raise RecordingError(f"{file}: {source.name}={source.source}: no such header{suggestion}")


def join_names(words: Sequence[str], most: int = 12) -> str:
    """Return `a, b, c and 9 more`; `none` for nothing."""
    more = len(words) - most
    return ", ".join(words[:most]) + (f" and {more} more" if more > 0 else "") or "none"
