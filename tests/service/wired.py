"""The whole gateway in virtual time: bank, controller, output line, codecs, device roles and the twin, joined by plain calls.

No process, no pty, no event loop: a clock that steps by a millisecond, two wires that take the time of their baud rates,
a tick every 10 ms. The observer shares no code with the gateway: it reads the bytes that reach the device, as anybody with a
probe on the wire could. Deterministic: the same seed gives the same run.
"""

import re
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import nan
from typing import Any

from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.control import Controller
from gateway.devices import PacedWire, cell_host, output_host
from gateway.modbus import Peer
from gateway.profiles import CellLine, OutputLine, Rig
from gateway.registers import RegisterBank
from gateway.registers.words import State
from gateway.service.running_rig.bank_rules import bank_rules
from gateway.service.running_rig.control_loop import ControlLoop, LoopProcess
from gateway.service.running_rig.lines.load_cell_line import CellExchange
from gateway.service.running_rig.lines.output_line import OutputExchange
from gateway.service.simulation.world import SimulatedRig
from tests.service.rigs import demo

STEP_S = 0.001
MASTER = Peer("10.0.0.5", 40001)
ENABLE, RESET = 1, 2


@dataclass(frozen=True)
class Setting:
    """What reached the device: `SET counts`, when its last byte had passed."""

    time_s: float
    voltage_v: float


class Observer:
    """Reads the wire to the device byte by byte; knows the manual's grammar and the rig's limits, nothing else."""

    def __init__(self) -> None:
        self.settings: list[Setting] = []
        self.others: list[bytes] = []
        self._line = b""
        self._halves: set[bytes] = set()

    def cut(self) -> None:
        """The cable was pulled, or the sender killed: what is begun now stands before the next sentence."""
        self._halves.add(self._line)

    def hear(self, chunk: bytes, now_s: float) -> None:
        *lines, self._line = (self._line + chunk).split(b"\r\n")
        for line in lines:
            if match := re.fullmatch(rb"SET (\d+)", line):
                self.settings.append(Setting(now_s, int(match[1]) * 10.0 / 1023))
            else:
                self.others.append(line)

    def check(self, rig: Rig) -> None:
        """Assert over everything that was ever on the wire: I1 the range, I2 the slew, I6 the safe voltage first."""
        limits, step_v = rig.control.limits, 10.0 / 1023
        broken = [line for line in self.others if line != b"MON" and not self._is_after_a_cut(line)]
        assert not broken, "I7: nothing but whole sentences"
        assert all(-1e-9 <= one.voltage_v <= limits.voltage_max_v + step_v for one in self.settings), "I1"
        for before, after in zip(self.settings, self.settings[1:], strict=False):
            allowed_v = limits.voltage_slew_v_per_s * (after.time_s - before.time_s + 0.02) + step_v
            assert after.voltage_v - before.voltage_v <= allowed_v, f"I2: {before} -> {after}"
        if self.settings:
            assert self.settings[0].voltage_v == limits.safe_voltage_v, "I6"

    def _is_after_a_cut(self, line: bytes) -> bool:
        return any(half and line.startswith(half) and line[len(half) :] in (b"MON", b"SET 0") for half in self._halves)


def wire_of(line: OutputLine | CellLine) -> PacedWire:
    return PacedWire(line.baud, line.settings.bits_per_character)


class Wired:
    """One simulated rig with its gateway. Times are virtual seconds since the start."""

    def __init__(self, rig: Rig | None = None, *, seed: int = 7) -> None:
        self.rig = rig = replace(rig or demo(), seed=seed)
        self.now_s = 0.0
        self.log: list[tuple[float, str]] = []
        self.observer = Observer()
        self.is_plugged = True
        self.is_cell_plugged = True
        self.lateness: Callable[[int], tuple[int, float]] = lambda tick: (1, 0.0)
        """Of each tick: periods since the one before, and how late it is, as the clock would say."""
        self.suspended_s = 0.0
        """For how long the machine has been suspended, while this clock stood still."""
        self._steps, self.tick_steps = 0, 10
        self._down = wire_of(rig.output)
        self._stream, self._asks = wire_of(rig.load_cell), wire_of(rig.load_cell)
        self._frame_steps = round(1.0 / (STEP_S * rig.load_cell.device.rate_hz)) if rig.load_cell.device.rate_hz else 0
        self.world = SimulatedRig(
            rig,
            send_output=lambda data: self._down.send(data, self.now_s),
            send_cell=lambda data: self._stream.send(data, self.now_s),
            now_s=0.0,
        )
        self.twin = self.world.twin
        self.start()

    def start(self, *, unclean: bool = False) -> None:
        """A fresh control process beside the same world; what the one before had not sent is gone."""
        self.observer.cut()
        self._up = wire_of(self.rig.output)
        rig, clock = self.rig, lambda: self.now_s
        self.bank = RegisterBank(rig.register_map, bank_rules(rig), now=clock)
        self.exchange = OutputExchange(output_host(rig.output.device), self._write, rig.output.device.reply_timeout_s)
        self.controller = Controller(
            rig.control,
            rig.calibration_in_use(rig.calibration),
            unclean_restart=unclean,
            compensation=rig.compensation,
        )
        self.loop = ControlLoop(
            self.bank,
            self.controller,
            self.exchange,
            CellExchange(
                cell_host(rig.load_cell.device, sign=rig.load_cell.sign, unit=rig.load_cell.unit),
                self._ask_cell,
                rig.load_cell.device,
            ),
            LoopProcess(
                clock,
                lambda cause, sentence: self.log.append((self.now_s, sentence)),
                suspended_s=lambda: self.suspended_s,
            ),
        )
        self.loop.pressure_pa_per_v = rig.output.device.pressure_pa_per_v

    # -- time

    def run(self, duration_s: float) -> None:
        for _ in range(round(duration_s / STEP_S)):
            self._step()

    def until(self, condition: Callable[[], bool], within_s: float) -> float:
        """Seconds that passed until the condition held; AssertionError when it did not."""
        began_s = self.now_s
        while not condition():
            assert self.now_s - began_s < within_s, f"not within {within_s} s: {self.show()}, log {self.log[-5:]}"
            self._step()
        return self.now_s - began_s

    def samples(self, duration_s: float) -> Iterator["Wired"]:
        """Itself, after each millisecond."""
        for _ in range(round(duration_s / STEP_S)):
            self._step()
            yield self

    def _step(self) -> None:
        self._steps += 1
        self.now_s = round(self._steps * STEP_S, 6)
        if sent := self._up.bytes_through(self.now_s):
            self.observer.hear(sent, self.now_s)
            self.world.on_output_bytes(sent, self.now_s)
        if asked := self._asks.bytes_through(self.now_s):
            self.world.on_cell_bytes(asked, self.now_s)
        if self._frame_steps and self._steps % self._frame_steps == 3 % self._frame_steps and self._wire_has_time():
            self.world.stream(self.now_s)
        if (heard := self._down.bytes_through(self.now_s)) and self.is_plugged:
            self.loop.on_output_bytes(heard, self.now_s)
        if (frame := self._stream.bytes_through(self.now_s)) and self.is_cell_plugged:
            self.loop.on_cell_bytes(frame, self.now_s)
        if self._steps % self.tick_steps == 0:
            self.loop.on_tick(*self.lateness(self._steps // self.tick_steps))

    def _wire_has_time(self) -> bool:
        """An amplifier leaves out the readings that its wire cannot carry."""
        last_s = self._stream.last_through_s
        return last_s is None or last_s - self.now_s < self._frame_steps * STEP_S

    def stall(self, duration_s: float, then: Callable[[], None] = lambda: None) -> None:
        """The loop does not come by; the world and the wires go on, and bytes wait for it. `then` is served first."""
        loop, waiting = self.loop, _Absent()
        self.loop = waiting  # type: ignore[assignment]
        self.run(duration_s)
        self.loop = loop
        then()
        loop.on_output_bytes(waiting.output, self.now_s)
        loop.on_cell_bytes(waiting.cell, self.now_s)

    # -- faults

    def fault(self, name: str, on: bool = True) -> None:
        self.world.fault({"do": "fault", "name": name, "on": on})

    def unplug(self) -> None:
        self.is_plugged = False
        self.observer.cut()
        self._up, self._down = wire_of(self.rig.output), wire_of(self.rig.output)
        self.loop.on_output_closed()

    def replug(self) -> None:
        self.is_plugged = True
        self.loop.on_output_opened()

    def _write(self, data: bytes) -> None:
        if self.is_plugged:
            self._up.send(data, self.now_s)

    def _ask_cell(self, data: bytes) -> None:
        if self.is_cell_plugged:
            self._asks.send(data, self.now_s)

    # -- a master

    def write(self, address: int, *words: int, peer: Peer = MASTER) -> None:
        """FC16; a Refusal comes through."""
        self.bank.write_registers(address, struct.pack(f">{len(words)}H", *(word & 0xFFFF for word in words)), peer)

    def word(self, name: str) -> int:
        register = self.rig.register_map.find(name)
        (word,) = struct.unpack(">H", self.bank.read_registers(register.address, 1))
        return int(word)

    def value(self, name: str) -> float:
        """A register of the status block in its unit, nan where it is unavailable."""
        register, word = self.rig.register_map.find(name), self.word(name)
        if word == 0x8000:
            return nan
        return (word - 65536 if word >= 32768 else word) * float(register.scale or 1.0)

    def floats(self, first: int, count: int) -> tuple[float, ...]:
        return struct.unpack(f">{count}f", self.bank.read_registers(first, 2 * count))

    @property
    def state(self) -> State:
        return State(self.word("state"))

    @property
    def fault_code(self) -> FaultCode:
        return FaultCode(self.word("fault_code"))

    @property
    def warnings(self) -> WarningBit:
        return WarningBit(self.word("warning_word"))

    @property
    def force_n(self) -> float:
        return self.value("force_measured")

    def settings_since(self, time_s: float) -> list[Setting]:
        return [one for one in self.observer.settings if one.time_s > time_s]

    def said(self, code: str) -> list[str]:
        return [sentence for _, sentence in self.log if sentence.startswith(code)]

    def show(self) -> dict[str, Any]:
        names = "force_measured force_applied output_voltage trim"
        return {"at": self.now_s, "state": self.state.name, "fault": self.fault_code.name} | {
            name: self.value(name) for name in names.split()
        }

    def ready(self) -> "Wired":
        """Past the start: both devices have spoken, an enable would be accepted."""
        self.until(lambda: bool(self.word("status_word") & 2), 1.0)
        return self

    def pressing(self, force_n: float) -> "Wired":
        """Enabled and settled at this force."""
        self.ready()
        self.write(0, ENABLE, round(100 * force_n))
        self.until(lambda: self.state is State.HOLDING, 3.0)
        return self

    def voltage_reaches_safe(self, within_s: float) -> float:
        """Seconds until the safe voltage is on the wire, whole."""
        began_s = self.now_s
        self.until(lambda: any(one.voltage_v == 0.0 for one in self.settings_since(began_s)), within_s)
        return self.now_s - began_s


class _Absent:
    """Stands for a loop that does not come by: what the kernel keeps for it."""

    def __init__(self) -> None:
        self.output = self.cell = b""

    def on_output_bytes(self, chunk: bytes, now_s: float) -> None:
        self.output += chunk

    def on_cell_bytes(self, chunk: bytes, now_s: float) -> None:
        self.cell += chunk

    def on_tick(self, expirations: int, late_s: float) -> None: ...
