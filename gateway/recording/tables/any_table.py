"""Any recording that a user may have, by its first bytes: our own format, Parquet, a workbook, else a table of text."""

from dataclasses import replace
from pathlib import Path

from gateway.plain_file import is_directory, other_kind
from gateway.recording.errors import RecordingError
from gateway.recording.foreign.table_text import ZIP, refuse_other_kinds
from gateway.recording.layout import MAGIC
from gateway.recording.reader import Recording, read_recording
from gateway.recording.tables.column_mapping import ColumnMapping, factors_of, select_columns
from gateway.recording.tables.csv_table import read_csv
from gateway.recording.tables.force_unit import force_in_newtons
from gateway.recording.tables.parquet_table import MAGIC as PARQUET_MAGIC
from gateway.recording.tables.parquet_table import read_parquet


def read_table(path: Path, mapping: ColumnMapping | None = None, *, lenient: bool = False) -> Recording:
    """Return the columns of any table, renamed and converted by `mapping`; float64, NaN where nothing was measured.

    lenient: rows and cells of a CSV that cannot be read are told in `notes` and left out; else they are a
    RecordingError that names row and column. OSError as usual.
    """
    return force_in_newtons(_read_any(path, mapping, lenient))


def _read_any(path: Path, mapping: ColumnMapping | None, lenient: bool) -> Recording:
    if is_directory(path):
        raise RecordingError(f"{path} is a directory: name the recording in it")
    if other := other_kind(path):
        raise RecordingError(
            f"{path} is {other}, not a recording (.fgr, CSV, Parquet or .xlsx): save it in a file first"
        )
    with path.open("rb") as stream:
        start = stream.read(len(MAGIC))
    if start == MAGIC or (path.suffix == ".fgr" and start):
        return _apply_mapping(read_recording(path), mapping)
    if start.startswith(PARQUET_MAGIC):
        return read_parquet(path, mapping)
    if not start:
        raise RecordingError(f"{path} is an empty file, not a recording (.fgr, CSV, Parquet or .xlsx)")
    if not start.startswith(ZIP):
        refuse_other_kinds(path)
    return read_csv(path, mapping, lenient=lenient)


def _apply_mapping(recording: Recording, mapping: ColumnMapping | None) -> Recording:
    if mapping is None:
        return recording
    names = list(recording.columns)
    picks = select_columns(names, mapping, str(recording.path))
    columns = {pick.name: recording.columns[names[pick.index]] * pick.factor + pick.offset for pick in picks}
    return replace(recording, columns=columns, factors=factors_of(picks))
