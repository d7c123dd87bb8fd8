"""Both shipped profiles in both roles over real ptys: five seconds' worth of traffic, as fast as the pty goes."""

import asyncio
import time
from collections.abc import Callable
from typing import Any

import pytest

from gateway.devices import DeviceProfile, cell_device, cell_host, output_device, output_host
from gateway.devices.messages import (
    Accepted,
    ForceSample,
    Garbage,
    OutputReply,
    OutputRequest,
    Pressure,
    ReadPressure,
    SetVoltage,
)
from gateway.ports import PacedPty, PortEvents, SerialPort

FASTEST_BAUD = 4_000_000  # paced, but quick: 9600 baud would take five seconds here too


class Regulator:
    """A device that obeys at once, behind a pty."""

    def __init__(self, profile: DeviceProfile, baud: int) -> None:
        self._device = output_device(profile)
        self.pty = PacedPty(baud, on_bytes=self._on_bytes)
        self.heard: list[OutputRequest | Garbage] = []
        self.setting_v = 0.0

    def _on_bytes(self, chunk: bytes, now_s: float) -> None:
        for request in self._device.receive(chunk, now_s):
            self.heard.append(request)
            self.pty.send(self._device.reply(self._answer(request)))

    def _answer(self, request: OutputRequest | Garbage) -> OutputReply:
        match request:
            case SetVoltage(voltage_v):
                self.setting_v = voltage_v
                return Accepted(voltage_v)
            case Garbage():
                return self._device.refusal(request)
            case _:
                return Pressure(self.setting_v * 0.9e5)


async def converse(profile: DeviceProfile, messages: list[OutputRequest], ear: Any, baud: int) -> list[OutputReply]:
    """One question at a time, as the service asks."""
    regulator = Regulator(profile, baud)
    regulator.pty.open()
    host = output_host(profile)
    replies: list[OutputReply] = []

    def on_bytes(chunk: bytes, now_s: float) -> None:
        replies.extend(host.receive(chunk, now_s))
        ear.on_bytes(chunk, now_s)

    port = _client(ear, on_bytes, regulator.pty.path, profile, baud)
    await port.open()
    for count, message in enumerate(messages, start=1):
        port.write(host.request(message))
        await ear.until(lambda count=count: len(replies) >= count)
    port.close()
    regulator.pty.close()
    assert regulator.heard == messages
    return replies


def _client(ear: Any, on_bytes: Callable[[bytes, float], None], path: str, profile: DeviceProfile, baud: int) -> Any:
    settings = profile.serial.at(baud)
    return SerialPort(path, settings, PortEvents(on_bytes, ear.on_lost, ear.on_open))


def test_two_hundred_settings_and_readings_of_the_regulator(ear: Any, itv: DeviceProfile) -> None:
    counts = [index * 5 for index in range(200)]
    messages: list[OutputRequest] = []
    for count in counts:
        messages += [SetVoltage(count * (10.0 / 1023)), ReadPressure()]
    replies = asyncio.run(converse(itv, messages, ear, FASTEST_BAUD))
    settings_v = [reply.voltage_v for reply in replies if isinstance(reply, Accepted)]
    pressures_pa = [reply.pressure_pa for reply in replies if isinstance(reply, Pressure)]
    assert settings_v == pytest.approx([count * (10.0 / 1023) for count in counts])
    assert pressures_pa == pytest.approx([count * (0.9e6 / 1023) for count in counts], abs=1.0)
    assert not ear.losses


def test_a_conversation_at_9600_baud_takes_what_the_wire_takes(ear: Any, itv: DeviceProfile) -> None:
    started_s = time.monotonic()
    replies = asyncio.run(converse(itv, [SetVoltage(512 * (10.0 / 1023)), ReadPressure()], ear, 9600))
    assert [type(reply) for reply in replies] == [Accepted, Pressure]
    assert ear.data == b"512\r\n512\r\n"
    on_the_wire = len(b"SET 512\r\n512\r\nMON\r\n512\r\n")
    assert ear.times_s[-1] - started_s >= on_the_wire * itv.serial.character_s


def test_five_hundred_frames_of_the_load_cell(ear: Any, indicator: DeviceProfile) -> None:
    forces_n = [0.1 * index - 20.0 for index in range(500)]
    device, host = cell_device(indicator), cell_host(indicator)
    samples: list[ForceSample | Garbage] = []

    def on_bytes(chunk: bytes, now_s: float) -> None:
        samples.extend(host.receive(chunk, now_s))
        ear.on_bytes(chunk, now_s)

    async def scene() -> None:
        pty = PacedPty(FASTEST_BAUD, on_bytes=lambda chunk, now_s: None)
        pty.open()
        port = _client(ear, on_bytes, pty.path, indicator, FASTEST_BAUD)
        await port.open()
        for start in range(0, 500, 50):
            for force_n in forces_n[start : start + 50]:
                pty.send(device.frame(force_n))
            await ear.until(lambda start=start: len(samples) >= start + 50)
        port.close()
        pty.close()

    asyncio.run(scene())
    read_n = [sample.force_n for sample in samples if isinstance(sample, ForceSample)]
    assert read_n == pytest.approx(forces_n, abs=0.5001 * host.resolution_n)
    times_s = [sample.time_s for sample in samples if isinstance(sample, ForceSample)]
    assert times_s == sorted(times_s)


def test_a_wrong_baud_gives_bytes_and_no_valid_line(ear: Any, indicator: DeviceProfile) -> None:
    """What E110 is about: many bytes, nothing understood, and never a wrong force."""
    device, host = cell_device(indicator), cell_host(indicator)
    found: list[ForceSample | Garbage] = []

    def on_bytes(chunk: bytes, now_s: float) -> None:
        found.extend(host.receive(chunk, now_s))
        ear.on_bytes(chunk, now_s)

    async def scene() -> None:
        pty = PacedPty(115200, on_bytes=lambda chunk, now_s: None)
        pty.open()
        port = _client(ear, on_bytes, pty.path, indicator, 9600)
        await port.open()
        for index in range(100):
            pty.send(device.frame(0.1 * index))
        await ear.until(lambda: len(ear.data) >= 100)
        port.close()
        pty.close()

    asyncio.run(scene())
    assert not [one for one in found if isinstance(one, ForceSample)]
