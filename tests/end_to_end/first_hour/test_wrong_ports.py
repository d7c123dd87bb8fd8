"""A serial port that does not open, asked for at the command line: which one, why, what to do, and the exit code."""

import errno
import fcntl
import os
from collections.abc import Iterator
from typing import Any

import pytest
from click.testing import CliRunner, Result

from gateway.cli.main import command

DEVICE, PERMISSION = 69, 77


@pytest.fixture
def port() -> Iterator[str]:
    """A pseudo-terminal with nobody behind it."""
    near, far = os.openpty()
    yield os.ttyname(far)
    os.close(near)
    os.close(far)


def probed(port: str) -> Result:
    return CliRunner().invoke(command, ["check", "stream-st-gs", "--probe", "--port", port])


def test_a_port_that_this_user_may_not_open_names_the_group(port: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Injected, for root has every permission."""
    really_open = os.open

    def refuse(name: Any, *arguments: Any, **keywords: Any) -> int:
        if name == port:
            raise PermissionError(errno.EACCES, "Permission denied", name)
        return really_open(name, *arguments, **keywords)

    monkeypatch.setattr("serial.serialposix.os.open", refuse)
    told = probed(port)
    assert told.exit_code == PERMISSION
    assert f"E101 {port}" in told.output
    assert "group" in told.output or "usermod" in told.output or "may not" in told.output


def test_a_port_that_is_not_there_is_named(port: str) -> None:
    told = probed(port + "9")
    assert told.exit_code == DEVICE
    assert f"E102 {port}9 is not there" in told.output


def test_a_port_that_another_process_holds_says_so(port: str) -> None:
    holder = os.open(port, os.O_RDWR | os.O_NOCTTY)
    try:
        fcntl.flock(holder, fcntl.LOCK_EX)
        told = probed(port)
    finally:
        os.close(holder)
    assert told.exit_code == DEVICE
    assert f"E103 {port}" in told.output
