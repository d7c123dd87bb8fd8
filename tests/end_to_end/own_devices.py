"""Both devices of a real rig, served by the test on ptys: what reaches the regulator is seen here, with its time.

Shares no code with the gateway. The regulator answers at once; the cell presses with 7.5 N per volt behind a lag, and streams
100 readings a second. A port's name is a link, so that another device can come back behind it.
"""

import contextlib
import os
import pty
import re
import select
import threading
import time
import tty
from dataclasses import dataclass, field
from pathlib import Path

RIG = """\
name: own
description: both devices served by the test
loop_hz: 100
registers: force-v1
calibration: demo
output: {{device: smc-itv-rc, port: {output}, baud: 9600}}
load_cell: {{device: stream-st-gs, port: {cell}, baud: 115200}}
limits: {{force_max_n: 60, over_force_n: 90, voltage_max_v: 8}}
defaults: {{force_ramp_n_per_s: 15}}
supervision: {{sample_timeout_s: {timeout_s}, output_timeout_s: {timeout_s}, stall_s: {stall_s}}}
accept_no_device_watchdog: true
"""
NEWTON_PER_VOLT, LAG_S, PERIOD_S = 7.5, 0.05, 0.01


@dataclass
class Heard:
    """One whole line at the regulator: when its last byte was read, and what it said."""

    time_s: float
    line: bytes

    @property
    def voltage_v(self) -> float | None:
        match = re.fullmatch(rb"SET (\d+)", self.line)
        return int(match[1]) * 10 / 1023 if match else None


@dataclass
class Line:
    """One pty behind a link; the client's end is kept open, for a pty without a client reads as an error."""

    link: Path
    device: int = -1
    client: int = -1

    def plug(self) -> None:
        self.device, self.client = pty.openpty()
        for end in (self.device, self.client):
            tty.setraw(end)
        os.set_blocking(self.device, False)  # a device does not wait for anybody who reads: what finds no room is lost
        self.link.symlink_to(os.ttyname(self.client))

    def pull(self) -> None:
        os.close(self.device)
        os.close(self.client)
        self.device = self.client = -1
        self.link.unlink()


@dataclass
class OwnDevices:
    directory: Path
    heard: list[Heard] = field(default_factory=list)
    setting_v: float = 0.0
    force_n: float = 0.0
    stall_s: float = 0.1
    timeout_s: float = 0.4
    is_silent: bool = False

    def __post_init__(self) -> None:
        self.output, self.cell = Line(self.directory / "output"), Line(self.directory / "cell")
        self._stop = threading.Event()
        self._wires = threading.Lock()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self.rig = self.directory / "own.yaml"
        links = {"output": self.output.link, "cell": self.cell.link}
        self.rig.write_text(RIG.format(**links, stall_s=self.stall_s, timeout_s=self.timeout_s))

    def __enter__(self) -> "OwnDevices":
        self.output.plug()
        self.cell.plug()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        for line in (self.output, self.cell):
            if line.device >= 0:
                line.pull()

    def pull_output(self) -> None:
        with self._wires:
            self.output.pull()

    def plug_output(self) -> None:
        """Another device: it knows nothing of the one before."""
        with self._wires:
            self.setting_v = 0.0
            self.output.plug()

    def settings_since(self, time_s: float) -> list[Heard]:
        return [heard for heard in list(self.heard) if heard.time_s >= time_s and heard.voltage_v is not None]

    def until_safe(self, since_s: float, within_s: float = 3.0) -> float:
        """Seconds from then until the safe voltage was on the wire, whole."""
        while True:
            safe = [heard for heard in self.settings_since(since_s) if heard.voltage_v == 0.0]
            if safe:
                return safe[0].time_s - since_s
            assert time.monotonic() - since_s < within_s, f"no safe voltage: {self.heard[-5:]}"
            time.sleep(0.001)

    def _run(self) -> None:
        due_s, pending = time.monotonic(), b""
        while not self._stop.is_set():
            with self._wires:
                pending = self._answer(pending)
                if time.monotonic() >= due_s:
                    due_s += PERIOD_S
                    self._stream()
            wait_s = max(0.0, min(PERIOD_S, due_s - time.monotonic()))
            with contextlib.suppress(OSError):  # pulled meanwhile
                select.select([self.output.device] if self.output.device >= 0 else [], [], [], wait_s)

    def _answer(self, pending: bytes) -> bytes:
        if self.output.device < 0 or not select.select([self.output.device], [], [], 0)[0]:
            return pending if self.output.device >= 0 else b""
        *lines, pending = (pending + os.read(self.output.device, 4096)).split(b"\r\n")
        for line in lines:
            heard = Heard(time.monotonic(), line)
            self.heard.append(heard)
            if not self.is_silent:
                with contextlib.suppress(BlockingIOError):
                    os.write(self.output.device, self._reply(heard) + b"\r\n")
        return pending

    def _reply(self, heard: Heard) -> bytes:
        if heard.voltage_v is not None:
            self.setting_v = heard.voltage_v
            return heard.line[4:]
        return b"%d" % round(20 * self.setting_v) if heard.line == b"MON" else b"UNKNOWN COMMAND"

    def _stream(self) -> None:
        self.force_n += (NEWTON_PER_VOLT * self.setting_v - self.force_n) * PERIOD_S / (LAG_S + PERIOD_S)
        with contextlib.suppress(BlockingIOError):
            os.write(self.cell.device, b"ST,GS,%+08.2fkg\r\n" % (self.force_n / 9.80665))
