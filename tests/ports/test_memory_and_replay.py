"""Ports without descriptors: the same interface, deterministic mischief."""

import asyncio
import math
from typing import Any

import pytest

from gateway.devices import DeviceProfile, cell_device, cell_host
from gateway.devices.messages import ForceSample
from gateway.ports import Listener, PortError, ReplayPort, byte_by_byte, delayed, lossy, memory_pair, whole


def listener(ear: Any) -> Listener:
    return Listener(ear.on_bytes, ear.on_lost, ear.on_open)


@pytest.mark.parametrize("channel", [whole, byte_by_byte, delayed(0.001)])
def test_what_is_written_arrives_in_order(ear: Any, channel: Any) -> None:
    async def scene() -> None:
        near, far = memory_pair(Listener(), listener(ear), channel=channel)
        await near.open()
        await far.open()
        assert near.write(b"SET 512\r\n")
        assert near.write(b"MON\r\n")
        await ear.until(lambda: len(ear.data) == 14)

    asyncio.run(scene())
    assert ear.data == b"SET 512\r\nMON\r\n"


def test_a_lossy_line_loses_the_same_bytes_each_time(ear: Any) -> None:
    async def scene() -> None:
        near, far = memory_pair(Listener(), listener(ear), channel=lossy(3))
        await near.open()
        await far.open()
        near.write(b"abcdefg")
        near.write(b"hi")
        await ear.until(lambda: len(ear.data) == 6)
        assert near.written == b"abcdefghi"

    asyncio.run(scene())
    assert ear.data == b"abdegh"


def test_time_is_the_callers(ear: Any) -> None:
    async def scene() -> None:
        near, far = memory_pair(Listener(), listener(ear), clock=lambda: 42.0)
        await near.open()
        await far.open()
        near.write(b"x")
        await ear.until(lambda: bool(ear.data))

    asyncio.run(scene())
    assert ear.times_s == [42.0]


def test_an_unplugged_pair_behaves_as_a_serial_port_does(ear: Any) -> None:
    async def scene() -> None:
        near, far = memory_pair(listener(ear), Listener())
        await near.open()
        await far.open()
        near.unplug()
        assert [failure.code for failure in ear.losses] == ["E102"]
        assert not near.write(b"SET 900\r\n")
        with pytest.raises(PortError):
            await near.write_last(b"SET 0\r\n")
        with pytest.raises(PortError):
            await far.open()
        far.replug()
        assert len(ear.opened) == 2
        await near.write_last(b"SET 0\r\n")
        near.close()
        assert not near.is_open

    asyncio.run(scene())


@pytest.mark.parametrize("speed", [math.inf, 1000.0])
def test_a_replay_says_the_same_with_the_same_times_at_any_speed(
    ear: Any, indicator: DeviceProfile, speed: float
) -> None:
    device, host = cell_device(indicator), cell_host(indicator)
    recorded = [(0.01 * index, device.frame(float(index))) for index in range(20)]

    async def scene() -> float:
        port = ReplayPort(recorded, on_bytes=ear.on_bytes, speed=speed)
        await port.open()
        async with asyncio.timeout(5.0):
            await port.ended.wait()
        assert port.write(b"kept")
        assert port.written[0][1] == b"kept"
        port.close()
        assert not port.write(b"closed")
        return port._start_s

    start_s = asyncio.run(scene())
    assert ear.data == b"".join(chunk for _, chunk in recorded)
    assert [at_s - start_s for at_s in ear.times_s] == pytest.approx([at_s for at_s, _ in recorded])
    assert all(isinstance(sample, ForceSample) for sample in host.receive(ear.data, 0.0))


def test_a_closed_replay_is_silent(ear: Any) -> None:
    async def scene() -> None:
        port = ReplayPort([(0.0, b"a"), (3600.0, b"b")], on_bytes=ear.on_bytes)
        await port.open()
        await ear.until(lambda: bool(ear.data))
        port.close()
        assert not port.ended.is_set()

    asyncio.run(scene())
    assert ear.data == b"a"
