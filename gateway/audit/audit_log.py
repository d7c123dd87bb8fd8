"""What is to be kept, on its way to the disk: put down in the loop, written and synced in a thread, in batches.

While the disk takes nothing (full, read only) records wait in memory, at most 2 000 of them, an alarm (A351) says so, and
control goes on. Of more the oldest go; how many, and from when to when, is a line of the audit itself once it is written again.
"""

import asyncio
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

from gateway.audit.audit_file import AuditFile
from gateway.plain_file import tell_place_and_refusal
from gateway.processes.disk_worker import DiskWorker
from gateway.processes.event import utc_text

MOST_WAITING: Final = 2000
_AGAIN_S: Final = 5.0
_LAST_WORDS_S: Final = 1.0
Log = Callable[[str, str], None]
Clock = Callable[[], float]


class _Lost(NamedTuple):
    """Records that were dropped: how many, and the times of the first and the last."""

    number: int
    first: str
    last: str

    def and_then(self, later: "_Lost") -> "_Lost":
        if not (self.number and later.number):
            return self if self.number else later
        return _Lost(self.number + later.number, self.first, later.last)


_NONE_LOST: Final = _Lost(0, "", "")


class AuditLog:
    """put() from the loop, flush() at each tick. wall: seconds since the epoch; clock: monotonic, s."""

    def __init__(self, file: AuditFile, log: Log, clock: Clock, wall: Clock) -> None:
        self._file, self._log, self._clock, self._wall = file, log, clock, wall
        self._worker = DiskWorker()
        self.run_in_background: Callable[[Callable[[], Any], Callable[[Any], None]], None] = self._worker
        self._waiting: deque[dict[str, Any]] = deque()
        self._in_flight: list[dict[str, Any]] = []
        self._not_before_s = 0.0
        self._has_failed = False
        self._lost = self._told = _NONE_LOST  # dropped and not told yet; told by what is being written

    def put(self, fields: Mapping[str, Any]) -> None:
        """Keep this record, with the time of now."""
        self._waiting.append({"time": utc_text(self._wall()), **fields})
        if len(self._waiting) > MOST_WAITING:
            time = self._waiting.popleft()["time"]
            self._lost = self._lost.and_then(_Lost(1, time, time))

    def flush(self) -> None:
        """Begin to write what waits, unless that is under way, or has failed a moment ago."""
        if not self._waiting or self._in_flight or self._clock() < self._not_before_s:
            return
        batch = self._in_flight = [*self._take_lost(), *self._waiting]
        self._waiting.clear()
        self.run_in_background(lambda: self._file.append(batch), self._on_written)

    async def close(self) -> None:
        """Write what waits, if the disk takes it within a second."""
        loop = asyncio.get_running_loop()
        end_s, self._not_before_s = loop.time() + _LAST_WORDS_S, 0.0
        self.flush()
        while (self._in_flight or (self._waiting and not self._has_failed)) and loop.time() < end_s:
            await asyncio.sleep(0.002)
            self.flush()
        if not self._in_flight:
            self._file.close()
        self._worker.close()

    def _take_lost(self) -> tuple[dict[str, Any], ...]:
        self._told, self._lost = self._lost, _NONE_LOST
        if not self._told.number:
            return ()
        span = f"{self._told.number} records from {self._told.first} to {self._told.last}"
        text = f"{span} were lost: the disk took none, and memory is bounded"
        return ({"time": utc_text(self._wall()), "what": "lost", "count": self._told.number, "text": text},)

    def _on_written(self, result: Any) -> None:
        batch, self._in_flight = self._in_flight, []
        if isinstance(result, Exception):
            self._put_back(batch[1:] if self._told.number else batch)
            self._lost = self._told.and_then(self._lost)
            self._not_before_s = self._clock() + _AGAIN_S
            if not self._has_failed:
                why = tell_place_and_refusal(result) if isinstance(result, OSError) else repr(result)
                self._log(
                    "audit",
                    f"A351 the audit is not stored: {why}; kept in memory (at most {MOST_WAITING}), control goes on",
                )
            self._has_failed = True
        if self._has_failed and not isinstance(result, Exception):
            self._has_failed = False
            self._log("audit", f"A351 the audit is stored again, {len(batch)} records of meanwhile with it")
        for found in () if isinstance(result, Exception) else result or ():
            self._log("audit", found)

    def _put_back(self, batch: list[dict[str, Any]]) -> None:
        for record in reversed(batch):
            if len(self._waiting) >= MOST_WAITING:
                self._lost = _Lost(1, record["time"], record["time"]).and_then(self._lost)
            else:
                self._waiting.appendleft(record)
