"""A machine as a scene draws it: output stage, air, slide, workpiece, payload and cell. It shares nothing with the product."""

from collections import deque
from dataclasses import dataclass, field
from math import cos
from random import Random

STEP_S = 0.001
GRAVITY_M_PER_S2 = 9.80665


@dataclass
class Machine:
    """What the tool really does. Forces are contact forces; the cell feels them without the payload's weight.

    gap_s: how long a tool that moves slides until it touches; push_n: by somebody else, onto the cell."""

    rng: Random
    gain_n_per_v: float = 7.4
    friction_n: float = 2.0
    friction_share: float = 0.25
    curve_per_v: float = 0.0
    lag_s: float = 0.08
    delay_s: float = 0.02
    cell_lag_s: float = 0.015
    noise_n: float = 0.04
    quantum_n: float = 0.098
    count_v: float = 0.002
    dead_band_v: float = 0.0
    slew_v_per_s: float = 1000.0
    supply_v: float = 12.0
    drift_per_s: float = 0.0
    payload_kg: float = 0.0
    tilt_rad: float = 0.0
    gap_s: float = 0.0
    air: bool = True
    hears: bool = True
    push_n: float = 0.0
    force_n: float = 0.0
    _slide_n: float = 0.0
    _stage_v: float = 0.0
    _pressure: float = 0.0
    _cell_n: float = 0.0
    _waiting: deque[float] = field(default_factory=deque)

    @property
    def weight_n(self) -> float:
        """What of the payload presses."""
        return self.payload_kg * GRAVITY_M_PER_S2 * cos(self.tilt_rad)

    @property
    def along_n_per_v(self) -> float:
        """Of the way in which it moves."""
        return self.gain_n_per_v

    @property
    def touches(self) -> bool:
        return self.gap_s <= 0.0

    def advance(self, voltage_v: float, steps: int) -> None:
        """Steps of 1 ms under one voltage."""
        told_v = round(voltage_v / self.count_v) * self.count_v
        waiting, delay, weight_n = self._waiting, round(self.delay_s / STEP_S), self.weight_n
        stage_v, pressure, slide_n, cell_n = self._stage_v, self._pressure, self._slide_n, self._cell_n
        slew_v, lag, cell_lag = self.slew_v_per_s * STEP_S, STEP_S / self.lag_s, STEP_S / self.cell_lag_s
        contact_n = self.force_n
        for _ in range(steps):
            waiting.append(told_v)
            goal_v = waiting.popleft() if len(waiting) > delay else 0.0
            if abs(goal_v - stage_v) > self.dead_band_v:
                stage_v = min(stage_v + slew_v, max(stage_v - slew_v, goal_v))
            pressure += ((min(stage_v, self.supply_v) if self.air else 0.0) - pressure) * lag
            drive_n = self.gain_n_per_v * pressure * (1.0 + self.curve_per_v * pressure)
            play_n = min(self.friction_n, self.friction_share * drive_n)
            slide_n = min(drive_n + play_n, max(drive_n - play_n, slide_n))
            if self.gap_s > 0.0 and slide_n + weight_n > 0.2:
                self.gap_s -= STEP_S
            contact_n = max(0.0, slide_n + weight_n) if self.gap_s <= 0.0 else 0.0
            cell_n += (contact_n - weight_n + self.push_n - cell_n) * cell_lag
        if self.drift_per_s:
            self.gain_n_per_v *= 1.0 + self.drift_per_s * STEP_S * steps
        self._stage_v, self._pressure, self._slide_n, self._cell_n, self.force_n = (
            stage_v, pressure, slide_n, cell_n, contact_n,
        )  # fmt: skip

    def reading_n(self) -> float:
        noisy_n = self._cell_n + self.rng.gauss(0.0, self.noise_n)
        return round(noisy_n / self.quantum_n) * self.quantum_n

    def bounds_n(self, voltage_v: float) -> tuple[float, float]:
        """Least and most contact force that may stand under this voltage for good."""
        reached_v = min(voltage_v, self.supply_v)
        off_v = self.dead_band_v + 0.5 * self.count_v
        ends = []
        for way in (-1.0, 1.0):
            there_v = max(0.0, reached_v + way * off_v)
            drive_n = self.gain_n_per_v * there_v * (1.0 + self.curve_per_v * there_v)
            ends.append(drive_n + way * min(self.friction_n, self.friction_share * drive_n) + self.weight_n)
        return max(0.0, ends[0]), max(0.0, ends[1])
