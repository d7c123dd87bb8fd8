"""A column mapping as a YAML file: `time_s: 1:ms`, one line for each column; the keys are those of `--columns`."""

from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from gateway.plain_file import read_plain
from gateway.profiles.strict_yaml.faults import ProfileError
from gateway.profiles.strict_yaml.text import Document, parse
from gateway.recording.errors import RecordingError
from gateway.recording.tables.column_mapping import ColumnMapping

_SUFFIXES: Final = (".yaml", ".yml")
_SHEET: Final = "sheet="
_KEYS: Final = {"column", "unit"}


def column_mapping(text: str | None) -> ColumnMapping | None:
    """Return the mapping of an option's value: a YAML file's name, else `NAME=COLUMN:UNIT,...`; None for None.
    `sheet=NAME` before either names the sheet of a workbook.

    RecordingError in the user's words, for a file with its line and column.
    """
    if text is None:
        return None
    first, _, rest = text.partition(",")
    if first.strip().startswith(_SHEET):
        mapping = column_mapping(rest.strip() or None) or ColumnMapping(())
        return replace(mapping, sheet=first.strip().removeprefix(_SHEET).strip())
    return read_mapping(Path(text)) if text.lower().endswith(_SUFFIXES) else ColumnMapping.parse(text)


def spell_mapping(text: str | None) -> str | None:
    """Return an option's value as text without a file: `NAME=COLUMN:UNIT,...`. None for a file with a header that such a text
    cannot hold."""
    head, comma, rest = (text or "").partition(",")
    if head.strip().startswith(_SHEET):
        entries = spell_mapping(rest)
        return entries if entries is None else f"{head}{comma}{entries}"
    if text is None or not text.lower().endswith(_SUFFIXES):
        return text or ""
    document = parse(read_plain(Path(text)), text)
    entries_by_name = {str(key): str(_entry(document, key)) for key in document.value}
    if any(set(",=") & set(entry.partition("..")[0]) for entry in entries_by_name.values()):
        return None
    return ",".join(f"{name}={entry}" for name, entry in entries_by_name.items())


def read_mapping(path: Path) -> ColumnMapping:
    """Return the mapping in a file. A value is a number, a header, either with `:unit`, or `{column: 7, unit: n}`."""
    try:
        document = parse(read_plain(path), str(path))
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror}") from error
    except ProfileError as error:
        raise RecordingError(str(error)) from None
    try:
        return ColumnMapping.of({str(key): _entry(document, key) for key in document.value})
    except RecordingError as error:
        raise RecordingError(f"{path}: {str(error).removeprefix('--columns: ')}") from None


def _entry(document: Document, key: Any) -> int | str:
    value = document.at(key)
    if isinstance(value, dict) and "column" in value and set(value) <= _KEYS:
        unit = value.get("unit")
        value = f"{value['column']}:{unit}" if unit is not None else value["column"]
    if isinstance(value, (int, str)) and not isinstance(value, bool):
        return value
    raise RecordingError(str(document.fault((key,), "is no column: 7, 7:n, a header, or {column: 7, unit: n}")))
