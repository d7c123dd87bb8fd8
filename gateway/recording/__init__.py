"""Recordings of a run: a binary file that survives a kill -9, its readers, and CSV and Parquet made from it.

Importing this room costs no numpy and no pyarrow: the recorder runs inside the control process.
"""

from gateway.recording.errors import RecordingError
from gateway.recording.export import export_csv, export_parquet, write_csv
from gateway.recording.reader import Entry, Recording, find_recording, list_recordings, read_recording
from gateway.recording.recorder import Recorder

__all__ = [
    "Entry",
    "Recorder",
    "Recording",
    "RecordingError",
    "export_csv",
    "export_parquet",
    "find_recording",
    "list_recordings",
    "read_recording",
    "write_csv",
]
