"""When a control process is started again, and when that has been enough. Standard library only."""

from collections import Counter
from dataclasses import dataclass, field
from typing import Final

from gateway.processes.exit_cause import EndCause

MOST_RESTARTS: Final = 5
WINDOW_S: Final = 60.0
HELPER_PAUSES_S: Final = (5.0, 30.0, 120.0)
"""Before a child that control can do without is started again (the fork server, the residual watch): it must not cost
processor time that control needs. One more death, and it stays off. The simulated rig, which control waits for, has
shorter ones of its own."""
_FIRST_PAUSE_S: Final = 0.25
_LONGEST_PAUSE_S: Final = 4.0


@dataclass
class RestartPolicy:
    """Counts ends within the window, and those since the last READY: what dies while it starts is given time."""

    _ends: list[tuple[float, EndCause]] = field(default_factory=list)
    _without_ready: int = 0

    def came_up(self) -> None:
        """Forget the failed starts: control has become ready."""
        self._without_ready = 0

    def count(self, now_s: float, cause: EndCause) -> float | None:
        """Return how long to wait before the next start; None when there were too many ends."""
        self._ends = [end for end in self._ends if now_s - end[0] < WINDOW_S] + [(now_s, cause)]
        if len(self._ends) > MOST_RESTARTS:
            return None
        self._without_ready += 1
        if self._without_ready <= 2:  # it was ready before, or this was the first try after that
            return 0.0
        return float(min(_LONGEST_PAUSE_S, _FIRST_PAUSE_S * 2 ** (self._without_ready - 3)))

    @property
    def causes(self) -> Counter[EndCause]:
        """Causes of the ends in the window."""
        return Counter(cause for _, cause in self._ends)
