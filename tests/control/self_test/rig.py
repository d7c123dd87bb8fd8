"""A drawn machine that tests itself, with one thing broken: control in virtual time, both wires with counts and losses."""

from collections.abc import Callable
from dataclasses import replace
from math import exp, hypot, nan, sqrt
from random import Random
from typing import Any

from gateway.control import CalibrationInUse, Controller, ControlSettings
from gateway.control.inputs import LineStatus, Output, WireCounts
from gateway.control.self_test.items import Item, SelfTestReport
from gateway.control.settings import SelfTestSettings
from gateway.devices.messages import ForceSample, Quality
from gateway.registers.command import Command
from gateway.registers.words import ControlBit, SelfTestVerdict, State
from tests.control.foreign.kept_calibrations import kept
from tests.control.foreign.machine import COUNT_V, Machine, Slide
from tests.control.foreign.stand import settings

KEPT = kept()
_POLL_MS, _TICK_MS = 100, 10


class SelfTestRig:
    """machine: what is there, behind the calibration of the machine of that seed. reading: what the cell makes of its force;
    leak_per_s: share of the pressure that a second at one voltage costs; lost_answers, lost_samples: share that nobody
    hears."""

    def __init__(self, seed: int, force_n: float = 10.0, *, machine: Machine | None = None, **changes: Any) -> None:
        calibrated = KEPT[seed]
        calibration = calibrated.calibration
        self.machine = machine or calibrated.machine
        self.reading: Callable[[float], float] = changes.pop("reading", lambda force_n: force_n)
        self.leak_per_s: float = changes.pop("leak_per_s", 0.0)
        self.lost_answers: float = changes.pop("lost_answers", 0.0)
        self.lost_samples: float = changes.pop("lost_samples", 0.0)
        self.garbled: float = changes.pop("garbled", 0.0)
        self.pressure_pa_per_v: float = changes.pop("pressure_pa_per_v", nan)
        self.pressure_pa = nan
        self.is_measured: bool = changes.pop("is_measured", True)
        control: ControlSettings = replace(settings(), self_test=SelfTestSettings(force_n=force_n, **changes))
        response = calibration.response
        noise_n = hypot(
            calibrated.machine.noise_n, calibrated.machine.quantum_n / sqrt(12.0)
        )  # as a ladder measures it
        in_use = CalibrationInUse(calibration.model(), 1, *((response, noise_n) if self.is_measured else ()))
        self.controller = Controller(control, in_use)
        self.slide, self.rng = Slide(self.machine), Random(seed)
        self.ms, self.next_sample = 0, 3.0
        self.command, self.sample = Command(), None
        self.output: Output | None = None
        self.events: list[str] = []
        self.peak_n = self.peak_v = 0.0
        self.output_counts, self.cell_counts = WireCounts(), WireCounts()
        self.sent_v = 0.0
        self.held_s = self._acting_v = self._last_v = 0.0
        self._sent_ms, self._asked_ms, self._unanswered_s = 0, -_POLL_MS, None
        self.run(0.3)

    def worked(self) -> "SelfTestRig":
        """Let friction remember a full cycle, as behind a ladder: at rest it keeps newtons pressed."""
        for volts in (5.0, 0.0):
            for _ in range(1500):
                self.slide.step(volts)
        self.run(0.5)
        return self

    @property
    def now_s(self) -> float:
        return self.ms * 0.001

    def write(self, word: ControlBit) -> None:
        self.command = self.command._replace(number=self.command.number + 1, control_word=word, peer="m")
        self._step()

    def tested(self) -> SelfTestReport:
        """Run the self-test to its end; `took_s` says how long until the output was off."""
        self.peak_n = 0.0
        began_ms = self.ms
        self.write(ControlBit.START_SELF_TEST)
        while self.controller.state is State.CALIBRATING:
            self.run(0.05)
        self.took_s = (self.ms - began_ms) * 0.001
        return self.controller.active_run.self_test

    def run(self, seconds: float) -> None:
        for _ in range(round(1000 * seconds)):
            self._millisecond()

    def _millisecond(self) -> None:
        self.ms += 1
        acting_v = self.sent_v if self.ms >= self._sent_ms else self._last_v
        self.held_s = self.held_s + 0.001 if acting_v == self._acting_v else 0.0
        self._acting_v = acting_v
        left_v = acting_v * exp(-self.leak_per_s * self.held_s)
        self.slide.step(left_v)
        self.pressure_pa = self.pressure_pa_per_v * left_v
        self.peak_n, self.peak_v = max(self.peak_n, self.slide.force_n), max(self.peak_v, acting_v)
        if self.ms >= self.next_sample:
            self.next_sample += 1000.0 / self.machine.rate_hz
            self._measure()
            self._step()
        if self.ms % _TICK_MS == 0:
            self._step()

    def _measure(self) -> None:
        if self.rng.random() < self.lost_samples:
            return
        if self.rng.random() < self.garbled:
            self.cell_counts.garbled += 1
            return
        machine = self.machine
        noisy_n = self.reading(self.slide.cell_n) + self.rng.gauss(0.0, machine.noise_n)
        force_n = round(noisy_n / machine.quantum_n) * machine.quantum_n
        self.cell_counts.heard += 1
        self.sample = ForceSample(force_n, force_n, Quality.OK, self.now_s)

    def _step(self) -> None:
        line = LineStatus(
            acknowledged_v=0.0,
            sent_v=self.sent_v,
            wire_s=2.0 * self.machine.wire_s,
            output_counts=self.output_counts,
            cell_counts=self.cell_counts,
            unanswered_since_s=self._unanswered_s,
            pressure_pa=self.pressure_pa,
        )
        self.output = self.controller.step(self.now_s, self.command, self.sample, line)
        self.events.extend(self.output.events)
        if self.output.clear_command:
            self.command = self.command._replace(control_word=ControlBit(0), number=self.command.number + 1)
        self._send(self.output.voltage_v)

    def _send(self, wanted_v: float) -> None:
        """A setting when it has changed, else a poll; one at a time."""
        wire_ms = round(self.machine.wire_s * 1000)
        changed = abs(wanted_v - self.sent_v) > 0.5 * COUNT_V
        if self.ms - self._asked_ms < (2 * wire_ms if changed else _POLL_MS):
            return
        self._last_v, self.sent_v = self.sent_v, round(wanted_v / COUNT_V) * COUNT_V
        self._asked_ms, self._sent_ms = self.ms, self.ms + wire_ms
        self.output_counts.asked += 1
        if self.rng.random() < self.lost_answers:
            self._unanswered_s = self._unanswered_s or self.now_s
        else:
            self._unanswered_s = None
            self.output_counts.heard += 1


def verdict_on(report: SelfTestReport, item: Item) -> SelfTestVerdict:
    """Return the verdict on an item; NOT_TESTED before there is one."""
    return next((found.verdict for found in report.findings if found.item is item), SelfTestVerdict.NOT_TESTED)
