"""The simulated wire on a real pty: time, speed, and a client that reads too little."""

import asyncio
import os
import time
from typing import Any

import pytest

from gateway.devices import SerialSettings
from gateway.ports import PacedPty
from tests.ports.raw_bytes import gather, read_all


def paced(ear: Any, baud: int) -> PacedPty:
    wire = PacedPty(baud, on_bytes=ear.on_bytes)
    wire.open()
    return wire


@pytest.mark.parametrize("baud", [9600, 115200])
def test_a_command_takes_its_time_on_the_wire(ear: Any, baud: int) -> None:
    command = b"SET 512\r\n" * 10

    async def scene() -> float:
        device, port = paced(ear, baud), type(ear)().port
        wire = device.path
        client = port(wire, SerialSettings(baud=baud))
        await client.open()
        started_s = time.monotonic()
        client.write(command)
        await ear.until(lambda: len(ear.data) == len(command))
        client.close()
        device.close()
        return float(ear.times_s[-1] - started_s)

    took_s = asyncio.run(scene())
    assert ear.data == command
    assert took_s >= len(command) * 10 / baud  # never early; how late is up to the machine


def test_an_answer_takes_its_time_on_the_wire(ear: Any) -> None:
    answer = b"1023\r\n" * 10

    async def scene() -> float:
        device = paced(type(ear)(), 9600)
        client = ear.port(device.path)
        await client.open()
        started_s = time.monotonic()
        device.send(answer[:30])
        device.send(answer[30:])
        await ear.until(lambda: len(ear.data) == len(answer))
        client.close()
        device.close()
        return float(ear.times_s[-1] - started_s)

    took_s = asyncio.run(scene())
    assert ear.data == answer
    assert took_s >= len(answer) * 10 / 9600


def test_a_client_at_another_speed_hears_and_says_garbage(ear: Any) -> None:
    async def scene() -> bytes:
        heard_by_device = type(ear)()
        device = paced(heard_by_device, 115200)
        client = ear.port(device.path, SerialSettings(baud=9600))
        await client.open()
        client.write(b"SET 512\r\n")
        device.send(b"ST,GS,+0012.34kg\r\n" * 5)
        await ear.until(lambda: bool(ear.data))
        await heard_by_device.until(lambda: bool(heard_by_device.data))
        client.close()
        device.close()
        return bytes(heard_by_device.data)

    said = asyncio.run(scene())
    assert b"SET" not in said
    assert b"ST,GS" not in ear.data
    assert b"\r\n" not in ear.data


def test_a_client_that_sets_no_speed_has_the_wires(ear: Any) -> None:
    async def scene() -> None:
        device = paced(ear, 9600)
        client = os.open(device.path, os.O_RDWR | os.O_NOCTTY)
        os.write(client, b"MON\r\n")
        await ear.until(lambda: len(ear.data) == 5)
        os.close(client)
        device.close()

    asyncio.run(scene())
    assert ear.data == b"MON\r\n"


def test_a_client_that_writes_too_much_waits_and_loses_nothing(ear: Any) -> None:
    flood = bytes(range(256)) * 40

    async def scene() -> None:
        device = paced(ear, 4_000_000)
        client = os.open(device.path, os.O_RDWR | os.O_NOCTTY)
        assert os.write(client, flood) == len(flood)
        await ear.until(lambda: len(ear.data) == len(flood))
        os.close(client)
        device.close()

    asyncio.run(scene())
    assert ear.data == flood


def test_nobody_reading_loses_bytes_not_the_device(ear: Any) -> None:
    sent = bytes(100_000)  # more than a terminal keeps

    async def scene() -> bytes:
        device = paced(type(ear)(), 4_000_000)
        client = os.open(device.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        device.send(sent)
        while device.backlog_s > 0.0:
            await asyncio.sleep(0.01)
        kept = b""
        while chunk := read_all(client):  # the kernel hands on what it has buffered in parts
            kept += chunk
            await asyncio.sleep(0.01)
        device.send(b"512\r\n")
        assert await gather(client, 5) == b"512\r\n"
        os.close(client)
        device.close()
        return kept

    kept = asyncio.run(scene())
    assert 0 < len(kept) < len(sent)


def test_closing_is_an_unplug_for_the_client(ear: Any) -> None:
    async def scene() -> None:
        device = paced(type(ear)(), 9600)
        client = ear.port(device.path)
        await client.open()
        device.send(b"never arrives")
        device.close()
        device.close()
        await ear.until(lambda: bool(ear.losses))
        client.close()

    asyncio.run(scene())
    assert ear.data == b""


def test_a_waiting_wire_does_not_spin(ear: Any) -> None:
    """100 bytes at 9600 baud are 0.1 s: a wake-up per 10 ms piece, not one per byte or per turn of the loop."""

    async def scene() -> int:
        device = paced(type(ear)(), 9600)
        client = ear.port(device.path)
        await client.open()
        device.send(b"x" * 100)
        await ear.until(lambda: len(ear.data) == 100)
        client.close()
        device.close()
        return len(ear.times_s)

    assert asyncio.run(scene()) <= 14


def test_what_was_on_the_wire_when_the_plug_was_pulled_comes_to_nobody(ear: Any) -> None:
    """Neither to the device, whose pty is gone, nor as an error of the loop."""
    errors = list[Any]()

    async def scene() -> None:
        asyncio.get_running_loop().set_exception_handler(lambda loop, told: errors.append(told))
        device, other = paced(ear, 9600), type(ear)()
        client = other.port(device.path)
        await client.open()
        client.write(b"SET 512\r\n")
        while device._inward._timer is None:
            await asyncio.sleep(0.0)
        device.send(b"1023\r\n")
        timers = [flow._timer for flow in (device._inward, device._outward)]
        device.close()
        assert all(timer is not None and timer.cancelled() for timer in timers)
        client.close()

    asyncio.run(scene())
    assert (ear.data, errors) == (b"", [])
