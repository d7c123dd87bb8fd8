"""Each way a port does not open, and the sentence that helps. Root has every permission, so EACCES is injected."""

import asyncio
import errno
import grp
import os
import pwd
import termios
from pathlib import Path
from typing import Any

import pytest
import serial
from serial import SerialException

from gateway.devices import SerialSettings
from gateway.ports import PortError, PortEvents, Pty, SerialPort
from gateway.ports.errors import explain_loss, explain_open_failure

root_only = pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a port to another group")


async def told_by_opening(ear: Any, path: str) -> PortError:
    with pytest.raises(PortError) as told:
        await ear.port(path).open()
    return told.value


def denying(path: str) -> Any:
    really_open = os.open

    def opened(name: Any, *arguments: Any, **keywords: Any) -> int:
        if name == path:
            raise PermissionError(errno.EACCES, "Permission denied", name)
        return really_open(name, *arguments, **keywords)

    return opened


@pytest.fixture
def anna(monkeypatch: pytest.MonkeyPatch) -> None:
    """A user anna, a group dialout that owns the port."""
    monkeypatch.setattr(
        "gateway.ports.errors.pwd.getpwuid", lambda number: pwd.struct_passwd(("anna", "", 7, 7, "", "", ""))
    )
    monkeypatch.setattr("gateway.ports.errors.grp.getgrgid", lambda number: grp.struct_group(("dialout", "", 20, [])))
    monkeypatch.setattr("gateway.ports.errors.grp.getgrnam", lambda name: grp.struct_group(("dialout", "", 20, [])))


@root_only
def test_no_permission_names_the_group_the_user_and_the_command(
    ear: Any, line: Pty, anna: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    os.chmod(line.path, 0o660)  # noqa: PTH101
    os.chown(line.path, -1, 20)
    monkeypatch.setattr("serial.serialposix.os.open", denying(line.path))
    told = asyncio.run(told_by_opening(ear, line.path))
    assert (told.code, told.exit_code) == ("E101", 77)
    assert told.sentence == (
        f"{line.path} belongs to group dialout, and user anna is not in it: sudo usermod -aG dialout anna, then log in again"
    )


@root_only
def test_a_member_who_has_not_logged_in_again_is_told_so(
    line: Pty, anna: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    os.chmod(line.path, 0o660)  # noqa: PTH101
    os.chown(line.path, -1, 20)
    monkeypatch.setattr(
        "gateway.ports.errors.grp.getgrnam", lambda name: grp.struct_group(("dialout", "", 20, ["anna"]))
    )
    assert "log in again" in str(explain_open_failure(line.path, PermissionError(errno.EACCES, ""), []))
    assert "usermod" not in str(explain_open_failure(line.path, PermissionError(errno.EACCES, ""), []))


@root_only
@pytest.mark.parametrize("mode", [0o600, 0o640, 0o620])
def test_a_port_for_root_alone_needs_a_group_first(line: Pty, anna: None, mode: int) -> None:
    """Or of which its group may do half: to be in that one helps nobody."""
    os.chmod(line.path, mode)  # noqa: PTH101
    os.chown(line.path, -1, 20)
    told = str(explain_open_failure(line.path, PermissionError(errno.EACCES, ""), []))
    assert f"(mode {mode:04o} anna:dialout): sudo chgrp dialout {line.path}" in told


def test_a_missing_port_lists_those_that_are_there(ear: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    present = ["/dev/serial/by-id/usb-FTDI_A10K-if00", "/dev/serial/by-id/usb-Prolific-if00"]
    monkeypatch.setattr("gateway.ports.opening.present_paths", lambda: present)
    told = asyncio.run(told_by_opening(ear, "/dev/serial/by-id/usb-FTDI_A1OK-if00"))
    assert told.code == "E102"
    assert f"Present: {', '.join(present)}; did you mean {present[0]}?" in told.sentence


def test_no_port_at_all_asks_for_the_adapter(ear: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gateway.ports.opening.present_paths", list)
    told = asyncio.run(told_by_opening(ear, "/dev/ttyUSB7"))
    assert str(told) == "E102 /dev/ttyUSB7 is not there, nor is any other serial port: is the adapter plugged in?"


def test_a_ring_of_links_is_told_once_and_without_a_number(ear: Any, tmp_path: Path) -> None:
    """'[Errno 40] could not open port X: [Errno 40] Too many levels of symbolic links: X' was."""
    ring = tmp_path / "ring"
    ring.symlink_to("ring")
    told = asyncio.run(told_by_opening(ear, str(ring)))
    assert told.sentence == f"{ring} does not open as a serial port: Too many levels of symbolic links"


def test_a_file_is_no_serial_port(ear: Any, tmp_path: Path) -> None:
    file = tmp_path / "port"
    file.write_text("")
    for path in (str(file), str(tmp_path), "/dev/null", "/dev/ptmx"):
        told = asyncio.run(told_by_opening(ear, path))
        assert str(told) == f"E102 {path} is no serial port: `force-gateway ports` lists those of this machine"


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (SerialException(errno.EACCES, "could not open port"), "E101"),
        (OSError(errno.EPERM, "not permitted"), "E101"),
        (termios.error(errno.ENODEV, "No such device"), "E102"),
        (OSError(errno.ENXIO, "No such device or address"), "E102"),
        (SerialException("Could not configure port: (5, 'Input/output error')"), "E102"),
        (SerialException(errno.EAGAIN, "Could not exclusively lock port"), "E103"),
        (OSError(errno.EBUSY, "busy"), "E103"),
    ],
)
def test_three_families_of_exceptions_become_one(error: Exception, code: str) -> None:
    assert explain_open_failure("/dev/ttyX", error, []).code == code
    assert explain_loss("/dev/ttyX", error).code == "E102"


@pytest.mark.parametrize("family", [SerialException("gone"), OSError(errno.EIO, "gone"), termios.error(5, "gone")])
def test_a_failure_while_configuring_leaks_no_descriptor(
    ear: Any, line: Pty, monkeypatch: pytest.MonkeyPatch, family: Exception
) -> None:
    """The conftest's descriptor check is the judge."""

    def failing(*arguments: Any) -> None:
        raise family

    monkeypatch.setattr(serial.serialposix.termios, "tcsetattr", failing)
    assert asyncio.run(told_by_opening(ear, line.path)).code == "E102"
    monkeypatch.undo()
    monkeypatch.setattr("gateway.ports.opening._return_eagain_for_nothing", failing)
    assert asyncio.run(told_by_opening(ear, line.path)).code == "E102"


def test_a_speed_that_no_uart_has_is_told(ear: Any, line: Pty, monkeypatch: pytest.MonkeyPatch) -> None:
    def refusing(*arguments: Any, **keywords: Any) -> None:
        raise ValueError("Invalid baud rate: 1")

    monkeypatch.setattr("serial.serialposix.Serial._reconfigure_port", refusing)
    assert "Invalid baud rate" in str(asyncio.run(told_by_opening(ear, line.path)))


def test_a_port_that_its_owner_refuses_is_free_for_the_next_try(line: Pty) -> None:
    """It would be held by this very process until that ends."""
    refusals = [PortError("E111", "another device answers")]

    def on_open(descriptor: int) -> None:
        if refusals:
            raise refusals.pop()

    async def scene() -> None:
        port = SerialPort(
            line.path, SerialSettings(baud=9600), PortEvents(lambda *_: None, lambda failure: None, on_open)
        )
        with pytest.raises(PortError, match="another device answers"):
            await port.open()
        assert not port.is_open and not port.write(b"SET 0\r\n")
        await port.open()
        assert port.is_open and port.write(b"SET 0\r\n")
        port.close()

    asyncio.run(scene())
