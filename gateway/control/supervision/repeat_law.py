"""How often a cell that lives repeats itself: the law for normal noise read in whole counts, and the runs that were seen.

A force that stands in the middle of a count is read as that count with a probability p = erf(1 / (sqrt(8) s)), s the
standard deviation of the noise in counts; anywhere else less often. n equal samples in a row begin at each sample with a
probability (1 - p) p^(n-1), so that at r samples/s less than one false alarm comes in a time T where
r (1 - p) p^(n-1) T < 1; T is FALSE_ALARM_S, 1000 h of holding. That is what the noise allows; no test of equal samples
finds a cell sooner without more false alarms. Seconds until a frozen cell is found, by this law and frozen_s = 0.5:

    noise in counts    0.2    0.3    0.5    0.7    1.0    1.5    3.0
    at  10 samples/s   (104)  15     4.4    2.7    1.9    1.4    1.0
    at  80 samples/s   (15)   2.2    0.63   0.5    0.5    0.5    0.5
    at 500 samples/s   (2.7)  0.5    0.5    0.5    0.5    0.5    0.5

Below FEWEST_COUNTS nothing is concluded: the spread of such noise cannot be told from readings of one or two counts, and
the cell is never found frozen while the force stands still. A finer count, a faster rate or a weaker filter is the cure.
repeated_readings learns s from samples, rather too small: at 0.3 counts a cell is mostly not found either, at 0.4 counts
after 1.2 times, from 0.7 counts up after 1.1 times as long as the law says.
"""

from math import ceil, erf, exp, inf, log, pi, sqrt
from typing import Final

FALSE_ALARM_S: Final = 3.6e6  # 1000 h of holding
FEWEST_EQUAL: Final = 10
FEWEST_COUNTS: Final = 0.28
_CAREFUL: Final = 0.3  # of the harmonic's size: how unsure a spread is below 0.4 counts
MOST_COUNTS: Final = 50.0
LONGEST_RUNS: Final = 3  # of a run that the law does not explain
_SURPRISE: Final = 0.01
_TAIL_RUNS: Final = 100
_SAMPLES: Final = 65536  # of one generation of runs


def stays(counts: float) -> float:
    """Return the probability that normal noise of this standard deviation is read as one count, at the worst place in it."""
    return erf(0.5 / (sqrt(2.0) * counts)) if counts > 0.0 else 1.0


def equal_samples(counts: float, rate_hz: float, independent: float = 1.0) -> float:
    """Return how many equal samples in a row are a false alarm once in FALSE_ALARM_S; inf where noise shows too seldom.

    independent: share of the samples that are new ones.
    """
    if not counts >= FEWEST_COUNTS or independent <= 0.0:
        return inf
    stay = stays(counts)
    seldom = log(FALSE_ALARM_S * rate_hz * (1.0 - stay)) / -log(stay)
    return max(FEWEST_EQUAL, 1.0 + seldom / independent)


def seconds_to_find(counts: float, rate_hz: float, at_least_s: float) -> float:
    """Return how long a cell of this noise repeats itself until it is called frozen, inf where it never is."""
    samples = equal_samples(counts, rate_hz)
    return max(at_least_s, ceil(samples) / rate_hz) if samples < inf else inf


def counts_found_within(bound_s: float, rate_hz: float) -> float:
    """Return the least noise, in counts, of which a frozen cell is found within bound_s; inf where no noise is enough."""
    low, high = FEWEST_COUNTS, MOST_COUNTS
    if seconds_to_find(high, rate_hz, 0.0) > bound_s:
        return inf
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if seconds_to_find(middle, rate_hz, 0.0) <= bound_s else (middle, high)
    return high


def spread_of(variance: float, centred: float) -> float:
    """Return the standard deviation in counts of normal noise whose readings in whole counts have this variance, counts^2.

    centred: cosine of the force's place in its count, 1 in the middle, -1 between two. Sheppard's correction with the
    first harmonic of the rounding (Widrow and Kollar, Quantization Noise, 2008), which counts below 0.5 counts of noise.
    """
    low, high = 0.0, MOST_COUNTS
    for _ in range(40):
        middle = 0.5 * (low + high)
        square = middle * middle
        harmonic = (4.0 * square + 1.0 / pi**2) * exp(-2.0 * pi**2 * square)
        low, high = (middle, high) if square + 1.0 / 12.0 - centred * harmonic < variance else (low, middle)
    return low * (1.0 - _CAREFUL * exp(-2.0 * pi**2 * low * low))


def spread_within_two(share: float) -> float:
    """Return the standard deviation in counts of normal noise of which two neighbouring counts hold at most this share."""
    low, high = 0.0, MOST_COUNTS
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if erf(1.0 / (sqrt(2.0) * middle)) > share else (low, middle)
    return low


class Runs:
    """The lengths of the runs of equal samples that ended, of the last 65 000 to 130 000 samples."""

    def __init__(self) -> None:
        self._now: dict[int, int] = {}
        self._before: dict[int, int] = {}
        self._samples = [0, 0]

    def add(self, length: int) -> None:
        """Count a run of this many equal samples."""
        self._now[length] = self._now.get(length, 0) + 1
        self._samples[0] += length
        if self._samples[0] >= _SAMPLES:
            self._before, self._now = self._now, {}
            self._samples = [0, self._samples[0]]

    @property
    def longest(self) -> int:
        """Length of the longest run."""
        return max((*self._now, *self._before), default=0)

    def is_explained(self, length: int, stay: float) -> bool:
        """Return whether a run of this length is no surprise among so many samples, each repeated with a probability of
        stay."""
        expected = sum(self._samples) * (1.0 - stay) * stay ** (length - 1)
        return expected > _SURPRISE

    def equal_samples(self, rate_hz: float) -> float:
        """Return what the tail of the runs allows, whatever the noise is like: as `equal_samples`.

        0 as long as too few runs are known. Extrapolated from the shortest length that only _TAIL_RUNS runs have reached, and
        how seldom those went on.
        """
        reached = gone_on = length = 0
        lengths = sorted({*self._now, *self._before}, reverse=True)
        for length, next_length in zip(lengths, [*lengths[1:], 0], strict=True):
            reached += self._now.get(length, 0) + self._before.get(length, 0)
            if reached >= _TAIL_RUNS:
                break
            gone_on += reached * (length - next_length)
        if reached < _TAIL_RUNS or not gone_on:
            return 0.0
        at_risk = gone_on + reached
        seldom = log(FALSE_ALARM_S * rate_hz * reached / sum(self._samples))
        return length + seldom / -log(gone_on / at_risk)
