"""What kind of CSV this is, from its first lines: facts, separator, decimal sign, header or none, which columns are words.

A tab is never part of a number, a semicolon hardly; so they are taken for the separator before the comma is, and then a
comma inside a cell is a decimal one.
"""

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TextIO

from gateway.recording.errors import RecordingError

MISSING: Final = frozenset(("", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--"))
"""What stands, in lower case, where no number was taken."""
_SAMPLE_LINES: Final = 200
_DECIMAL_COMMA: Final = re.compile(r"\d,\d")
_UNPRINTABLE: Final = re.compile(r"[\x00-\x08\x0e-\x1f]")
_OTHER_FORMATS: Final = (
    (b"PK\x03\x04", "an Excel or zip file: save the sheet as CSV"),
    (b"\x1f\x8b", "a gzip file: unpack it first"),
    (b"\xff\xfe", "UTF-16 text: save it as UTF-8"),
    (b"\xfe\xff", "UTF-16 text: save it as UTF-8"),
    (b"\xd0\xcf\x11\xe0", "an old Excel file: save the sheet as CSV"),
)


@dataclass(frozen=True, slots=True)
class CsvDialect:
    """names: one per column, "" where the header has none; skip: lines before the first row; sample: the first rows."""

    path: Path
    facts: dict[str, str]
    names: tuple[str, ...]
    separator: str
    decimal: str
    has_header: bool
    skip: int
    sample: tuple[tuple[str, ...], ...]

    def cells(self, line: str) -> list[str]:
        """Return the cells of a line as they stand; empty ones beyond the last column are a trailing separator, and dropped."""
        cells = split_cells(line, self.separator)
        while len(cells) > len(self.names) and not cells[-1].strip():
            cells.pop()
        return cells

    def parse_number(self, cell: str) -> float | None:
        """Return the value of a cell, NaN where nothing was taken; None when it is no number."""
        return parse_number(cell, self.decimal)

    def is_words(self, index: int) -> bool:
        """Return whether no filled cell of the first rows is a number."""
        cells = [row[index] for row in self.sample if index < len(row) and row[index].strip().lower() not in MISSING]
        return bool(cells) and all(self.parse_number(cell) is None for cell in cells)


def split_cells(line: str, separator: str) -> list[str]:
    """Return the cells of a line; quotes are heeded where there are any."""
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


def detect_dialect(path: Path) -> CsvDialect:
    """Read the first lines. RecordingError for what is no table, OSError as usual."""
    _refuse_other_formats(path)
    with path.open(encoding="utf-8-sig") as stream:
        try:
            facts, lines = _first_lines(stream)
        except UnicodeDecodeError as error:
            raise RecordingError(
                f"{path} is neither a recording nor a CSV: byte 0x{error.object[error.start]:02X} near its beginning "
                "is no UTF-8 text; a table from another program: save it as UTF-8"
            ) from error
    if not lines:
        raise RecordingError(f"{path} holds no table: no row with numbers")
    return _make_dialect(path, facts, lines)


def rows_of(stream: TextIO, facts: dict[str, str]) -> Iterator[tuple[int, str]]:
    """Yield (line number, line) of every line that is neither blank nor a comment; `# key: value` goes into facts."""
    for at, line in enumerate(stream, start=1):
        stripped = line.strip()
        if stripped.startswith("#"):
            key, colon, value = stripped[1:].partition(":")
            facts |= {key.strip(): value.strip()} if colon else {}
        elif stripped:
            yield at, line.rstrip("\r\n")


def _refuse_other_formats(path: Path) -> None:
    with path.open("rb") as stream:
        start = stream.read(8)
    for magic, what in _OTHER_FORMATS:
        if start.startswith(magic):
            raise RecordingError(f"{path} is neither a recording nor a CSV but {what}")


def _first_lines(stream: TextIO) -> tuple[dict[str, str], list[tuple[int, str]]]:
    facts: dict[str, str] = {}
    lines: list[tuple[int, str]] = []
    for line in rows_of(stream, facts):
        lines.append(line)
        if len(lines) == _SAMPLE_LINES:
            break
    return facts, lines


def _make_dialect(path: Path, facts: dict[str, str], lines: Sequence[tuple[int, str]]) -> CsvDialect:
    (at, first), rest = lines[0], [line for _, line in lines[1:]]
    if _UNPRINTABLE.search(first):
        raise RecordingError(f"{path} is neither a recording nor a CSV: line {at} is no text")
    separator = _separator(first)
    decimal = "," if separator != "," and any(_DECIMAL_COMMA.search(line) for line in rest or [first]) else "."
    names = tuple(cell.strip() for cell in split_cells(first, separator))
    has_header = any(parse_number(name, decimal) is None for name in names)
    rows = rest if has_header else [first, *rest]
    sample = tuple(tuple(split_cells(row, separator)) for row in rows)
    shown = names if has_header else ("",) * _width(names)
    return CsvDialect(path, facts, shown, separator, decimal, has_header, at if has_header else at - 1, sample)


def _width(cells: Sequence[str]) -> int:
    """Without a header, a trailing separator makes no column."""
    return len(cells) - 1 if len(cells) > 1 and not cells[-1] else len(cells)


def _separator(line: str) -> str:
    return next((sign for sign in ("\t", ";") if sign in line), ",")
