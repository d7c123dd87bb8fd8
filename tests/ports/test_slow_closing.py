"""A driver that keeps whoever closes its port waiting, for bytes that its adapter does not take, holds up no loop."""

import asyncio
import errno
import os
import threading
from typing import Any

import pytest

from gateway.ports import Pty, closing
from gateway.ports.errors import explain_loss
from gateway.processes.disk_worker import DiskWorker


@pytest.fixture
def has_queue(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pty has none: its driver passes on at once."""
    monkeypatch.setattr(closing, "queued_bytes", lambda descriptor: 3)


@pytest.mark.usefixtures("has_queue")
def test_the_loop_goes_on_and_opens_the_port_again_once_it_is_closed(
    ear: Any, line: Pty, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a hung adapter on a bus of masters it stood for half a minute, and the force of another master went."""
    may_close, really_close = threading.Event(), closing._close

    def close_late(descriptor: int) -> None:
        assert may_close.wait(10.0), "the loop stands still"
        really_close(descriptor)

    async def scene() -> None:
        monkeypatch.setattr(closing, "_close", close_late)
        port, tried = ear.port(line.path), list[float]()
        wait = port._reopen_after

        def note(delay_s: float) -> None:
            tried.append(delay_s)
            wait(0.001)

        monkeypatch.setattr(port, "_reopen_after", note)
        await port.open()
        port._lose(explain_loss(line.path, None))
        assert ear.losses and not port.is_open
        while len(tried) < 3:
            await asyncio.sleep(0.001)
        assert len(ear.opened) == 1, "who opens it meanwhile waits in its place"
        may_close.set()
        await ear.until(lambda: len(ear.opened) == 2)
        port.close()

    asyncio.run(asyncio.wait_for(scene(), 20.0))


@pytest.mark.usefixtures("has_queue")
def test_without_a_thread_it_is_closed_all_the_same(ear: Any, line: Pty, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(worker: DiskWorker, work: Any) -> None:
        raise OSError(errno.EAGAIN, "no thread")

    async def scene() -> None:
        monkeypatch.setattr(DiskWorker, "_submit", refuse)
        port = ear.port(line.path)
        await port.open()
        port.close()
        await asyncio.sleep(0)
        with pytest.raises(OSError, match="Bad file descriptor"):
            os.fstat(ear.opened[0])

    asyncio.run(asyncio.wait_for(scene(), 20.0))
