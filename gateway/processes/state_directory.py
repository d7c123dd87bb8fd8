"""What stands where in the state directory of a rig, by the names that several rooms open.

Beside these: `events.jsonl` (event_file), `lock` (state_lock), `reference` (gateway.watch.reference_recording), each known to
one file. Beside the directory a restore leaves what was there before, and works on what will be (cli/state_archive.py).
"""

from glob import escape
from pathlib import Path
from typing import Final

from gateway.plain_file import exists, is_directory
from gateway.processes.durable_file import lock_directory, sync_path

RECORDINGS: Final = "recordings"
CALIBRATIONS: Final = "calibrations"
PLANTS: Final = "plants"
AUDIT: Final = "audit"
CONTROL_SOCKET: Final = "control.sock"
RIG_SOCKET: Final = "rig.sock"
"""Of the simulated rig's process."""
RUNNING: Final = "running"
"""A file that exists only while a gateway runs."""
LEFT: Final = "left.json"
"""What a gateway that has ended cleanly leaves to the next start."""


def place_of_restore(state: Path) -> Path:
    """Return the directory beside the state that a restore works in; one that is killed leaves it there."""
    return state.with_name(f".{state.name}.restored")


def place_before_restore(state: Path, number: int | str) -> Path:
    """Return where a restore keeps what was there before. number: from 1 on."""
    return state.with_name(f"{state.name}.before-restore-{number}")


def left_aside(state: Path) -> Path | None:
    """Return where a restore that was killed between its two renames has left the state; None where it is in its place, or none
    was killed."""
    state = state.resolve()
    if exists(state) or not is_directory(place_of_restore(state)):
        return None
    aside = state.parent.glob(place_before_restore(Path(escape(state.name)), "*").name)
    return max(aside, key=lambda path: path.stat().st_ctime_ns, default=None)


def put_back(state: Path) -> str:
    """Put it back where it belongs; the sentence that says so, empty if there was nothing to do. OSError where the disk
    refuses, or the restore is at work still."""
    if left_aside(state) is None:
        return ""
    state = state.resolve()
    with lock_directory(place_of_restore(state)):
        if aside := left_aside(state):
            aside.rename(state)
    sync_path(state.parent)
    return f"a restore was killed halfway: what was there before is back, from {aside}" if aside else ""
