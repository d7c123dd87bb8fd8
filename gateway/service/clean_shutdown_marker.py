"""Did the last run end cleanly? A file that exists only while a gateway runs.

A disk that does not take it is no reason not to control: then the next start does not know of this run.
"""

import contextlib
from pathlib import Path

from gateway.processes.state_directory import RUNNING


class CleanShutdownMarker:
    """File that exists while a run lasts: found at the next start, the last run did not end cleanly."""

    def __init__(self, state: Path) -> None:
        self._path = state / RUNNING

    def mark_running(self) -> bool:
        """Mark this run as begun; True when the one before never lowered its flag, or when that cannot be known."""
        try:
            was_unclean = self._path.exists()
        except OSError:
            was_unclean = True
        with contextlib.suppress(OSError):
            self._path.touch(mode=0o600)
        return was_unclean

    def clear(self) -> None:
        """Remove the file: this run ended cleanly."""
        with contextlib.suppress(OSError):
            self._path.unlink(missing_ok=True)
