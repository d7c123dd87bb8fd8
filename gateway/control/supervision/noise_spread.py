"""How large the noise of a load cell is, in counts of its converter, by windows of samples in which the force stood still."""

from collections.abc import Iterable
from math import cos, erf, exp, pi, sqrt, tau
from typing import Final, NamedTuple

from gateway.control.supervision.repeat_law import MOST_COUNTS

WINDOW: Final = 32
EXPECTED_ERROR: Final = 0.1  # of a noise that a calibration has measured: 50 readings; the cell may have changed since
STILL_COUNTS: Final = 0.5  # between the halves of a window: more is a force that moves
_CAREFUL: Final = 0.3  # of the harmonic's size: how unsure a spread is below 0.4 counts
_HARMONIC, _DAMPING = 1.0 / pi**2, -2.0 * pi**2  # of the first harmonic of the rounding, by noise in counts
_CONTRADICTION: Final = 1.5  # standard errors of the variance, by which neighbours differ by less: the force drifted
_CLEARLY: Final = 2.0  # standard errors by which so few samples are outside two counts
_SURELY: Final = 1.5  # standard errors below 1, from which on samples are taken for fewer than they seem
_ALIKE: Final = 4.0  # standard errors: as far as chance spreads some hundred pools


class Spread(NamedTuple):
    """Of a noise. counts: standard deviation; error: of it, relative; changes: of the reading, expected: what independent
    samples would have made."""

    counts: float
    error: float
    changes: float
    expected: float

    @property
    def independent(self) -> float:
        """The share of the samples that are new ones; 1 where fewer may be chance."""
        share = self.changes / self.expected if self.expected else 1.0
        unsure = sqrt(max(0.0, 1.0 - share) / self.changes) if self.changes else 0.0
        return share if share < 1.0 - _SURELY * unsure else 1.0


def expected_spread(noise_n: float, count_n: float) -> Spread:
    """Return the spread that a calibration's noise makes in counts, Sheppard's correction taken off. It says nothing of how
    many samples are new ones."""
    variance = (noise_n / count_n) ** 2 - 1.0 / 12.0
    return Spread(sqrt(max(0.0, variance)), EXPECTED_ERROR, 0.0, 0.0)


def quietest(pools: Iterable[Spread]) -> Spread:
    """Return the spread of the least noise among these: of all that may be the same as the least one, together."""
    known = list(pools)
    least = min(known)
    alike = [pool for pool in known if pool.counts <= least.counts * (1.0 + _ALIKE * least.error)]
    weights = [1.0 / pool.error**2 for pool in alike]
    counts = sum(weight * pool.counts for weight, pool in zip(weights, alike, strict=True)) / sum(weights)
    return Spread(
        counts, 1.0 / sqrt(sum(weights)), sum(pool.changes for pool in alike), sum(pool.expected for pool in alike)
    )


def spread_of(variance: float, centred: float) -> float:
    """Return the standard deviation in counts of normal noise whose readings in whole counts have this variance, counts^2.

    centred: cosine of the force's place in its count, 1 in the middle, -1 between two. Sheppard's correction with the
    first harmonic of the rounding (Widrow and Kollar, Quantization Noise, 2008), which counts below 0.5 counts of noise.
    """
    low, high = 0.0, MOST_COUNTS
    for _ in range(40):
        middle = 0.5 * (low + high)
        square = middle * middle
        harmonic = (4.0 * square + _HARMONIC) * exp(_DAMPING * square)
        low, high = (middle, high) if square + 1.0 / 12.0 - centred * harmonic < variance else (low, middle)
    return low * (1.0 - _CAREFUL * exp(_DAMPING * low * low))


def spread_within_two(share: float) -> float:
    """Return the standard deviation in counts of normal noise of which two neighbouring counts hold at most this share."""
    low, high = 0.0, MOST_COUNTS
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if erf(1.0 / (sqrt(2.0) * middle)) > share else (low, middle)
    return low


class SampleWindow:
    """WINDOW samples in a row: how often each level was read, and whether the force stood still."""

    def __init__(self) -> None:
        self.size = self.changes = self.travel = self.squares = 0
        self._levels: dict[int, int] = {}
        self._half_sums = [0, 0]

    @property
    def is_full(self) -> bool:
        """Tell whether it has WINDOW samples."""
        return self.size >= WINDOW

    def add(self, level: int, count: int) -> int:
        """Add so many samples of one level, as far as there is room; return how many were taken."""
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
        """Tell whether the force stood still: its halves differ by no more than the noise makes of them."""
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
    def centring(self) -> float:
        """1 where the force stands in the middle of a count, -1 where it stands between two."""
        return cos(tau * (self._half_sums[0] + self._half_sums[1]) / WINDOW)

    @property
    def expected_changes(self) -> float:
        """Return the number of changes that independent samples of this spread would show."""
        return WINDOW - sum(count * count for count in self._levels.values()) / WINDOW


class Pool:
    """A few windows together, so that chance evens out."""

    def __init__(self) -> None:
        self.windows = 0
        self._in_two = 0
        self._squares = 0
        self._deviations = self._centred = self._changes = self._expected = 0.0

    def add(self, window: SampleWindow) -> None:
        """Add a full window, unless the force moved in it."""
        if not window.is_still:
            return
        self.windows += 1
        self._in_two += window.in_two
        self._squares += window.squares
        self._deviations += window.deviations
        self._centred += window.centring
        self._changes += window.changes
        self._expected += window.expected_changes

    @property
    def spread(self) -> Spread:
        """The noise of its samples; ask for it with one still window at least."""
        freedom = self.windows * (WINDOW - 1)
        error = min(1.0, max(sqrt(2.0 / freedom), 1.0 / sqrt(self._changes or 1.0)))
        variance, between = self._deviations / freedom, 0.5 * self._squares / freedom
        if between < variance * (1.0 - _CONTRADICTION * error):
            variance = between
        centred = self._centred / self.windows
        counts, careful = spread_of(variance, centred), spread_of(variance * (1.0 - error), centred)
        outside, samples = self.windows * WINDOW - self._in_two, self.windows * WINDOW
        if spread_within_two(1.0 - (outside + _CLEARLY * sqrt(outside)) / samples) < counts:
            counts = careful = min(careful, spread_within_two(1.0 - (outside - sqrt(outside)) / samples))
        relative = (counts - careful) / counts if counts > careful else 0.5 * error
        return Spread(counts, relative, self._changes, self._expected)
