"""The spectrum of a recording's noise: white plus Lorentzians, fitted to what no candidate explains.

A test that takes coloured noise for white finds causes everywhere (40 false alarms of 40 in a prototype), and an AR
model of affordable order misses the slow end. So the periodogram of the remainder is fitted by Whittle's likelihood with
    S(f) = s0 + sum of up to two  a / (1 + ((f - c)/w)^2),  c = 0 or where a frame rings,
on logarithmic bins. Bins are medians where they hold enough lines: a spectral line is a cause, not noise.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from gateway.diagnosis.measurement import Floats

_BINS: Final = 64
_MANY_LINES: Final = 12  # of a bin, from which its median is told
_NOWHERE: Final = 1.0e-12  # centre of a Lorentzian that falls from frequency 0
_FIRST_DAMPING: Final = 0.1
_FLAT: Final = 1.0e-9  # curvature of a number that changes nothing
_MOST_SCORINGS: Final = 60
_LEAST_SCORED: Final = 1.0e-6  # of a log-likelihood: less is no progress
_MEDIAN_OF_EXPONENTIAL: Final = float(np.log(2.0))


@dataclass(frozen=True, slots=True)
class Spectrum:
    """White level, then (level, width, centre) of each Lorentzian, in lines."""

    numbers: Floats

    def __call__(self, lines: Floats) -> Floats:
        """Return the level at each line."""
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


def fit_periodogram(power: Floats, left: Floats, rows: int) -> Spectrum:
    """Return the spectrum of noise from its periodogram, both (lines,), without the line of the mean; rows: of the FFT.

    left: share of the power that is left at each line.
    """
    centres, levels, weights = _bin_spectrum(power, left)
    return _fit_by_likelihood(centres, np.maximum(levels, 1.0e-300), weights, rows)


def fit_to_lines(lines: Floats, power: Floats, rows: int) -> Spectrum:
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


def _bin_spectrum(power: Floats, left: Floats) -> tuple[Floats, Floats, Floats]:
    """Centre line, level and weight of logarithmic bins."""
    edges = np.unique(np.round(np.geomspace(1, power.size + 1, _BINS)).astype(int))
    centres, levels, weights = [], [], []
    for low, high in pairwise(edges):
        inside = power[low - 1 : high - 1]
        centres.append(np.sqrt(low * max(high - 1, low)))
        levels.append(_level(inside))
        weights.append(min(float(np.sum(left[low - 1 : high - 1])), 400.0))
    return np.array(centres), np.array(levels), np.array(weights, dtype=float)


def _fit_by_likelihood(centres: Floats, levels: Floats, weights: Floats, rows: int) -> Spectrum:
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
