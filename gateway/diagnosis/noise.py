"""The noise of a recording: white plus Lorentzians, fitted to what no candidate explains; and its whitening.

A test that takes coloured noise for white finds causes everywhere (40 false alarms of 40 in a prototype), and an AR
model of affordable order misses the slow end. So the periodogram of the remainder is fitted by Whittle's likelihood with
    S(f) = s0 + sum of up to two  a / (1 + ((f - c)/w)^2),  c = 0 or where a frame rings,
on logarithmic bins. Bins are medians where they hold enough lines: a spectral line is a cause, not noise. Whitening divides by
sqrt(S) in the frequency domain, row by row (rows count as evenly spaced), and leaves a variance of 1.
"""

from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.diagnosis.measurement import Floats
from gateway.diagnosis.search.bench import Bench, Channel
from gateway.robust import noise_from_second_differences
from gateway.side_by_side import side_by_side

_LEAST_LEFT: Final = 0.15
_BINS: Final = 64
_AT_ONCE: Final = 8  # vectors
_MANY_LINES: Final = 12  # of a bin, from which its median is told
_NOWHERE: Final = 1.0e-12  # centre of a Lorentzian that falls from frequency 0
_FIRST_DAMPING: Final = 0.1
_FLAT: Final = 1.0e-9  # curvature of a number that changes nothing
_MOST_SCORINGS: Final = 60
_LEAST_SCORED: Final = 1.0e-6  # of a log-likelihood: less is no progress
_MEDIAN_OF_EXPONENTIAL: Final = float(np.log(2.0))


@dataclass(frozen=True, slots=True)
class Noise:
    """Spectrum of one segment. weights: 1/sqrt(S) at the lines of the real FFT of its rows and zeros, `length` in all."""

    total_n: float  # standard deviation
    weights: Floats

    @property
    def length(self) -> int:
        """Of the FFT: even."""
        return 2 * (self.weights.size - 1)

    @property
    def scale(self) -> Floats:
        """What turns lines into coordinates with the same sums of products: all but the first and the last stand for two."""
        scale = np.full(self.weights.size, np.sqrt(2.0 / self.length))
        scale[[0, -1]] = np.sqrt(1.0 / self.length)
        return scale


@dataclass(frozen=True, slots=True)
class Whitener:
    """How residuals are weighted: one noise per segment of a bench, and a weight (rows,) for each row.

    A row weighs less where its own time is in doubt while the force moves; 1 where its time is known.
    """

    channels: tuple[Channel, ...]
    noises: tuple[Noise, ...]
    weights: Floats

    def __call__(self, vectors: Floats) -> Floats:
        """Whitened vectors (..., rows)."""
        whitened = np.empty_like(vectors)
        flat, found = vectors.reshape(-1, vectors.shape[-1]), whitened.reshape(-1, vectors.shape[-1])

        def fill(some: slice) -> None:
            for channel, noise in zip(self.channels, self.noises, strict=True):
                rows = channel.rows.stop - channel.rows.start
                lines = self._lines(flat[some, channel.rows], channel, noise)
                found[some, channel.rows] = np.fft.irfft(lines, noise.length)[:, :rows]

        side_by_side(fill, _some_at_once(flat.shape[0]))
        return whitened

    def spectra(self, vectors: Floats) -> Floats:
        """Return whitened vectors (..., rows) by their spectral lines, (..., coordinates): what least squares ask of them,
        products of one with another, is the same, for half the work."""
        flat = vectors.reshape(-1, vectors.shape[-1])
        found = np.empty((flat.shape[0], sum(each.length + 2 for each in self.noises)))

        def fill(some: slice) -> None:
            at = 0
            for channel, noise in zip(self.channels, self.noises, strict=True):
                lines = self._lines(flat[some, channel.rows], channel, noise)
                lines *= noise.scale
                found[some, at : at + noise.length + 2] = lines.view(np.float64)
                at += noise.length + 2

        side_by_side(fill, _some_at_once(flat.shape[0]))
        return found.reshape(*vectors.shape[:-1], -1)

    def _lines(self, part: Floats, channel: Channel, noise: Noise) -> NDArray[np.complex128]:
        """Weighted lines of some vectors of one segment."""
        lines: NDArray[np.complex128] = np.fft.rfft(part * self.weights[channel.rows], noise.length)
        lines *= noise.weights
        return lines

    @property
    def knows_times(self) -> bool:
        """Are all rows taken to be read when they say?"""
        return bool(np.all(self.weights == 1.0))

    @property
    def floor_n(self) -> float:
        """Standard deviation of the force's noise over all recordings, N."""
        forces = [
            (noise.total_n**2, channel.rows.stop - channel.rows.start)
            for channel, noise in zip(self.channels, self.noises, strict=True)
            if channel.is_force
        ]
        return float(np.sqrt(sum(power * rows for power, rows in forces) / sum(rows for _, rows in forces)))


def _some_at_once(vectors: int) -> list[slice]:
    """Few vectors at a time: what is done to them one after another stays in the processor's cache."""
    return [slice(first, first + _AT_ONCE) for first in range(0, vectors, _AT_ONCE)]


@cache
def fast_length(rows: int) -> int:
    """Return the even length from `rows` on whose FFT is fast: a product of small primes; others take five times as long."""
    length = rows + rows % 2
    while _without_small_primes(length) > 1:
        length += 2
    return length


def _without_small_primes(number: int) -> int:
    for prime in (2, 3, 5, 7):
        while number % prime == 0:
            number //= prime
    return number


def white_whitener(bench: Bench, residual_n: Floats, weights: Floats | None = None) -> Whitener:
    """Return a first guess, before anything is known: each segment white, with the size of its fastest part.

    weights: of the rows; None: all alike.
    """
    noises = []
    for channel in bench.channels:
        sigma = fast_noise_n(residual_n[channel.rows][bench.usable[channel.rows]])
        lines = fast_length(channel.rows.stop - channel.rows.start) // 2 + 1
        noises.append(Noise(sigma, np.full(lines, 1.0 / sigma)))
    return Whitener(bench.channels, tuple(noises), np.ones(bench.rows) if weights is None else weights)


def timing_weights(bench: Bench, simulated_n: Floats, late_s: float, noise_n: float) -> Floats:
    """Return weights (rows,) of readings that come early or late by chance, by `late_s` (standard deviation).

    While the force moves they say less. noise_n: standard deviation of a reading at rest.
    """
    slope = bench.slope_n_per_s(simulated_n)
    return np.asarray(1.0 / np.sqrt(1.0 + (slope * late_s / noise_n) ** 2))


def fast_noise_n(values: Floats) -> float:
    """Return the standard deviation of white noise from second differences, robust; never 0."""
    if values.size < 8:
        return max(float(np.std(values)) if values.size else 0.0, 1.0e-9)
    return float(max(noise_from_second_differences(values), 1.0e-3 * float(np.std(values)), 1.0e-9))


def coloured_whitener(bench: Bench, remainder_n: Floats, basis: Floats, weights: Floats) -> Whitener:
    """Return the noise of what is left after the orthonormal columns `basis` (k, rows) were fitted; weights of the rows.

    They took most at the slow end, where trends and steps live: each line of the periodogram is divided by the share
    that they left there, or the noise would look too small just where false causes are likeliest.
    """
    basis = np.vstack([basis, bench.nuisance.T])
    noises = []
    for channel in bench.channels:
        part, usable = remainder_n[channel.rows] * weights[channel.rows], bench.usable[channel.rows]
        length = fast_length(part.size)
        taken = np.zeros(length // 2 + 1)
        for column in basis:  # one at a time: there are hundreds
            taken += np.abs(np.fft.rfft(column[channel.rows], length)) ** 2 / part.size
        noises.append(_fit_spectrum(part, np.clip(1.0 - taken, _LEAST_LEFT, 1.0) * max(float(np.mean(usable)), 0.05)))
    return Whitener(bench.channels, tuple(noises), weights)


def _fit_spectrum(part: Floats, left: Floats) -> Noise:
    """left: share of the power that is left at each line, for rows that do not count and columns that were fitted."""
    rows = fast_length(part.size)
    power = np.abs(np.fft.rfft(part, rows)) ** 2 / (part.size * left)
    lines = np.arange(1, power.size)
    centres, levels, weights = _bin_spectrum(lines, power[1:], left[1:])
    spectrum = _fit_by_likelihood(centres, np.maximum(levels, 1.0e-300), weights, rows)
    model = spectrum(np.maximum(np.arange(power.size), 0.5))
    one_sided = np.ones(power.size)
    one_sided[1:-1] = 2.0
    total = float(np.sqrt(np.sum(model * one_sided) / rows))
    return Noise(total, 1.0 / np.sqrt(model))


def fit_to_lines(lines: Floats, power: Floats, rows: int) -> "Spectrum":
    """Return the spectrum of noise whose power is known at some lines, in lines of so many rows. Both (k,), any order."""
    edges = np.geomspace(float(lines.min()), float(lines.max()) * (1.0 + 1.0e-9), _BINS // 2)
    place = np.searchsorted(edges, lines, side="right")
    bins = [place == each for each in np.unique(place)]
    levels = [_level(power[inside]) for inside in bins]
    centres = [float(np.exp(np.mean(np.log(lines[inside])))) for inside in bins]
    weights = [min(float(inside.sum()), 400.0) for inside in bins]
    return _fit_by_likelihood(np.array(centres), np.maximum(levels, 1.0e-300), np.array(weights), rows)


def _level(power: Floats) -> float:
    """Level of a bin of the periodogram; one of many lines does not feel a line that stands out."""
    return float(np.median(power) / _MEDIAN_OF_EXPONENTIAL if power.size >= _MANY_LINES else np.mean(power))


def _bin_spectrum(lines: NDArray[np.int64], power: Floats, left: Floats) -> tuple[Floats, Floats, Floats]:
    """Centre line, level and weight of logarithmic bins."""
    edges = np.unique(np.round(np.geomspace(1, lines.size + 1, _BINS)).astype(int))
    centres, levels, weights = [], [], []
    for low, high in pairwise(edges):
        inside = power[low - 1 : high - 1]
        centres.append(np.sqrt(low * max(high - 1, low)))
        levels.append(_level(inside))
        weights.append(min(float(np.sum(left[low - 1 : high - 1])), 400.0))
    return np.array(centres), np.array(levels), np.array(weights, dtype=float)


def _fit_by_likelihood(centres: Floats, levels: Floats, weights: Floats, rows: int) -> "Spectrum":
    """The spectrum of greatest likelihood; one Lorentzian fewer where the second does not pay."""
    floor = float(np.median(levels[-8:]))
    slow = max(float(np.mean(levels[: max(4, levels.size // 4)])) - floor, 0.1 * floor)
    peaks = [(max(levels[k] - floor, 0.1 * floor), 0.15 * centres[k], centres[k]) for k in _highest_bins(levels)]
    lows = [(slow, rows * share, _NOWHERE) for share in (0.001, 0.01, 0.08)]
    best = _minimise_misfit([floor], centres, levels, weights)
    for humps in (
        [[low] for low in lows] + [[peak] for peak in peaks],
        [[lows[0], lows[2]], [lows[0], lows[1]]] + [[lows[1], peak] for peak in peaks],
    ):
        starts = [[floor, *(number for hump in each for number in hump)] for each in humps]
        found = min((_minimise_misfit(start, centres, levels, weights) for start in starts), key=lambda each: each[0])
        if found[0] < best[0] - 6.0:  # more numbers must pay for themselves
            best = found
    return Spectrum(best[1])


def _highest_bins(levels: Floats) -> list[int]:
    """The two bins that rise most above their surroundings, where a frame may ring."""
    around = np.array([np.median(levels[max(k - 6, 0) : k + 7]) for k in range(levels.size)])
    inner = slice(levels.size // 4, levels.size - 2)
    return [int(k) + levels.size // 4 for k in np.argsort(-(levels / around)[inner])[:2]]


def _minimise_misfit(start: list[float], centres: Floats, levels: Floats, weights: Floats) -> tuple[float, Floats]:
    """Return the least negative log-likelihood and its numbers: damped steps of Fisher's scoring in their logarithms.

    The spectrum's own derivatives give the expected curvature, so a step costs no more than its slope does.
    """

    def look(logs: Floats) -> tuple[float, Floats, Floats]:
        value, gradient = Spectrum(np.exp(logs)).with_gradient(centres)
        relative = gradient / value
        cost = float(np.sum(weights * (np.log(value) + levels / value)))
        return cost, relative @ (weights * (1.0 - levels / value)), (relative * weights) @ relative.T

    logs, damping = np.log(start), _FIRST_DAMPING
    cost, slope, curvature = look(logs)
    for _ in range(_MOST_SCORINGS):
        own = np.diag(np.diag(curvature)) * damping + np.eye(logs.size) * _FLAT
        tried = np.clip(logs - np.clip(np.linalg.solve(curvature + own, slope), -1.0, 1.0), -200.0, 200.0)
        found = look(tried)
        if not found[0] < cost:
            damping *= 8.0
            if damping > 1.0e6:
                break
            continue
        gain, damping = cost - found[0], max(damping * 0.2, 1.0e-9)
        logs, (cost, slope, curvature) = tried, found
        if gain < _LEAST_SCORED:
            break
    return cost, np.exp(logs)


@dataclass(frozen=True, slots=True)
class Spectrum:
    """White level, then (level, width, centre) of each Lorentzian, in lines."""

    numbers: Floats

    def __call__(self, lines: Floats) -> Floats:
        return self.with_gradient(lines)[0]

    def with_gradient(self, lines: Floats) -> tuple[Floats, Floats]:
        """Return the level at each line, and its derivative by the logarithm of each number, (numbers, lines)."""
        value = np.full(lines.shape, float(self.numbers[0]))
        gradient = [np.full(lines.shape, float(self.numbers[0]))]
        for level, width, centre in self.numbers[1:].reshape(-1, 3):
            apart = (lines - centre) / width
            part = level / (1.0 + apart**2)
            value = value + part
            steep = 2.0 * part * apart / (1.0 + apart**2)
            gradient += [part, steep * apart, steep * centre / width]
        return value, np.array(gradient)
