"""Where a port is said to be: opened there at once and once, and nothing is kept of what does not open."""

import asyncio
import os
from pathlib import Path
from typing import Any

import pytest

from gateway.devices import SerialSettings
from gateway.ports import PortError, Pty
from gateway.ports.opening import open_descriptor


def test_a_lost_port_that_is_said_to_be_where_it_was_is_opened_at_once_and_only_once(
    ear: Any, line: Pty, tmp_path: Path
) -> None:
    name = tmp_path / "by-id"
    name.symlink_to(line.path)

    async def scene() -> None:
        port, other = ear.port(str(name)), Pty()
        await port.open()
        name.unlink()
        line.close()
        await ear.until(lambda: bool(ear.losses))
        waiting = port._reopening
        name.symlink_to(other.path)
        port.move(str(name))
        assert (port.is_open, len(ear.opened), len(ear.losses)) == (True, 2, 1)
        assert waiting is not None and waiting.cancelled()
        port.close()
        other.close()

    asyncio.run(scene())


def test_a_port_that_did_not_open_at_first_is_opened_where_it_is_said_to_be(ear: Any, tmp_path: Path) -> None:
    async def scene() -> None:
        port, here = ear.port(str(tmp_path / "nothing")), Pty()
        with pytest.raises(PortError) as failure:
            await port.open()
        port.begin_lost(failure.value)
        port.move(here.path)
        assert (port.is_open, port.path, len(ear.losses)) == (True, here.path, 1)
        port.close()
        here.close()

    asyncio.run(scene())


def test_a_pty_that_does_not_open_is_remembered_by_nobody(ear: Any, line: Pty) -> None:
    """Each try would cost a descriptor."""
    holder = open_descriptor(line.path, SerialSettings(baud=9600))
    port = ear.port(line.path, is_simulated=True)
    with pytest.raises(PortError, match="E103"):
        asyncio.run(port.open())
    os.close(holder)
    assert port._identity._descriptor == -1
