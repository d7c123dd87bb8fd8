"""How a run goes to its next stair: at once, or along a ramp where the plant rings.

A regulator that overshoots takes the force beyond each stair, and friction keeps a part of that: the stair reads too high on
the way up and too low on the way down, and a descent at once frees the tool that friction should keep pressed. The coarse
cycle that every run begins with tells whether the force comes back from a peak, and when the peak is. From then on stairs are
approached along a parabola that ends flat, 1.3 periods long: behind it a second-order plant of any damping from 0.2 on passes
the end by a thirtieth of the stair at most (a test computes it), where a step passes it by 53 to 16 %.
"""

from statistics import median
from typing import Final

from gateway.control.runs.blind_time import LEAST_N, NOISE_AT, Trace

EARLY: Final = 0.1  # of the way: the force has begun to move
READINGS: Final = 3  # whose mean is one look at the force
OVERSHOT_SHARE: Final = 0.03  # of the step: less is no ringing that a ladder would show
OVERSHOT_SIGMAS: Final = 4.0  # of the noise
PEAKS: Final = 3.3  # times from a tenth of the way to the peak (half a period, but for its beginning): 1.3 periods
FEWEST: Final = 2  # stairs that rang
LONGEST_S: Final = 2.0


class StairApproach:
    """`observe` each step of the check that was made at once; ramp_s is 0 for a plant that does not ring."""

    def __init__(self) -> None:
        self._peaks_s: list[float] = []
        self._seen = 0

    @property
    def ramp_s(self) -> float:
        """Duration of the way to a stair, s; 0: at once."""
        if len(self._peaks_s) < FEWEST or 2 * len(self._peaks_s) <= self._seen:
            return 0.0
        return min(LONGEST_S, PEAKS * median(self._peaks_s))

    def observe(self, trace: Trace, from_n: float, to_n: float, noise_n: float) -> None:
        """Learn from one settled step. trace: (seconds since the step, N); from_n, to_n: settled before and after."""
        way_n = to_n - from_n
        if abs(way_n) < max(LEAST_N, NOISE_AT * noise_n) or len(trace) <= READINGS:
            return
        self._seen += 1
        way = 1.0 if way_n > 0.0 else -1.0
        beyond_n = [way * (force_n - to_n) for _, force_n in trace]
        smooth_n = [sum(beyond_n[k : k + READINGS]) / READINGS for k in range(len(beyond_n) - READINGS + 1)]
        peak_n = max(smooth_n)
        if peak_n < max(OVERSHOT_SHARE * abs(way_n), OVERSHOT_SIGMAS * noise_n):
            return
        began_s = next(
            at_s for (at_s, _), left_n in zip(trace, beyond_n, strict=True) if left_n > (EARLY - 1.0) * abs(way_n)
        )
        peak_s = trace[smooth_n.index(peak_n) + READINGS // 2][0]
        self._peaks_s.append(max(0.0, peak_s - began_s))

    def share(self, since_s: float) -> float:
        """Return the share of the way to the stair that is put out so many seconds after its beginning."""
        left = 1.0 - since_s / self.ramp_s if since_s < self.ramp_s else 0.0
        return 1.0 - left * left
