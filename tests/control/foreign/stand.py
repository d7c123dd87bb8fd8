"""A foreign machine on the bench: control in virtual time before it, the wire between, its own ladder fitted as usual."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from gateway.bsfm import Bsfm
from gateway.bsfm.fit.evaluation import FitRequest
from gateway.bsfm.ladder.plan import LABELS
from gateway.bsfm.model import Calibration, Response
from gateway.control import (
    CalibrationInUse,
    Controller,
    ControlSettings,
    Defaults,
    Limits,
    LineStatus,
    Output,
    Supervision,
    Trim,
)
from gateway.control.runs.ladder_run import LadderRun
from gateway.control.runs.ladder_stairs import QUICK, CalibrationPlan
from gateway.devices.messages import ForceSample, Quality
from gateway.recording import Recording
from gateway.registers.command import Command
from gateway.registers.words import CalibrationPhase, ControlBit
from gateway.service.fitting.ladder_fit import calibration_of, fit_recording
from gateway.service.fitting.ladder_source import RigContext
from tests.control.foreign.machine import COUNT_V, Machine, Slide

TICK_MS = 10
MOST_N = 56.0  # thrust up to which a machine is calibrated
CALIBRATED_TO_N = 74.0  # force_max of the rig while it is


def settings(trim: Trim | None = None, **more: Any) -> ControlSettings:
    """As a rig file that `init` writes, but for the force range."""
    return ControlSettings(
        limits=Limits(force_max_n=50.0, over_force_n=75.0, smallest_force_n=0.5, voltage_max_v=8.5),
        defaults=Defaults(precontact_force_n=3.0),
        trim=trim or Trim(gain_v_per_n_s=0.3, limit_v=0.5),
        supervision=Supervision(sample_timeout_s=0.25, output_timeout_s=0.3, stall_s=0.25, saturation_n=96.0),
        **more,
    )


class Stand:
    """One machine, one controller, one clock. history: (time, true force, cell force of the last sample, voltage)."""

    def __init__(self, machine: Machine, controller: Controller, seed: int = 1, slide: Slide | None = None) -> None:
        self.machine, self.controller = machine, controller
        self.slide = slide or Slide(machine)
        self.rng = Random(seed)
        self.ms = 0
        self.command = Command()
        self.sample: ForceSample | None = None
        self.voltage_v = self.wanted_v = 0.0
        self._sent_v, self._busy_until = 0.0, 0.0
        self._next_sample = 3.0
        self.rows: list[tuple[float, ...]] = []
        self.recording = False
        self.output: Output | None = None
        self.events: list[str] = []
        self.on_ms: Callable[[Stand], None] = lambda stand: None

    def worked(self) -> "Stand":
        """A slide whose friction remembers a full cycle, as behind a ladder."""
        for volts in (5.0, 0.0):
            for _ in range(1500):
                self.slide.step(volts)
        return self

    @property
    def now_s(self) -> float:
        return self.ms * 0.001

    def write(self, **changes: Any) -> None:
        self.command = self.command._replace(number=self.command.number + 1, peer="m", **changes)
        self._step()

    def force(self, force_n: float) -> None:
        self.write(control_word=ControlBit.ENABLE, force_setpoint_n=force_n)

    def _step(self) -> None:
        output = self.controller.step(
            self.now_s,
            self.command,
            self.sample,
            LineStatus(acknowledged_v=0.0, sent_v=self._sent_v, wire_s=2.0 * self.machine.wire_s),
        )
        self.output, self.wanted_v = output, output.voltage_v
        self.events.extend(output.events)
        if output.clear_command:
            self.command = self.command._replace(
                control_word=ControlBit(0), force_setpoint_n=0.0, number=self.command.number + 1
            )
        self._send()

    def _send(self) -> None:
        """One setting at a time; it acts when its last byte is through, and the answer takes as long again."""
        if self.ms >= self._busy_until and abs(self.wanted_v - self._sent_v) > 0.5 * COUNT_V:
            self._sent_v = round(self.wanted_v / COUNT_V) * COUNT_V
            self._arrives = self.ms + round(self.machine.wire_s * 1000)
            self._busy_until = self.ms + 2 * round(self.machine.wire_s * 1000)

    def run(self, seconds: float) -> Output:
        for _ in range(round(seconds * 1000)):
            self.millisecond()
        assert self.output
        return self.output

    def millisecond(self) -> None:
        self.ms += 1
        if self._sent_v != self.voltage_v and self.ms >= self._arrives:
            self.voltage_v = self._sent_v
        self.slide.step(self.voltage_v)
        self._send()
        if self.ms >= self._next_sample:
            self._next_sample += 1000.0 / self.machine.rate_hz
            self._measure()
            self._step()
            if self.recording and self.controller.active_run.running and self.output and self.sample:
                self.rows.append(
                    (self.now_s, self.output.voltage_v, self.controller.active_run.cell_n, *self._labels())
                )
        if self.ms % TICK_MS == 0:
            self._step()
        self.on_ms(self)

    def _labels(self) -> tuple[float, ...]:
        """As the recorder of a rig writes them, LABELS."""
        active = self.controller.active_run
        run = active.run
        assert isinstance(run, LadderRun)
        return float(active.phase), float(run.stairs[min(run.done, len(run.stairs) - 1)].group), float(run.done)

    def _measure(self) -> None:
        machine = self.machine
        noisy_n = self.slide.cell_n + self.rng.gauss(0.0, machine.noise_n)
        force_n = round(noisy_n / machine.quantum_n) * machine.quantum_n
        self.sample = ForceSample(force_n, force_n, Quality.OK, self.now_s)

    def columns(self) -> dict[str, Any]:
        table = np.array(self.rows)
        return dict(zip(("time_s", "command_v", "force_n", *LABELS), table.T, strict=True))


@dataclass(frozen=True)
class Calibrated:
    """What a run on a machine gave; took_s: how long the run was."""

    machine: Machine
    calibration: Calibration
    took_s: float = 0.0

    @property
    def response(self) -> Response | None:
        return self.calibration.response


def calibrated(machine: Machine, started_with: Bsfm, plan: CalibrationPlan = QUICK, seed: int = 1) -> Calibrated:
    """An ordinary run of the product on this machine, and the product's fit of it. The rig allows as much force as it bears:
    the calibration that a run starts with may expect more than a weak machine makes."""
    rig = settings()
    rig = replace(rig, limits=replace(rig.limits, force_max_n=CALIBRATED_TO_N))
    controller = Controller(rig, CalibrationInUse(started_with, 1))
    stand = Stand(machine, controller, seed)
    stand.run(0.3)
    top_v = next(tenths / 10 for tenths in range(85, 0, -1) if machine.drive_n(tenths / 10) < MOST_N)
    controller.active_run.ask(replace(plan, v_max_v=min(8.0, top_v)))
    stand.recording = True
    stand.run(0.05)
    while controller.active_run.running:
        stairs = controller.active_run.run.stairs
        stand.run(0.1)
    # the recorder's last row says that the last stair was left
    stand.rows.append(
        (stand.now_s, 0.0, controller.active_run.cell_n, float(CalibrationPhase.FITTING), -1.0, len(stairs))
    )
    facts = {"rig": "foreign", "rig_fingerprint": "", "force_unit": "N", "ladder": asdict(plan)}
    recording = Recording(Path("foreign.fgr"), facts, stand.columns(), len(stand.rows), False)
    fit = fit_recording(recording, FitRequest(), RigContext())
    return Calibrated(machine, calibration_of(fit, 98.0), stand.now_s)
