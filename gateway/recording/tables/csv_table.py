"""Reads a CSV of the recording contract: UTF-8, `# key: value` lines, one header row or a column mapping, numbers.

Two ways to the same numbers: pyarrow reads a clean table at hundreds of megabytes per second; the first thing that it
does not understand (a word, a row too short, a comment or a blank line between rows) sends the file down the exact way,
line by line, which knows every rule and names row and column. Without pyarrow (extra `analysis`) every file takes that way.

strict (the diagnosis): a cell of a contract column that is no number, or a row with too few or too many cells, is a
RecordingError. lenient (the fit, which needs stairs and not every row): it is told in the notes, and left out.
"""

import mmap
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from gateway.extras import is_installed
from gateway.recording.errors import RecordingError
from gateway.recording.foreign.table_text import TableText, as_text, refuse_our_profiles
from gateway.recording.foreign.time_stamps import parse_stamp, seconds_from_stamps
from gateway.recording.reader import Recording
from gateway.recording.tables.column_mapping import (
    EXAMPLE,
    ColumnMapping,
    SelectedColumn,
    describe_understood,
    factors_of,
    join_names,
    select_columns,
    unit_facts,
)
from gateway.recording.tables.csv_dialect import MISSING, CsvDialect, detect_dialect, rows_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

LARGEST_CELLS: Final = 64_000_000  # half a gigabyte as float64
_MOST_NOTES: Final = 3
_CELLS_AT_ONCE: Final = 1 << 18
_QUALITY_WORDS: Final = {
    "ok": 0.0,
    "good": 0.0,
    "valid": 0.0,
    "unstable": 1.0,
    "overload": 2.0,
    "bad": 2.0,
    "invalid": 2.0,
}


def read_csv(path: Path, mapping: ColumnMapping | None = None, *, lenient: bool = False) -> Recording:
    """Read header facts and columns of a table of text, or of a sheet.
    RecordingError with what was seen when it is none, OSError as usual."""
    with as_text(path, mapping.sheet if mapping else None) as text:
        return _read_text(text, path, mapping, lenient)


def _read_text(text: TableText, path: Path, mapping: ColumnMapping | None, lenient: bool) -> Recording:
    form = detect_dialect(path, text.file)
    if not form.has_header and not (mapping and mapping.sources):
        raise RecordingError(
            f"{path}:{form.skip + 1}: no header row; it names the columns, such as time_s,command_v,force_n. "
            f"Or say which is which: {EXAMPLE} (the table has {len(form.names)} columns)"
        )
    headers = form.headers()
    selected = select_columns(form.names, mapping, str(path), headers)
    chosen = [pick for pick in selected if pick.is_contract or not form.is_words(pick.index)]
    words = [pick.name for pick in selected if pick not in chosen]
    chosen = [SelectedColumn(pick.index, pick.name) if _is_stamps(form, pick) else pick for pick in chosen]
    if not chosen:
        refuse_our_profiles(path)
        raise RecordingError(
            f"{path}: no column of numbers; a recording is a table with a header such as time_s,command_v,force_n"
        )
    _check_size(form, len(chosen))
    table = _read_fast(form, chosen) or _LineReader(form, chosen, lenient).read()
    notes = [*text.notes, *form.notes, *describe_understood(form.names, selected, mapping), *table.notes]
    notes += [f"columns of words, not numbers: {join_names(words)}"] if words else []
    columns = {pick.name: _convert(table.columns[k], pick) for k, pick in enumerate(chosen) if k in table.columns}
    facts = dict(table.facts) | unit_facts(headers, selected, mapping)
    rows = len(table.lines)
    return Recording(
        path,
        facts,
        columns,
        rows,
        table.dropped,
        tuple(notes),
        lines=table.lines,
        suggestion=headers.suggest(),
        factors=factors_of(chosen),
    )


@dataclass(slots=True)
class NumberTable:
    """Numbers as they stand, by the place of the column in what was chosen; lines: line number of each row."""

    facts: dict[str, str]
    columns: "dict[int, NDArray[np.float64]]"
    lines: "Sequence[int] | NDArray[np.int64]"
    notes: list[str] = field(default_factory=list)
    dropped: bool = False


def _convert(values: "NDArray[np.float64]", pick: SelectedColumn) -> "NDArray[np.float64]":
    return values if (pick.factor, pick.offset) == (1.0, 0.0) else values * pick.factor + pick.offset


def _read_fast(form: CsvDialect, chosen: Sequence[SelectedColumn]) -> NumberTable | None:
    """All rows at once; None when there is anything between them that is no row of numbers, and without pyarrow."""
    if not chosen or not form.sample or not is_installed("pyarrow"):
        return None
    if form.separator == " " or any(_is_stamps(form, pick) for pick in chosen):
        return None
    import pyarrow as pa
    from pyarrow import csv

    pa.enable_signal_handlers(False)  # they would hold a pipe open from now on, and Ctrl-C is Python's
    names = [str(k) for k in range(len(form.names))]
    wanted_names = [names[pick.index] for pick in chosen]
    with form.file.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        if data.find(b"\n#", 1) >= 0 and _is_comment_between(form, data):
            return None
        try:
            table = csv.read_csv(
                pa.BufferReader(pa.memory_map(str(form.file)).read_buffer().slice(0, _end(data))),
                read_options=csv.ReadOptions(skip_rows=form.skip, column_names=names, block_size=8 << 20),
                parse_options=csv.ParseOptions(delimiter=form.separator, ignore_empty_lines=False),
                convert_options=csv.ConvertOptions(
                    column_types=dict.fromkeys(wanted_names, pa.float64()),
                    include_columns=list(dict.fromkeys(wanted_names)),
                    null_values=[word for given in MISSING for word in (given, given.upper(), given.title(), "NaN")],
                    decimal_point=form.decimal,
                ),
            )
        except pa.ArrowInvalid:
            return None
        columns = {k: _floats(table[name]) for k, name in enumerate(wanted_names)}
    first = form.skip + 1
    return NumberTable(form.facts, columns, range(first, first + table.num_rows))


def _floats(column: Any) -> "NDArray[np.float64]":
    """Return a float64 array that owns its numbers; NaN for null."""
    import numpy as np

    return np.array(column.to_numpy(zero_copy_only=False), dtype=np.float64)


def _is_comment_between(form: CsvDialect, data: mmap.mmap) -> bool:
    """Return whether a comment follows the first row: pyarrow could take it for data where its first cell is not asked for."""
    at = 0
    for _ in range(form.skip):
        at = data.find(b"\n", at) + 1
    return data.find(b"\n#", at) >= 0


def _end(data: mmap.mmap) -> int:
    """Return where the last row ends: blank lines after it are no rows."""
    end = len(data)
    while end > 0 and data[end - 1] in b"\r\n":
        end -= 1
    return end


def _check_size(form: CsvDialect, columns: int) -> None:
    """Refuse more numbers than the program takes, before they are read."""
    if form.file.stat().st_size < LARGEST_CELLS:  # every cell takes two bytes at least
        return
    with form.file.open("rb") as stream:
        rows = sum(piece.count(b"\n") for piece in iter(lambda: stream.read(1 << 24), b""))
    refuse_too_large(form.path, rows, columns)


def _is_stamps(form: CsvDialect, pick: SelectedColumn) -> bool:
    """Decide whether this is the column of time, and holds stamps."""
    if pick.name != "time_s":
        return False
    form.refuse_ambiguous_date(pick.index)
    return form.is_stamps(pick.index)


def refuse_too_large(path: Path, rows: int, columns: int) -> None:
    """Refuse a table of more numbers than the program takes, with RecordingError."""
    if rows * columns > LARGEST_CELLS:
        raise RecordingError(
            f"{path}: {rows} rows of {columns} columns are more than {LARGEST_CELLS} numbers: "
            "take a part of the rows, or leave columns out"
        )


class _LineReader:
    """One line after the other."""

    def __init__(self, form: CsvDialect, chosen: Sequence[SelectedColumn], lenient: bool) -> None:
        self._form = form
        self._chosen = chosen
        self._lenient = lenient
        self._stamps = frozenset(k for k, pick in enumerate(chosen) if _is_stamps(form, pick))
        self._findings: list[str] = []
        self._ragged: tuple[int, int] | None = None  # (line, cells) of a row that may be the torn last one
        self._wrong: dict[int, int] = {}  # column -> cells that were no number
        self._first_wrong: dict[int, str] = {}

    def read(self) -> NumberTable:
        """Return the whole table. RecordingError, where strict, names row and column of what cannot be read."""
        import numpy as np

        facts: dict[str, str] = {}
        lines: list[int] = []
        blocks: list[Any] = []
        rows: list[list[float]] = []
        with self._form.file.open(encoding="utf-8-sig", errors="replace") as stream:
            for at, line in rows_of(stream, facts, self._form.path):
                values = self._values(at, line) if at > self._form.skip else None
                if values is not None:
                    lines.append(at)
                    rows.append(values)
                if len(rows) * len(self._chosen) >= _CELLS_AT_ONCE:
                    blocks.append(np.array(rows, dtype=np.float64))
                    rows = []
        blocks.append(np.array(rows, dtype=np.float64).reshape(-1, len(self._chosen)))
        self._end_of_file()
        if self._findings and not lines:
            raise RecordingError(f"{self._form.path}: no row can be read: {self._findings[0]}")
        table = np.concatenate(blocks)
        columns = {k: table[:, k].copy() for k in range(len(self._chosen)) if not self._is_words(k, len(table))}
        columns |= {k: seconds_from_stamps(columns[k]) for k in self._stamps if k in columns}
        notes = self._notes(columns)
        return NumberTable(facts, columns, np.array(lines, dtype=np.int64), notes, dropped=bool(self._findings))

    def _values(self, at: int, line: str) -> list[float] | None:
        """Return the chosen numbers of a row; None when it is left out."""
        form = self._form
        cells = form.cells(line)
        if self._ragged:
            self._refuse_ragged(*self._ragged)
        if len(cells) != len(form.names):
            self._ragged = (at, len(cells))
            return None
        try:
            if form.decimal == "." and "_" not in line:
                return [float(cells[pick.index]) for pick in self._chosen]
        except ValueError:
            pass
        return [self._value(at, k, cells[pick.index]) for k, pick in enumerate(self._chosen)]

    def _value(self, at: int, k: int, cell: str) -> float:
        value = self._form.parse_number(cell)
        if k in self._stamps and value is None:
            value = parse_stamp(cell)
        if value is None and self._chosen[k].name == "quality":
            value = _QUALITY_WORDS.get(cell.strip().lower())
        return self._no_number(at, k, cell.strip()) if value is None else value

    def _no_number(self, at: int, k: int, cell: str) -> float:
        pick = self._chosen[k]
        if pick.is_contract and not self._lenient:
            raise RecordingError(
                f"{self._form.path}:{at}, column {pick.name} (the {pick.index + 1}. of the table): {cell[:20]!r} is no number"
                "; where nothing was read, leave the cell empty"
            )
        if pick.is_contract:
            self._findings.append(f"line {at}, {pick.name}: {cell[:20]!r} is no number")
        self._wrong[k] = self._wrong.get(k, 0) + 1
        self._first_wrong.setdefault(k, f"line {at}, {pick.name}: {cell[:20]!r} is no number")
        return nan

    def _refuse_ragged(self, at: int, cells: int) -> None:
        self._ragged = None
        width = f"{len(self._form.names)}" if self._form.has_header else f"{len(self._form.names)} as in the first row"
        sentence = f"{cells} cells, {'the header' if self._form.has_header else 'expected'} {width}"
        if self._form.separator == "," and 1 < len(self._form.names) < cells <= 2 * len(self._form.names):
            sentence += " (decimal commas beside commas? Nobody can tell them apart: write the table with semicolons)"
        if not self._lenient:
            raise RecordingError(f"{self._form.path}:{at}: {sentence}")
        self._findings.append(f"line {at} has {sentence}: left out")

    def _end_of_file(self) -> None:
        if self._ragged:
            at, cells = self._ragged
            self._findings.append(
                f"line {at}, the last, is torn: {cells} of {len(self._form.names)} cells; it was left out"
            )

    def _is_words(self, k: int, rows: int) -> bool:
        return not self._chosen[k].is_contract and self._wrong.get(k, 0) > 0.5 * rows

    def _notes(self, columns: "dict[int, NDArray[np.float64]]") -> list[str]:
        mixed = [k for k in self._first_wrong if k in columns and not self._chosen[k].is_contract]
        words = [pick.name for k, pick in enumerate(self._chosen) if k not in columns]
        notes = shorten_notes(self._findings, "such lines")
        notes += shorten_notes(
            [f"{self._first_wrong[k]} ({self._wrong[k]} such cells): not known there" for k in mixed], "such columns"
        )
        return notes + ([f"columns of words, not numbers: {join_names(words)}"] if words else [])


def shorten_notes(notes: Sequence[str], noun: str) -> list[str]:
    """Return the first few, and how many more there were."""
    more = len(notes) - _MOST_NOTES
    return [*notes[:_MOST_NOTES], f"and {more} more {noun}"] if more > 0 else list(notes)
