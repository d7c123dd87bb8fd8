"""What one does with a rig, done to the twin in virtual time: a staircase of voltages, and steps that settle.

Used where a twin's closed loop is judged, by tools and by the tests, so that all of them run the same experiment.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gateway.twin.simulation import Twin

Floats: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Dwell:
    """How long a stair lasts: until the pressure has moved by less than `settled_pa` over `check_s`, within bounds."""

    least_s: float = 0.2  # longer than any transport delay, else a stair looks settled before it has begun
    most_s: float = 2.0
    check_s: float = 0.05
    settled_pa: float = 20.0  # 2 mN on 100 mm2
    readings: int = 5  # averaged at the end of the stair
    reading_s: float = 0.01


def settle(twin: Twin, dwell: Dwell) -> None:
    """Let time pass until the twin stands still."""
    twin.advance(dwell.least_s)
    passed_s = dwell.least_s
    while passed_s < dwell.most_s:
        before_pa = twin.pressure_pa
        twin.advance(dwell.check_s)
        passed_s += dwell.check_s
        if np.all(np.abs(twin.pressure_pa - before_pa) < dwell.settled_pa):
            return


def staircase(twin: Twin, voltages_v: Iterable[float], dwell: Dwell) -> Floats:
    """Return the measured force at the end of each stair, N; shape (stairs,), or (stairs, lanes)."""
    measured = []
    for voltage_v in voltages_v:
        twin.command(float(voltage_v))
        settle(twin, dwell)
        total: Any = 0.0
        for _ in range(dwell.readings):
            twin.advance(dwell.reading_s)
            total = total + twin.read()
        measured.append(total / dwell.readings)
    return np.asarray(measured, dtype=np.float64)


def settling_time_s(force_n: Floats, target_n: float, band_n: float, every_s: float = 1.0e-3) -> float:
    """Return when the force has come within the band for good; nan when it never stays."""
    outside = np.flatnonzero(np.abs(force_n - target_n) > band_n)
    if outside.size == 0:
        return 0.0
    last = int(outside[-1])
    return float("nan") if last == force_n.size - 1 else (last + 1) * every_s
