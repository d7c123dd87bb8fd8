"""What a foreign machine is put through, what is measured on it, and what its physics allows.

The bound of a step is the fastest that any command brings the force within BAND_N for good: dead time and wire, then the
best of the bang-bang family through the two lags, one pulse along the limit and one back, within voltage range and slew. Two
lags in series need no more switches, and a regulator that rings none within its first half period. Friction, the cell and the
force ramp are left out of it: the bound is a little low.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, sin
from typing import Final

import numpy as np

from gateway.bsfm.model import Calibration
from gateway.control import CalibrationInUse, Controller, ControlSettings
from tests.control.foreign.machine import Machine
from tests.control.foreign.stand import Stand, settings

BAND_N: Final = 0.5
STEPS_N: Final = (
    5.0,
    15.0,
    25.0,
    35.0,
    40.0,
    30.0,
    20.0,
    10.0,
    20.0,
    12.0,
    15.0,
    13.0,
    26.0,
    24.0,
    30.0,
    8.0,
    9.5,
    8.0,
)
SHORT_N: Final = (15.0, 35.0, 20.0, 12.0, 15.0, 13.0, 26.0, 24.0, 8.0)
GRID_S: Final = 0.002


@dataclass(frozen=True)
class Step:
    """error_n: true force minus setpoint each millisecond; volts: before and after."""

    from_n: float
    to_n: float
    error_n: np.ndarray
    volts: tuple[float, float]

    @property
    def settled_s(self) -> float:
        """Until within BAND_N for good; the whole dwell where it never is."""
        outside = np.flatnonzero(np.abs(self.error_n) > BAND_N)
        return float(outside[-1] + 1) * 1.0e-3 if len(outside) else 0.0

    @property
    def is_settled(self) -> bool:
        return self.settled_s < 1.0e-3 * len(self.error_n) - 0.05

    @property
    def after_1_s_n(self) -> float:
        return float(abs(np.mean(self.error_n[950:1050])))


@dataclass(frozen=True)
class Course:
    """hold_n: RMS of the last half second of every step; after_1_s_n: RMS over the steps one second after each; still_n: RMS of
    seven seconds at one force, swing_n its peak to peak."""

    steps: tuple[Step, ...]
    hold_n: float
    after_1_s_n: float
    still_n: float
    swing_n: float
    sines_n: tuple[float, ...]
    ramp_n: float
    warnings: tuple[str, ...]

    def settled_s(self) -> float:
        return float(np.median([step.settled_s for step in self.steps]))


def rms(values: Sequence[float] | np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else float("nan")


def dwell_s(machine: Machine) -> float:
    return max(2.0, 1.0 + 3.0 * (machine.dead_time_s + machine.lag_s + machine.second_lag_s))


def course(
    machine: Machine,
    calibration: Calibration,
    control: ControlSettings,
    targets_n: Sequence[float] = STEPS_N,
    *,
    measured: bool = True,
    tracks: bool = True,
    seed: int = 3,
) -> Course:
    """All of it. measured: the response of the calibration is used; tracks: sines and a ramp as well."""
    response = calibration.response if measured else None
    controller = Controller(control, CalibrationInUse(calibration.model(), 1, response))
    stand = Stand(machine, controller, seed).worked()
    stand.run(0.3)
    stand.force(5.0)
    stand.run(2.5)
    steps = tuple(_step(stand, target_n, dwell_s(machine)) for target_n in targets_n)
    still_n = _still(stand)
    sines = tuple(_sine(stand, hertz) for hertz in (0.5, 0.2)) if tracks else ()
    ramp_n = _ramp(stand) if tracks else float("nan")
    return Course(
        steps,
        rms(np.concatenate([step.error_n[-500:] for step in steps])),
        rms([step.after_1_s_n for step in steps]),
        rms(still_n),
        float(np.ptp(still_n)),
        sines,
        ramp_n,
        tuple(event for event in stand.events if event[0] in "AW"),
    )


def _watched(stand: Stand, seconds: float, wanted_n: float) -> np.ndarray:
    forces: list[float] = []
    stand.on_ms = lambda at: forces.append(at.slide.force_n)
    stand.run(seconds)
    stand.on_ms = lambda at: None
    return np.array(forces) - wanted_n


def _step(stand: Stand, target_n: float, seconds: float) -> Step:
    from_n, from_v = stand.command.force_setpoint_n, stand.wanted_v
    stand.force(target_n)
    error_n = _watched(stand, seconds, target_n)
    return Step(from_n, target_n, error_n, (from_v, stand.wanted_v))


def _still(stand: Stand) -> np.ndarray:
    stand.force(20.0)
    stand.run(3.0)
    return _watched(stand, 7.0, 20.0)


def _sine(stand: Stand, hertz: float, swing_n: float = 8.0, every_s: float = 0.02) -> float:
    """RMS of the error against what a master writes at 50 Hz, two periods, the first second left out."""
    began_s, errors = stand.now_s, []
    for _ in range(round(2.0 / hertz / every_s)):
        stand.force(round(20.0 + swing_n * sin(2.0 * pi * hertz * (stand.now_s - began_s)), 2))
        stand.run(every_s)
        wanted_n = 20.0 + swing_n * sin(2.0 * pi * hertz * (stand.now_s - began_s))
        errors.append(stand.slide.force_n - wanted_n)
    return rms(errors[round(1.0 / every_s) :])


def _ramp(stand: Stand) -> float:
    """RMS of the error against the target's own ramp of 10 N/s."""
    stand.force(20.0)
    stand.run(2.0)
    stand.write(force_ramp_n_per_s=10.0)
    stand.force(35.0)
    errors: list[float] = []
    stand.on_ms = lambda at: errors.append(at.slide.force_n - (at.output.force_applied_n if at.output else 0.0))
    stand.run(1.5)
    stand.on_ms = lambda at: None
    stand.write(force_ramp_n_per_s=0.0)
    return rms(errors[300:])


def allowed_s(machine: Machine, step: Step, control: ControlSettings | None = None) -> float:
    """The bound of this step, seconds from the write."""
    limits = (control or settings()).limits
    from_v, to_v = step.volts
    slope = (machine.drive_n(to_v + 0.1) - machine.drive_n(to_v - 0.1)) / 0.2
    band_v = BAND_N / max(slope, 1.0)
    if abs(to_v - from_v) <= band_v:
        return machine.dead_time_s + machine.wire_s
    ends = (limits.voltage_max_v, limits.voltage_min_v)
    push_v, brake_v = ends if to_v > from_v else ends[::-1]
    longest_s = 4.0 * (machine.lag_s + machine.second_lag_s) + 0.2
    pushes, brakes = np.meshgrid(
        np.arange(0.004, longest_s, 0.008), np.arange(0.0, 0.6 * longest_s, 0.012), indexing="ij"
    )
    settled_s = _settled_s(
        machine, (pushes.ravel(), brakes.ravel()), (from_v, push_v, brake_v, to_v), band_v, limits.voltage_slew_v_per_s
    )
    return machine.dead_time_s + machine.wire_s + float(settled_s.min())


def _settled_s(
    machine: Machine,
    pulses_s: tuple[np.ndarray, np.ndarray],
    volts: tuple[float, float, float, float],
    band_v: float,
    slew_v_per_s: float,
) -> np.ndarray:
    from_v, push_v, brake_v, to_v = volts
    push_s, brake_s = pulses_s
    output = np.full(len(push_s), from_v)
    first, second, settled_s = output.copy(), output.copy(), np.zeros(len(push_s))
    natural = 1.0 / max(1.0e-6, (machine.lag_s * machine.second_lag_s) ** 0.5)
    if machine.damping < 1.0:
        first[:] = 0.0  # its speed
    shares = [1.0 - np.exp(-GRID_S / max(lag_s, 1.0e-6)) for lag_s in (machine.lag_s, machine.second_lag_s)]
    longest_s = float(push_s.max() + brake_s.max()) + 0.3
    for k in range(round(longest_s / GRID_S)):
        now_s = k * GRID_S
        wanted = np.where(now_s < push_s, push_v, np.where(now_s < push_s + brake_s, brake_v, to_v))
        output = np.minimum(wanted, output + slew_v_per_s * GRID_S)
        if machine.damping < 1.0:
            first += GRID_S * natural * (natural * (output - second) - 2.0 * machine.damping * first)
            second += GRID_S * first
        else:
            first += shares[0] * (output - first)
            second += shares[1] * (first - second)
        settled_s = np.where(np.abs(second - to_v) > band_v, now_s + GRID_S, settled_s)
    return settled_s
