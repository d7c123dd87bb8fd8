"""The simulated rig: a process of its own with two ptys, the device role of each codec, and the twin behind them.

It is a child of the guardian in its own session, so it outlives a kill of control as a real rig does, and ends when the
guardian does (its link closes). The wires take the time that their baud rates take. A socket in the state directory
(`rig.sock`) takes faults for tests and demonstrations: no air, no contact, a cut wire, an inverted sign, an amplifier that
repeats its last value, or a plant that is no longer the one in the rig's file.
"""

import asyncio
import json
import os
import socket
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict
from math import isfinite
from pathlib import Path
from typing import Any

from gateway.devices import DeviceProfile, cell_device, output_device
from gateway.devices.messages import (
    Accepted,
    Garbage,
    OutputRequest,
    Pressure,
    Quality,
    ReadPressure,
    ReadVoltage,
    SetVoltage,
)
from gateway.ports import PacedPty
from gateway.processes import message_link as guardian_link
from gateway.processes import priority
from gateway.processes.clock_tick import ClockTick
from gateway.processes.event_file import EventFile
from gateway.processes.event_log import EventLog
from gateway.processes.json_socket import JsonLineServer
from gateway.profiles import Rig, load_rig
from gateway.profiles.strict_yaml.text import Document
from gateway.profiles.strict_yaml.typed import build
from gateway.service.socket_requests import FaultRequest, parse_request
from gateway.twin import Plant, Twin
from gateway.twin.plant import with_value

_LONGEST_LEAP_S = 1.0  # a rig process that was stopped does not replay the hours it missed
_SETTLED_S = 1.0  # until a changed plant has come to what is commanded


class SimulatedRig:
    """The twin behind the device ends of both wires. Bytes in through `on_output_bytes`, out through the two `send`s.

    It begins as a calibration leaves a rig and as any later vent does: pressed before, and vented.
    """

    def __init__(
        self, rig: Rig, *, send_output: Callable[[bytes], None], send_cell: Callable[[bytes], None], now_s: float
    ) -> None:
        assert rig.plant
        self.twin = Twin(rig.plant, rig.seed)
        self.twin.press_and_vent()
        self.is_cell_cut = False
        self.is_output_cut = False
        self._output = output_device(rig.output.device)
        self._cell = cell_device(rig.load_cell.device, rig.load_cell.unit)
        self._wiring = rig.load_cell.sign  # the simulated cell is wired as the rig says that the real one is
        self._send_output = send_output
        self._send_cell = send_cell
        self._setting_v = 0.0
        self._now_s = now_s
        self._range_n = rig.plant.cell.range_n
        self._plant = rig.plant
        self._seed = rig.seed
        self._twin_faults: dict[str, bool] = {}
        self.is_cell_frozen, self._shown_n = False, 0.0

    def advance(self, now_s: float) -> None:
        """Advance the twin to now_s; after a long pause by a limited time only."""
        self.twin.advance(min(max(0.0, now_s - self._now_s), _LONGEST_LEAP_S))
        self._now_s = now_s

    def on_output_bytes(self, chunk: bytes, now_s: float) -> None:
        """Answer requests to the output device, unless its wire is cut."""
        self.advance(now_s)
        for request in self._output.receive(chunk, now_s):
            answer = self._answer(request)
            if not self.is_output_cut:
                self._send_output(answer)

    def on_cell_bytes(self, chunk: bytes, now_s: float) -> None:
        """Answer questions to a load cell that speaks only when asked."""
        for _ in range(self._cell.receive(chunk, now_s)):
            self.stream(now_s)

    def stream(self, now_s: float) -> None:
        """Send one frame of the load-cell amplifier."""
        self.advance(now_s)
        if not self.is_cell_cut:
            measured_n = self._wiring * float(self.twin.measured_n)
            force_n = self._shown_n = self._shown_n if self.is_cell_frozen else measured_n
            overload = abs(force_n) >= self._range_n
            self._send_cell(self._cell.frame(force_n, Quality.OVERLOAD if overload else Quality.OK))

    def _answer(self, request: OutputRequest | Garbage) -> bytes:
        match request:
            case SetVoltage(voltage_v):
                self._setting_v = voltage_v
                self.twin.command(voltage_v)
                return self._output.reply(Accepted(voltage_v), to=request)
            case ReadVoltage():
                return self._output.reply(Accepted(self._setting_v), to=request)
            case ReadPressure():
                return self._output.reply(Pressure(float(self.twin.pressure_pa)), to=request)
            case Garbage():
                return self._output.reply(self._output.refusal(request))

    def fault(self, request: dict[str, Any]) -> dict[str, Any]:
        """Switch a simulated fault on or off.

        {"do": "fault", "name": NAME, "on": bool}; NAME plant takes {"values": {"friction.coulomb_n": 2.5}} besides.
        ValueError on an unknown name, or a value that no plant has.
        """
        query = parse_request(FaultRequest, request)
        name, is_on = query.name, query.on
        match name:
            case "no-air" | "no-contact" | "sign-inverted":
                self._twin_faults[name] = is_on
                self._set_twin_faults()
            case "cell-cut":
                self.is_cell_cut = is_on
            case "cell-frozen":
                self.is_cell_frozen = is_on
            case "output-cut":
                self.is_output_cut = is_on
            case "plant":
                self._change_plant(_change_plant(self._plant, query.values) if is_on else self._plant)
            case _:
                raise ValueError(
                    f"fault {name!r} is not one of no-air, no-contact, sign-inverted, cell-cut, cell-frozen, "
                    "output-cut, plant"
                )
        return {"fault": name, "on": is_on}

    def _set_twin_faults(self) -> None:
        self.twin.set_air(not self._twin_faults.get("no-air", False))
        self.twin.set_contact(not self._twin_faults.get("no-contact", False))
        self.twin.set_sign(-1 if self._twin_faults.get("sign-inverted", False) else 1)

    def _change_plant(self, plant: Plant) -> None:
        """Another machine in the place of this one, which has come to the standing command already. ValueError, and nothing has
        changed, where its physics do not compute."""
        twin = Twin(plant, self._seed + 1)
        try:
            twin.press_and_vent()
            twin.command(self._setting_v)
            twin.advance(_SETTLED_S)
            measured_n = float(twin.measured_n)
        except ArithmeticError as error:
            raise ValueError(f"no machine has such a plant: {error}") from None
        if not isfinite(measured_n):
            raise ValueError(f"no machine has such a plant: it measures {measured_n} N")
        self._seed += 1
        self.twin = twin
        self._set_twin_faults()


def _change_plant(plant: Plant, values: Mapping[str, float]) -> Plant:
    """Return the plant with some numbers changed, by `section.field`; ValueError for what it does not have, or cannot be."""
    for path, value in values.items():
        section, _, field = path.partition(".")
        try:
            known = getattr(getattr(plant, section), field)
            plant = with_value(plant, section, field, value)
        except (AttributeError, TypeError):
            raise ValueError(f"{path} = {value}: no number of a plant, such as friction.coulomb_n = 2.5") from None
        if not isinstance(known, float):
            raise ValueError(f"{path} is no number of a plant")
    _, faults = build(Plant, Document("plant", asdict(plant), {}))
    if faults:
        raise ValueError(f"{faults[0].path} {faults[0].message}")
    return plant


def _make_pty(device: DeviceProfile, on_bytes: Callable[[bytes, float], None]) -> PacedPty:
    serial = device.serial
    return PacedPty(serial.baud, on_bytes=on_bytes, bits_per_character=serial.bits_per_character)


async def serve(rig: Rig, link: socket.socket, state: Path, log: EventLog) -> None:
    """Run until the guardian's end of the link closes."""
    loop = asyncio.get_running_loop()
    ended = asyncio.Event()
    output_pty = _make_pty(rig.output.device, lambda chunk, now_s: simulated.on_output_bytes(chunk, now_s))
    cell_pty = _make_pty(rig.load_cell.device, lambda chunk, now_s: simulated.on_cell_bytes(chunk, now_s))
    simulated = SimulatedRig(rig, send_output=output_pty.send, send_cell=cell_pty.send, now_s=time.monotonic())
    faults = JsonLineServer(state / "rig.sock", {"fault": simulated.fault}, log)

    rate_hz = rig.load_cell.device.rate_hz

    def on_tick(expirations: int, late_s: float) -> None:
        """A stream, whose amplifier leaves out what its wire has no time for."""
        if cell_pty.backlog_s * rate_hz < 1.0:
            simulated.stream(time.monotonic())

    tick = ClockTick(1.0 / rate_hz, on_tick) if rate_hz else None
    output_pty.open()
    cell_pty.open()
    if unserved := await faults.start():
        log("socket", f"E152 {unserved}")
    if tick:
        tick.start()
    loop.add_reader(link.fileno(), ended.set)
    ptys = {"output": output_pty.path, "load_cell": cell_pty.path}
    guardian_link.send(link, guardian_link.PTYS, {"ptys": ptys, "pid": os.getpid()})
    await ended.wait()
    loop.remove_reader(link.fileno())
    if tick:
        tick.close()
    await faults.close()
    output_pty.close()
    cell_pty.close()


def main(arguments: list[str]) -> int:
    """Run the simulated rig; return its exit code. arguments: descriptor of the link, options as JSON."""
    link = socket.socket(fileno=int(arguments[0]))
    options = json.loads(arguments[1])
    state = Path(options["state"])
    priority.set_nice(priority.RIG_NICE)
    with EventLog(source="rig", file=EventFile(state)) as log:
        asyncio.run(serve(load_rig(options["rig"], simulated=True), link, state, log))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
