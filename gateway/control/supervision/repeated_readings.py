"""How many equal samples in a row a load cell gives while it is alive, learned from its own samples.

A cell whose noise spans several counts of its converter never repeats itself for long; one whose noise is far below a count
may do so for ever, depending on where in the count the force stands. So the rate of repeats so far proves nothing for the next
force; the spread of the noise does (repeat_law: what normal noise of that spread allows, at the worst place in a count).
The spread is that about the mean of a short window. Where they contradict it beyond their own errors, two others hold: between
neighbouring samples (a force that drifts does not widen it), and what the share of the two fullest neighbouring counts allows
(noise that never leaves two counts proves nothing). To take the least of the three at any rate, and of all pools the quietest,
would be the least of many chances: a cell of one count at 10 samples/s was found after 2.1 s for that, and is after 1.9 s.
Judged are windows in which the force stood still, and of all that are remembered, at rest and under force, the quietest pools
that are alike: a spindle that is switched off must not look like a dead cell. Samples that are sent more often than they are
converted, or filtered, are fewer than they seem: the rate of changes is compared with that of independent samples.

Noise of another kind shows in the runs of equal samples themselves: where their tail is longer than the law's it is
extrapolated (repeat_law.Runs), and of a run that the law does not explain three times its length is waited for.

A calibration knows the noise of its cell before the first sample. As long as the samples since the start are not clearly
quieter, both together count, from the first window on; a full pool of the cell's own replaces it. Cells with one count of
noise at 10 samples/s need 1.7 s by the law: 93 in 100 are found within 2.0 s from 50 samples on; of the others chance has the
first samples look quieter or fewer than they are (3.1 s at most behind 70 of them, 2.4 s behind 100). Without a calibration's
noise none is found at 50 samples, half at 70. Samples alone cannot do it: 2.0 s need a noise that is known to 13 %, and as
many samples as tell that, some 30, take 3 s. Where the noise is as expected, false alarms are as seldom as without. A cell
that has become half as noisy since costs one in some 3000 starts, for nobody can know that before so many samples.

repeat_law says which noise is found within 2 s at which rate, and which never; measured in
tests/control/supervision/readings/test_stuck_sensor.py.
"""

from collections import deque
from math import inf, nan
from typing import Final

from gateway.control.supervision.noise_spread import WINDOW, Pool, SampleWindow, Spread, expected_spread, quietest
from gateway.control.supervision.repeat_law import LONGEST_RUNS, Runs, careful_counts, equal_samples, stays

POOL_WINDOWS: Final = 32
FEWEST_WINDOWS: Final = 2
FEWEST_CHANGES: Final = 40
FEWEST_EXPECTED_CHANGES: Final = 16  # the same of noise that is as a calibration has measured it
QUIETER: Final = (
    2.0  # standard errors of the samples, by which they are quieter than the calibration: it counts no more
)
POOLS: Final = 128
INTERVAL_SHARE: Final = 0.01
CLEARLY: Final = 4.0  # standard errors of a pool that is not full
_ALIKE: Final = 1.0e-9  # N: less is the rounding of a unit's conversion
_OFF_GRID: Final = 0.1  # of a count, that a change is beside whole ones


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
        self._doubted: tuple[int, float] | None = None  # a finer count: which change showed it, and the count before, N
        self._least_later_n = inf  # of the changes since
        self._pool = Pool()
        self._window = SampleWindow()
        self._pools: dict[bool, deque[Spread]] = {way: deque(maxlen=POOLS) for way in (True, False)}
        self._known: Spread | None = None
        self._stay = 1.0
        self._expected_n = 0.0

    def expect(self, noise_n: float) -> None:
        """Begin with the noise that a calibration has measured, N, until the cell's own samples say more; 0: not known."""
        self._expected_n = noise_n

    def observe(self, value_n: float, interval_s: float, under_force: bool) -> None:
        """Count one more sample. Only what has ended with a change was alive: the present run is not learned from."""
        if value_n == self._value_n:
            self._run += 1
            return
        step_n = abs(value_n - self._value_n)
        if step_n > _ALIKE:  # not for the first one
            share = max(INTERVAL_SHARE, 1.0 / (1.0 + self._changes))  # the mean at first, then forgetting
            self.interval_s += share * (interval_s - self.interval_s)
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
        self._refine(step_n)
        self._changes += 1
        self.runs.add(self._run)
        left = min(self._run, POOL_WINDOWS * WINDOW)
        while left:
            left -= self._window.add(round(self._value_n / self.count_n), left)
            if self._window.is_full:
                self._take_window(under_force)
        self._window.change(round(step_n / self.count_n))
        if LONGEST_RUNS * self._run > self.limit and not self.runs.is_explained(self._run, self._stay):
            self.limit = LONGEST_RUNS * self._run

    def _refine(self, step_n: float) -> None:
        """See whether the counts are finer than was known. One false digit shows as much, in two changes one after the other:
        so a finer count is doubted until a later change is none of whole counts as they were known before. Where none were,
        before the first changes, it is doubted until a later change is one such count; else the least later one counts."""
        if self._doubted and self._changes > self._doubted[0] + 1:
            counts, counts_before = step_n / self.count_n, step_n / self._doubted[1]
            self._least_later_n = min(self._least_later_n, step_n)
            if abs(counts - 1.0) <= _OFF_GRID or abs(counts_before - round(counts_before)) > _OFF_GRID:
                self._doubted = None
        if step_n < 0.75 * self.count_n:  # what was judged with larger counts looks quieter than it is
            if self._doubted is None or self._doubted[1] == inf:
                self._doubted = self._changes, inf if self._doubted else self.count_n
                self._least_later_n = inf
            self.count_n, self._window = step_n, SampleWindow()

    def _take_window(self, under_force: bool) -> None:
        """Learn from a full window; where its count is doubted still, the noise would look larger than it is."""
        window, self._window = self._window, SampleWindow()
        if self._doubted:
            before_n = min(self._doubted[1], self._least_later_n)
            if before_n < inf:
                self.count_n, self._doubted = before_n, None
            return
        self._pool.add(window)
        self._renew(under_force)

    def _renew(self, under_force: bool) -> None:
        """After a window: what all that is remembered, and the pool that is not full yet, allow."""
        if self._pool.windows >= POOL_WINDOWS:
            self._pools[under_force].append(self._pool.spread)
            self._pool = Pool()
            self._known = quietest(pool for pools in self._pools.values() for pool in pools)
        expected = self._as_expected()
        noise = expected or self._quieter_now()
        if noise is None or self._changes < (FEWEST_EXPECTED_CHANGES if expected else FEWEST_CHANGES):
            return
        rate_hz = 1.0 / self.interval_s
        self.counts = careful_counts(noise.counts, noise.error, rate_hz)
        self._stay = stays(self.counts) ** noise.independent
        needed = equal_samples(self.counts, rate_hz, noise.independent)
        strange = LONGEST_RUNS * self.runs.longest_unexplained(self._stay)
        self.limit = max(needed, self.runs.equal_samples(rate_hz, self._stay), strange)

    def _as_expected(self) -> Spread | None:
        """The calibration's noise and the first samples together, where they are not quieter than that."""
        if self._known or not self._expected_n or not self._pool.windows:
            return None
        now, expected = self._pool.spread, expected_spread(self._expected_n, self.count_n)
        if now.counts < expected.counts * (1.0 - QUIETER * now.error):
            return None
        counts, error, *_ = quietest((now, expected))
        return Spread(counts, error, now.changes, now.expected)

    def _quieter_now(self) -> Spread | None:
        """What is remembered, or the pool that is not full yet where it is clearly quieter than that."""
        known, pool = self._known, self._pool
        if pool.windows < (POOL_WINDOWS // 4 if known else FEWEST_WINDOWS):
            return known
        now = pool.spread
        return now if known is None or now.counts < known.counts * (1.0 - CLEARLY * now.error) else known
