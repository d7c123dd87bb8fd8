"""The sheet of an Excel workbook (.xlsx) as lines of tab-separated text; line n is row n of the sheet.

Read row by row, never whole. A workbook is a zip file, and a small one may hold terabytes: the sizes that its directory
says are looked at first (Python reads no more of a part than was said), and rows and columns are counted on the way.
"""

import warnings
from collections.abc import Iterator, Sequence
from datetime import date, datetime, time, timedelta
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Final
from zipfile import BadZipFile, ZipFile

from gateway.extras import import_library
from gateway.recording.errors import RecordingError
from gateway.recording.foreign.headers import MOST_COLUMNS

LARGEST_SHEET_BYTES: Final = 512 << 20
"""As XML, unpacked: a million rows of five columns are 250 MB."""
LARGEST_PART_BYTES: Final = 32 << 20
"""Of any other part: these are held in memory."""
LONGEST_ROWS: Final = 1 << 20
_SHEETS: Final = "xl/worksheets/"
_WHITE: Final = str.maketrans("\t\r\n\x0b\x0c", "     ")
_FAULTY: Final = "is a damaged Excel workbook"


def write_sheet(path: Path, sheet: str | None, target: Path) -> tuple[str, ...]:
    """Write one sheet, the first where none is asked for, and return notes. RecordingError for what is no workbook."""
    _check_zip(path)
    openpyxl = import_library("openpyxl")
    with path.open("rb") as stream, warnings.catch_warnings():  # ours to close: openpyxl forgets it after a fault
        warnings.simplefilter("ignore")  # on styles and charts that it does not know
        try:
            workbook = openpyxl.load_workbook(stream, read_only=True, data_only=True, keep_links=False)
        except Exception as error:  # whatever a damaged file makes of it
            raise RecordingError(f"{path} {_FAULTY}: {_first_line(error)}") from error
        try:
            chosen = _choose(path, workbook, sheet)
            _write_rows(path, chosen, target)
            names = [each.title for each in workbook.worksheets]
        finally:
            workbook.close()
    others = [name for name in names if name != chosen.title]
    return (
        (f"sheet {chosen.title!r} was read; --sheet takes another: {', '.join(others[:6])}",)
        if others and not sheet
        else ()
    )


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:120]


def _check_zip(path: Path) -> None:
    """Refuse what is no workbook, and one that is larger than it looks."""
    try:
        with ZipFile(path) as file:
            parts = file.infolist()
    except (BadZipFile, OSError, ValueError, NotImplementedError) as error:
        raise RecordingError(f"{path} {_FAULTY} or zip file: {_first_line(error)}") from error
    names = {part.filename for part in parts}
    if "xl/workbook.xml" not in names:
        raise RecordingError(f"{path} is {_other_zip(names)}, not a recording: save the table as CSV or .xlsx")
    for part in parts:
        largest = LARGEST_SHEET_BYTES if part.filename.startswith(_SHEETS) else LARGEST_PART_BYTES
        if part.filename.endswith((".xml", ".rels", ".bin")) and part.file_size > largest:
            raise RecordingError(
                f"{path}: its part {part.filename[:60]} is {part.file_size >> 20} MB unpacked, allowed {largest >> 20} MB: "
                "save the sheet as CSV"
            )


def _other_zip(names: set[str]) -> str:
    if "xl/workbook.bin" in names:
        return "a binary Excel workbook (.xlsb)"
    if "word/document.xml" in names:
        return "a Word document"
    return "an OpenDocument file (.ods, .odt)" if "content.xml" in names else "a zip file"


def _choose(path: Path, workbook: Any, sheet: str | None) -> Any:
    """Return the sheet of a name or number (from 1), the first without one."""
    names = [each.title for each in workbook.worksheets]
    if not names:
        raise RecordingError(f"{path} has no sheet with cells")
    if sheet is None:
        return workbook.worksheets[0]
    if sheet in names:
        return workbook.worksheets[names.index(sheet)]
    if sheet.isdecimal() and 1 <= int(sheet) <= len(names):
        return workbook.worksheets[int(sheet) - 1]
    near = get_close_matches(sheet, names, n=1, cutoff=0.5)
    raise RecordingError(
        f"{path} has no sheet {sheet!r}; {f'did you mean {near[0]!r}?' if near else 'there: ' + ', '.join(names[:12])}"
    )


def _write_rows(path: Path, chosen: Any, target: Path) -> None:
    """Write every row, filled up to the widest before: a cell that is empty at the end of a row is not in the file."""
    width = 0
    with target.open("w", encoding="utf-8", newline="") as text:
        for cells in _rows(path, chosen):
            words = [_cell_text(cell) for cell in cells]
            while words and not words[-1]:
                words.pop()
            width = max(width, len(words))
            text.write("\t".join([*words, *[""] * (width - len(words) if words else 0)]) + "\n")


def _rows(path: Path, chosen: Any) -> Iterator[Sequence[Any]]:
    """Yield the rows as they stand: what a file says of its size is not believed."""
    chosen.reset_dimensions()
    try:
        for at, cells in enumerate(chosen.iter_rows(values_only=True)):
            if at >= LONGEST_ROWS or len(cells) > MOST_COLUMNS:
                raise RecordingError(
                    f"{path}: row {at + 1} of {len(cells)} columns: a sheet has at most {LONGEST_ROWS} rows of "
                    f"{MOST_COLUMNS} columns here"
                )
            yield cells
    except RecordingError:
        raise
    except Exception as error:
        raise RecordingError(f"{path} {_FAULTY}: {_first_line(error)}") from error


def _cell_text(cell: Any) -> str:
    """Return a cell as text: numbers in full, stamps by ISO 8601, a fault such as #DIV/0! as no number."""
    match cell:
        case None:
            return ""
        case bool():
            return str(int(cell))
        case timedelta():
            return repr(cell.total_seconds())
        case datetime() | date() | time():
            return cell.isoformat()
        case str():
            return "nan" if cell.startswith("#") and cell.endswith(("!", "?", "/A")) else cell.translate(_WHITE)
    return repr(cell)
