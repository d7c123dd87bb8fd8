"""What is to be kept, on its way to the disk: put down in the loop, written in a thread in batches, and synced in another one.

A sync may take seconds where the kernel takes lines at once: behind one, control that was killed (kill -9) two seconds after
its start had lost 24 of 26 records. So they are written as they come, and kept in memory until they are synced: what a sync
that failed was for is written again.

While the disk takes nothing (full, read only) records wait in memory, at most 2 000 of them, an alarm (A351) says so, and
control goes on. Of more the oldest go; how many, and from when to when, is a line of the audit itself once it is written again.
Behind a sync that hangs 2 000 more are written.
"""

import asyncio
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple

from gateway.audit.audit_file import AuditFile, Place
from gateway.plain_file import tell_place_and_refusal
from gateway.processes.disk_worker import DiskWorker
from gateway.processes.event import utc_text

MOST_WAITING: Final = 2000
_AGAIN_S: Final = 5.0
_LAST_WORDS_S: Final = 1.0
Log = Callable[[str, str], None]
Clock = Callable[[], float]
Background = Callable[[Callable[[], Any], Callable[[Any], None]], None]


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


class _Kept(NamedTuple):
    """A record, what is lost with it, and whether that is what it tells of."""

    record: dict[str, Any]
    lost: _Lost
    tells_loss: bool = False


class AuditLog:
    """put() from the loop, flush() at each tick. wall: seconds since the epoch; clock: monotonic, s."""

    def __init__(self, file: AuditFile, log: Log, clock: Clock, wall: Clock) -> None:
        self._file, self._log, self._clock, self._wall = file, log, clock, wall
        self._workers = DiskWorker(), DiskWorker()
        self.run_in_background: Background
        self.sync_in_background: Background
        self.run_in_background, self.sync_in_background = self._workers
        self._waiting: deque[_Kept] = deque()
        self._in_flight: list[_Kept] = []  # is being written
        self._written: list[_Kept] = []  # and not known to be synced
        self._place = Place()  # of the last of those
        self._syncing = 0  # how many of them
        self._not_before_s = 0.0
        self._has_failed = self._is_again = False  # again: and what it was about has been written since
        self._takes_back = self._awaits_sync = False
        self._lost = _NONE_LOST  # dropped and not told yet, all of it before what waits

    def put(self, fields: Mapping[str, Any]) -> None:
        """Keep this record, with the time of now."""
        time = utc_text(self._wall())
        self._waiting.append(_Kept({"time": time, **fields}, _Lost(1, time, time)))
        if len(self._waiting) > MOST_WAITING:
            self._lost = self._lost.and_then(self._waiting.popleft().lost)

    def flush(self) -> None:
        """Begin to write what waits and to sync what is written, unless that is under way, or has failed a moment ago."""
        if self._waiting and not self._in_flight and self._clock() >= self._not_before_s and self._may_write():
            self._begin_write()
        if self._written and not self._syncing and not self._takes_back:
            self._syncing, place = len(self._written), self._place
            self.sync_in_background(lambda: self._file.sync(place), self._on_synced)

    async def close(self) -> None:
        """Write what waits, if the disk takes it within a second."""
        loop = asyncio.get_running_loop()
        end_s, self._not_before_s = loop.time() + _LAST_WORDS_S, 0.0
        self.flush()
        while (self._in_flight or self._written or (self._waiting and not self._has_failed)) and loop.time() < end_s:
            await asyncio.sleep(0.002)
            self.flush()
        if not self._in_flight and not self._syncing:
            self._file.close()
        for worker in self._workers:
            worker.close()

    def _may_write(self) -> bool:
        """Behind a failure, and where another file is to be begun, one thing comes after the other."""
        is_held = self._has_failed or self._awaits_sync or len(self._written) >= MOST_WAITING
        return not (self._written and is_held)

    def _begin_write(self) -> None:
        again, batch = self._has_failed, [*self._take_lost(), *self._waiting]
        self._in_flight = batch
        self._waiting.clear()
        records = [kept.record for kept in batch]
        self.run_in_background(lambda: self._file.write(records, again=again), self._on_written)

    def _take_lost(self) -> tuple[_Kept, ...]:
        lost, self._lost = self._lost, _NONE_LOST
        if not lost.number:
            return ()
        span = f"{lost.number} records from {lost.first} to {lost.last}"
        text = f"{span} were lost: the disk took none, and memory is bounded"
        record = {"time": utc_text(self._wall()), "what": "lost", "count": lost.number, "text": text}
        return (_Kept(record, lost, tells_loss=True),)

    def _on_written(self, result: Any) -> None:
        batch, self._in_flight = self._in_flight, []
        if isinstance(result, Exception) or result is None:
            self._put_back(batch)
        else:
            self._written += batch
            self._place = result.place
            self._is_again = self._has_failed and not self._takes_back
        self._awaits_sync = result is None
        if self._takes_back:
            self._take_back()
        if isinstance(result, Exception):
            self._tell_failure(result)
        elif result:
            for found in result.found:
                self._log("audit", found)

    def _on_synced(self, result: Any) -> None:
        count, self._syncing = self._syncing, 0
        if isinstance(result, Exception):
            self._takes_back = True
            if not self._in_flight:
                self._take_back()
            self._tell_failure(result)
            return
        del self._written[:count]
        if self._is_again:
            self._has_failed = self._is_again = False
            self._log("audit", f"A351 the audit is stored again, {count} records of meanwhile with it")

    def _take_back(self) -> None:
        """Put down again what was written and is not known to be synced; the next write takes it out of the file."""
        self._takes_back = self._is_again = False
        self._put_back(self._written)
        self._written.clear()

    def _put_back(self, batch: Sequence[_Kept]) -> None:
        """What is lost so far stands between these and what waits."""
        self._waiting.extendleft(reversed((*batch, *self._take_lost())))
        while self._waiting and (len(self._waiting) > MOST_WAITING or self._waiting[0].tells_loss):
            self._lost = self._lost.and_then(self._waiting.popleft().lost)

    def _tell_failure(self, error: Exception) -> None:
        self._not_before_s = self._clock() + _AGAIN_S
        if not self._has_failed:
            why = tell_place_and_refusal(error) if isinstance(error, OSError) else repr(error)
            kept = f"kept in memory (at most {MOST_WAITING}), control goes on"
            self._log("audit", f"A351 the audit is not stored: {why}; {kept}")
        self._has_failed = True
