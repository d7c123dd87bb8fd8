"""What is written to a serial port: in order, with a deadline for the last words, and no device can hold the loop up."""

import asyncio
import os
import termios
from typing import Any

import pytest

from gateway.ports import PortError, Pty
from gateway.ports.serial_port import MOST_UNSENT_BYTES
from tests.ports.raw_bytes import gather, read_all


def test_what_the_driver_does_not_take_at_once_follows_in_order(ear: Any, line: Pty) -> None:
    """A pty takes about 20 kB; the rest waits here, and no byte is lost or moved."""

    async def scene() -> None:
        port = ear.port(line.path)
        await port.open()
        sent = b""
        while not port._unsent:
            chunk = len(sent).to_bytes(4) * 250
            assert port.write(chunk)
            sent += chunk
        tail = b"the last words"
        assert port.write(tail)
        assert port.unsent_bytes > len(tail)
        assert await gather(line.fd, len(sent + tail)) == sent + tail
        await port.drain()
        assert port.unsent_bytes == 0
        port.close()

    asyncio.run(scene())


def test_a_device_that_takes_no_bytes_is_a_lost_one(ear: Any, line: Pty) -> None:
    async def scene() -> None:
        port = ear.port(line.path)
        await port.open()
        assert not all(port.write(b"x" * 1000) for _ in range(500)), "what is unsent has no end"
        await ear.until(lambda: bool(ear.losses))
        assert ear.losses[0].code == "E111"
        assert f"more than {MOST_UNSENT_BYTES} unsent" in str(ear.losses[0])
        port.close()

    asyncio.run(scene())


def test_what_the_driver_held_of_a_device_that_took_no_bytes_is_not_sent_later(ear: Any, line: Pty) -> None:
    """The guardian has the line open meanwhile, so that the driver keeps its buffer: 20 kB of old voltages went before the safe
    one of the new beginning. What a pty's far end has received, 4 kB, nobody can take back."""

    async def scene() -> None:
        port = ear.port(line.path)
        await port.open()
        guardians = os.dup(ear.opened[-1])
        while port.write(b"SET 512\r\n"):
            pass
        await ear.until(lambda: len(ear.opened) > 1)
        assert port.write(b"SET 0\r\n")
        heard = await gather(line.fd, 7)
        os.close(guardians)
        port.close()
        assert heard.endswith(b"SET 0\r\n")
        assert len(heard) <= 4096 + len(b"SET 0\r\n")

    asyncio.run(scene())


def test_the_last_words_are_waited_for_with_a_deadline(ear: Any, line: Pty) -> None:
    async def scene() -> None:
        port = ear.port(line.path)
        await port.open()
        await port.write_last(b"SET 0\r\n")
        assert read_all(line.fd) == b"SET 0\r\n"
        termios.tcflow(ear.opened[-1], termios.TCOOFF)  # a buffer that is only full has room again at any time
        port.write(b"x" * 1000)
        assert port._unsent
        with pytest.raises(PortError, match=r"E111 .* takes no bytes"):
            await port.write_last(b"SET 0\r\n", deadline_s=0.01)
        port.close()
        with pytest.raises(PortError, match="E102"):
            await port.write_last(b"SET 0\r\n")

    asyncio.run(scene())


def test_a_failing_drain_is_a_port_error_whatever_its_family(
    ear: Any, line: Pty, monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(descriptor: int) -> None:
        raise termios.error(5, "Input/output error")

    async def scene() -> None:
        port = ear.port(line.path)
        await port.open()
        with monkeypatch.context() as patched:
            patched.setattr("gateway.ports.serial_port.termios.tcdrain", failing)
            with pytest.raises(PortError, match="Input/output error"):
                await port.write_last(b"SET 0\r\n")
        port.close()

    asyncio.run(scene())


def test_closing_does_not_drop_the_last_bytes(ear: Any, line: Pty) -> None:
    async def scene() -> None:
        port = ear.port(line.path)
        await port.open()
        port.write(b"SET 0\r\n")
        port.close()
        assert read_all(line.fd) == b"SET 0\r\n"

    asyncio.run(scene())


def test_closing_a_stuck_port_does_not_hang(ear: Any, line: Pty) -> None:
    async def scene() -> None:
        port = ear.port(line.path)
        await port.open()
        while not port._unsent:
            port.write(b"x" * 1000)
        started_s = asyncio.get_running_loop().time()
        port.close()
        assert asyncio.get_running_loop().time() - started_s < 1.0

    asyncio.run(scene())


def filled(port: Any) -> bytes:
    """Write until some of it waits here; all that was written."""
    sent = b""
    while not port._unsent:
        chunk = len(sent).to_bytes(4) * 250
        assert port.write(chunk)
        sent += chunk
    return sent


def test_what_waits_when_the_port_is_closed_is_sent_first(ear: Any, line: Pty, monkeypatch: pytest.MonkeyPatch) -> None:
    """The last of it is the safe voltage."""
    heard = bytearray()

    def listens_meanwhile(readers: list[int], writers: list[int], *rest: Any) -> tuple[list[int], list[int], list[int]]:
        heard.extend(read_all(line.fd))
        return [], writers, []

    async def scene() -> bytes:
        port = ear.port(line.path)
        await port.open()
        sent = filled(port) + b"SET 0\r\n"
        assert port.write(b"SET 0\r\n") and port._unsent
        monkeypatch.setattr("gateway.ports.serial_port.select.select", listens_meanwhile)
        port.close()
        heard.extend(read_all(line.fd))
        return sent

    assert asyncio.run(scene()) == bytes(heard)


def test_what_comes_when_there_is_room_again_goes_behind_what_waits(ear: Any, line: Pty) -> None:
    """The driver may have taken bytes meanwhile, and the loop not have heard of it."""

    async def scene() -> None:
        port = ear.port(line.path)
        await port.open()
        sent = filled(port) + b"SET 0\r\n"
        heard = read_all(line.fd)
        assert heard and port._unsent
        assert port.write(b"SET 0\r\n")
        assert heard + await gather(line.fd, len(sent) - len(heard)) == sent
        port.close()

    asyncio.run(scene())


def test_who_has_sent_all_asks_for_room_no_more(ear: Any, line: Pty) -> None:
    """A writable descriptor would wake the loop for ever."""

    async def scene() -> None:
        port = ear.port(line.path)
        await port.open()
        sent = filled(port)
        assert await gather(line.fd, len(sent)) == sent
        await port.drain()
        assert not asyncio.get_running_loop().remove_writer(ear.opened[-1])
        port.close()

    asyncio.run(scene())


def test_an_open_port_tells_what_its_adapter_is_slow_at(ear: Any, line: Pty, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gateway.ports.serial_port.set_low_latency", lambda descriptor, path: f"W332 {path} waits")

    async def scene() -> None:
        port = ear.port(line.path)
        assert port.warning == ""
        await port.open()
        assert port.warning == f"W332 {line.path} waits"
        port.close()

    asyncio.run(scene())


def test_what_waited_before_a_loss_is_not_sent_after_it_and_nothing_looks_at_a_closed_port(ear: Any, line: Pty) -> None:
    async def scene() -> None:
        port, other = ear.port(line.path), Pty()
        await port.open()
        filled(port)
        port.move(other.path)
        assert port.is_open and port.unsent_bytes == 0
        assert not asyncio.get_running_loop().remove_writer(ear.opened[0]), "its number may be another's by now"
        assert port.write(b"SET 0\r\n")
        assert await gather(other.fd, 7) == b"SET 0\r\n"
        port.close()
        assert port._look.cancelled()
        other.close()

    asyncio.run(scene())


def test_what_is_dropped_is_not_sent_and_what_comes_behind_it_is(ear: Any, line: Pty) -> None:
    """A line that stands still takes nothing: what waits here is dropped, and of the driver's what the far end has not got."""

    async def scene() -> None:
        port = ear.port(line.path)
        await port.open()
        while not port._unsent:
            assert port.write(b"SET 512\r\n" * 100)
        port.drop_unsent()
        assert port.unsent_bytes == 0
        assert port.write(b"SET 0\r\n")
        heard = b""
        while not heard.endswith(b"SET 0\r\n"):
            heard += await gather(line.fd, 1)
        assert len(heard) <= 4096 + len(b"SET 0\r\n")
        assert not asyncio.get_running_loop().remove_writer(ear.opened[-1])
        port.close()
        port.drop_unsent()

    asyncio.run(scene())
