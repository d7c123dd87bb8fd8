"""The recordings that a retention leaves alone: the ladders of the calibrations that are in use, come back with a rollback, or
stand in a slot: `fit`, `calibration compare` and who asks where a curve comes from read them again; and the last ladder of all,
which `calibrate --resume` goes on with.

Those of all other calibrations go in their turn, for a robot may make one each day, and the disk has an end.
"""

import contextlib
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

from gateway.numbered_documents.selection import read_selection
from gateway.numbered_documents.store import file_name
from gateway.processes.durable_file import read_regular
from gateway.processes.state_directory import CALIBRATIONS, RECORDINGS
from gateway.recording import RecordingError, read_header, recording_paths
from gateway.recording.layout import SUFFIX, number_in

_LOOKED_AT: Final = 200  # of the last recordings: whoever goes on with a ladder does so before there are so many others
_SOURCE: Final = re.compile(r'^source: "recording ([^/"\\:]+):', re.MULTILINE)


def kept_ladders(state: Path) -> frozenset[str]:
    """Return the files' names in STATE/recordings; no calibration is checked for it, and one that cannot be read keeps none."""
    folder = state / CALIBRATIONS
    names: set[str] = set()
    if last := find_last_ladder(recording_paths(state)[-_LOOKED_AT:]):
        names |= set(_parts(state / RECORDINGS, last[0].name))
    with contextlib.suppress(OSError):
        selected, _ = read_selection(folder, "calibration")
        for number in selected.numbers:
            names |= set(_parts(state / RECORDINGS, _source_of(folder / file_name(number))))
    return frozenset(names)


def find_last_ladder(paths: Sequence[Path]) -> tuple[Path, dict[str, Any]] | None:
    """Return the last of these recordings that is a ladder, and its header; None where none is. Of the others, which may have
    gigabytes, only the headers are read."""
    for path in reversed(paths):
        with contextlib.suppress(OSError, RecordingError):
            if (header := read_header(path)).get("ladder"):
                return path, header
    return None


def _source_of(calibration: Path) -> str:
    with contextlib.suppress(OSError, UnicodeDecodeError):
        if found := _SOURCE.search(read_regular(calibration).decode()):
            return found[1]
    return ""


def _parts(recordings: Path, name: str) -> Iterator[str]:
    """Yield a recording of ours and, of a resumed run, those that it goes on from."""
    path = recordings / name
    if path.suffix != SUFFIX or number_in(path) is None:
        return
    yield name
    with contextlib.suppress(OSError, RecordingError, ValueError, TypeError):
        for number in read_header(path).get("continues", ()):
            yield f"{int(number):04d}{SUFFIX}"
