"""What kind of table of text this is, from its first lines: facts, separator, decimal sign, header, units, which are words.

A tab is never part of a number, a semicolon hardly; so they are taken for the separator before the comma is, and then a
comma inside a cell is a decimal one. Spaces separate where nothing else does. Lines before the header that have fewer cells
(a title, who measured) are left out, and told; a row of units below the header belongs to it.
"""

import csv
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, TextIO

from gateway.recording.errors import RecordingError
from gateway.recording.foreign.headers import MOST_COLUMNS, TableHeaders
from gateway.recording.foreign.time_stamps import is_ambiguous_date, parse_stamp
from gateway.recording.foreign.unit_names import is_unit

MISSING: Final = frozenset(
    ("", *"nan na n/a #n/a #nv null none - -- nan(ind) -nan(ind) 1.#qnan 1.#ind -1.#ind".split())
)
"""What stands, in lower case, where no number was taken: #NV is a German Excel's #N/A, the last ones Windows' own NaN."""
LONGEST_LINE: Final = 1 << 20
_SAMPLE_LINES: Final = 200
_MOST_TITLE_LINES: Final = 60
_LONGEST_CELL: Final = csv.field_size_limit()  # whoever does not close a quote makes a cell of the whole line
_DECIMAL_COMMA: Final = re.compile(r"\d,\d")
_QUOTED_DECIMAL_COMMA: Final = re.compile(r'"\s*[-+]?\d+,\d+(?:[eE][-+]?\d+)?\s*"')
_DECIMAL_POINT: Final = re.compile(r"(?<![\d.:])\d+\.\d+(?![\d.])")
_POINT_CELL: Final = re.compile(r"[-+]?\d*\.\d+(?:[eE][-+]?\d+)?")
_THOUSANDS_CELL: Final = re.compile(r"[-+]?[1-9]\d{0,2}(?:,\d{3})+(?:\.\d*)?")
_QUOTED: Final = re.compile(r'"[^"]*"')
_NAMED_SEPARATOR: Final = re.compile(r'"?sep=(.)"?', re.IGNORECASE)
_LABVIEW_END: Final = "***End_of_Header***"
_UNPRINTABLE: Final = re.compile(r"[\x00-\x08\x0e-\x1f]")


@dataclass(frozen=True, slots=True)
class CsvDialect:
    """How a table of text is written."""

    path: Path
    file: Path  # where the text lies: path itself, or what was made of it
    facts: dict[str, str]
    names: tuple[str, ...]  # one per column, "" where the header has none
    separator: str
    decimal: str
    has_header: bool
    skip: int  # lines before the first row
    sample: tuple[tuple[str, ...], ...]  # the first rows
    units: tuple[str, ...] = ()  # of the row below the header
    notes: list[str] = field(default_factory=list)
    is_sure: bool = False  # the decimal sign was seen: a comma beside points is one of thousands

    def cells(self, line: str) -> list[str]:
        """Return the cells of a line as they stand; empty ones beyond the last column are a trailing separator, and dropped."""
        cells = split_cells(line, self.separator)
        while len(cells) > len(self.names) and not cells[-1].strip():
            cells.pop()
        return cells

    def parse_number(self, cell: str) -> float | None:
        """Return the value of a cell, NaN where nothing was taken; None when it is no number."""
        may_be_comma = self.separator != "," and not self.is_sure
        return parse_number(cell, "," if self.decimal == "," or may_be_comma else ".")

    def is_words(self, index: int) -> bool:
        """Return whether no filled cell of the first rows is a number."""
        cells = self._filled(index)
        return bool(cells) and all(self.parse_number(cell) is None for cell in cells)

    def is_stamps(self, index: int) -> bool:
        """Return whether every filled cell of the first rows is a stamp of time. RecordingError for 11/12/2026 alone."""
        cells = self._filled(index)
        return bool(cells) and all(parse_stamp(cell) is not None for cell in cells)

    def refuse_ambiguous_date(self, index: int) -> None:
        """Refuse stamps whose day and month cannot be told apart."""
        cells = self._filled(index)
        if cells and is_ambiguous_date(cells[0]):
            raise RecordingError(
                f"{self.path}, column {index + 1}: {cells[0].strip()[:24]!r} may be two days: write dates as "
                "2026-11-22T10:31:47.5 (in Excel: cell format yyyy-mm-dd hh:mm:ss.000), or name a column of seconds with "
                "--columns time_s=..."
            )

    def headers(self) -> TableHeaders:
        """Return what the headers say, with the units below them."""
        stamps = [k for k in range(len(self.names)) if self.is_stamps(k)]
        going_on = [k for k in stamps if len(set(self._filled(k))) > 1]  # a date stands still beside the time of day
        return TableHeaders.of(self.names, self.units, going_on or stamps)

    def _filled(self, index: int) -> list[str]:
        return [row[index] for row in self.sample if index < len(row) and row[index].strip().lower() not in MISSING]


def split_cells(line: str, separator: str) -> list[str]:
    """Return the cells of a line; quotes are heeded where there are any. A space stands for any number of them."""
    if separator == " ":
        return line.split()
    return next(csv.reader([line], delimiter=separator)) if '"' in line else line.split(separator)


def parse_number(cell: str, decimal: str) -> float | None:
    """Return the value of a cell, NaN where nothing was taken; None when it is no number. decimal: its decimal sign."""
    text = cell.strip()
    if text.lower() in MISSING:
        return float("nan")
    try:
        return None if "_" in text else float(text.replace(",", ".") if decimal == "," else text)
    except ValueError:
        return None


def detect_dialect(path: Path, file: Path | None = None) -> CsvDialect:
    """Read the first lines. RecordingError for what is no table, OSError as usual. file: the text, path itself without it."""
    with (file or path).open(encoding="utf-8-sig", errors="replace") as stream:
        facts, lines = _first_lines(stream, path)
    if not lines:
        raise RecordingError(f"{path} holds no table: no row with numbers")
    return _make_dialect(path, file or path, facts, lines)


def rows_of(stream: TextIO, facts: dict[str, str], path: Path) -> Iterator[tuple[int, str]]:
    """Yield (line number, line) of every line that is neither blank nor a comment; `# key: value` goes into facts."""
    for at, line in enumerate(iter(lambda: stream.readline(LONGEST_LINE), ""), start=1):
        if len(line) == LONGEST_LINE:
            raise RecordingError(f"{path}: line {at} has a million characters or more: no table of rows and columns")
        if len(line) > _LONGEST_CELL and '"' in line:
            raise RecordingError(
                f"{path}: line {at} has quotes and {len(line)} characters: no table of rows and columns"
            )
        stripped = line.strip()
        if stripped.startswith("#"):
            key, colon, value = stripped[1:].partition(":")
            facts |= {key.strip(): value.strip()} if colon else {}
        elif stripped:
            yield at, line.rstrip("\r\n")


def _first_lines(stream: TextIO, path: Path) -> tuple[dict[str, str], list[tuple[int, str]]]:
    facts: dict[str, str] = {}
    lines: list[tuple[int, str]] = []
    for line in rows_of(stream, facts, path):
        lines.append(line)
        if len(lines) == _SAMPLE_LINES:
            break
    return facts, lines


def _make_dialect(path: Path, file: Path, facts: dict[str, str], lines: list[tuple[int, str]]) -> CsvDialect:
    named = _NAMED_SEPARATOR.fullmatch(lines[0][1].strip())
    lines = lines[1:] if named and len(lines) > 1 else lines
    if _UNPRINTABLE.search(lines[0][1]):
        raise RecordingError(f"{path} is neither a recording nor a CSV: line {lines[0][0]} is no text")
    separator = named[1] if named else _separator([line for _, line in lines])
    lines, notes = _behind_labview(lines) or _without_title(lines, separator)
    (at, first), rest = lines[0], [line for _, line in lines[1:]]
    decimal, is_sure = _decimal(separator, rest or [first])
    names = tuple(cell.strip() for cell in split_cells(first, separator))
    _refuse_wide(path, len(names))
    has_header = any(parse_number(name, decimal) is None and parse_stamp(name) is None for name in names)
    units = _units_below(rest[0] if has_header and rest else "", separator, len(names))
    skip = lines[1][0] if units else at if has_header else at - 1
    rows = rest[1:] if units else rest if has_header else [first, *rest]
    sample = tuple(tuple(split_cells(row, separator)) for row in rows)
    shown = names if has_header else ("",) * _width(names)
    return CsvDialect(path, file, facts, shown, separator, decimal, has_header, skip, sample, units, notes, is_sure)


def _refuse_wide(path: Path, columns: int) -> None:
    if columns > MOST_COLUMNS:
        raise RecordingError(f"{path}: {columns} columns: at most {MOST_COLUMNS} are read; write the ones that matter")


def _decimal(separator: str, rows: Sequence[str]) -> tuple[str, bool]:
    """Return the decimal sign, and whether it was seen. In a table with commas between cells, one inside a cell is quoted;
    beside decimal points it would be one of thousands, and is no number. So is 1,234 beside points in any other table."""
    if separator == ",":
        quoted = any(_QUOTED_DECIMAL_COMMA.search(line) for line in rows)
        return ("," if quoted and not any(_DECIMAL_POINT.search(line) for line in rows) else "."), True
    cells = [cell.strip() for line in rows for cell in split_cells(line, separator)]
    commas = [cell for cell in cells if _DECIMAL_COMMA.search(cell)]
    has_points = any(map(_POINT_CELL.fullmatch, cells))
    if commas and not (has_points and all(map(_THOUSANDS_CELL.fullmatch, commas))):
        return ",", True
    return ".", has_points


def _behind_labview(lines: list[tuple[int, str]]) -> tuple[list[tuple[int, str]], list[str]] | None:
    """Leave out what LabVIEW's measurement files tell of the machine and of each channel, in lines as wide as rows; None for
    any other file."""
    ends = [k for k, (_, line) in enumerate(lines[:_MOST_TITLE_LINES]) if line.startswith(_LABVIEW_END)]
    behind = lines[ends[-1] + 1 :] if ends else []
    return (behind, [f"LabVIEW's lines before the header (line {behind[0][0]}) were left out"]) if behind else None


def _without_title(lines: list[tuple[int, str]], separator: str) -> tuple[list[tuple[int, str]], list[str]]:
    """Leave out lines before the header that have fewer cells than most, where a header follows them."""
    widths = [_filled_width(line, separator) for _, line in lines]
    usual = Counter(widths).most_common(1)[0][0]
    title = next((k for k, width in enumerate(widths) if width >= usual), 0)
    if usual < 2 or not 0 < title <= _MOST_TITLE_LINES:
        return lines, []
    cells = split_cells(lines[title][1], separator)
    if all(parse_number(cell, ",") is not None or parse_stamp(cell) is not None for cell in cells):
        return lines, []  # rows come first: the lines before are a header that is too short, or rows
    return lines[title:], [f"{title} lines before the header (line {lines[title][0]}) were left out"]


def _filled_width(line: str, separator: str) -> int:
    cells = split_cells(line, separator)
    while cells and not cells[-1].strip():
        cells.pop()
    return len(cells)


def _units_below(line: str, separator: str, columns: int) -> tuple[str, ...]:
    """Return the cells of a row of units; nothing for a row of anything else."""
    cells = tuple(cell.strip() for cell in split_cells(line, separator)) if line else ()
    filled = [cell for cell in cells if cell.lower() not in MISSING]
    return cells if filled and len(cells) <= columns + 1 and all(map(is_unit, filled)) else ()


def _width(cells: Sequence[str]) -> int:
    """Without a header, a trailing separator makes no column."""
    return len(cells) - 1 if len(cells) > 1 and not cells[-1] else len(cells)


def _separator(lines: Sequence[str]) -> str:
    """Return what stands, outside of quotes, in most lines; a space where no other does and numbers stand between them."""
    plain = [_QUOTED.sub("", line) for line in lines]
    for sign in ("\t", ";", ","):
        if sum(sign in line for line in plain) * 2 > len(plain):
            return sign
    rows = [line.split() for line in plain]
    numbers = [cells for cells in rows if len(cells) > 1 and all(parse_number(cell, ".") is not None for cell in cells)]
    if len(numbers) * 2 > len(rows):
        return " "
    return next((sign for sign in ("\t", ";") if sign in lines[0]), ",")
