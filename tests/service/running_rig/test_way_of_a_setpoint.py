"""How many files a setpoint passes: from the bytes of a master's request to the bytes on the wire of the output device.

Two counts of one write, which enables and asks for 12 N: the files that hand the value on, which are on the stack of calls
when it becomes a voltage, characters and bytes on the wire; and all files with a function that was entered meanwhile, with
what else a step of control does (supervision, edges, the status for the registers).
"""

import asyncio
import os
import struct
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Final

import gateway
from gateway.modbus.mbap import Adu, encode
from gateway.ports import PortEvents, Pty, SerialPort
from tests.fieldbus.conftest import Stand, put
from tests.service.wired import ENABLE, Wired

MOST_ON_THE_WAY: Final = 20
MOST_ENTERED: Final = 61
"""As measured on 2026-11-29: two rooms of control and of the bank were split, a sleep of the machine is asked for, and the
write that repeats the last one has a file of its own, without which admission is shorter by a fifth."""
_PACKAGE: Final = Path(gateway.__file__).parent
_STATIONS: Final = {
    "bsfm/inverse.py": None,  # the force becomes a voltage
    "devices/fields/numbers.py": "encode",  # the voltage becomes characters
    "ports/serial_port.py": "write",  # the characters go to the wire
}
"""File and function (None: any) at which the stack of calls is noted."""
_WIRING: Final = frozenset(("service/running_rig/lines/rig_ports.py", "fieldbus/socket_transport.py"))
"""On the way of a real rig, too: its `write_output` stands between the output's exchange and the port, and the request comes by
a socket."""


@dataclass
class Trace:
    """Files of the gateway, relative to its folder. entered: those of all calls; on_the_way: those on the stack of calls
    when the setpoint becomes a voltage, the voltage a frame, and the frame bytes on the wire."""

    entered: set[str] = field(default_factory=lambda: {*_WIRING})
    on_the_way: set[str] = field(default_factory=lambda: {*_WIRING})
    stations: set[str] = field(default_factory=set)

    def note_call(self, frame: FrameType, event: str, _: object) -> None:
        """For sys.setprofile."""
        file = _file_of(frame)
        if event != "call" or file is None:
            return
        self.entered.add(file)
        if file in _STATIONS and _STATIONS[file] in (None, frame.f_code.co_name):
            self.stations.add(file)
            self.on_the_way |= {name for each in _stack_of(frame) if (name := _file_of(each))}


def _file_of(frame: FrameType) -> str | None:
    file = Path(frame.f_code.co_filename)
    return str(file.relative_to(_PACKAGE)) if file.is_relative_to(_PACKAGE) else None


def _stack_of(frame: FrameType | None) -> Iterator[FrameType]:
    while frame is not None:
        yield frame
        frame = frame.f_back


def write_request(*words: int) -> bytes:
    """FC16 of the holding registers from address 0 on, as a frame of Modbus TCP."""
    body = struct.pack(f">BHHB{len(words)}H", 16, 0, len(words), 2 * len(words), *words)
    return encode(Adu(1, 1, body))


async def trace_one_write(wired: Wired, data: bytes) -> Trace:
    """What one request enters until its bytes are on a pty, and its answer is with the master."""
    pty = Pty()
    port = SerialPort(
        pty.path,
        wired.rig.output.settings,
        PortEvents(on_bytes=lambda *_: None, on_lost=lambda _: None, on_open=lambda _: None),
    )
    await port.open()

    def write(frame: bytes) -> None:
        port.flush_input()
        port.write(frame)

    wired.exchange._write = write
    server, trace = Stand(), Trace()
    server.shared.bank = wired.bank  # type: ignore[assignment]
    connection, transport = server.connect()
    try:
        sys.setprofile(trace.note_call)
        try:
            put(connection, transport, data)
        finally:
            sys.setprofile(None)
        sent = os.read(pty.fd, 100)
    finally:
        port.close()
        pty.close()
    assert sent.startswith(b"SET "), "the voltage is on the wire before the master has its answer"
    assert transport.written[7] == data[7], "no exception code"
    return trace


def test_a_setpoint_passes_at_most_twenty_files() -> None:
    wired = Wired().ready()
    wired.run(0.0355)  # between two ticks
    wired.until(lambda: wired.exchange.unanswered_since_s is None, 0.1)

    trace = asyncio.run(trace_one_write(wired, write_request(ENABLE, 1200)))
    print(f"{len(trace.on_the_way)} files on the way:\n  " + "\n  ".join(sorted(trace.on_the_way)))
    print(f"{len(trace.entered)} files entered:\n  " + "\n  ".join(sorted(trace.entered)))
    assert trace.stations == set(_STATIONS), "each station was passed, or the list means nothing"
    assert len(trace.on_the_way) <= MOST_ON_THE_WAY, sorted(trace.on_the_way)
    assert len(trace.entered) <= MOST_ENTERED, sorted(trace.entered)
