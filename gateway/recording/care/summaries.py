"""One summary per recording, for lists: a file is read once, and again only when it has changed.

What was read is kept in RECORDINGS/.summaries.json, for every process that lists them; without it, or where it cannot be
written, everything is read again. A thousand recordings are listed from it in a fraction of a second.
One that is being recorded changes all the time: who looks again and again has only its header read.
"""

import contextlib
import json
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import Any, Final

from gateway.plain_file import closing_descriptor, write_whole
from gateway.processes.durable_file import open_beside, read_object
from gateway.processes.state_directory import RECORDINGS
from gateway.progress import report
from gateway.recording.care.keeping import is_being_recorded
from gateway.recording.care.what_happened import tell_happened
from gateway.recording.errors import RecordingError, tell_unreadable
from gateway.recording.label import label_of
from gateway.recording.reader import Recording, read_header, read_recording, recording_paths

_CACHE: Final = ".summaries.json"
_FORMAT: Final = 1  # of what stands in it; another one is read as nothing
Summary = dict[str, Any]


def list_summaries(state: Path, *, reads_growing: bool = True) -> list[Summary]:
    """Return what is known of every recording, by number. reads_growing: False for who asks every few seconds, and needs no
    more of one that is being recorded than what its header says, and `growing`; by the hour it has 250 MB."""
    folder = state / RECORDINGS
    before, paths = _read_cache(folder), recording_paths(state)
    now: dict[str, list[Any]] = {}
    growing: dict[str, list[Any]] = {}
    for done, path in enumerate(paths):
        with contextlib.suppress(FileNotFoundError):  # deleted meanwhile
            status = path.stat()
            key, known = [status.st_mtime_ns, status.st_size], before.get(path.name)
            if known is None or known[0] != key:
                if not reads_growing and _grows(path):
                    growing[path.name] = [key, _summary_of_growing(path)]
                    continue
                report("reading recordings", done, len(paths))
                known = [key, summary_of(path)]
            now[path.name] = known
    if now != before:
        _write_cache(folder, now)
    found = now | growing
    return [{"path": str(path), **found[path.name][1]} for path in paths if path.name in found]


def summary_of(path: Path) -> Summary:
    """Return what is known of one recording; of one that cannot be read, why. FileNotFoundError where there is none."""
    summary = _of_file(path)
    try:
        recording = read_recording(path)
    except FileNotFoundError:
        raise
    except (RecordingError, OSError) as error:
        return _NOTHING_KNOWN | summary | {"fault": tell_unreadable(error)}
    happened = tell_happened(recording)
    return {
        **summary,
        **_said_by(recording.header),
        "happened": happened.as_words() if happened else "",
        "facts": happened.as_facts() if happened else {},
        "rows": recording.rows,
        "duration_s": _duration_s(recording),
        "truncated": recording.truncated,
        "fault": "",
    }


def _grows(path: Path) -> bool:
    """What cannot be asked is read as any other one: that tells why."""
    with contextlib.suppress(OSError):
        return is_being_recorded(path)
    return False


def _summary_of_growing(path: Path) -> Summary:
    """FileNotFoundError where there is none."""
    try:
        said = _said_by(read_header(path)) | {"growing": True, "truncated": False, "fault": ""}
    except FileNotFoundError:
        raise
    except (RecordingError, OSError) as error:
        said = {"fault": tell_unreadable(error)}
    return _NOTHING_KNOWN | _of_file(path) | said


def _of_file(path: Path) -> Summary:
    return {"number": int(path.stem), "file": path.name, "size_bytes": path.stat().st_size}


def _said_by(header: Mapping[str, Any]) -> Summary:
    label = label_of(header)
    return {
        "name": label.name,
        "note": label.note,
        "started_utc": _text_of(header, "started_utc"),
        "rig": _text_of(header, "rig"),
        "calibration": header.get("calibration"),
        "plant": (header.get("plant_in_use") or {}).get("number"),
    }


def _text_of(header: Mapping[str, Any], key: str) -> str | None:
    """Another program may have written anything there."""
    value = header.get(key)
    return None if value is None else str(value)


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
        beside, descriptor = open_beside(folder / _CACHE, 0o600)
        with closing_descriptor(descriptor):
            try:
                write_whole(descriptor, json.dumps({"format": _FORMAT, "recordings": recordings}).encode())
                beside.replace(folder / _CACHE)
            except OSError:
                beside.unlink()
