"""How many equal samples in a row a load cell gives while it is alive, learned from its own samples.

A cell whose noise spans several counts of its converter never repeats itself for long; one whose noise is far below a count
may do so for ever, depending on where in the count the force stands. So the rate of repeats so far proves nothing for the next
force. What does: the share M of the samples that the two fullest neighbouring counts of a short window hold. No stretch of one
count's width, wherever it lies, holds more, so that n independent samples are equal with a probability below M^n; noise that
never leaves two counts has M = 1, and nothing is ever concluded from it. Judged are windows in which the force stood still,
and of all that are remembered, at rest and under force, the quietest counts: a spindle that is switched off must not look
like a dead cell. Samples that are sent more often than they are converted, or filtered, are fewer than they seem: the rate of
changes is compared with that of independent samples of the same spread.

FALSE_ALARMS_PER_S is what normal noise may cost at most (`power` has the closer bound that holds for it). Three times the
longest run that is remembered is waited for in any case, which covers noise of another kind (with K runs seen, one in K^3 is
three times as long as the longest). Measured in tests/control/supervision/test_stuck_sensor.py: at 100 samples/s a
dead cell is found
within 2 s from a noise of 0.6 counts up, at 10 samples/s from 2 counts up.
"""

from collections import deque
from math import inf, log, nan
from typing import Final

WINDOW: Final = 32
POOL_WINDOWS: Final = 8
FEWEST_WINDOWS: Final = 2
FEWEST_CHANGES: Final = 40
POOLS: Final = 512
FALSE_ALARMS_PER_S: Final = 1.0e-8
LONGEST_RUNS: Final = 3
FEWEST_EQUAL: Final = 10
STILL_COUNTS: Final = 0.5  # between the halves of a window: more is a force that moves
_ALIKE: Final = 1.0e-9  # N: less is the rounding of a unit's conversion


def power(share: float) -> float:
    """Normal noise stays in one count, wherever that lies, with a probability below share ** power(share)."""
    return min(2.0, 1.15 + 1.25 * share)


class RepeatedReadings:
    """Fed with every usable sample; `limit` equal samples in a row are more than the cell gives while it is alive."""

    def __init__(self) -> None:
        self.longest = 0
        self.limit = inf
        self._value_n = nan
        self._run, self._is_dead = 0, False
        self._count_n = inf
        self._changes = 0
        self._pool = _Pool()
        self._window = _Window()
        self._pools: dict[bool, deque[tuple[float, int]]] = {way: deque(maxlen=POOLS) for way in (True, False)}
        self._known = 0.0, 0
        self._interval_s = 0.01

    def observe(self, value_n: float, interval_s: float, under_force: bool) -> None:
        """One more sample. Only what has ended with a change was alive: the present run is not learned from."""
        if value_n == self._value_n:
            self._run += 1
            return
        step_n = abs(value_n - self._value_n)
        if step_n > _ALIKE:  # not for the first one
            self._interval_s += 0.01 * (interval_s - self._interval_s)
            self._learn(step_n, under_force)
        self._value_n, self._run, self._is_dead = value_n, 1, False

    def forget_run(self) -> None:
        """The present run is no sign of life, however long it goes on."""
        self._is_dead = True

    def _learn(self, step_n: float, under_force: bool) -> None:
        if self._is_dead:
            return
        if step_n < 0.75 * self._count_n:  # what was judged with larger counts looks quieter than it is
            self._count_n, self._window = step_n, _Window()
        self._changes += 1
        level, steps = round(self._value_n / self._count_n), round(step_n / self._count_n)
        left = min(self._run, POOL_WINDOWS * WINDOW)
        self._pool.longest = max(self._pool.longest, self._run)
        while left:
            left -= self._window.add(level, left)
            if self._window.is_full:
                self._pool.add(self._window)
                self._window = _Window()
                self._renew(under_force)
        self._window.change(steps)
        if self._run > self.longest:
            self.longest = self._run
            self.limit = max(self.limit, LONGEST_RUNS * self.longest)

    def _renew(self, under_force: bool) -> None:
        """After a window: what all that is remembered, and the pool that is not full yet, allow."""
        if self._pool.windows >= POOL_WINDOWS:
            self._pools[under_force].append((self._pool.draws, self._pool.longest))
            self._pool = _Pool()
            known = [*self._pools[True], *self._pools[False]]
            self._known = max(draws for draws, _ in known), max(longest for _, longest in known)
        draws, longest = self._known
        if self._pool.windows >= (POOL_WINDOWS // 2 if draws else FEWEST_WINDOWS):
            draws = max(draws, self._pool.draws)
        self.longest = max(longest, self._pool.longest)
        if draws and self._changes >= FEWEST_CHANGES:
            needed = draws * -log(FALSE_ALARMS_PER_S * self._interval_s)
            self.limit = max(FEWEST_EQUAL, needed, LONGEST_RUNS * self.longest)


class _Window:
    """WINDOW samples in a row: how often each level was read, and whether the force stood still."""

    def __init__(self) -> None:
        self.size = self.changes = self.travel = 0
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
        self.changes += 1
        self.travel += steps

    @property
    def is_still(self) -> bool:
        moved = abs(self._half_sums[1] - self._half_sums[0]) / (WINDOW // 2)
        return moved <= max(STILL_COUNTS, self.travel / WINDOW)

    @property
    def in_two(self) -> int:
        """Samples in the two fullest neighbouring levels."""
        return max(count + self._levels.get(level + 1, 0) for level, count in self._levels.items())

    @property
    def expected_changes(self) -> float:
        """Of independent samples of this spread."""
        return WINDOW - sum(count * count for count in self._levels.values()) / WINDOW


class _Pool:
    """A few windows together, so that chance evens out."""

    def __init__(self) -> None:
        self.windows = self.longest = 0
        self._in_two = 0
        self._changes = self._expected = 0.0

    def add(self, window: _Window) -> None:
        if not window.is_still:
            return
        self.windows += 1
        self._in_two += window.in_two
        self._changes += window.changes
        self._expected += window.expected_changes

    @property
    def draws(self) -> float:
        """Equal samples that make it less likely by a factor of e; inf where the noise does not leave two levels."""
        share = (self._in_two + 1) / (self.windows * WINDOW + 1)
        if share >= 1.0 or not self._changes:
            return inf
        independent = min(1.0, self._changes / self._expected) if self._expected else 1.0
        return 1.0 / (-log(share) * power(share) * independent)
