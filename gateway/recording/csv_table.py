"""Reads a CSV of the recording contract: UTF-8, `# key: value` lines, one header row, numbers.

Separator (comma, semicolon, tab) is detected; with semicolons a decimal comma is understood. A cell that is empty or no
number becomes NaN and is told in the notes by row and column, because a reader cannot know whether the row matters; a
row with too few or too many cells is told and left out. What is no table at all is a RecordingError.
"""

import csv
import io
from collections.abc import Sequence
from math import nan
from pathlib import Path
from typing import Final

from gateway.recording.errors import RecordingError
from gateway.recording.reader import Recording

_MOST_NOTES: Final = 3


def read_csv(path: Path) -> Recording:
    """Header facts and columns of a CSV; RecordingError with what was seen when it is none, OSError as usual."""
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise RecordingError(f"{path} is neither a recording nor a CSV: byte {error.start} is no UTF-8 text") from error
    facts, lines = _split(text)
    if not lines:
        raise RecordingError(f"{path} holds no table: no row with numbers")
    separator = _separator(lines[0][1])
    names = [cell.strip() for cell in lines[0][1].split(separator)]
    if all(_number(name, separator) is not None for name in names):
        raise RecordingError(
            f"{path}:{lines[0][0]}: no header row; it names the columns, such as time_s,command_v,force_n"
        )
    if len(set(names)) != len(names):
        raise RecordingError(f"{path}:{lines[0][0]}: a column name stands twice in {', '.join(names)}")
    return _table(path, facts, names, lines[1:], separator)


def _split(text: str) -> tuple[dict[str, str], list[tuple[int, str]]]:
    """Facts of the comment lines, and the other lines with their numbers."""
    facts: dict[str, str] = {}
    lines: list[tuple[int, str]] = []
    for number, line in enumerate(io.StringIO(text), start=1):
        stripped = line.strip()
        if stripped.startswith("#"):
            key, colon, value = stripped[1:].partition(":")
            facts |= {key.strip(): value.strip()} if colon else {}
        elif stripped:
            lines.append((number, stripped))
    return facts, lines


def _separator(header: str) -> str:
    return max((",", ";", "\t"), key=header.count)


def _table(
    path: Path, facts: dict[str, str], names: list[str], lines: Sequence[tuple[int, str]], separator: str
) -> Recording:
    import numpy as np

    rows: list[list[float]] = []
    notes: list[str] = []
    for number, line in lines:
        cells = next(csv.reader([line], delimiter=separator))
        if len(cells) != len(names):
            notes.append(f"line {number} has {len(cells)} cells, the header {len(names)}: left out")
            continue
        values = [_number(cell, separator) for cell in cells]
        notes += [
            f"line {number}, {names[k]}: {cells[k].strip()[:20]!r} is no number"
            for k, value in enumerate(values)
            if value is None
        ]
        rows.append([nan if value is None else value for value in values])
    table = np.array(rows, dtype=np.float64).reshape(-1, len(names))
    columns = {name: table[:, k].copy() for k, name in enumerate(names)}
    return Recording(path, dict(facts), columns, len(rows), bool(notes), _shortened(notes))


def _number(cell: str, separator: str) -> float | None:
    """The value of a cell; NaN as written is a value."""
    text = cell.strip()
    try:
        return float(text.replace(",", ".") if separator == ";" else text)
    except ValueError:
        return None


def _shortened(notes: list[str]) -> tuple[str, ...]:
    more = len(notes) - _MOST_NOTES
    return (*notes[:_MOST_NOTES], f"and {more} more such lines") if more > 0 else tuple(notes)
