"""Words for what stands out in a chart of a diagnosis: the largest residual and what happens there, a line of a spectrum."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.diagnosis.measurement import Floats, Measurement
from gateway.reports.diagnosis import series
from gateway.reports.diagnosis import wording as words
from gateway.reports.diagnosis.series import TraceResiduals

_JUST_BEFORE_S: Final = 1.0
_MOVES_SHARE: Final = 0.02  # of the drive's range within that second: less is rest
_PEAK_RATIO: Final = 2.0  # of a density over the usual one beside it
_BESIDE: Final = 10  # bands on either side


@dataclass(frozen=True, slots=True)
class Peak:
    """The point that stands out most: where, and how high."""

    x: float
    y: float


def largest(x: Floats, y: Floats) -> Peak | None:
    """Return the point furthest from zero; None where there is none."""
    finite = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    if not finite.size:
        return None
    place = finite[int(np.argmax(np.abs(y[finite])))]
    return Peak(float(x[place]), float(y[place]))


def signed_force(value_n: float) -> str:
    """Return `+0.84 N` or `−0.84 N`."""
    return f"{'+' if value_n > 0.0 else ''}{words.force(value_n)} N"


def describe_residual_over_time(measurement: Measurement, residuals: TraceResiduals, *, changed: bool) -> str:
    """Return where the residual is largest before and after, and what happens there."""
    before, after = (largest(residuals.time_s, left_n) for left_n in (residuals.before_n, residuals.after_n))
    if before is None or after is None:
        return ""
    first = f"Largest before: {_at_time(before)}, {describe_moment(measurement, before.x)}"
    return f"{first}; after: {_at_time(after)}." if changed else f"{first}."


def _at_time(peak: Peak) -> str:
    return f"{signed_force(peak.y)} at {words.number(peak.x)} s"


def describe_moment(measurement: Measurement, time_s: float) -> str:
    """Return what the drive does at a time: a reversal just before it, a move, or rest."""
    label, drive = series.drive(measurement)
    name, unit = label.removesuffix(")").split(" (")
    rows = np.flatnonzero((measurement.time_s > time_s - _JUST_BEFORE_S) & (measurement.time_s <= time_s + 1e-9))
    moving, near = series.direction(measurement)[rows], drive[rows][np.isfinite(drive[rows])]
    whole = drive[np.isfinite(drive)]
    if not near.size or not float(np.ptp(whole)):
        return f"where the {name} is not known" if not near.size else f"with the {name} constant"
    if moving.min() < 0 < moving.max():
        return "within a second after a reversal"
    if np.ptp(near) > _MOVES_SHARE * np.ptp(whole):
        return f"while the {name} moves from {words.number(float(near[0]))} to {words.number(float(near[-1]))} {unit}"
    return f"with the {name} at rest at {words.number(float(near[-1]))} {unit}"


def describe_means(before: Peak | None, after: Peak | None, unit: str) -> str:
    """Return where the means over bins are largest. after: None where nothing was added to the model."""
    if before is None:
        return ""
    first = f"Largest mean before: {signed_force(before.y)} at {words.number(before.x)}{unit}"
    last = f"; after: {signed_force(after.y)} at {words.number(after.x)}{unit}" if after else ""
    return f"{first}{last}."


def spectral_peak(frequency_hz: Floats, density: Floats) -> Peak | None:
    """Return the band that stands out most from those beside it; None where none does."""
    if density.size < 2 * _BESIDE:
        return None
    usual = np.array([np.median(density[max(0, k - _BESIDE) : k + _BESIDE + 1]) for k in range(density.size)])
    ratio = density / np.maximum(usual, 1e-300)
    place = int(np.argmax(ratio))
    return Peak(float(frequency_hz[place]), float(density[place])) if ratio[place] >= _PEAK_RATIO else None
