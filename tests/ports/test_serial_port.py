"""The port class on real ptys: bytes both ways, the plug pulled, the lock, bytes that do not fit, the last bytes."""

import asyncio
import errno
import fcntl
import os
import sys
from pathlib import Path
from typing import Any, get_args

import pytest
import serial

from gateway.devices import SerialSettings
from gateway.devices.line_settings import Baud
from gateway.ports import PortError, Pty
from gateway.ports.opening import open_descriptor
from gateway.ports.port import CHUNK_BYTES
from tests.ports.raw_bytes import gather


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


def test_flushing_drops_all_of_it_however_long_it_is(ear: Any, line: Pty, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gateway.ports.serial_port._DROPPED_BYTES", 2)

    async def scene() -> None:
        port = ear.port(line.path)
        await port.open()
        os.write(line.fd, b"stale")
        assert port.flush_input() == 5
        port.close()

    asyncio.run(scene())


def test_a_device_that_talks_faster_than_it_can_be_read_does_not_hold_up_a_setpoint(
    ear: Any, line: Pty, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is there is dropped ahead of each question."""
    reads = 0

    def endless(descriptor: int, size: int) -> bytes:
        nonlocal reads
        reads += 1
        assert reads < 1000, "it is read for ever"
        return b"7" * size

    async def scene() -> None:
        port = ear.port(line.path)
        await port.open()
        with monkeypatch.context() as patch:
            patch.setattr(os, "read", endless)
            assert port.flush_input() >= 4096 + 65536, "all that a terminal keeps"
        port.close()

    asyncio.run(scene())


def test_what_has_piled_up_comes_in_pieces_that_take_little_of_a_turn(ear: Any, line: Pty) -> None:
    """4 kB of crafted bytes in one piece took 26 ms in the search for a frame; other ports and the tick have turns between."""

    async def scene() -> None:
        sizes: list[int] = []
        port = ear.port(line.path)
        port._on_bytes = lambda chunk, now_s: (sizes.append(len(chunk)), ear.on_bytes(chunk, now_s))
        await port.open()
        sent = bytes(range(1, 256)) * 8
        os.write(line.fd, sent)
        await ear.until(lambda: len(ear.data) == len(sent))
        assert ear.data == sent
        assert max(sizes) <= CHUNK_BYTES
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


def test_a_pty_behind_a_link_is_opened_without_the_frame_that_it_has_not(line: Pty, tmp_path: Path) -> None:
    link = tmp_path / "regulator"
    link.symlink_to(line.path)
    for _ in range(2):  # once it was told of a parity it takes nothing more
        os.close(open_descriptor(str(link), SerialSettings(baud=19200, parity="even")))
        assert line.client_baud() == 19200


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


def test_the_driver_is_told_the_frame_that_the_device_has(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pty has no frame: only the call tells."""
    told: list[dict[str, object]] = []

    def open_nothing(path: str, baud: int, **settings: object) -> None:
        told.append({"baud": baud, **settings})
        raise OSError(errno.ENOENT, "not there")

    monkeypatch.setattr(serial, "Serial", open_nothing)
    with pytest.raises(PortError):
        open_descriptor("/dev/ttyNONE", SerialSettings(baud=19200, data_bits=7, parity="even", stop_bits=2))
    frame = {"baud": 19200, "bytesize": 7, "parity": serial.PARITY_EVEN, "stopbits": 2, "exclusive": True}
    assert frame.items() <= told[0].items()
