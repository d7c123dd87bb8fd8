"""Effects that the readings themselves tell, whatever the model: spikes, repeated readings, coarse counts.

They come first, because a spike spoils a fit and a repeated row is no second witness. Each is judged by a count that
chance would hardly give, not by what a simulation gains.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.catalogue.effect import Parameter
from gateway.catalogue.sensing import OUTLIER, OUTLIER_SHARE, QUANTUM, REPEATED
from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.measurement import Flags, Floats
from gateway.diagnosis.noise.whitening import fast_noise_n
from gateway.robust import SIGMA_PER_MAD

_SPIKE: Final = 7.5  # robust standard deviations: one chance in 10^13 rows
FEWEST_SPIKES: Final = 3
"""Fewer are set aside where they spoil a fit, and are no finding."""
_LEAST_REPEATED: Final = 0.001  # share of rows ...
_MORE_THAN_CHANCE: Final = 3.0  # ... and times what counts as coarse as these repeat by chance
_LEAST_COARSE: Final = 0.05  # share of the noise's power that rounding to the lattice makes


@dataclass(frozen=True, slots=True)
class DirectEvidence:
    """A finding: its parameters with a standard error each, and rows that are no witness."""

    name: str
    values: tuple[tuple[Parameter, float, float], ...]
    rows: Flags
    before_n: float
    after_n: float


def find_outliers(bench: Bench, residual_n: Floats, quantum_n: float) -> DirectEvidence | None:
    """Return rows that stand apart from both neighbours, by the residual of the model as it is, beyond one count."""
    flagged = flag_spikes(bench, residual_n, quantum_n)
    count = int(flagged.sum())
    if count < FEWEST_SPIKES:
        return None
    judged = bench.judged
    share = count / int(judged.sum())
    size = float(np.sqrt(np.mean(residual_n[flagged] ** 2)))
    values = (
        (OUTLIER_SHARE, share, float(np.sqrt(share / judged.sum()))),
        (OUTLIER, size, size / float(np.sqrt(2.0 * count))),
    )
    return DirectEvidence("outliers", values, flagged, bench.rms_n(residual_n), _rms_of(residual_n[judged & ~flagged]))


def flag_spikes(bench: Bench, residual_n: Floats, quantum_n: float = 0.0) -> Flags:
    """Return the rows (rows,) that stand apart from both neighbours, however few they are."""
    flagged = np.zeros(bench.rows, dtype=bool)
    for channel in bench.channels:
        if channel.is_force:
            simulated_n = (bench.measured_n - residual_n)[channel.rows]
            flagged[channel.rows] = _stands_out(
                residual_n[channel.rows], simulated_n, bench.usable[channel.rows], quantum_n
            )
    return flagged


def flag_spoiling_spikes(bench: Bench, residual_n: Floats) -> Flags:
    """Return the spikes, where they hold more of the squared residual than all other rows: what was fitted to them is no model
    of anything. None else."""
    flagged = flag_spikes(bench, residual_n) & bench.judged
    of_spikes, of_others = (float(np.sum(residual_n[rows] ** 2)) for rows in (flagged, bench.judged & ~flagged))
    return flagged if of_spikes > of_others else np.zeros_like(flagged)


def _stands_out(residual_n: Floats, simulated_n: Floats, usable: Flags, quantum_n: float) -> Flags:
    """Rows that differ from the median of five around them far beyond chance, and beyond a row's error in time."""
    padded = np.pad(residual_n, 2, mode="edge")
    around = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
    apart = residual_n - around
    spread = max(
        SIGMA_PER_MAD * float(np.median(np.abs(apart[usable]))), 0.5 * fast_noise_n(residual_n[usable]), 1.0e-9
    )
    moves_n = np.abs(np.gradient(simulated_n)) * 2.0
    aside = np.abs(np.gradient(residual_n))  # half of what the neighbours differ: a spike returns to where it came from
    return (np.abs(apart) > _SPIKE * spread + moves_n + quantum_n) & (np.abs(apart) > 4.0 * aside) & usable


def find_repeats(bench: Bench, residual_n: Floats) -> DirectEvidence | None:
    """Return rows that the reader found to be copies of the one before."""
    flagged = np.zeros(bench.rows, dtype=bool)
    for channel in bench.channels:
        if channel.is_force:
            flagged[channel.rows] = bench.measurements[channel.recording].repeated & bench.usable[channel.rows]
    share = float(flagged.sum()) / max(int(bench.judged.sum()), 1)
    if share < max(_LEAST_REPEATED, _MORE_THAN_CHANCE * _chance_of_a_repeat(bench, residual_n)):
        return None
    values = ((REPEATED, share, float(np.sqrt(share / bench.judged.sum()))),)
    return DirectEvidence(
        "repeated-samples", values, flagged, bench.rms_n(residual_n), _rms_of(residual_n[bench.judged & ~flagged])
    )


def _chance_of_a_repeat(bench: Bench, residual_n: Floats) -> float:
    """That two readings of Gaussian noise fall on the same count."""
    quantum_n = max(_lattice_n(each.force_n[each.usable]) for each in bench.measurements)
    return quantum_n / (2.0 * float(np.sqrt(np.pi)) * max(fast_noise_n(residual_n[bench.judged]), 1.0e-9))


def find_quantisation(bench: Bench, residual_n: Floats, known_n: float) -> DirectEvidence | None:
    """Return a lattice in the readings that is coarse against their noise; known_n: the quantum that the plant states."""
    quanta = [_lattice_n(each.force_n[each.usable]) for each in bench.measurements]
    quantum_n = min(quanta)
    power = fast_noise_n(residual_n[bench.judged]) ** 2
    if quantum_n <= 1.5 * known_n or quantum_n**2 / 12.0 < _LEAST_COARSE * max(power, quantum_n**2 / 12.0):
        return None
    rms = bench.rms_n(residual_n)
    after = float(np.sqrt(max(rms**2 - quantum_n**2 / 12.0, 0.0)))
    return DirectEvidence(
        "sensor-quantisation", ((QUANTUM, quantum_n, 0.0),), np.zeros(bench.rows, dtype=bool), rms, after
    )


def _lattice_n(force_n: Floats) -> float:
    """Spacing of the lattice on which all readings lie, N; 0 when there is none."""
    levels = np.unique(force_n)
    if levels.size < 3 or levels.size > 0.5 * force_n.size:
        return 0.0
    gaps = np.diff(levels)
    quantum = float(np.min(gaps[gaps > 1.0e-9 * max(np.ptp(levels), 1.0e-9)], initial=np.inf))
    if not np.isfinite(quantum):
        return 0.0
    steps = gaps / quantum
    quantum *= float(np.sum(steps * np.round(steps)) / np.sum(np.round(steps) ** 2))
    off = np.abs(gaps / quantum - np.round(gaps / quantum))
    return quantum if float(np.mean(off < 0.02)) > 0.98 else 0.0


def _rms_of(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0
