"""How often a cell that lives repeats itself: the law for normal noise read in whole counts, and the runs that were seen.

A force that stands in the middle of a count is read as that count with a probability p = erf(1 / (sqrt(8) s)), s the
standard deviation of the noise in counts; anywhere else less often. n equal samples in a row begin at each sample with a
probability (1 - p) p^n, so that at r samples/s less than one false alarm comes in a time T where r (1 - p) p^n T < 1; T is
FALSE_ALARM_S: 1000 h of holding at the worst place, half a year of shifts. That is what the noise allows; no test of equal
samples finds a cell sooner without more false alarms. The first of the n was alive, so a cell is found at the latest
(n - 1) / r after it has frozen, when the nth is read. Seconds until then, by this law and frozen_s = 0.5:

    noise in counts    0.3    0.4    0.5    0.7    0.86   1.0    1.5    3.0
    at  10 samples/s          6.6    4.2    2.5    2.0    1.7    1.2    0.9
    at  25 samples/s          2.8    1.8    1.1    0.84   0.72   0.52   0.5
    at  80 samples/s   2.1    0.94   0.6    0.5    0.5    0.5    0.5    0.5
    at 100 samples/s   1.7    0.76   0.5    0.5    0.5    0.5    0.5    0.5

Below `fewest_counts` nothing is concluded: the spread of such noise cannot be told from readings of one or two counts, and
the cell is never found frozen while the force stands still. (Of slow cells they are more: as many samples see more of a force
that wanders, and behind an hour the noise of 0.3 counts looked large enough to make four false alarms of one.) A finer count,
a faster rate or a weaker filter is the cure.
repeated_readings learns s from samples, and is careful as long as they are few: from 0.4 counts up the law holds behind
800 samples to one sample in ten; at 0.3 counts a cell is mostly not found.
"""

from math import ceil, erf, exp, factorial, inf, log, sqrt
from typing import Final

FALSE_ALARM_S: Final = 3.6e6  # 1000 h of holding
FEWEST_EQUAL: Final = 10
FEWEST_COUNTS: Final = 0.28
FEWEST_COUNTS_OF_SLOW: Final = 0.32
FAST_HZ: Final = 80.0
_NEAR: Final = 1.01  # for a derivative
MOST_COUNTS: Final = 50.0  # what is read of more noise no cell says twice
LONGEST_RUNS: Final = 3  # of a run that the law does not explain
_SURPRISE: Final = 1.0e-4  # probability of as many runs so long, among some 100 000 samples
_JUDGED: Final = 3  # lengths: a strange run may be followed by an equal sample
_TAIL_RUNS: Final = 100
_MOST_SEEN: Final = 20  # of so many runs a term of the sum
_CLEARLY: Final = 2.0  # standard errors from which on a tail is longer than the law's
_SAMPLES: Final = 65536  # of one generation of runs


def stays(counts: float) -> float:
    """Return the probability that normal noise of this standard deviation is read as one count, at the worst place in it."""
    return erf(0.5 / (sqrt(2.0) * counts)) if counts > 0.0 else 1.0


def fewest_counts(rate_hz: float) -> float:
    """Return the least noise, in counts, of which anything is concluded at so many samples/s."""
    return FEWEST_COUNTS if rate_hz >= FAST_HZ else FEWEST_COUNTS_OF_SLOW


def equal_samples(counts: float, rate_hz: float, independent: float = 1.0) -> float:
    """Return how many equal samples in a row are a false alarm once in FALSE_ALARM_S; inf where noise shows too seldom.

    independent: share of the samples that are new ones.
    """
    if not counts >= fewest_counts(rate_hz) or independent <= 0.0:
        return inf
    stay = stays(counts)
    seldom = log(FALSE_ALARM_S * rate_hz * (1.0 - stay)) / -log(stay)
    return max(FEWEST_EQUAL, seldom / independent)


def careful_counts(counts: float, error: float, rate_hz: float) -> float:
    """Return the noise to reckon with where it is known but to this relative standard error.

    A limit of S / -ln(stay) samples, S the logarithm of the samples without a false alarm, makes exp((S g e)^2 / 2) times as
    many on average, g being how fast ln(stay) goes with the noise. Noise smaller by S g e^2 / 2 makes up for that.
    """
    if not counts >= fewest_counts(rate_hz):
        return counts
    slope = log(log(stays(counts / _NEAR)) / log(stays(counts * _NEAR))) / (-2.0 * log(_NEAR))
    return counts * max(0.0, 1.0 - 0.5 * log(FALSE_ALARM_S * rate_hz) * slope * error * error)


def seconds_to_find(counts: float, rate_hz: float, at_least_s: float) -> float:
    """Return how long a cell of this noise repeats itself until it is called frozen, inf where it never is."""
    samples = equal_samples(counts, rate_hz)
    return max(at_least_s, (ceil(samples) - 1) / rate_hz) if samples < inf else inf


def counts_found_within(bound_s: float, rate_hz: float) -> float:
    """Return the least noise, in counts, of which a frozen cell is found within bound_s; inf where no noise is enough.

    A sample early by the law, because the noise is learned and not known.
    """
    low, high, bound_s = fewest_counts(rate_hz), MOST_COUNTS, bound_s - 1.0 / rate_hz
    if seconds_to_find(high, rate_hz, 0.0) > bound_s:
        return inf
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if seconds_to_find(middle, rate_hz, 0.0) <= bound_s else (middle, high)
    return high


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

    def longest_unexplained(self, stay: float) -> int:
        """Return the length of the longest runs that the law does not explain, 0 where it explains the longest ones."""
        lengths = sorted({*self._now, *self._before}, reverse=True)[:_JUDGED]
        return next((length for length in lengths if not self.is_explained(length, stay)), 0)

    def is_explained(self, length: int, stay: float) -> bool:
        """Return whether as many runs of this length or more as there were are no surprise among so many samples, each
        repeated with a probability of stay (Poisson)."""
        seen = sum(count for runs in (self._now, self._before) for at, count in runs.items() if at >= length)
        expected = sum(self._samples) * (1.0 - stay) * stay**length
        fewer = sum(expected**k / factorial(k) for k in range(min(seen, _MOST_SEEN)))
        return 1.0 - exp(-expected) * fewer > _SURPRISE

    def equal_samples(self, rate_hz: float, stay: float) -> float:
        """Return what the tail of the runs allows, whatever the noise is like: as `equal_samples`.

        0 as long as too few runs are known, or where it is no longer than that of samples of which each is repeated with a
        probability of stay. Extrapolated from the shortest length that only _TAIL_RUNS runs have reached, and how seldom those
        went on.
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
        at_risk, samples = gone_on + reached, sum(self._samples)
        is_long = gone_on > at_risk * stay + _CLEARLY * sqrt(at_risk * stay * (1.0 - stay))
        expected = samples * (1.0 - stay) * stay**length
        if not is_long and reached <= expected + _CLEARLY * sqrt(expected):
            return 0.0
        seldom = log(FALSE_ALARM_S * rate_hz * reached / samples)
        return length + seldom / -log(gone_on / at_risk)
