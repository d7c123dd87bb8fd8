"""Another program on an open port: the lock binds only who asks for it, and a terminal program sets its own speed and mode.

A regulator hears nothing at another speed, not even the safe voltage, and what is behind a program that has ended stays set.
"""

import asyncio
import os
import select
import termios
from typing import Any

import pytest

from gateway.devices import SerialSettings
from gateway.ports import PortError, PortEvents, Pty, SerialPort
from gateway.ports.opening import open_descriptor, settings_of
from tests.ports.raw_bytes import gather


def other_speed(line: Pty) -> None:
    mode = termios.tcgetattr(line._slave)
    mode[4] = mode[5] = termios.B1200
    termios.tcsetattr(line._slave, termios.TCSANOW, mode)


def other_mode(line: Pty) -> None:
    """As `stty sane` does: lines are edited, echoed, and end otherwise."""
    mode = termios.tcgetattr(line._slave)
    mode[0] |= termios.ICRNL | termios.IXON
    mode[1] |= termios.OPOST | termios.ONLCR
    mode[3] |= termios.ICANON | termios.ECHO | termios.ISIG
    termios.tcsetattr(line._slave, termios.TCSANOW, mode)


def watched(ear: Any, path: str, told: list[PortError], settings: SerialSettings | None = None) -> SerialPort:
    events = PortEvents(ear.on_bytes, ear.on_lost, ear.on_open, on_restored=told.append)
    return SerialPort(path, settings or SerialSettings(baud=9600), events)


@pytest.mark.parametrize("change", [other_speed, other_mode])
def test_what_another_program_sets_is_set_again_and_told(ear: Any, line: Pty, change: Any) -> None:
    told = list[PortError]()

    async def scene() -> None:
        port = watched(ear, line.path, told)
        await port.open()
        before = settings_of(ear.opened[0])
        change(line)
        assert settings_of(ear.opened[0]) != before
        port._look_at_settings()  # what its timer does, without waiting for it
        assert settings_of(ear.opened[0]) == before and line.client_baud() == 9600
        port.write(b"SET 0\r\n")
        assert await gather(line.fd, 7) == b"SET 0\r\n"
        os.write(line.fd, b"0\r")
        await ear.until(lambda: ear.data == b"0\r")
        port._look_at_settings()
        port.close()

    asyncio.run(scene())
    assert [error.code for error in told] == ["E103"] and line.path in str(told[0])
    assert (len(ear.opened), ear.losses) == (1, []), "nothing was lost: a force may be held all the while"


def test_the_look_comes_by_itself(ear: Any, line: Pty) -> None:
    """Takes two looks, 0.2 s."""
    told = list[PortError]()

    async def scene() -> None:
        port = watched(ear, line.path, told)
        await port.open()
        for count in (1, 2):
            other_mode(line)
            async with asyncio.timeout(5.0):
                while len(told) < count:
                    await asyncio.sleep(0.01)
        port.close()

    asyncio.run(scene())
    assert len(told) == 2


def test_a_speed_without_a_name_is_set_again_by_opening_anew(ear: Any, line: Pty) -> None:
    told = list[PortError]()

    async def scene() -> None:
        port = watched(ear, line.path, told, SerialSettings(baud=12345))
        await port.open()
        other_speed(line)
        port._look_at_settings()
        assert [loss.code for loss in ear.losses] == ["E103"]
        await ear.until(lambda: len(ear.opened) == 2)
        assert line.client_baud() == 12345
        port.close()

    asyncio.run(scene())
    assert told == []


def test_a_driver_that_does_not_take_them_back_is_opened_anew(
    ear: Any, line: Pty, monkeypatch: pytest.MonkeyPatch
) -> None:
    """tcsetattr succeeds where a part of it is taken: each look would tell that it is set again, and nothing would be."""
    told = list[PortError]()

    async def scene() -> None:
        port = watched(ear, line.path, told)
        await port.open()
        other_speed(line)
        with monkeypatch.context() as deaf:
            deaf.setattr(termios, "tcsetattr", lambda *_: None)
            port._look_at_settings()
        assert [loss.code for loss in ear.losses] == ["E103"]
        await ear.until(lambda: len(ear.opened) == 2)
        assert line.client_baud() == 9600
        port.close()

    asyncio.run(scene())
    assert told == []


def test_a_port_that_is_gone_is_lost_by_its_hang_up_and_nothing_else(ear: Any, line: Pty) -> None:
    told = list[PortError]()

    async def scene() -> None:
        port = watched(ear, line.path, told)
        await port.open()
        line.close()
        port._look_at_settings()
        await ear.until(lambda: bool(ear.losses))
        port.close()

    asyncio.run(scene())
    assert (told, [loss.code for loss in ear.losses]) == ([], ["E102"])


def test_a_terminal_that_somebody_stops_sends_again(ear: Any, line: Pty) -> None:
    """Before it is opened, or while it is open: that outlives the program which did it."""

    async def scene() -> None:
        termios.tcflow(line._slave, termios.TCOOFF)
        port = ear.port(line.path)
        await port.open()
        port.write(b"SET 0\r\n")
        assert await gather(line.fd, 7) == b"SET 0\r\n"
        termios.tcflow(line._slave, termios.TCOOFF)
        port.write(b"SET 1\r\n")
        port._look_at_settings()
        assert await gather(line.fd, 7) == b"SET 1\r\n"
        port.close()

    asyncio.run(scene())


def test_a_line_that_was_stopped_before_it_is_opened_sends_from_its_first_byte_on(line: Pty) -> None:
    """The first one is the safe voltage, and the probe that opens a port looks at no settings later."""
    termios.tcflow(line._slave, termios.TCOOFF)
    descriptor = open_descriptor(line.path, SerialSettings(baud=9600))
    os.write(descriptor, b"SET 0")
    os.set_blocking(line.fd, False)
    heard = os.read(line.fd, 16) if select.select([line.fd], [], [], 5.0)[0] else b""
    os.close(descriptor)
    assert heard == b"SET 0"


def test_a_port_that_has_nothing_to_say_is_not_read_as_one_that_is_gone(line: Pty) -> None:
    """As pyserial leaves it, both were no bytes."""
    descriptor = open_descriptor(line.path, SerialSettings(baud=9600))
    try:
        with pytest.raises(BlockingIOError):
            os.read(descriptor, 1)
        os.write(line.fd, b"x")
        assert select.select([descriptor], [], [], 5.0)[0] and os.read(descriptor, 8) == b"x"
    finally:
        os.close(descriptor)
