"""Did the last run end cleanly? A file that exists only while a gateway runs. Beside it stands what its end leaves to the
next start, whose guardian is another one; by a power cut it leaves nothing.

A disk that does not take it is no reason not to control: then the next start does not know of this run.
"""

import contextlib
import json
import os
from pathlib import Path
from typing import Any

from gateway.plain_file import closing_descriptor, exists
from gateway.processes.durable_file import read_object, replace_durably, sync_path
from gateway.processes.state_directory import LEFT, RUNNING


class CleanShutdownMarker:
    """File that exists while a run lasts: found at the next start, the last run did not end cleanly."""

    def __init__(self, state: Path) -> None:
        self._path, self._left = state / RUNNING, state / LEFT

    def mark_running(self) -> bool:
        """Mark this run as begun, on the disk: the power may go at once. True when the one before never lowered its flag, or
        when that cannot be known."""
        try:
            was_unclean = exists(self._path)
        except OSError:
            was_unclean = True
        with contextlib.suppress(OSError):
            if not was_unclean:
                self._path.touch(mode=0o600)
                sync_path(self._path.parent)
        return was_unclean

    @property
    def left(self) -> dict[str, Any]:
        """Facts that the last run has left at its end; empty where there are none, or no object."""
        try:
            return read_object(self._left)
        except (OSError, ValueError):
            return {}

    def leave(self, left: dict[str, Any]) -> None:
        """Store facts for the next start where the file is still there: control did not come to its own end, but its guardian
        has. Nothing where it was cleared, for what is left then is control's."""
        with (
            contextlib.suppress(OSError),
            closing_descriptor(os.open(self._path.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)) as directory,
        ):
            if left and exists(self._path):
                replace_durably(directory, LEFT, json.dumps(left).encode(), mode=0o600)

    def clear(self, left: dict[str, Any] | None = None) -> None:
        """Remove the file: this run ended cleanly. left: for the next start; where that is not stored the file stays, for the
        next start would believe that nobody had hung. So it is on the disk before the file goes: a machine is often
        switched off right behind its gateway."""
        with (
            contextlib.suppress(OSError),
            closing_descriptor(os.open(self._path.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)) as directory,
        ):
            if left:
                replace_durably(directory, LEFT, json.dumps(left).encode(), mode=0o600)
            elif exists(self._left):
                self._left.unlink(missing_ok=True)
                os.fsync(directory)
            self._path.unlink(missing_ok=True)
            os.fsync(directory)
