"""One summary per recording, for lists: a file is read once, and again only when it has changed.

What was read is kept in RECORDINGS/.summaries.json, for every process that lists them; without it, or where it cannot be
written, everything is read again. A thousand recordings are listed from it in a fraction of a second.
"""

import contextlib
import json
import os
import tempfile
from math import isfinite
from pathlib import Path
from typing import Any, Final

from gateway.processes.durable_file import read_object
from gateway.progress import report
from gateway.recording.care.what_happened import tell_happened
from gateway.recording.errors import RecordingError
from gateway.recording.label import label_of
from gateway.recording.reader import Recording, read_recording, recording_paths

_CACHE: Final = ".summaries.json"
_FORMAT: Final = 1  # of what stands in it; another one is read as nothing
Summary = dict[str, Any]


def list_summaries(state: Path) -> list[Summary]:
    """Return what is known of every recording, by number."""
    folder = state / "recordings"
    before, paths = _read_cache(folder), recording_paths(state)
    now: dict[str, list[Any]] = {}
    for done, path in enumerate(paths):
        with contextlib.suppress(FileNotFoundError):  # deleted meanwhile
            status = path.stat()
            key, known = [status.st_mtime_ns, status.st_size], before.get(path.name)
            if known is None or known[0] != key:
                report("reading recordings", done, len(paths))
                known = [key, summary_of(path)]
            now[path.name] = known
    if now != before:
        _write_cache(folder, now)
    return [{"path": str(folder / name), **summary} for name, (_, summary) in now.items()]


def summary_of(path: Path) -> Summary:
    """Return what is known of one recording; of one that cannot be read, why. FileNotFoundError where there is none."""
    summary: Summary = {"number": int(path.stem), "file": path.name, "size_bytes": path.stat().st_size}
    try:
        recording = read_recording(path)
    except FileNotFoundError:
        raise
    except (RecordingError, OSError) as error:
        return _NOTHING_KNOWN | summary | {"fault": str(error)}
    header, happened = recording.header, tell_happened(recording)
    label = label_of(header)
    return summary | {
        "name": label.name,
        "note": label.note,
        "started_utc": header.get("started_utc"),
        "rig": header.get("rig"),
        "calibration": header.get("calibration"),
        "plant": (header.get("plant_in_use") or {}).get("number"),
        "happened": happened.as_words() if happened else "",
        "facts": happened.as_facts() if happened else {},
        "rows": recording.rows,
        "duration_s": _duration_s(recording),
        "truncated": recording.truncated,
        "fault": "",
    }


def _duration_s(recording: Recording) -> float:
    time_s = recording.columns.get("time_s")
    duration_s = 0.0 if time_s is None or not len(time_s) else float(time_s[-1] - time_s[0])
    return duration_s if isfinite(duration_s) else 0.0  # of another program: JSON has no NaN


_NOTHING_KNOWN: Final[Summary] = {
    **dict.fromkeys(("name", "note", "happened"), ""),
    **dict.fromkeys(("started_utc", "rig", "calibration", "plant")),
    "facts": {},
    "rows": 0,
    "duration_s": 0.0,
    "truncated": True,
}


def _read_cache(folder: Path) -> dict[str, list[Any]]:
    with contextlib.suppress(OSError, ValueError, KeyError, AttributeError):
        cache = read_object(folder / _CACHE)
        if cache.get("format") == _FORMAT:
            return {name: known for name, known in cache["recordings"].items() if _is_known(known)}
    return {}


def _is_known(entry: Any) -> bool:
    """Decide whether an entry is key and summary."""
    return isinstance(entry, list) and len(entry) == 2 and isinstance(entry[1], dict)


def _write_cache(folder: Path, recordings: dict[str, list[Any]]) -> None:
    """Replace the file at once; whoever reads meanwhile has the one before. A disk that takes none costs time only."""
    with contextlib.suppress(OSError):
        descriptor, beside = tempfile.mkstemp(dir=folder, prefix=_CACHE)
        try:
            with os.fdopen(descriptor, "w", encoding="utf-8") as stream:
                json.dump({"format": _FORMAT, "recordings": recordings}, stream)
            Path(beside).replace(folder / _CACHE)
        finally:
            Path(beside).unlink(missing_ok=True)
