"""Time how long the force has been in band, and how long it has not: two timers on the same comparison.

In band means: target at its goal, contact, and the measured force within the tolerance, for the in-band time without a
break. Without contact there is no band: a reading of 0.2 N in free air is not a held force. Target-unreachable means
the same wait in vain, longer.

Bounds: Supervision.unreachable_s, Defaults.in_band_time_s and Defaults.in_band_tolerance_n in control/settings.py.
"""

from math import inf


class InBandTimer:
    """unreachable_s: how long out of band until the target counts as unreachable. Times are monotonic seconds."""

    def __init__(self, unreachable_s: float) -> None:
        self._unreachable_s = unreachable_s
        self.restart()

    def restart(self) -> None:
        """Restart both timers: nothing is pursued, or something new."""
        self._in_since_s = inf
        self._out_since_s = inf
        self.in_band = False
        self.unreachable = False

    def update(self, now_s: float, is_inside: bool, in_band_time_s: float) -> None:
        """Compare once more. is_inside: the comparison of this moment, with the target at its goal."""
        if is_inside:
            self._in_since_s = min(self._in_since_s, now_s)
            self._out_since_s, self.unreachable = inf, False
        else:
            self._out_since_s = min(self._out_since_s, now_s)
            self._in_since_s = inf
            self.unreachable = now_s - self._out_since_s >= self._unreachable_s
        self.in_band = now_s - self._in_since_s >= in_band_time_s
