"""A small rig whose lines and machine fail when they are told to, beside the service that records runs, in virtual time.

What stands on the output's device is apart from what the gateway asks for; what the cell says is apart from what it feels.
"""

import os
from collections import deque
from collections.abc import Callable
from math import inf
from pathlib import Path
from typing import Any

from gateway.codes.faults import FaultCode
from gateway.control import ControlSettings
from gateway.control.inputs import ValveStatus
from gateway.devices.messages import ForceSample, Garbage, Quality
from gateway.devices.valve_profile import ValveDirection
from gateway.service.running_rig.calibration_runs import CalibrationRuns
from tests.control.valve.valve_bench import SHARE
from tests.disk.at_once import AtOnce
from tests.service.rigs import demo
from tests.service.running_rig.simulated_rig import TICK_S, Relay, SmallRig, Wire

AS_CALIBRATED_N_PER_V = 7.4
LOST_FAULTS = {"refuses": FaultCode.OUTPUT_REFUSED, "tripped": FaultCode.WATCHDOG_TRIPPED}


class DrawnOutput(Wire):
    """how: `well`, `unanswered` (it obeys, its answers are lost), `deaf` (it keeps what stands), `refuses`, `tripped` (at 0 V
    until a reset), `away` (its port is). device_v: what stands there."""

    def __init__(self, rest_v: float, how: str = "well", device_v: float = 0.0) -> None:
        super().__init__()
        self.how, self.device_v, self._rest_v = how, device_v, rest_v
        self.reset()

    def reset(self) -> None:
        """The port has been opened: the first command is the safe voltage."""
        self.voltage_v = self._rest_v
        self.acknowledged_v: float | None = None  # type: ignore[assignment]
        self.unanswered_since_s, self.fault = None, FaultCode.NONE
        self._set()

    @property
    def standing_v(self) -> float | None:  # type: ignore[override]
        return self.acknowledged_v if self.acknowledged_v == self.voltage_v else None

    def clear_faults(self) -> None:
        if self.how == "tripped":
            self.how, self.fault = "well", FaultCode.NONE
            self._set()

    def set_voltage(self, voltage_v: float, now_s: float) -> None:
        if voltage_v != self.voltage_v or self.how == "well":
            self.voltage_v = voltage_v
            self._set()

    def tick(self, now_s: float) -> None:
        if self.how in ("unanswered", "deaf"):
            self.unanswered_since_s = now_s if self.unanswered_since_s is None else self.unanswered_since_s
        self._set()

    def _set(self) -> None:
        if self.how in ("well", "unanswered"):
            self.device_v = self.voltage_v
        if self.how == "tripped":
            self.device_v = 0.0
        if self.how == "well":
            self.acknowledged_v, self.unanswered_since_s = self.voltage_v, None
        self.fault = LOST_FAULTS.get(self.how, FaultCode.NONE)


class DrawnRelay(Relay):
    """is_stuck: it stays where it is; silent_s: since when it has not answered."""

    is_stuck = False
    silent_s: float | None = None

    @property
    def status(self) -> ValveStatus:
        return ValveStatus(self.stands, self.silent_s, self.lost)

    def tick(self, now_s: float) -> None:
        if not self.is_stuck:
            super().tick(now_s)


class Fits:
    """Stands for `FitLauncher`: answer: who waits for the fit of the last ladder."""

    answer: Callable[[dict[str, Any]], None] | None = None

    def __init__(
        self, recording: Path, rig_file: Path, state: Path, on_result: Callable[[dict[str, Any]], None]
    ) -> None:
        Fits.answer = staticmethod(on_result)

    def close(self) -> None: ...


class RunRig(SmallRig):
    """cell: `well`, `silent`, `frozen`, `garbled`; cell_late: readings that a reading comes late by; outside_n: force that
    neither slide nor gateway knows of; period_ticks: of its
    readings; curve_per_v: by how much it grows stronger with each volt. heard: (s, N) of each reading that came."""

    def __init__(self, control: ControlSettings, folder: Path, period_ticks: int, *, seed: int, **plant: float) -> None:
        self.cell, self.cell_late, self.outside_n, self.false_n = "well", 0, 0.0, 0.0
        self.noise_n = 0.04
        self.heard: list[tuple[float, float]] = []
        self._felt: deque[float] = deque(maxlen=12)
        self._said_n = 0.0
        self.folder, self._period_ticks = folder, period_ticks
        self.on_tick: Callable[[], None] = lambda: None
        self.relay: DrawnRelay | None = None
        self.curve_per_v, self._gain_n_per_v = 0.0, plant["gain_n_per_v"]
        super().__init__(control, seed=seed, **plant)
        self.beats = False

    def new_wire(self) -> DrawnOutput:
        before = getattr(self, "wire", None)
        rest_v = self.settings.limits.safe_voltage_v
        return DrawnOutput(rest_v, before.how, before.device_v) if before else DrawnOutput(rest_v)

    def start(self, *, is_restarted: bool = False) -> None:
        """The one before has ended without a word, and the guardian has sent the safe voltage."""
        super().start(is_restarted=is_restarted)
        if self.loop.valve:
            self.relay = self.relay or DrawnRelay(self.plant)
            self.loop.valve = self.relay  # type: ignore[assignment]
        self.runs = CalibrationRuns(self.controller, demo(), self.folder, self.now, self.note)
        self.runs.disk = self.runs.syncing = AtOnce()  # type: ignore[assignment]
        self.loop.calibration_runs, self.runs.decide = self.runs, self.loop.refresh
        if self.wire.how == "away":
            self.loop.on_output_closed()

    def _tick(self) -> None:
        self.pass_by()
        self._hear()
        self.loop.on_tick(1, 0.0)
        self.runs.flush(self.now())
        self.on_tick()

    def pass_by(self) -> None:
        """One tick of the world alone."""
        self.ticks += 1
        if self.curve_per_v:
            self.plant.gain_n_per_v = self._gain_n_per_v * (1.0 + self.curve_per_v * self.plant._pressure)
        self.plant.advance(self.wire.device_v, 10)
        self._felt.append(self.plant.reading_n() + self.plant.sign * self.outside_n)

    def _hear(self) -> None:
        now_s = self.now()
        if self.cell == "silent" or self.ticks % self._period_ticks:
            return
        if self.cell == "garbled":
            self.samples.next = Garbage(b"?")  # type: ignore[assignment]
            self.loop.on_cell_bytes(b"", now_s)
            return
        if self.cell != "frozen":
            self._said_n = self._felt[max(-1 - self.cell_late, -len(self._felt))] + self.false_n
        self.false_n = 0.0
        said_n = self._said_n
        self.heard.append((now_s, said_n))
        self.samples.next = ForceSample(said_n, said_n, Quality.OK, now_s)
        self.loop.on_cell_bytes(b"", now_s)

    def stand_still(self, seconds: float, *, is_suspended: bool) -> None:
        """The process does not come by; suspended, this clock does not go on either."""
        before = self.ticks
        for _ in range(round(seconds / TICK_S)):
            self.pass_by()
        if is_suspended:
            self.ticks, self.suspended_s = before, self.suspended_s + seconds

    def let_go(self) -> None:
        """What the kernel does with the files of a process that has ended."""
        recording = self.runs._recording
        if recording and recording._file and recording._file._descriptor is not None:
            os.close(recording._file._descriptor)
            recording._file._descriptor = None

    def make_as_calibrated(self) -> None:
        """As strong as the calibration says, whichever way it works."""
        self.plant.gain_n_per_v, self.curve_per_v = AS_CALIBRATED_N_PER_V, 0.0
        if self.relay:
            self.relay._push_n_per_v = AS_CALIBRATED_N_PER_V
            self.plant.gain_n_per_v *= SHARE if self.relay.stands is ValveDirection.PULL else 1.0

    def silent_since_s(self) -> float:
        return self.heard[-1][0] if self.heard else -inf
