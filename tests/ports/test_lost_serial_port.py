"""A serial port that is lost, held by another, or found elsewhere: told once, and opened again."""

import asyncio
import errno
import os
import termios
from pathlib import Path
from typing import Any

import pytest

from gateway.devices import SerialSettings
from gateway.ports import PortError, Pty
from gateway.ports.errors import explain_loss
from gateway.ports.opening import open_descriptor
from tests.ports.raw_bytes import gather, read_all
from tests.service.supervisor.scripted_children import open_descriptors


def test_a_pulled_plug_is_told_once_and_the_port_opens_again(ear: Any, line: Pty, tmp_path: Path) -> None:
    """By-id names are symlinks: after the replug the same name leads to another device."""
    name = tmp_path / "usb-FTDI-port0"
    name.symlink_to(line.path)

    async def scene() -> None:
        port = ear.port(str(name))
        await port.open()
        line.close()
        await ear.until(lambda: bool(ear.losses))
        assert ear.losses[0].code == "E102"
        assert "unplugged?" in str(ear.losses[0])
        assert not port.is_open
        assert not port.write(b"SET 900\r\n")
        other = Pty()
        name.unlink()
        name.symlink_to(other.path)
        await ear.until(lambda: len(ear.opened) == 2)
        assert read_all(other.fd) == b""  # nothing of before the loss is sent after it
        assert port.write(b"SET 0\r\n")
        assert await gather(other.fd, 7) == b"SET 0\r\n"
        assert (len(ear.losses), len(ear.opened)) == (1, 2)
        port.close()
        other.close()

    asyncio.run(scene())


def test_a_closed_port_stays_closed(ear: Any, line: Pty) -> None:
    async def scene() -> None:
        port = ear.port(line.path)
        await port.open()
        line.close()
        await ear.until(lambda: bool(ear.losses))
        waiting = port._reopening
        port.close()
        port.close()
        assert port._reopening is None and waiting is not None
        assert waiting.cancelled()
        assert not port.write(b"x")

    asyncio.run(scene())


def test_reopening_waits_longer_each_time_up_to_two_seconds(
    ear: Any, line: Pty, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = tmp_path / "by-id"
    name.symlink_to(line.path)

    async def scene() -> list[float]:
        loop = asyncio.get_running_loop()
        port = ear.port(str(name))
        await port.open()
        waits_s: list[float] = []

        def at_once(delay_s: float, callback: Any) -> asyncio.TimerHandle:
            waits_s.append(delay_s)
            return loop.call_at(
                loop.time(), callback if len(waits_s) < 8 else ear.on_open, *((-1,) * (len(waits_s) == 8))
            )

        monkeypatch.setattr(loop, "call_later", at_once)
        name.unlink()  # its number may be another pty's at once, of whoever runs beside this
        line.close()
        await ear.until(lambda: ear.opened[-1] == -1, timeout_s=5.0)
        monkeypatch.undo()
        port.close()
        return waits_s

    assert asyncio.run(scene()) == pytest.approx([0.1, 0.2, 0.4, 0.8, 1.6, 2.0, 2.0, 2.0])


def test_a_port_that_was_back_is_looked_for_soon_when_it_is_lost_again(ear: Any, line: Pty, tmp_path: Path) -> None:
    name, delays_s = tmp_path / "by-id", list[float]()
    name.symlink_to(line.path)

    async def scene() -> None:
        port, other = ear.port(str(name)), Pty()

        def at_once(delay_s: float) -> None:
            delays_s.append(delay_s)
            if len(delays_s) == 4:
                name.symlink_to(other.path)
            asyncio.get_running_loop().call_soon(port._reopen)

        port._reopen_after = at_once
        await port.open()
        name.unlink()
        line.close()
        await ear.until(lambda: len(ear.opened) == 2)
        other.close()
        await ear.until(lambda: len(ear.losses) == 2)
        port.close()

    asyncio.run(scene())
    assert delays_s[:5] == pytest.approx([0.1, 0.2, 0.4, 0.8, 0.1])


def test_a_lost_port_that_is_found_elsewhere_is_opened_there_at_once(ear: Any, line: Pty) -> None:
    async def scene() -> None:
        port, other = ear.port(line.path), Pty()
        await port.open()
        port.move(line.path)  # nothing is lost: an open port is still good
        line.close()
        await ear.until(lambda: bool(ear.losses))
        port.move(other.path)
        assert (port.is_open, port.path, len(ear.opened), len(ear.losses)) == (True, other.path, 2, 1)
        port.close()
        other.close()

    asyncio.run(scene())


def successor_of(line: Pty, most: int = 64) -> list[Pty]:
    """Ptys of somebody else, the last of them under the number of this one, which has lost its device."""
    others = [Pty()]
    while others[-1].path != line.path:
        assert len(others) < most, "the kernel gives the lowest free number"
        others.append(Pty())
    return others


def test_a_lost_ptys_number_is_not_its_name(ear: Any, line: Pty) -> None:
    """Somebody else's line is neither opened nor locked, however often the port tries."""

    async def scene() -> None:
        port, path = ear.port(line.path, is_simulated=True), line.path
        await port.open()
        line.close()
        await ear.until(lambda: bool(ear.losses))
        line.path = path
        others = successor_of(line)
        for _ in range(3):
            port._reopen()
        assert not port.is_open
        assert port._reopening is None, "and not later either"
        os.close(open_descriptor(path, SerialSettings(baud=9600)))
        here = Pty()
        port.move(here.path)
        assert (port.is_open, port.path) == (True, here.path)
        port.close()
        for other in (*others, here):
            other.close()

    asyncio.run(scene())


def test_a_pty_that_a_rig_names_by_its_number_is_found_again_under_it(ear: Any, line: Pty) -> None:
    """Nobody will say where else it is, and whoever wrote the number means it."""

    async def scene() -> None:
        port, path = ear.port(line.path), line.path
        await port.open()
        line.close()
        await ear.until(lambda: bool(ear.losses))
        line.path = path
        others = successor_of(line)
        await ear.until(lambda: len(ear.opened) == 2)
        assert port.is_open
        port.close()
        for other in others:
            other.close()

    asyncio.run(scene())


def test_a_port_that_is_told_of_another_place_gives_up_what_it_has(ear: Any, line: Pty) -> None:
    """What it has is not the device: that one has been started anew."""

    async def scene() -> None:
        port, here = ear.port(line.path), Pty()
        await port.open()
        port.move(here.path)
        assert (port.is_open, port.path, len(ear.losses)) == (True, here.path, 1)
        os.close(open_descriptor(line.path, SerialSettings(baud=9600)))
        port.close()
        port.move(line.path)
        assert (port.is_open, port.path) == (False, line.path), "a closed port stays closed until it is opened there"
        here.close()

    asyncio.run(scene())


def test_a_failure_of_the_old_place_is_none_of_the_new_one(
    ear: Any, line: Pty, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A write fails, and before the loop comes to it the port has moved."""

    async def scene() -> None:
        port, here = ear.port(line.path), Pty()
        await port.open()
        with monkeypatch.context() as patched:
            patched.setattr(os, "write", lambda *_: (_ for _ in ()).throw(OSError(errno.EIO, "")))
            assert not port.write(b"SET 0\r\n")
        port.move(here.path)
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        assert (port.is_open, len(ear.losses)) == (True, 1)
        port.close()
        here.close()

    asyncio.run(scene())


def test_a_port_that_is_held_at_the_beginning_is_opened_as_soon_as_it_is_free(ear: Any, line: Pty) -> None:
    async def scene() -> None:
        holder = open_descriptor(line.path, SerialSettings(baud=9600))
        port = ear.port(line.path)
        with pytest.raises(PortError, match="E103") as held:
            await port.open()
        port.begin_lost(held.value)
        assert ear.losses == [held.value]
        os.close(holder)
        await ear.until(lambda: bool(ear.opened))
        assert port.is_open
        port.close()

    asyncio.run(scene())


@pytest.mark.parametrize(
    "failure",
    [
        OSError(errno.EIO, "Input/output error"),
        OSError(errno.ENXIO, "No such device"),
        PermissionError(errno.EACCES, ""),
    ],
)
def test_a_failing_write_is_a_loss_that_is_told_outside_the_write(
    ear: Any, line: Pty, monkeypatch: pytest.MonkeyPatch, failure: OSError
) -> None:
    def failing(descriptor: int, data: bytes) -> int:
        raise failure

    async def scene() -> None:
        port = ear.port(line.path)
        await port.open()
        with monkeypatch.context() as patched:
            patched.setattr("gateway.ports.serial_port.os.write", failing)
            assert not port.write(b"SET 512\r\n")
        assert ear.losses == []
        assert not port.is_open
        await ear.until(lambda: bool(ear.losses))
        port.close()

    asyncio.run(scene())


@pytest.mark.parametrize("is_open", [False, True])
def test_a_plug_that_bounces_while_it_is_opened_is_a_port_that_does_not_open(
    ear: Any, line: Pty, monkeypatch: pytest.MonkeyPatch, is_open: bool
) -> None:
    """And no error of ours, which would end the process: nothing is left open, and a lost port is tried again."""

    async def scene() -> None:
        port, before = ear.port(line.path), open_descriptors()
        if is_open:
            await port.open()
            port._lose(explain_loss(line.path, None))
        with monkeypatch.context() as patched:
            patched.setattr("gateway.ports.serial_port.settings_of", lambda _: (_ for _ in ()).throw(gone))
            if is_open:
                port._reopen()
            else:
                with pytest.raises(PortError, match="E102"):
                    await port.open()
        assert not port.is_open and open_descriptors() == before
        if is_open:
            await ear.until(lambda: len(ear.opened) == 2)
            assert port.is_open
        port.close()

    gone = termios.error(errno.EIO, "Input/output error")
    asyncio.run(scene())
