"""Watches the heartbeat of the control loop: when it is overdue, and what caused a silence. Standard library only.

What happens then (kill, safe voltage, restart) is decided in guardian.py, from `_on_deadline` on; when a restart is one too
many in restart_policy.py.
"""

from collections.abc import Callable
from typing import Final

from gateway import defaults
from gateway.processes.exit_cause import Ending
from gateway.processes.scheduling.scheduler_counters import (
    ProcessorTime,
    Silence,
    explain_silence,
    load_of_machine,
    time_between,
)
from gateway.processes.scheduling.withheld_time import WithheldTime
from gateway.service.supervisor.child_process import Child

_LATE_S: Final = 0.02


class Heartbeat:
    """stall_s: the longest silence, which READY tells. Times are monotonic seconds."""

    def __init__(self) -> None:
        self.stall_s = defaults.STALL_S
        self._beat_s: float | None = None  # later than it was where we were late ourselves
        self._heard_s = 0.0
        self._used: ProcessorTime | None = None  # at the last heartbeat
        self._was_late = False
        self._withheld = WithheldTime()

    @property
    def is_up(self) -> bool:
        """Decide whether there is a loop that beats: from READY on."""
        return self._beat_s is not None

    @property
    def heard_s(self) -> float:
        """Time of the last beat, s; 0 before the first."""
        return self._heard_s

    @property
    def due_s(self) -> float:
        """Time at which the silence has lasted too long, s."""
        return (self._beat_s or 0.0) + self.stall_s

    def reset(self) -> None:
        """Forget the last beat: another control process begins."""
        self._beat_s = None

    def record_beat(self, control: Child, now_s: float) -> None:
        """Record a beat of control at now_s."""
        self._beat_s = self._heard_s = now_s
        self._was_late = False
        self._used = control.counters.read() if control.counters else None
        self._withheld.note(now_s)

    def is_overdue(self, now_s: float) -> bool:
        """Decide whether stall_s of silence are over.
        Where we woke late ourselves the machine stood still: one more chance."""
        late_s = now_s - self.due_s
        if late_s > _LATE_S and not self._was_late:
            self._was_late, self._beat_s = True, now_s - self.stall_s + _LATE_S
            return False
        return late_s >= 0.0

    def why_silent(self, control: Child, now_s: float) -> Callable[[], Ending]:
        """Return how to find the cause of the silence until now; to be asked behind the kill, when the kernel's counters are
        complete and nothing waits for them any more."""
        state = control.counters.state() if control.counters else ""
        silent_s, before, was_late = now_s - self._heard_s, self._used, self._was_late

        def why() -> Ending:
            turns = time_between(before, control.counters.read() if control.counters else None)
            silence = Silence(silent_s, self.stall_s, turns, state, was_late, self._withheld.lately())
            return explain_silence(silence, load_of_machine())

        return why
