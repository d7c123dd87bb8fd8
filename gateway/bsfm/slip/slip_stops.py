"""Reversal by Maxwell slip: stops on the voltage say where between the branches the plant is.

s = sum c_j stop_{r_j}[V] / r_j, V = m(f) + s h(f), m = (V_rise + V_fall) / 2, h = (V_rise - V_fall) / 2. A stop follows the
voltage within -r .. r, so the voltages at which the plant turned round are remembered until they are passed: a closed
minor loop comes back to the same voltage, and a movement in one direction may be cut into any steps.

V is implicit, because s depends on it. Along one movement s is a broken line in V with a corner where each stop gives way,
so V - s h is solved segment by segment in closed form, without iteration. It grows with V everywhere if h sum c_j/r_j < 1;
`check` proves that. A stiffer set would leave the voltage open in a dead zone right after each reversal.
Memory: stop_j / r_j, each in [-1, 1]. Starts at -1: where the calibration's cycle has come down to the lowest voltage.
Stops nearer to the turn give way first in any memory that a movement from there, or from a branch, can lead to.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import isfinite
from typing import Final

from gateway.bsfm.branches import Branches
from gateway.bsfm.slip.reversal import FALLING, Memory

STOPS_MAX: Final = 16
STOPS_CARRIED: Final = 10  # by a set of registers, and by a fit therefore
STIFFEST: Final = 0.95  # of h sum c/r: the voltage right after a reversal moves at most 20 times as far as on a branch
BOUND_SHARE: Final = 0.05  # of the proof of it
BOUND_RESOLUTION: Final = 1.0e-3  # of the voltage range: a loop narrower than that counts as that wide
SUM_TOLERANCE: Final = 1.0e-6


@dataclass(frozen=True, slots=True)
class SlipStops:
    """A reversal by slip stops that give way one after the other. radii_v: ascending; shares: c_j >= 0 with sum 1, one per
    radius. ValueError otherwise.
    """

    radii_v: tuple[float, ...]
    shares: tuple[float, ...]

    def __post_init__(self) -> None:
        radii, shares = self.radii_v, self.shares
        if not 1 <= len(radii) <= STOPS_MAX or len(shares) != len(radii):
            raise ValueError(
                f"slip stops: {len(radii)} radii and {len(shares)} shares: as many of each, 1 to {STOPS_MAX}, are needed"
            )
        ascending = all(a < b for a, b in zip((0.0, *radii), radii, strict=False))
        if not (ascending and isfinite(radii[-1])):
            raise ValueError(f"slip radii {radii} V: positive and ascending is needed")
        if not (all(share >= 0.0 for share in shares) and abs(sum(shares) - 1.0) <= SUM_TOLERANCE):
            raise ValueError(f"slip shares {shares}: 0 or more each, and a sum of 1, is needed")

    @property
    def stiffness_per_v(self) -> float:
        """Rate of s right after a reversal, 1/V."""
        return sum(share / radius for share, radius in zip(self.shares, self.radii_v, strict=True))

    def start(self) -> Memory:
        """Return the memory of a vented tool: fallen to the lowest voltage from so far above that every stop has given way."""
        return self.at(FALLING)

    def at(self, share: float) -> Memory:
        """Return all stops at the same share: on a branch for +1 and -1."""
        return (share,) * len(self.radii_v)

    def branch_share(self, memory: Memory) -> float:
        """Return s in [-1, 1]."""
        total = 0.0
        for share, place in zip(self.shares, memory, strict=True):
            total += share * place
        return max(-1.0, min(1.0, total))  # shares in decimal digits add up to 1 only nearly

    def advance(self, memory: Memory, voltage_delta_v: float) -> Memory:
        """Return the memory after the voltage has moved. ValueError unless the change is finite."""
        if not isfinite(voltage_delta_v):
            raise ValueError(f"change of {voltage_delta_v!r} V: not finite")
        if voltage_delta_v == 0.0:
            return memory
        return tuple(
            [max(-1.0, min(1.0, at + voltage_delta_v / r)) for at, r in zip(memory, self.radii_v, strict=True)]
        )

    def memory_after(self, branches: Branches, memory: Memory, from_n: float, to_n: float) -> Memory:
        """Return the memory after the force has gone from one value to another without turning round in between."""
        if from_n == to_n:
            return memory
        share = self.branch_share(memory)
        from_middle_v, from_half_v = middle_and_half(branches, from_n)
        to_middle_v, to_half_v = middle_and_half(branches, to_n)
        stuck_v = to_middle_v - from_middle_v + share * (to_half_v - from_half_v)
        return self.advance(memory, self._travel_v(memory, stuck_v, to_half_v))

    def _travel_v(self, memory: Memory, stuck_v: float, half_v: float) -> float:
        """The root d of d = stuck + h (s(d) - s(0)): stuck_v is what it would be if no stop moved."""
        way = 1.0 if stuck_v > 0.0 else -1.0
        distance_v, stiffness = abs(stuck_v), half_v * self.stiffness_per_v
        travel_v = distance_v / (1.0 - stiffness)
        for radius, share, place in zip(self.radii_v, self.shares, memory, strict=True):
            free = 1.0 - way * place
            if travel_v <= radius * free:
                break
            distance_v += half_v * share * free  # this stop gives way: what it could still add is added
            stiffness -= half_v * share / radius
            travel_v = distance_v / (1.0 - stiffness)
        return way * travel_v

    def check(self, branches: Branches) -> None:
        """Raise ValueError where the voltage would not be unique, or nearly so, right after a reversal."""
        widest_v = half_width_bound_v(branches)
        if self.stiffness_per_v * widest_v > STIFFEST:
            raise ValueError(
                f"slip stops give way over {1.0 / self.stiffness_per_v:.3g} V at first, on a loop of up to "
                f"+-{widest_v:.3g} V: more than {widest_v / STIFFEST:.3g} V is needed"
            )


def middle_and_half(branches: Branches, force_n: float) -> tuple[float, float]:
    """Return (m, h) in V: middle and half width of the loop at this force, each branch clamped to its range."""
    rising_v, _ = branches.rising.inverse(force_n)
    falling_v, _ = branches.falling.inverse(force_n)
    return 0.5 * (rising_v + falling_v), 0.5 * (rising_v - falling_v)


@lru_cache(maxsize=16)
def half_width_bound_v(branches: Branches) -> float:
    """Return a bound of half the loop's width, V: nowhere is it wider; at most BOUND_SHARE too much.

    Both inverses grow, so the ends of a range of forces bound all of it: rise(high) - fall(low). Ranges are halved until
    that is close to the widest place seen. An uploaded set waits for this, so no voltage is reckoned twice; one that is judged,
    stored and loaded is the same each time.
    """
    rising, falling = branches.rising, branches.falling
    low_n, high_n = min(rising.handles[0], falling.handles[0]), max(rising.handles[-1], falling.handles[-1])
    seen_v = BOUND_RESOLUTION * (rising.x1 - rising.x0)
    proven_v = 0.0
    ranges = [(low_n, high_n, falling.inverse(low_n)[0], rising.inverse(high_n)[0])]
    while ranges:
        start_n, end_n, start_v, end_v = ranges.pop()
        bound_v = 0.5 * (end_v - start_v)
        if bound_v <= (1.0 + BOUND_SHARE) * seen_v:
            proven_v = max(proven_v, bound_v)
            continue
        middle_n = 0.5 * (start_n + end_n)
        rising_v, falling_v = rising.inverse(middle_n)[0], falling.inverse(middle_n)[0]
        seen_v = max(seen_v, 0.5 * (rising_v - falling_v))
        ranges += [(start_n, middle_n, start_v, rising_v), (middle_n, end_n, falling_v, end_v)]
    return proven_v
