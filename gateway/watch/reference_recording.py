"""The rig's reference recording: the machine as it is known to be well. What differs from it later is a change.

STATE/reference holds a copy of the recording, so that it outlives the other ones, and who has chosen it. A user does
(`recordings reference`); else it is the first good recording that begins after a `calibration use`, for then somebody has just
said that the machine is as it should be. What a user has chosen stays until he chooses again.
"""

import json
import os
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from typing import Final

from gateway.numbered_documents.selection import read_selection
from gateway.plain_file import is_file
from gateway.processes.durable_file import (
    lock_directory,
    make_directory,
    read_object,
    remove_if_possible,
    replace_durably,
)
from gateway.processes.state_directory import CALIBRATIONS
from gateway.recording import RecordingError, read_header, read_table
from gateway.recording.care.keeping import CLOSED_S
from gateway.recording.errors import tell_unreadable
from gateway.recording.reader import Recording, recording_paths

_FOLDER: Final = "reference"
_FACTS: Final = "reference.json"
_DIGITS: Final = 12
_LEAST_S: Final = 30.0
LEAST_EXCITATION_V: Final = 0.2
LEAST_MOVES: Final = 4
"""What a recording, or a window that later ones are compared with, must have: a rest, or one step, says little of a machine."""


@dataclass(frozen=True, slots=True)
class ReferenceRecording:
    """file: the copy's name in STATE/reference, another one for other content; name: of the recording; calibration: the number
    that was in use then, 0 for one that a user has chosen (is_chosen)."""

    file: str
    name: str
    sha256: str
    kept_utc: str
    calibration: int = 0
    is_chosen: bool = False


def reference_path(state: Path, reference: ReferenceRecording) -> Path:
    """Return the copy of the recording."""
    return state / _FOLDER / reference.file


def read_reference_recording(state: Path) -> ReferenceRecording | None:
    """Return the rig's reference; None where none was kept, or its file is gone."""
    try:
        reference = ReferenceRecording(**read_object(state / _FOLDER / _FACTS))
        is_whole = isinstance(reference.name, str) and isinstance(reference.kept_utc, str)
        return reference if is_whole and is_file(reference_path(state, reference)) else None
    except (OSError, ValueError, TypeError):
        return None


def keep_reference_recording(state: Path, recording: Path, calibration: int | None = None) -> ReferenceRecording:
    """Keep a copy of this recording as the rig's reference, and return what is known of it. calibration: that it was found
    for; None: a user has chosen it. OSError, and the one before stays, where it cannot be read or the disk refuses."""
    folder, data = state / _FOLDER, recording.read_bytes()
    digest = sha256(data).hexdigest()
    make_directory(folder)
    kept = ReferenceRecording(
        file=f"{recording.stem}-{digest[:_DIGITS]}{recording.suffix}",
        name=recording.name,
        sha256=digest,
        kept_utc=f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}",
        calibration=calibration or 0,
        is_chosen=calibration is None,
    )
    with lock_directory(folder) as descriptor:
        try:
            replace_durably(descriptor, kept.file, data)
            replace_durably(descriptor, _FACTS, json.dumps(asdict(kept)).encode())
        except OSError as error:  # of the descriptor it knows the name alone
            raise OSError(error.errno, error.strerror, str(folder)) from None
        _remove_all_but(folder, descriptor, kept.file)
    return kept


def drop_reference_recording(state: Path) -> bool:
    """Have no reference any more; return whether there was one. OSError where the disk refuses."""
    folder = state / _FOLDER
    if read_reference_recording(state) is None:
        return False
    with lock_directory(folder) as descriptor:
        (folder / _FACTS).unlink(missing_ok=True)
        os.fsync(descriptor)
        _remove_all_but(folder, descriptor, "")
    return True


def _remove_all_but(folder: Path, descriptor: int, kept: str) -> None:
    for path in folder.iterdir():
        if path.name not in {kept, _FACTS}:
            remove_if_possible(descriptor, path.name)


class FirstGoodRecording:
    """Looks for the first good recording that begins after the last `calibration use`; each recording is read once."""

    def __init__(self, state: Path) -> None:
        self._state = state
        self._passed: set[tuple[Path, int]] = set()

    def keep(self, now_s: float) -> ReferenceRecording | None:
        """Return the reference that was kept now; None where there is nothing to do: no calibration was taken into use, a user
        has chosen, or the calibration has one. now_s: of the epoch."""
        since = _calibration_in_use(self._state)
        known = read_reference_recording(self._state)
        if since is None or (known and (known.is_chosen or known.calibration == since[0])):
            return None
        if since[1] > now_s + CLOSED_S:  # of years to come: the clock was ahead then, and nobody knows when it was
            since = since[0], 0.0
        for path in recording_paths(self._state):
            if (path, since[0]) in self._passed:
                continue
            if abs(now_s - path.stat().st_mtime) < CLOSED_S:  # one of years to come: the clock was ahead, and is set
                return None  # it may become the first good one
            if _is_first_good(path, *since):
                return keep_reference_recording(self._state, path, since[0])
            self._passed.add((path, since[0]))
        return None


def _is_first_good(path: Path, calibration: int, since_s: float) -> bool:
    """Of what was made otherwise only the header is read: recordings of a day have hundreds of megabytes each."""
    try:
        header = read_header(path)
        is_of_it = header.get("calibration") == calibration and _begin_s(header) >= since_s
        return is_of_it and not _why_it_says_little(read_table(path))
    except (OSError, RecordingError):
        return False


def why_no_reference(path: Path) -> str:
    """Return why a recording cannot describe a machine, as a sentence; empty where it can."""
    try:
        recording = read_table(path)
    except (OSError, RecordingError) as error:
        return tell_unreadable(error)
    return _why_it_says_little(recording)


def _why_it_says_little(recording: Recording) -> str:
    import numpy as np

    columns = recording.columns
    if missing := [name for name in ("time_s", "command_v") if name not in columns]:
        return f"it has no {' and no '.join(missing)}"
    time_s, command_v = columns["time_s"], columns["command_v"]
    if command_v.size < 2 or time_s[-1] - time_s[0] < _LEAST_S:
        return f"it is shorter than {_LEAST_S:.0f} s"
    if np.any(columns.get("fault_code", np.zeros(1)) != 0.0):
        return "a fault stood in it"
    signs = np.sign(np.diff(command_v))
    turns = np.count_nonzero(np.diff(signs[signs != 0.0]))
    if np.std(command_v) < LEAST_EXCITATION_V or turns < LEAST_MOVES:
        return f"the command hardly moves in it: {np.std(command_v):.2f} V (rms), {turns} turns"
    return ""


def _calibration_in_use(state: Path) -> tuple[int, float] | None:
    """Number of the calibration that somebody has taken into use, and when, s of the epoch; None for the rig's own."""
    folder = state / CALIBRATIONS
    selection, _ = read_selection(folder, "calibration")
    if not selection.active.number:
        return None
    try:
        return selection.active.number, (folder / f"active.{selection.generation:06d}").stat().st_mtime
    except OSError:
        return None


def _begin_s(header: dict[str, object]) -> float:
    try:
        return datetime.fromisoformat(str(header.get("started_utc")).replace("Z", "+00:00")).timestamp()
    except ValueError:
        return 0.0
