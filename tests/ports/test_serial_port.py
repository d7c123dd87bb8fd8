"""The port class on real ptys: bytes both ways, the plug pulled, the lock, bytes that do not fit, the last bytes."""

import asyncio
import errno
import fcntl
import os
import sys
import termios
from pathlib import Path
from typing import Any, get_args

import pytest

from gateway.devices import SerialSettings
from gateway.devices.line_settings import Baud
from gateway.ports import PortError, Pty
from gateway.ports.opening import open_descriptor
from gateway.ports.serial_port import MOST_UNSENT_BYTES
from tests.ports.raw_bytes import gather, read_all


def test_bytes_pass_both_ways_with_their_time_of_arrival(ear: Any, line: Pty) -> None:
    async def scene() -> None:
        port = ear.port(line.path)
        await port.open()
        assert len(ear.opened) == 1
        assert port.write(b"SET 512\r\n")
        assert await gather(line.fd, 9) == b"SET 512\r\n"
        os.write(line.fd, b"512\r\n")
        await ear.until(lambda: ear.data == b"512\r\n")
        assert ear.times_s == sorted(ear.times_s)
        port.close()
        assert not port.is_open

    asyncio.run(scene())


def test_no_byte_is_changed_by_the_terminal(ear: Any, line: Pty) -> None:
    every_byte = bytes(range(256))

    async def scene() -> None:
        port = ear.port(line.path)
        await port.open()
        port.write(every_byte)
        assert await gather(line.fd, 256) == every_byte
        os.write(line.fd, every_byte)
        await ear.until(lambda: len(ear.data) == 256)
        assert ear.data == every_byte
        port.close()

    asyncio.run(scene())


@pytest.mark.parametrize("baud", [9600, 19200, 115200, 12345])
def test_the_master_sees_the_clients_speed(ear: Any, line: Pty, baud: int) -> None:
    async def scene() -> None:
        port = ear.port(line.path, SerialSettings(baud=baud))
        await port.open()
        assert line.client_baud() == baud
        port.close()

    asyncio.run(scene())


def test_what_came_before_the_opening_is_dropped(ear: Any, line: Pty) -> None:
    async def scene() -> None:
        os.write(line.fd, b"old")
        port = ear.port(line.path)
        await port.open()
        os.write(line.fd, b"new")
        await ear.until(lambda: bool(ear.data))
        assert ear.data == b"new"
        port.close()

    asyncio.run(scene())


def test_flushing_drops_what_was_not_read_yet(ear: Any, line: Pty) -> None:
    async def scene() -> None:
        port = ear.port(line.path)
        await port.open()
        os.write(line.fd, b"stale")
        assert port.flush_input() == 5
        assert port.flush_input() == 0
        assert port.is_open
        os.write(line.fd, b"fresh")
        await ear.until(lambda: bool(ear.data))
        assert ear.data == b"fresh"
        port.close()

    asyncio.run(scene())


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
        port.close()
        port.close()
        assert port._reopening is None
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
        line.close()
        await ear.until(lambda: ear.opened[-1] == -1, timeout_s=5.0)
        monkeypatch.undo()
        port.close()
        return waits_s

    assert asyncio.run(scene()) == pytest.approx([0.1, 0.2, 0.4, 0.8, 1.6, 2.0, 2.0, 2.0])


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


def successor_of(line: Pty, most: int = 32) -> list[Pty]:
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


def test_the_second_opener_is_told_who_holds_the_port(ear: Any, line: Pty) -> None:
    async def scene() -> None:
        first, second = ear.port(line.path), ear.port(line.path)
        await first.open()
        with pytest.raises(
            PortError, match=f"E103 {line.path} is held by this very process; stop that one first"
        ) as told:
            await second.open()
        assert told.value.exit_code == 69
        first.close()
        await second.open()
        second.close()

    asyncio.run(scene())


def test_a_port_held_by_another_process_names_it(ear: Any, line: Pty) -> None:
    script = "import serial, sys; p = serial.Serial(sys.argv[1], exclusive=True); print('held', flush=True); sys.stdin.read()"

    async def scene() -> None:
        pipe = asyncio.subprocess.PIPE
        child = await asyncio.create_subprocess_exec(sys.executable, "-c", script, line.path, stdin=pipe, stdout=pipe)
        assert child.stdout is not None
        assert await child.stdout.readline() == b"held\n"
        with pytest.raises(PortError) as told:
            await ear.port(line.path).open()
        assert f"(pid {child.pid})" in str(told.value)
        assert "python" in str(told.value)
        await child.communicate(b"")  # closes its stdin, which ends it
        port = ear.port(line.path)
        await port.open()
        port.close()

    asyncio.run(scene())


def test_a_descriptor_given_to_the_guardian_does_not_keep_the_port_locked(ear: Any, line: Pty) -> None:
    """A copied descriptor is the same open file, lock included; one left by a killed process must be unlocked by hand."""

    async def scene() -> None:
        first, second = ear.port(line.path), ear.port(line.path)
        await first.open()
        guardians = os.dup(ear.opened[0])
        first.close()
        await second.open()
        second.close()
        fcntl.flock(guardians, fcntl.LOCK_EX)
        with pytest.raises(PortError, match="E103"):
            await second.open()
        fcntl.flock(guardians, fcntl.LOCK_UN)
        await second.open()
        assert os.write(guardians, b"SET 0\r\n") == 7
        second.close()
        os.close(guardians)

    asyncio.run(scene())


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
        while port.write(b"x" * 1000):
            pass
        await ear.until(lambda: bool(ear.losses))
        assert ear.losses[0].code == "E111"
        assert f"more than {MOST_UNSENT_BYTES} unsent" in str(ear.losses[0])
        port.close()

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


@pytest.mark.parametrize("parity", ["none", "even", "odd"])
def test_every_speed_and_frame_that_a_profile_may_name_can_be_set(line: Pty, parity: Any) -> None:
    for baud in get_args(Baud):
        settings = SerialSettings(baud=baud, parity=parity, data_bits=7 if parity == "odd" else 8, stop_bits=2)
        descriptor = open_descriptor(line.path, settings)
        try:
            assert line.client_baud() == baud
        finally:
            os.close(descriptor)
        line.set_client_baud(9600)
        line.set_client_baud(baud)
        assert line.client_baud() == baud
