"""How many equal samples in a row a load cell gives while it is alive, learned from its own samples.

A cell whose noise spans several counts of its converter never repeats itself for long; one whose noise is far below a count
may do so for ever, depending on where in the count the force stands. So the rate of repeats so far proves nothing for the next
force; the spread of the noise does (repeat_law: what normal noise of that spread allows, at the worst place in a count).
The spread is the least of three: about the mean of a short window, between neighbouring samples (a force that drifts does not
widen it), and what the share of the two fullest neighbouring counts allows (noise that never leaves two counts proves nothing).
Judged are windows in which the force stood still, and of all that are remembered, at rest and under force, the quietest pool:
a spindle that is switched off must not look like a dead cell. Samples that are sent more often than they are converted, or
filtered, are fewer than they seem: the rate of changes is compared with that of independent samples of the same counts.

Noise of another kind shows in the runs of equal samples themselves: their tail is extrapolated (repeat_law.Runs), and of one
that the law does not explain three times its length is waited for.

repeat_law says which noise is found within 2 s at which rate, and which never; measured in
tests/control/supervision/test_stuck_sensor.py.
"""

from collections import deque
from math import cos, inf, nan, sqrt, tau
from typing import Final, NamedTuple

from gateway.control.supervision.repeat_law import (
    LONGEST_RUNS,
    Runs,
    equal_samples,
    spread_of,
    spread_within_two,
    stays,
)

WINDOW: Final = 32
POOL_WINDOWS: Final = 32
FEWEST_WINDOWS: Final = 2
FEWEST_CHANGES: Final = 40
POOLS: Final = 128
STILL_COUNTS: Final = 0.5  # between the halves of a window: more is a force that moves
_ALIKE: Final = 1.0e-9  # N: less is the rounding of a unit's conversion


class Spread(NamedTuple):
    """Of a noise: standard deviation in counts, and the share of its samples that are new ones. Sorted by the former."""

    counts: float
    independent: float


class RepeatedReadings:
    """Fed with every usable sample; `limit` equal samples in a row are more than the cell gives while it is alive.

    counts: standard deviation of the quietest noise that is remembered, in counts, nan as long as it is not known.
    """

    def __init__(self) -> None:
        self.limit = inf
        self.counts = nan
        self.count_n = inf
        self.interval_s = 0.01
        self.runs = Runs()
        self._value_n = nan
        self._run, self._is_dead = 0, False
        self._changes = 0
        self._pool = _Pool()
        self._window = _Window()
        self._pools: dict[bool, deque[Spread]] = {way: deque(maxlen=POOLS) for way in (True, False)}
        self._known: Spread | None = None
        self._stay = 1.0

    def observe(self, value_n: float, interval_s: float, under_force: bool) -> None:
        """Count one more sample. Only what has ended with a change was alive: the present run is not learned from."""
        if value_n == self._value_n:
            self._run += 1
            return
        step_n = abs(value_n - self._value_n)
        if step_n > _ALIKE:  # not for the first one
            self.interval_s += 0.01 * (interval_s - self.interval_s)
            self._learn(step_n, under_force)
        self._value_n, self._run, self._is_dead = value_n, 1, False

    def forget_run(self) -> None:
        """Forget the present run: it is no sign of life, however long it goes on."""
        self._is_dead = True

    @property
    def longest(self) -> int:
        """Length of the longest run of equal readings."""
        return self.runs.longest

    def _learn(self, step_n: float, under_force: bool) -> None:
        if self._is_dead:
            return
        if step_n < 0.75 * self.count_n:  # what was judged with larger counts looks quieter than it is
            self.count_n, self._window = step_n, _Window()
        self._changes += 1
        self.runs.add(self._run)
        level, steps = round(self._value_n / self.count_n), round(step_n / self.count_n)
        left = min(self._run, POOL_WINDOWS * WINDOW)
        while left:
            left -= self._window.add(level, left)
            if self._window.is_full:
                self._pool.add(self._window)
                self._window = _Window()
                self._renew(under_force)
        self._window.change(steps)
        self.limit = max(self.limit, self._unexplained(self._run))

    def _unexplained(self, run: int) -> float:
        """What is waited for after a run that the law does not explain, 0 for any other."""
        return 0.0 if self.runs.is_explained(run, self._stay) else LONGEST_RUNS * run

    def _renew(self, under_force: bool) -> None:
        """After a window: what all that is remembered, and the pool that is not full yet, allow."""
        if self._pool.windows >= POOL_WINDOWS:
            self._pools[under_force].append(self._pool.spread)
            self._pool = _Pool()
            self._known = min(min(pools) for pools in self._pools.values() if pools)
        known = self._known
        if self._pool.windows >= (POOL_WINDOWS // 4 if known else FEWEST_WINDOWS):
            known = min(known, self._pool.spread) if known else self._pool.spread
        if known is None or self._changes < FEWEST_CHANGES:
            return
        self.counts, independent = known
        rate_hz = 1.0 / self.interval_s
        self._stay = stays(self.counts) ** independent
        needed = equal_samples(self.counts, rate_hz, independent)
        self.limit = max(needed, self.runs.equal_samples(rate_hz), self._unexplained(self.runs.longest))


class _Window:
    """WINDOW samples in a row: how often each level was read, and whether the force stood still."""

    def __init__(self) -> None:
        self.size = self.changes = self.travel = self.squares = 0
        self._levels: dict[int, int] = {}
        self._half_sums = [0, 0]

    @property
    def is_full(self) -> bool:
        return self.size >= WINDOW

    def add(self, level: int, count: int) -> int:
        """So many samples of one level, as far as there is room: how many were taken."""
        taken = min(count, WINDOW - self.size)
        self._levels[level] = self._levels.get(level, 0) + taken
        first = min(taken, max(0, WINDOW // 2 - self.size))
        self._half_sums[0] += first * level
        self._half_sums[1] += (taken - first) * level
        self.size += taken
        return taken

    def change(self, steps: int) -> None:
        """Count a change of the reading by so many counts."""
        self.changes += 1
        self.travel += steps
        self.squares += steps * steps

    @property
    def is_still(self) -> bool:
        moved = abs(self._half_sums[1] - self._half_sums[0]) / (WINDOW // 2)
        return moved <= max(STILL_COUNTS, self.travel / WINDOW)

    @property
    def in_two(self) -> int:
        """Samples in the two fullest neighbouring levels."""
        return max(count + self._levels.get(level + 1, 0) for level, count in self._levels.items())

    @property
    def deviations(self) -> float:
        """Sum of the squares about the mean, counts^2."""
        total = self._half_sums[0] + self._half_sums[1]
        return sum(count * level * level for level, count in self._levels.items()) - total * total / WINDOW

    @property
    def centred(self) -> float:
        """1 where the force stands in the middle of a count, -1 where it stands between two."""
        return cos(tau * (self._half_sums[0] + self._half_sums[1]) / WINDOW)

    @property
    def expected_changes(self) -> float:
        """Of independent samples of this spread."""
        return WINDOW - sum(count * count for count in self._levels.values()) / WINDOW


class _Pool:
    """A few windows together, so that chance evens out."""

    def __init__(self) -> None:
        self.windows = 0
        self._in_two = 0
        self._squares = 0
        self._deviations = self._centred = self._changes = self._expected = 0.0

    def add(self, window: _Window) -> None:
        if not window.is_still:
            return
        self.windows += 1
        self._in_two += window.in_two
        self._squares += window.squares
        self._deviations += window.deviations
        self._centred += window.centred
        self._changes += window.changes
        self._expected += window.expected_changes

    @property
    def spread(self) -> Spread:
        """Its noise in counts, rather too small by the standard error of so few samples, and the share of new samples."""
        freedom = self.windows * (WINDOW - 1)
        error = min(1.0, max(sqrt(2.0 / freedom), 1.0 / sqrt(self._changes or 1.0)))
        variance = min(self._deviations, 0.5 * self._squares) / freedom * (1.0 - error)
        outside = self.windows * WINDOW - self._in_two
        share = 1.0 - (outside - sqrt(outside)) / (self.windows * WINDOW)
        counts = min(spread_of(variance, self._centred / self.windows), spread_within_two(share))
        independent = min(1.0, self._changes / self._expected) if self._expected else 1.0
        return Spread(counts, independent)
