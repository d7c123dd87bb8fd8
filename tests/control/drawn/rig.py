"""The controller alone on a drawn machine, its cell and its loop at drawn rates."""

from collections import deque
from dataclasses import replace
from random import Random

from gateway.bsfm.model import Response
from gateway.control import (
    CalibrationInUse,
    Controller,
    ControlSettings,
    LeaseAction,
    Limits,
    Supervision,
    Trim,
)
from gateway.control.settings import Defaults
from gateway.devices.messages import ForceSample, Quality
from tests.control.bench import Bench, bsfm
from tests.control.drawn.machine import Machine

AS_CALIBRATED_N_PER_V = 7.4
SLOW_CELL_MS = 40  # a slower one is thought frozen, with right, where no noise shows


class DrawnRig(Bench):
    """A bench with another machine. cell_ms: between two readings; tick_ms: of the loop; calibration_scale: of the model."""

    def __init__(self, seed: int) -> None:
        draw = Random(seed)
        self.tick_ms = draw.choice((4, 5, 10, 10, 10, 20, 50))
        self.cell_ms = draw.choice((10, 10, 10, 12, 20, 25, 50, 100, 200))
        machine = self.drawn_machine(draw, seed)
        super().__init__(self.drawn_settings(draw, machine, seed), seed)
        self.plant = machine  # type: ignore[assignment]
        self.machine = machine
        if self.cell_ms >= SLOW_CELL_MS:
            machine.noise_n = max(machine.noise_n, machine.quantum_n)
        self.sample_every_ms = self.cell_ms
        self.scale, self.response = 1.0, draw_response(draw, machine, self.cell_ms)
        self.controller = Controller(self.settings, CalibrationInUse(bsfm(), 1, self.response))
        self.voltage_v = self.settings.limits.safe_voltage_v
        self.cell_late_ms, self.false_n, self.answers_late = 0, 0.0, False
        self._felt: deque[tuple[int, float]] = deque()
        self.readings: deque[tuple[float, float]] = deque(maxlen=400)

    def drawn_machine(self, draw: Random, seed: int) -> Machine:
        return draw_machine(draw)

    def drawn_settings(self, draw: Random, machine: Machine, seed: int) -> ControlSettings:
        return draw_settings(draw, machine, self.tick_ms, self.cell_ms)

    @property
    def whole_s(self) -> float:
        """Time in which a voltage has become a reading that control has seen."""
        machine = self.machine
        lags_s = machine.delay_s + machine.lag_s + machine.cell_lag_s + 8.0 / machine.slew_v_per_s
        return lags_s + 1e-3 * (self.cell_ms + self.tick_ms + self.cell_late_ms)

    def use(self, scale: float, response: Response | None) -> None:
        """Take another calibration."""
        self.scale, self.response = scale, response
        self.controller.use(CalibrationInUse(bsfm(scale), 2, response))

    def _steps_to_next(self) -> int:
        to_sample = (self._sampled_at_ms - self.ms - 1) % self.sample_every_ms + 1
        to_tick = self.tick_ms - self.ms % self.tick_ms
        to_beat = self.heartbeat_every_ms - self.ms % self.heartbeat_every_ms if self.heartbeat_every_ms else to_tick
        return min(to_tick, to_sample, to_beat)

    def _advance(self, steps: int) -> None:
        self.ms += steps
        if not self.answers_late:
            self.line = self.line._replace(acknowledged_v=self.voltage_v)
        self.machine.advance(self.voltage_v, steps)
        if self.ms % self.sample_every_ms == self._sampled_at_ms and not self.cell_silent:
            self._measure()
            self.step()
        if self.heartbeat_every_ms and self.ms % self.heartbeat_every_ms == 0:
            self.write(heartbeat=(self.command.heartbeat + 1) % 1000)
        if self.ms % self.tick_ms == 0:
            self.step()

    def _measure(self) -> None:
        if self.cell_frozen and self.sample:
            self.sample = replace(self.sample, time_s=self.now_s)
            return
        self._felt.append((self.ms, self.machine.reading_n()))
        while len(self._felt) > 1 and self._felt[1][0] <= self.ms - self.cell_late_ms:
            self._felt.popleft()
        force_n = self._felt[0][1] + self.false_n
        self.readings.append((self.now_s, force_n))
        self.sample = ForceSample(force_n, force_n, Quality.OK, self.now_s)


def draw_machine(draw: Random) -> Machine:
    """One in two is about as it was calibrated."""
    is_near = draw.random() < 0.65
    quantum_n = draw.choice((0.01, 0.05, 0.098))
    machine = Machine(
        Random(draw.random()),
        gain_n_per_v=AS_CALIBRATED_N_PER_V * (draw.uniform(0.93, 1.07) if is_near else 2.5 ** draw.uniform(-1.0, 1.0)),
        friction_n=draw.uniform(0.3, 2.5 if is_near else 5.0),
        friction_share=draw.uniform(0.05, 0.3),
        curve_per_v=0.0 if is_near else draw.uniform(-0.04, 0.04),
        lag_s=draw.choice((0.03, 0.08, 0.08, 0.2, 0.4)),
        delay_s=draw.choice((0.005, 0.02, 0.05, 0.1)),
        cell_lag_s=draw.choice((0.004, 0.015, 0.05)),
        quantum_n=quantum_n,
        noise_n=max(0.5 * quantum_n, draw.choice((0.02, 0.04, 0.1, 0.25))),
        count_v=draw.choice((0.0003, 0.0025, 0.01, 0.04)),
        dead_band_v=draw.choice((0.0, 0.0, 0.01, 0.03)),
        slew_v_per_s=draw.choice((1000.0, 1000.0, 60.0, 15.0)),
        supply_v=draw.choice((12.0, 12.0, 12.0, 6.0, 3.0)),
    )
    if draw.random() < 0.3:
        machine.payload_kg = draw.choice((0.2, 0.6, 1.2))
    machine.drift_per_s = draw.choice((0.0, 0.0, 0.0, 0.005, -0.005))
    machine.gap_s = draw.choice((0.0, 0.0, 0.0, 0.1, 0.5))
    return machine


def draw_response(draw: Random, machine: Machine, cell_ms: int) -> Response | None:
    """As a calibration may have measured it."""
    if draw.random() < 0.5:
        return None
    wrong = draw.uniform(0.8, 1.25)
    lag_s = wrong * (machine.lag_s + 2.0 / machine.slew_v_per_s)
    dead_time_s = draw.uniform(0.8, 1.25) * (machine.delay_s + 0.5e-3 * cell_ms)
    return Response(dead_time_s=dead_time_s, lag_s=lag_s, second_lag_s=draw.choice((0.0, machine.cell_lag_s)))


def draw_settings(draw: Random, machine: Machine, tick_ms: int, cell_ms: int) -> ControlSettings:
    """A rig file that somebody who knows the machine has written: what depends on time fits it, the rest is drawn."""
    whole_s = machine.lag_s + machine.delay_s + machine.cell_lag_s + 1e-3 * (cell_ms + tick_ms)
    force_max_n = draw.choice((30.0, 40.0, 50.0))
    rest_v = draw.choice((0.0, 0.0, 0.0, 0.0, 0.3))
    pace = draw.uniform(0.1, 0.4)
    limits = Limits(
        force_max_n=force_max_n,
        over_force_n=force_max_n + draw.choice((5.0, 10.0, 20.0)),
        over_force_samples=draw.choice((3, 3, 2)),
        smallest_force_n=draw.choice((0.0, 0.2, 1.0)),
        voltage_max_v=draw.choice((9.0, 9.0, 10.0, 7.0)),
        safe_voltage_v=rest_v,
        voltage_min_v=rest_v,
        voltage_slew_v_per_s=draw.choice((100.0, 100.0, 20.0, 8.0)),
    )
    least_band_n = 4.0 * machine.noise_n + 2.0 * machine.quantum_n + 10.0 * (machine.count_v + machine.dead_band_v)
    return ControlSettings(
        limits=limits,
        defaults=Defaults(
            force_ramp_n_per_s=draw.choice((15.0, 60.0, 200.0)),
            contact_ramp_s=draw.choice((0.0, 0.0, 0.5)),
            in_band_tolerance_n=max(least_band_n, draw.choice((0.6, 1.0, 2.0))),
            in_band_time_s=draw.choice((0.0, 0.1, 0.5)),
            contact_threshold_n=max(0.5, 4.0 * machine.noise_n),
        ),
        trim=Trim(
            gain_v_per_n_s=draw.choice((0.0, 1.0, 1.0, 1.0)) * pace / (AS_CALIBRATED_N_PER_V * whole_s),
            limit_v=draw.choice((0.3, 0.6, 1.5, 3.0)),
        ),
        supervision=Supervision(
            response_lag_s=whole_s,
            sample_timeout_s=max(0.05, 2.5e-3 * cell_ms),
            sample_quantum_n=machine.quantum_n,
            lease_s=draw.choice((None, None, 0.35)),
            lease_action=draw.choice(tuple(LeaseAction)),
            unreachable_s=max(2.0, 5.0 * whole_s),
            saturation_n=98.0,
        ),
    )
