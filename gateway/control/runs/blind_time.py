"""How long a stair of this machine takes, learned from the coarse cycle that every run begins with.

The check's stairs are large and held long. From each: when a tenth of the way was done and when nine tenths. One or two lags,
whatever they are, then tell the rest: the way that is left falls by a factor e in 0.45 of that time or less. A stair that is
judged before its transient is over would be off by what was left of it, in the direction of the step: a loop that looks
wider than the friction makes it.
"""

from math import log
from statistics import median
from typing import Final

Trace = list[tuple[float, float]]

UNKNOWN_BLIND_S: Final = 0.6  # of the first stairs: longer than any dead time that is believed
LEAST_N: Final = 3.0
NOISE_AT: Final = 10.0
EARLY, LATE = 0.1, 0.9
FOLD: Final = (
    0.455  # of the time between a tenth and nine tenths: in which what is left falls by e, for one lag; two are faster
)
SHORTEST_BLIND_S: Final = 0.12
LONGEST_BLIND_S: Final = 3.0
LEAST_LEFT_N: Final = 0.07  # of a transient: nobody sees less
LEFT_NOISE: Final = 0.4


class BlindTime:
    """`observe` each stair of the check; `blind_s` then says how long another one moves."""

    def __init__(self) -> None:
        self._early_s: list[float] = []
        self._rise_s: list[float] = []

    @property
    def is_known(self) -> bool:
        """Decide whether enough stairs have been seen to know the pace."""
        return len(self._rise_s) >= 3

    def observe(self, trace: Trace, from_n: float, to_n: float, noise_n: float) -> None:
        """Learn from one settled step. trace: (seconds since the step, N); from_n, to_n: settled before and after."""
        way_n = to_n - from_n
        if abs(way_n) < max(LEAST_N, NOISE_AT * noise_n):
            return
        early_s, late_s = (_passed_s(trace, from_n + share * way_n, way_n > 0.0) for share in (EARLY, LATE))
        self._early_s.append(early_s)
        self._rise_s.append(max(0.0, late_s - early_s))

    def blind_s(self, step_n: float, noise_n: float) -> float:
        """Return the seconds after a step of this size until what is left of it is nothing to speak of."""
        if not self.is_known:
            return UNKNOWN_BLIND_S
        left = max(LEAST_LEFT_N, LEFT_NOISE * noise_n) / max(abs(step_n), 1.0e-6)
        folds = max(0.0, log(EARLY / left)) if left < EARLY else 0.0
        blind_s = median(self._early_s) + median(self._rise_s) * (1.0 + FOLD * folds)
        return max(SHORTEST_BLIND_S, min(LONGEST_BLIND_S, blind_s))


def _passed_s(trace: Trace, level_n: float, is_rising: bool) -> float:
    """When the force passed the level, between two readings."""
    last_s, last_n = 0.0, None
    for at_s, force_n in trace:
        if (force_n >= level_n) is is_rising:
            if last_n is None or force_n == last_n:
                return at_s
            return last_s + (at_s - last_s) * (level_n - last_n) / (force_n - last_n)
        last_s, last_n = at_s, force_n
    return last_s
