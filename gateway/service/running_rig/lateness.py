"""What kept our loop, and the process behind a simulated rig, from running lately: the evidence against blaming a wire.

The loop notes each tick; of a simulated rig the kernel's counters are read with it (1.5 us). The wait that still lasts is in
no counter: a process whose counters stand still is runnable or stopped by its state, which is asked only when it matters.
A stop is in none of them, either: it is remembered from having been seen.
"""

from collections import deque
from typing import Final

from gateway.control.blame_for_silence import Held
from gateway.processes.scheduling.scheduler_counters import STOPPED_STATES, ProcessorTime, SchedulerCounters
from gateway.processes.scheduling.withheld_time import WithheldTime

_WORTH_S: Final = 0.005  # shorter pauses explain nothing
_STILL_S: Final = 0.05  # longer than a simulated rig ever sleeps
_KEPT: Final = 256


class _Pauses:
    """Spans of time in which something did not run: (end, length, so much of it waiting for a processor)."""

    def __init__(self) -> None:
        self._spans: deque[tuple[float, float, float]] = deque(maxlen=_KEPT)

    def add(self, end_s: float, length_s: float, waited_s: float) -> None:
        if length_s >= _WORTH_S:
            self._spans.append((end_s, length_s, waited_s))

    def since(self, then_s: float) -> tuple[float, float]:
        """(length, waited) of what fell into the time since then."""
        length_s = waited_s = 0.0
        for end_s, span_s, span_waited_s in reversed(self._spans):
            share = min(1.0, (end_s - then_s) / span_s)
            if share <= 0.0:
                break
            length_s, waited_s = length_s + share * span_s, waited_s + share * span_waited_s
        return length_s, waited_s


class Lateness:
    """period_s: of the tick. Times are monotonic seconds."""

    def __init__(self, period_s: float, withheld: WithheldTime) -> None:
        self._period_s, self._withheld = period_s, withheld
        self._ours, self._of_rig, self._stops = _Pauses(), _Pauses(), _Pauses()
        self._tick_s: float | None = None
        self._waited_s: float | None = None
        self._rig: SchedulerCounters | None = None
        self._rig_turns: ProcessorTime | None = None
        self._rig_ran_s, self._is_rig_stopped = 0.0, False

    def follow_rig(self, rig: SchedulerCounters | None) -> None:
        """Count the turns of the process behind a simulated rig, or the one that took its place."""
        if self._rig:
            self._rig.close()
        self._rig, self._rig_turns, self._is_rig_stopped = rig, None, False

    def tick(self, now_s: float, waited_s: float | None) -> None:
        """Count the lateness of one tick.
        waited_s: of this process until now, as the kernel counts; None where it does not."""
        if self._tick_s is not None:
            waited = waited_s - self._waited_s if waited_s is not None and self._waited_s is not None else 0.0
            self._ours.add(now_s, now_s - self._tick_s - self._period_s, waited)
        self._tick_s, self._waited_s = now_s, waited_s
        self._withheld.note(now_s)
        self._look_at_rig(now_s)

    def _look_at_rig(self, now_s: float) -> None:
        if self._rig is None:
            return
        turns = self._rig.read()
        known, self._rig_turns = self._rig_turns, turns
        if turns is None or turns == known:
            if turns and now_s - self._rig_ran_s >= _STILL_S:
                self._is_rig_stopped = self._rig.state() in STOPPED_STATES
            return
        if self._is_rig_stopped:
            self._is_rig_stopped = False
            self._stops.add(now_s, now_s - self._rig_ran_s, 0.0)
        if known is not None:
            waited_s = min(turns.waited_s - known.waited_s, now_s - self._rig_ran_s)
            self._of_rig.add(now_s, waited_s, waited_s)
        self._rig_ran_s = now_s

    def since(self, then_s: float, now_s: float, waited_s: float | None) -> Held:
        """Return what fell into the time from then to now, what still lasts included."""
        late_s, late_waited_s = self._ours.since(then_s)
        if self._tick_s is not None and (lasts_s := now_s - max(self._tick_s, then_s) - self._period_s) > 0.0:
            late_s += lasts_s
            if waited_s is not None and self._waited_s is not None:
                late_waited_s += min(lasts_s, waited_s - self._waited_s)
        self._look_at_rig(now_s)
        rig_waited_s, _ = self._of_rig.since(then_s)
        still_s = now_s - max(self._rig_ran_s, then_s) if self._rig_turns else 0.0
        stopped_s, _ = self._stops.since(then_s)
        state = self._rig.state() if self._rig and still_s >= _WORTH_S else ""
        rig_waited_s += still_s if state == "R" else 0.0
        return Held(
            loop_late_s=late_s,
            loop_waited_s=late_waited_s if waited_s is not None else None,
            withheld=self.withheld() if max(late_s, rig_waited_s) >= _WORTH_S else (0.0, ""),
            rig_waited_s=rig_waited_s,
            rig_stopped_s=stopped_s + (still_s if state and state in STOPPED_STATES else 0.0),
        )

    def withheld(self) -> tuple[float, str]:
        """Return the processor time that was withheld in the last second or two, s, and who did that, in words."""
        return self._withheld.lately()

    def close(self) -> None:
        """Close the counters of the simulated rig."""
        self.follow_rig(None)
