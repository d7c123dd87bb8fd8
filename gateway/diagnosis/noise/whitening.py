"""The whitening of residuals: each segment divided by the square root of its noise's spectrum.

In the frequency domain, row by row (rows count as evenly spaced); it leaves a variance of 1. The noise is what no candidate
explains (spectrum.py).
"""

from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.diagnosis.bench.bench import Bench, Channel
from gateway.diagnosis.measurement import Floats
from gateway.diagnosis.noise.spectrum import fit_periodogram
from gateway.robust import noise_from_second_differences
from gateway.side_by_side import side_by_side

_LEAST_LEFT: Final = 0.15
_AT_ONCE: Final = 8  # vectors


@dataclass(frozen=True, slots=True)
class Noise:
    """Spectrum of one segment. weights: 1/sqrt(S) at the lines of the real FFT of its rows and zeros, `length` in all."""

    total_n: float  # standard deviation
    weights: Floats

    @property
    def length(self) -> int:
        """Length of the FFT: even."""
        return 2 * (self.weights.size - 1)

    @property
    def scale(self) -> Floats:
        """Factors that turn lines into coordinates with the same products: all but the first and the last stand for two."""
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
        return found.reshape(*vectors.shape[:-1], found.shape[1])  # of no vectors, too

    def apply_adjoint(self, spectrum: Floats) -> Floats:
        """Return the vector (rows,) whose product with any vector is that of `spectrum`, (coordinates,), with the spectra of
        this vector: products with many vectors then need no spectra of them."""
        found, at = np.empty(self.weights.size), 0
        for channel, noise in zip(self.channels, self.noises, strict=True):
            lines = spectrum[at : at + noise.length + 2].view(np.complex128) * (noise.weights / noise.scale)
            rows = channel.rows.stop - channel.rows.start
            found[channel.rows] = np.fft.irfft(lines, noise.length)[:rows] * self.weights[channel.rows]
            at += noise.length + 2
        return found

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
    noises = []
    for channel in bench.channels:
        part, usable = remainder_n[channel.rows] * weights[channel.rows], bench.usable[channel.rows]
        length = fast_length(part.size)
        taken = np.zeros(length // 2 + 1)
        for column in (*basis, *bench.nuisance.T):  # one at a time: there are hundreds
            taken += np.abs(np.fft.rfft(column[channel.rows], length)) ** 2 / part.size
        noises.append(_fit_noise(part, np.clip(1.0 - taken, _LEAST_LEFT, 1.0) * max(float(np.mean(usable)), 0.05)))
    return Whitener(bench.channels, tuple(noises), weights)


def _fit_noise(part: Floats, left: Floats) -> Noise:
    """Return the noise of one segment.

    left: share of the power that is left at each line, for rows that do not count and columns that were fitted.
    """
    rows = fast_length(part.size)
    power = np.abs(np.fft.rfft(part, rows)) ** 2 / (part.size * left)
    spectrum = fit_periodogram(power[1:], left[1:], rows)
    model = spectrum(np.maximum(np.arange(power.size), 0.5))
    one_sided = np.ones(power.size)
    one_sided[1:-1] = 2.0
    total = float(np.sqrt(np.sum(model * one_sided) / rows))
    return Noise(total, 1.0 / np.sqrt(model))
