"""Removes the recordings that the rig has no room for, at the start, every hour, and whenever
one has become as long as one may be, in a thread beside the control loop."""

from math import inf
from pathlib import Path
from typing import Any, Final

from gateway.calibrations.kept_ladders import kept_ladders
from gateway.processes.disk_worker import DiskWorker
from gateway.processes.event_log import EventLog
from gateway.profiles.recordings_section import Retention
from gateway.progress import few
from gateway.recording.care.keeping import Prunable, prune_recordings
from gateway.watch.reference_recording import read_reference_recording

_EVERY_S: Final = 3600.0


class RecordingRetention:
    """Prunes the recordings of one state directory. Without a limit it does nothing."""

    def __init__(self, state: Path, retention: Retention, log: EventLog) -> None:
        self._state, self._retention, self._log = state, retention, log
        self._worker = DiskWorker()
        self._due_s = inf if retention.is_unlimited else -inf

    def tick(self, now_s: float) -> None:
        """Begin to prune where it is time; nothing waits for it. In a running loop, if there is a limit."""
        if now_s >= self._due_s:
            self._due_s = now_s + _EVERY_S
            self._worker(self._prune, self._tell)

    def hasten(self) -> None:
        """Have it begin with the next tick, if there is a limit: a recording has ended by its length."""
        if self._due_s < inf:
            self._due_s = -inf

    def close(self) -> None:
        """Begin nothing more."""
        self._due_s = inf
        self._worker.close()

    def _prune(self) -> list[Prunable]:
        reference = read_reference_recording(self._state)
        name = reference.name if reference else ""
        return prune_recordings(self._state, self._retention, name, kept_ladders(self._state))

    def _tell(self, gone: Any) -> None:
        if isinstance(gone, BaseException):
            self._log("recording", f"recordings were not pruned: {gone}")
        elif gone:
            names, size_mb = few([one.path.name for one in gone]), sum(one.size_bytes for one in gone) / 1e6
            reasons = few([one.why for one in gone])
            self._log("recording", f"pruned {len(gone)} recordings ({size_mb:.1f} MB): {names}; {reasons}")
