"""What has passed since the loop's last tick: what arrived meanwhile is executed late, and control judges by it.

The monotonic clock stands still while the machine is suspended (a lid that was closed, a panel that was left alone), and so
does whatever is measured by it: an enable that the network has kept since would come in time.
"""

from collections.abc import Callable
from math import inf
from typing import Final

from gateway.defaults import STALL_S
from gateway.processes.scheduling.scheduler_counters import ProcessorTime

_WORTH_S: Final = 0.02  # less passes between the reading of two clocks


class LastTick:
    """suspended_s: for how long the machine has been suspended until now, or a bit less. processor_time: of this process at the
    tick; slept_s: for how long it was suspended between that tick and the one before."""

    def __init__(self, suspended_s: Callable[[], float]) -> None:
        self.processor_time: ProcessorTime | None = None
        self.slept_s = 0.0
        self._time_s: float | None = None
        self._awake_since_s = -inf
        self._until_now_s, self._until_then_s = suspended_s, suspended_s()

    def note(self, now_s: float, processor_time: ProcessorTime | None) -> None:
        """Note a tick."""
        until_s = self._until_now_s()
        grown_s = until_s - self._until_then_s
        self.slept_s = grown_s if grown_s > _WORTH_S else 0.0
        self._until_then_s = max(self._until_then_s, until_s)
        self._awake_since_s = self.awake_since_s(now_s)
        self._time_s, self.processor_time = now_s, processor_time

    def suspended_s(self) -> float:
        """Return for how long the machine has been suspended since, s."""
        grown_s = self._until_now_s() - self._until_then_s
        return grown_s if grown_s > _WORTH_S else 0.0

    def late_s(self, now_s: float, suspended_s: float) -> float:
        """Return the time since, s, that in which the machine was suspended with it."""
        return 0.0 if self._time_s is None else now_s - self._time_s + suspended_s

    def awake_since_s(self, now_s: float) -> float:
        """Return since when the loop has come by without a stall, s: now_s where one lies behind the last tick."""
        return now_s if self.late_s(now_s, 0.0) > STALL_S else self._awake_since_s
