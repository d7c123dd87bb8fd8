"""The heartbeat of the control loop in memory that it shares with the guardian: when it beat last. Beside it stand those of the
master, for the control process that is started next.

A beat is one store of eight bytes, and wakes nobody: the guardian looks when the next one is overdue, a tenth as often as the
loop beats. As a message each beat woke the guardian, which cost the loop up to a quarter of a millisecond, fifty times a
second. The clock is the machine's monotonic one, so both mean the same time. Standard library only.
"""

import mmap
import os
from collections.abc import Sequence
from typing import Final

from gateway import defaults

_MOST_BEATS: Final = 1 + defaults.MOST_FRAMES  # the register's own beside them
_BYTES: Final = 8 * (1 + _MOST_BEATS)


class HeartbeatMemory:
    """Either end. descriptor: of memory without a name, as both processes have it; it is laid out by whoever comes first."""

    def __init__(self, descriptor: int) -> None:
        """Map the memory. OSError when there is none to be had."""
        if os.fstat(descriptor).st_size < _BYTES:
            os.ftruncate(descriptor, _BYTES)
        self._map = mmap.mmap(descriptor, _BYTES)
        self._numbers = memoryview(self._map).cast("d")  # one store of eight aligned bytes each: never half a number
        self._master_beats: Sequence[int] = ()

    @property
    def beat_s(self) -> float:
        """Time of the last beat, s; 0 before the first."""
        return self._numbers[0]

    @property
    def master_beats(self) -> tuple[int, ...]:
        """Values of the master's heartbeat at the last beat, one or more; 0 before the first."""
        return tuple({int(beat): None for beat in self._numbers[1:]})

    def beat(self, now_s: float, master_beats: Sequence[int] = (0,)) -> None:
        """Write the time of a beat, and what the master's frames bring as its heartbeat. now_s: monotonic."""
        self._numbers[0] = now_s
        if master_beats != self._master_beats:
            self._master_beats = master_beats
            for place in range(_MOST_BEATS):
                self._numbers[1 + place] = master_beats[place if place < len(master_beats) else 0]

    def close(self) -> None:
        """Close the memory."""
        self._numbers.release()
        self._map.close()
