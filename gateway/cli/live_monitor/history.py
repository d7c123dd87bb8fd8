"""What the monitor remembers from poll to poll: a minute of force, when it settled, and when each register changed last.

Time is an argument (monotonic seconds), so that a test plays a minute in a millisecond.
"""

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import takewhile
from math import isnan, nan
from typing import Final

from gateway.cli.master.client import RegisterReading
from gateway.registers.words import State, StatusBit

WINDOW_S: Final = 60.0


@dataclass(frozen=True, slots=True)
class TrackPoint:
    """Setpoint of one poll, and the force measured in the tool's direction, N; time in s."""

    time_s: float
    measured_n: float
    setpoint_n: float


@dataclass(frozen=True, slots=True)
class Settling:
    """How the force stands to its band since the last change of setpoint.

    after_s: from that change until the force came into the band for good; None where the change was before the monitor.
    since_s: monotonic time at which it came.
    """

    is_settled: bool = False
    after_s: float | None = None
    since_s: float = 0.0


@dataclass(slots=True)
class _Seen:
    words: tuple[int, ...]
    changed_s: float | None = None


class Track:
    """Fed with the readings of the command and the status block of each poll."""

    def __init__(self) -> None:
        self.points: deque[TrackPoint] = deque()
        self.readings: dict[str, RegisterReading] = {}
        self.settling = Settling()
        self.time_s = 0.0
        self._seen: dict[str, _Seen] = {}
        self._step_s: float | None = None

    def add(self, time_s: float, readings: Iterable[RegisterReading]) -> None:
        """Add the readings of one poll."""
        self.time_s = time_s
        self.readings = {reading.register.name: reading for reading in readings}
        for name, reading in self.readings.items():
            self._note_change(name, reading.words)
        point = TrackPoint(time_s, self.acting_n, self.wanted_n)
        self._settle(point)
        self.points.append(point)
        while self.points[0].time_s < time_s - WINDOW_S:
            self.points.popleft()

    def value(self, name: str) -> float:
        """Return the newest value in the register's unit; NaN when unavailable, or not in the map."""
        reading = self.readings.get(name)
        return float(reading.value) if reading else nan

    @property
    def is_calibrating(self) -> bool:
        """True while a run, not a master, moves the force."""
        return self.value("state") == State.CALIBRATING

    @property
    def wanted_n(self) -> float:
        """The setpoint; in a calibration or an experiment its own target, N."""
        return self.value("force_accepted" if self.is_calibrating else "force_requested")

    @property
    def acting_n(self) -> float:
        """The measured force in the tool's direction, as setpoints count: the register is negative where the tool pulls."""
        measured_n = self.value("force_measured")
        return -measured_n if self.has_status(StatusBit.PULLING) else measured_n

    def change_age_s(self, name: str) -> float | None:
        """Return how long ago a register changed; None when it has not since the monitor began."""
        changed_s = self._seen[name].changed_s
        return None if changed_s is None else self.time_s - changed_s

    def has_status(self, bit: StatusBit) -> bool:
        """Return whether a bit of the status word is set; False before the first poll."""
        word = self.value("status_word")
        return not isnan(word) and bool(int(word) & bit)

    def _note_change(self, name: str, words: tuple[int, ...]) -> None:
        values = self._seen.setdefault(name, _Seen(words))
        if values.words != words:
            values.words, values.changed_s = words, self.time_s

    def _settle(self, point: TrackPoint) -> None:
        last, settling = (self.points[-1] if self.points else None), self.settling
        if last is not None and last.setpoint_n != point.setpoint_n:
            self._step_s, settling = point.time_s, Settling()
        if not self.has_status(StatusBit.IN_BAND):
            self.settling = Settling()
            return
        if not settling.is_settled:
            after_s = None if self._step_s is None else point.time_s - self._step_s
            settling = Settling(True, after_s, point.time_s)
        self.settling = settling

    def largest_error_n(self, window_s: float) -> float:
        """Return the largest |measured - setpoint| of the last window_s since it settled, N; NaN when it has not."""
        if not self.settling.is_settled:
            return nan
        begin_s = max(self.settling.since_s, self.time_s - window_s)
        recent = takewhile(lambda point: point.time_s >= begin_s, reversed(self.points))
        return max((abs(point.measured_n - point.setpoint_n) for point in recent), default=nan)


def buckets(points: Sequence[TrackPoint], now_s: float, count: int) -> list[TrackPoint | None]:
    """Return the last minute in `count` equal pieces, oldest first, each its mean; None where nothing was measured."""
    width_s = WINDOW_S / count
    gathered: list[list[TrackPoint]] = [[] for _ in range(count)]
    for point in points:
        index = count - 1 - int((now_s - point.time_s) / width_s)
        if 0 <= index < count and not isnan(point.measured_n):
            gathered[index].append(point)
    return [_mean(group) if group else None for group in gathered]


def _mean(group: Sequence[TrackPoint]) -> TrackPoint:
    measured_n = sum(point.measured_n for point in group) / len(group)
    return TrackPoint(group[-1].time_s, measured_n, group[-1].setpoint_n)
