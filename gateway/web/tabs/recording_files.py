"""The recordings of a state directory for the page: the list, whole files in other forms, and a picture.

Everything here reads from the disk and runs in worker threads.
"""

import threading
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from gateway.recording import Recording, find_recording, read_recording
from gateway.recording.care.keeping import is_kept
from gateway.recording.care.summaries import list_summaries
from gateway.recording.errors import RecordingError
from gateway.web.tabs.answers import NOT_FOUND, TabRefusedError

FORMS: Final = ("csv", "parquet")


def recording_path(state: Path, number: int) -> Path:
    """Return the file of a number. TabRefusedError where there is none."""
    try:
        return find_recording(state, number)
    except RecordingError as error:
        raise TabRefusedError(f"E403 {error}", NOT_FOUND) from None


def recording_facts(state: Path) -> list[dict[str, Any]]:
    """Return every recording, the newest first; of one that is being recorded no rows, for a page asks every two seconds."""
    known = reversed(list_summaries(state, reads_growing=False))
    return [{"growing": False, **facts, "kept": is_kept(Path(facts["path"]))} for facts in known]


@dataclass(frozen=True, slots=True)
class ExportedFile:
    """A recording in another form, in a folder that is to be removed when it was sent."""

    path: Path
    folder: TemporaryDirectory[str]


_one_at_a_time: Final = threading.Lock()


def export_recording(state: Path, number: int, form: str) -> ExportedFile:
    """Write a recording as CSV or Parquet into a folder of its own. One at a time: a long one takes memory."""
    from gateway.recording import export_csv, export_name, export_parquet

    source = recording_path(state, number)
    with _one_at_a_time:
        recording = _read(source)
        folder = TemporaryDirectory(prefix="force-gateway-export-")
        target = Path(folder.name) / export_name(recording, number, form)
        try:
            (export_parquet if form == "parquet" else export_csv)(recording, target)
        except BaseException:
            folder.cleanup()
            raise
    return ExportedFile(target, folder)


def draw_recording(state: Path, number: int) -> str:
    """Return a page with two drawings: forces and the voltage against time."""
    from gateway.reports.recording_plot import recording_page, why_no_picture

    with _one_at_a_time:
        recording = _read(recording_path(state, number))
    if why := why_no_picture(recording):
        raise TabRefusedError(f"recording {number} {why}")
    return recording_page(recording)


def _read(path: Path) -> Recording:
    try:
        return read_recording(path)
    except RecordingError as error:
        raise TabRefusedError(f"E403 {error}") from None
