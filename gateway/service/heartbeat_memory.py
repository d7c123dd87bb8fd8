"""The heartbeat of the control loop in memory that it shares with the guardian: when it beat last.

A beat is one store of eight bytes, and wakes nobody: the guardian looks when the next one is overdue, a tenth as often as the
loop beats. As a message each beat woke the guardian, which cost the loop up to a quarter of a millisecond, fifty times a
second. The clock is the machine's monotonic one, so both mean the same time. Standard library only.
"""

import mmap
import os
from typing import Final

_TIME_BYTES: Final = 8


class HeartbeatMemory:
    """Either end. descriptor: of memory without a name, as both processes have it; it is laid out by whoever comes first."""

    def __init__(self, descriptor: int) -> None:
        """Map the memory. OSError when there is none to be had."""
        if os.fstat(descriptor).st_size < _TIME_BYTES:
            os.ftruncate(descriptor, _TIME_BYTES)
        self._map = mmap.mmap(descriptor, _TIME_BYTES)
        self._time = memoryview(self._map).cast("d")  # one store of eight aligned bytes: never half a time

    @property
    def beat_s(self) -> float:
        """Time of the last beat, s; 0 before the first."""
        return self._time[0]

    def beat(self, now_s: float) -> None:
        """Write the time of a beat. now_s: monotonic."""
        self._time[0] = now_s

    def close(self) -> None:
        """Close the memory."""
        self._time.release()
        self._map.close()
