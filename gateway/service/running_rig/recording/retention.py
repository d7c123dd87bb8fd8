"""Removes the recordings that the rig has no room for, at the start, every hour, and whenever
one has become as long as one may be, in a thread beside the control loop.

A clock by which all recordings are too old is not believed for a day, nor one that has leapt ahead since it was looked at last:
a machine whose clock was years ahead at its start, or was set wrong by hand, would have lost them before anybody, or a time
server, could set it.
"""

import time
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any, Final

from gateway.calibrations.kept_ladders import kept_ladders
from gateway.live.standstill import suspended_s
from gateway.plain_file import tell_place_and_refusal
from gateway.processes.disk_worker import DiskWorker
from gateway.processes.event_log import EventLog
from gateway.profiles.recordings_section import Retention
from gateway.progress import few
from gateway.recording import recording_paths
from gateway.recording.care.clock_doubt import ClockDoubt, Doubt, doubt_clock, doubt_leap
from gateway.recording.care.keeping import Prunable, prune_recordings
from gateway.watch.reference_recording import read_reference_recording

_EVERY_S: Final = 3600.0
_DOUBT_S: Final = 86400.0


class RecordingRetention:
    """Prunes the recordings of one state directory. Without a limit it does nothing."""

    def __init__(self, state: Path, retention: Retention, log: EventLog) -> None:
        self._state, self._retention, self._log = state, retention, log
        self._worker = DiskWorker()
        self._due_s = inf if retention.is_unlimited else -inf
        self._told = ClockDoubt.NONE
        self._doubted_s: float | None = None  # since when the clock seemed to be ahead
        self._ahead_s = inf  # of the monotonic clock, when it was looked at last

    def tick(self, now_s: float) -> None:
        """Begin to prune where it is time; nothing waits for it. In a running loop, if there is a limit."""
        if now_s >= self._due_s:
            self._due_s = now_s + _EVERY_S
            self._worker(lambda: self._prune(now_s), self._tell)

    def hasten(self) -> None:
        """Have it begin with the next tick, if there is a limit: a recording has ended by its length."""
        if self._due_s < inf:
            self._due_s = -inf

    def close(self) -> None:
        """Begin nothing more."""
        self._due_s = inf
        self._worker.close()

    def _prune(self, now_s: float) -> list[Prunable]:
        reference = read_reference_recording(self._state)
        name = reference.name if reference else ""
        return prune_recordings(self._state, self._believed_limits(now_s), name, kept_ladders(self._state))

    def _believed_limits(self, now_s: float) -> Retention:
        """Return the limits, without that of the age for a day once the clock seems to be ahead."""
        if self._retention.days is None:
            return self._retention
        doubt = self._doubt(self._retention.days, now_s)
        if doubt.sentence and doubt.kind is not self._told:
            self._log("recording", doubt.sentence)
        self._told = doubt.kind
        if doubt.kind is ClockDoubt.LEAPT or (doubt.kind is ClockDoubt.AHEAD and self._doubted_s is None):
            self._doubted_s = now_s
        is_doubted = self._doubted_s is not None and now_s < self._doubted_s + _DOUBT_S
        if doubt.kind is not ClockDoubt.AHEAD and not is_doubted:
            self._doubted_s = None  # the next leap is another one
        return replace(self._retention, days=None) if is_doubted else self._retention

    def _doubt(self, days: float, now_s: float) -> Doubt:
        wall_s, before_s = time.time(), self._ahead_s
        self._ahead_s = wall_s - now_s - suspended_s()
        doubt = doubt_clock(recording_paths(self._state), days, wall_s)
        return doubt if doubt.kind is not ClockDoubt.NONE else doubt_leap(self._ahead_s - before_s, days, wall_s)

    def _tell(self, gone: Any) -> None:
        if isinstance(gone, BaseException):
            why = tell_place_and_refusal(gone) if isinstance(gone, OSError) else repr(gone)
            self._log("recording", f"recordings were not pruned: {why}")
        elif gone:
            names, size_mb = few([one.path.name for one in gone]), sum(one.size_bytes for one in gone) / 1e6
            reasons = few([one.why for one in gone])
            self._log("recording", f"pruned {len(gone)} recordings ({size_mb:.1f} MB): {names}; {reasons}")
