"""Did the last run end cleanly? A file that exists only while a gateway runs. Beside it stands what a clean end leaves to the
next start, whose guardian is another one.

A disk that does not take it is no reason not to control: then the next start does not know of this run.
"""

import contextlib
import json
from pathlib import Path
from typing import Any

from gateway.processes.durable_file import read_object
from gateway.processes.state_directory import LEFT, RUNNING


class CleanShutdownMarker:
    """File that exists while a run lasts: found at the next start, the last run did not end cleanly."""

    def __init__(self, state: Path) -> None:
        self._path, self._left = state / RUNNING, state / LEFT

    def mark_running(self) -> bool:
        """Mark this run as begun; True when the one before never lowered its flag, or when that cannot be known."""
        try:
            was_unclean = self._path.exists()
        except OSError:
            was_unclean = True
        with contextlib.suppress(OSError):
            self._path.touch(mode=0o600)
        return was_unclean

    @property
    def left(self) -> dict[str, Any]:
        """Facts that the last run that ended cleanly has left; empty where there are none, or no object."""
        try:
            return read_object(self._left)
        except (OSError, ValueError):
            return {}

    def clear(self, left: dict[str, Any] | None = None) -> None:
        """Remove the file: this run ended cleanly. left: for the next start; where that is not stored the file stays, for the
        next start would believe that nobody had hung."""
        with contextlib.suppress(OSError):
            self._left.unlink(missing_ok=True)
            if left:
                self._left.touch(mode=0o600)
                self._left.write_text(json.dumps(left), encoding="utf-8")
            self._path.unlink(missing_ok=True)
