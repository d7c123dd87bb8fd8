"""Whether this process has just stood still: a machine that slept or swapped, a debugger, a processor that others had.

What has come meanwhile waits in sockets and comes now, all at once. It belongs to a situation that is over: whoever asked has
given it up, and may stand beside the tool. Control drops what its own loop came late to; the processes beside it that pass
commands on look here. A stop is passed on all the same. The kernel's monotonic clock stands still while a machine sleeps, so
that is asked for apart.
"""

import asyncio
import time
from collections.abc import Callable
from typing import Final

STANDSTILL_S: Final = 1.0
AFTERMATH_S: Final = 0.5  # what the kernel has kept comes in several pieces
_BEAT_S: Final = 0.1


def suspended_s() -> float:
    """Return for how long this machine has been suspended since its start, s, while `time.monotonic` stood still; 0 where the
    system does not tell. Too little by what passes between the reading of two clocks, never too much."""
    if not hasattr(time, "CLOCK_BOOTTIME"):  # not Linux
        return 0.0
    return max(0.0, time.clock_gettime(time.CLOCK_BOOTTIME) - time.clock_gettime(time.CLOCK_MONOTONIC))


def boottime_s() -> float:
    """Return monotonic seconds that go on while the machine is suspended."""
    return time.monotonic() + suspended_s()


class Standstill:
    """clock: in seconds. Nothing is a standstill before `keep_time` runs."""

    def __init__(self, clock: Callable[[], float] = boottime_s) -> None:
        self._clock = clock
        self._beat_s: float | None = None
        self._over_s: float | None = None

    async def keep_time(self) -> None:
        """Watch for a standstill, for ever."""
        self._beat_s = self._clock()
        while True:
            self.note_time()
            await asyncio.sleep(_BEAT_S)

    def note_time(self) -> None:
        """Note that this process runs now."""
        now_s = self._clock()
        if self._beat_s is None:
            return
        if now_s - self._beat_s > STANDSTILL_S:
            self._over_s = now_s
        self._beat_s = now_s

    def is_aftermath(self) -> bool:
        """Decide whether what comes now may have waited through a standstill."""
        self.note_time()  # whoever wakes first
        return self._over_s is not None and self._clock() - self._over_s < AFTERMATH_S
