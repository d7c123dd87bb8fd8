"""Recordings of a run: a binary file that survives a kill -9, its readers, and CSV and Parquet made from it; and tables
from anywhere else, by a column mapping.

Importing this room costs no numpy and no pyarrow: the recorder runs inside the control process. What does is imported by
its module: `measurement.measurement_of` (numpy), `mapping_file.column_mapping` (the strict YAML reader).
"""

from gateway.recording.errors import RecordingError
from gateway.recording.export import export_csv, export_name, export_parquet, write_csv
from gateway.recording.reader import (
    Recording,
    RecordingEntry,
    find_recording,
    list_recordings,
    read_entry,
    read_header,
    read_recording,
    recording_paths,
)
from gateway.recording.recorder import Recorder
from gateway.recording.tables.any_table import read_table
from gateway.recording.tables.column_mapping import ColumnMapping, ColumnSource

__all__ = [
    "ColumnMapping",
    "ColumnSource",
    "Recorder",
    "Recording",
    "RecordingEntry",
    "RecordingError",
    "export_csv",
    "export_name",
    "export_parquet",
    "find_recording",
    "list_recordings",
    "read_entry",
    "read_header",
    "read_recording",
    "read_table",
    "recording_paths",
    "write_csv",
]
