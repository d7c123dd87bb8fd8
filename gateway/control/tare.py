"""Tare: the zero of the load cell is the mean of recent samples, taken when the tare bit is written.

Allowed only while nothing presses on purpose: output off, or enabled with setpoint 0; and only on a steady, usable
signal, so that a force that is still decaying cannot become the zero. The payload's weight is added first: after a tare
the contact force reads 0 at the present tilt, and a later tilt is still compensated. A restart forgets the zero:
only coefficients are restored. Where the process before has died, what it pressed with may still be leaving: during the dead
time it stands as steady as a zero, so any but a small reading is waited for. An output that was not heard may have kept it for
longer: the wait begins when it has confirmed a voltage.
"""

from collections import deque
from itertools import pairwise
from statistics import fmean, median
from typing import Final

from gateway.control.settings import Supervision

_WINDOW: Final = 20  # readings: 0.2 s of a 100 Hz cell
_APART_S: Final = 0.0075  # of a faster one the samples of so long are one reading: it would not see a slow decay
_FEWEST: Final = 5
_DEVIATION: Final = 1.4826 / 2.0**0.5  # times the median step between neighbours: the standard deviation of white noise
_NOISE_RANGE: Final = 7.0  # standard deviations, which it stays within
LEAVING_LAGS: Final = 5.0  # response lags until what pressed before has gone: 150 times less is left of it
_LARGEST_SHARE: Final = 0.5  # of the saturation: a zero beyond it leaves no range to measure


class Zero:
    """Collects cell forces as converted (before tare); `zero_n` is what is subtracted from them."""

    def __init__(self, supervision: Supervision, *, is_behind_death: bool = False) -> None:
        """is_behind_death: the process before has not ended in order."""
        self.zero_n = 0.0
        self._recent_n: deque[float] = deque(maxlen=_WINDOW)
        self._since_s = self._sum_n = 0.0
        self._samples = 0
        self.largest_spread_n = max(5.0 * supervision.sample_quantum_n, 0.5)
        self._largest_n = _LARGEST_SHARE * supervision.saturation_n
        self._leaving_s = LEAVING_LAGS * supervision.response_lag_s
        self._may_leave_s = self._leaving_s if is_behind_death else 0.0

    def observe(self, force_n: float, interval_s: float = _APART_S) -> None:
        """Keep one more usable sample, N. interval_s: since the one before."""
        self._may_leave_s -= interval_s
        self._since_s, self._sum_n, self._samples = self._since_s + interval_s, self._sum_n + force_n, self._samples + 1
        if self._since_s >= _APART_S:
            self._recent_n.append(self._sum_n / self._samples)
            self._since_s, self._sum_n, self._samples = 0.0, 0.0, 0

    def expect_left(self) -> None:
        """Expect from now on that what was pressed before may still leave."""
        self._may_leave_s = self._leaving_s

    def retime(self, response_lag_s: float) -> None:
        """Replace the response lag, s: what is left from before leaves at the pace of the calibration in use."""
        longer_s = LEAVING_LAGS * response_lag_s - self._leaving_s
        self._leaving_s += longer_s
        if self._may_leave_s > 0.0:
            self._may_leave_s += longer_s

    def forget(self) -> None:
        """Forget all samples after the stream was interrupted: they do not describe now."""
        self._recent_n.clear()
        self._since_s, self._sum_n, self._samples = 0.0, 0.0, 0

    def take(self, gravity_n: float) -> float:
        """Take the zero: by how much it moved, N; gravity_n as in `demand`. Ask `unsteady` first."""
        before_n = self.zero_n
        self.zero_n = self._mean_n() + gravity_n
        return self.zero_n - before_n

    def unsteady(self, gravity_n: float) -> str:
        """Return why the recent samples are no zero, in numbers; empty where they are one."""
        recent = self._recent_n
        if len(recent) < _FEWEST:
            return f"{len(recent)} usable samples, at least {_FEWEST} are needed"
        spread_n, mean_n = max(recent) - min(recent), self._mean_n()
        if spread_n > self.largest_spread_n and not self._is_noise(spread_n):
            return f"force not steady: {spread_n:.2f} N between samples, allowed {self.largest_spread_n:.2f} N"
        if self._may_leave_s > 0.0 and abs(mean_n + gravity_n) > self.largest_spread_n:
            left_s = max(0.1, self._may_leave_s)
            return f"{mean_n:.1f} N, which may be left of what was pressed before the output was heard: wait {left_s:.1f} s"
        if abs(mean_n + gravity_n) > self._largest_n:
            return f"{mean_n:.1f} N at rest, allowed {self._largest_n:.0f} N: stuck in contact or wrong cell"
        return ""

    def _is_noise(self, spread_n: float) -> bool:
        """Decide whether the samples scatter so from each one to the next, go nowhere, and give a mean to rely on: halves of a
        force that goes on as far as allowed differ by half of that, and a mean may be wrong by a quarter."""
        recent, half = list(self._recent_n), len(self._recent_n) // 2
        moved_n = abs(fmean(recent[half:]) - fmean(recent[:half]))
        noise_n = _DEVIATION * median(abs(after_n - before_n) for before_n, after_n in pairwise(recent))
        is_still = (
            moved_n <= 0.5 * self.largest_spread_n and noise_n <= 0.25 * self.largest_spread_n * len(recent) ** 0.5
        )
        return is_still and spread_n <= _NOISE_RANGE * noise_n

    def _mean_n(self) -> float:
        return sum(self._recent_n) / len(self._recent_n)
