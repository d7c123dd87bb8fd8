"""One run of the controller against the twin, in virtual time: ticks, samples of the cell and a master's writes, as the
gateway has them, without processes and wires."""

from dataclasses import dataclass, replace
from math import nan, radians
from typing import Final

import numpy as np

from gateway.bsfm import Bsfm
from gateway.bsfm.fit.projected_problem import Floats
from gateway.control import CalibrationInUse, Compensation, Controller, ControlSettings, LineStatus, apply_command_map
from gateway.defaults import TICK_S
from gateway.devices.messages import ForceSample, Quality
from gateway.registers.command import Command
from gateway.registers.words import ControlBit, State
from gateway.service.closed_loop.identified_model import condition_twin
from gateway.service.closed_loop.schedule import SETTLED_S, SetpointSchedule, SetpointSegment
from gateway.twin import Plant
from gateway.twin.surroundings import Surroundings

BAND_N: Final = 1.0


@dataclass(frozen=True, slots=True)
class ControlSetup:
    """Setup that drives the plant: settings, a model that speaks straight volts, and what is compensated on top of it."""

    settings: ControlSettings
    model: Bsfm
    compensation: Compensation


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedRun:
    """error_n: true minus commanded force at every tick that counts; settled_s: of each step, its hold where it never came
    to stay; fault: what stopped it, empty if nothing did."""

    error_n: Floats
    settled_s: tuple[float, ...]
    fault: str

    @property
    def rms_n(self) -> float:
        """Root mean square of the force error, N."""
        return float(np.sqrt(np.mean(self.error_n**2)))


class SimulatedLoop:
    """Master, gateway and plant in one clock."""

    def __init__(self, driver: ControlSetup, plant: Plant, seed: int, inputs: frozenset[str]) -> None:
        self._twin = condition_twin(plant, driver.model.voltage_range_v[1], seed)
        self._voltage_v = 0.0
        supervision = replace(driver.settings.supervision, lease_s=None)  # this master has no heartbeat
        self._controller = Controller(
            replace(driver.settings, supervision=supervision, valve=None),  # and the plant pushes
            CalibrationInUse(apply_command_map(driver.model, driver.compensation.command), 1),
            compensation=driver.compensation,
        )
        self._inputs = inputs
        self._command, self._sample = Command(), ForceSample(0.0, 0.0, Quality.OK, 0.0)
        self._line = LineStatus(acknowledged_v=0.0)
        self.fault = ""

    def tick(self, time_s: float, force_n: float, schedule: SetpointSchedule) -> float:
        """Run one sample, one write of the master and one step between; return the true force at the end, N."""
        tilt_rad = self._surround(schedule.around(time_s)) if schedule.columns else 0.0
        self._write(time_s, force_n, tilt_rad)
        self._twin.advance(0.5 * TICK_S)
        reading_n = float(self._twin.read())
        self._sample = ForceSample(reading_n, reading_n, Quality.OK, time_s + 0.5 * TICK_S)
        self._step(time_s + 0.5 * TICK_S)
        self._twin.advance(0.5 * TICK_S)
        return float(self._twin.force_n)

    def _surround(self, around: Surroundings) -> float:
        """The plant feels it, the controller is told what it has an input for; returns the tilt that the master writes."""
        self._twin.set_surroundings(around)
        temperature_c, feed_mm_s, tilt_deg = (
            getattr(around, name) if name in self._inputs else None
            for name in ("temperature_c", "feed_mm_s", "tilt_deg")
        )
        self._line = LineStatus(
            acknowledged_v=0.0, temperature_c=_nan_if_absent(temperature_c), feed_mm_s=_nan_if_absent(feed_mm_s)
        )
        return 0.0 if tilt_deg is None else radians(tilt_deg)

    def _write(self, time_s: float, force_n: float, tilt_rad: float) -> None:
        command = self._command
        enable = ControlBit.ENABLE if time_s > 0.0 and self._controller.state is not State.FAULT else ControlBit(0)
        wanted = (enable, force_n if enable else 0.0, tilt_rad)
        if wanted != (command.control_word, command.force_setpoint_n, command.tilt_angle_rad):
            self._command = command._replace(
                control_word=enable,
                force_setpoint_n=wanted[1],
                tilt_angle_rad=tilt_rad,
                number=command.number + 1,
            )
        self._step(time_s)

    def _step(self, time_s: float) -> None:
        output = self._controller.step(time_s, self._command, self._sample, self._line)
        if output.voltage_v != self._voltage_v:
            self._twin.command(output.voltage_v)
            self._voltage_v = output.voltage_v
        self.fault = self.fault or (output.fault.name.lower() if output.fault else "")


def _nan_if_absent(value: float | None) -> float:
    return nan if value is None else value


def simulate_run(
    driver: ControlSetup, plant: Plant, schedule: SetpointSchedule, seed: int, inputs: frozenset[str]
) -> SimulatedRun:
    """Return the whole schedule. Once a fault has stopped it, the remaining force counts as it is: gone."""
    loop = SimulatedLoop(driver, plant, seed, inputs)
    errors, settled, time_s = [], [], 0.0
    for wish in (SetpointSegment(0.0, schedule.wishes[0].start_s, 0.0, 0.0), *schedule.wishes):
        away = []
        for tick in range(round(wish.hold_s / TICK_S)):
            time_s = wish.start_s + tick * TICK_S
            force_n = wish.force_n(time_s)
            away.append(loop.tick(time_s, force_n, schedule) - force_n)
        if wish.from_n > 0.0:
            errors += away[round(SETTLED_S / TICK_S) :]
            settled += [_settling_time_s(away)] if wish.is_step else []
    return SimulatedRun(np.array(errors), tuple(settled), loop.fault)


def _settling_time_s(away_n: list[float]) -> float:
    outside = [tick for tick, error_n in enumerate(away_n) if abs(error_n) > BAND_N]
    return (outside[-1] + 1) * TICK_S if outside else 0.0
