"""A system that has nothing left for a new connection: told once, nothing is cut, and taken when there is room. Both loops."""

import asyncio
import errno
import os
import resource
import socket
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from gateway.fieldbus import listener
from tests.fieldbus.by_hand import READ, READ_ANSWER, framed


@contextmanager
def no_descriptor_left() -> Iterator[None]:
    """This process may open nothing more: a limit of what it has, every hole filled."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    limit = max(int(path.name) for path in Path("/proc/self/fd").iterdir()) + 20
    resource.setrlimit(resource.RLIMIT_NOFILE, (limit, hard))
    taken = []
    try:
        with pytest.raises(OSError, match="Too many open files"):
            while True:
                taken.append(os.open("/dev/null", os.O_RDONLY))
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        for descriptor in taken:
            os.close(descriptor)


@contextmanager
def accepting(error: OSError, listening: Any) -> Iterator[list[int]]:
    """Every accept fails; yields how often it was tried, as [count]."""
    tries = [0]

    class Failing:
        def __getattr__(self, name: str) -> Any:
            return getattr(listening._sockets[0], name)

        def accept(self) -> Any:
            tries[0] += 1
            raise error

    accept = listening._accept
    listening._accept = lambda _: accept(Failing())
    real = listening._sockets[0]
    listening._loop.remove_reader(real)
    listening._await_connection(real)
    try:
        yield tries
    finally:
        del listening._accept
        listening._loop.remove_reader(real)
        listening._await_connection(real)


def test_without_descriptors_who_is_connected_goes_on_and_who_comes_waits(run: Any, serve: Any) -> None:
    async def main() -> None:
        defects: list[Any] = []
        asyncio.get_running_loop().set_exception_handler(lambda loop, context: defects.append(context))
        async with serve() as running:
            reader, writer = await running.connect()
            late = [socket.socket() for _ in range(3)]
            with no_descriptor_left():
                for each in late:
                    each.connect(("127.0.0.1", running.port))
                    each.sendall(framed(READ))
                await running.until(lambda: running.log)
                writer.write(framed(READ))
                assert await reader.readexactly(13) == framed(READ_ANSWER)
            assert [sentence[:4] for _, sentence in running.log] == ["W248"]
            assert "Too many open files" in running.log[0][1]
            for each in late:
                each.setblocking(False)
                assert await asyncio.get_running_loop().sock_recv(each, 13) == framed(READ_ANSWER)
                each.close()
            writer.close()
        assert defects == []

    run(main())


@pytest.mark.parametrize("number", [errno.ENFILE, errno.ENOMEM, errno.ENOBUFS])
def test_a_shortage_is_told_once_a_minute_and_waited_for(
    number: int, run: Any, serve: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(listener, "_PAUSE_S", 0.001)

    async def main() -> None:
        async with serve() as running:
            with accepting(OSError(number, os.strerror(number)), running.server._listener) as tries:
                reader, writer = await running.connect()
                writer.write(framed(READ))
                async with asyncio.timeout(10):
                    while tries[0] < 5:
                        await asyncio.sleep(0.001)
            assert await reader.readexactly(13) == framed(READ_ANSWER)
            assert [sentence for _, sentence in running.log] == [
                f"W248 new connections wait, those that are open go on: {os.strerror(number)}"
            ]
            writer.close()

    run(main())


def test_a_shortage_that_comes_back_behind_a_quiet_time_is_told_again(
    run: Any, serve: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(listener, "_PAUSE_S", 0.001)
    monkeypatch.setattr(listener, "_QUIET_S", 0.0)  # each pause between two tries is longer

    async def main() -> None:
        async with serve() as running:
            with accepting(OSError(errno.ENOMEM, "no room"), running.server._listener) as tries:
                _, writer = await running.connect()
                async with asyncio.timeout(10):
                    while tries[0] < 3:
                        await asyncio.sleep(0.001)
            assert [sentence[:4] for _, sentence in running.log][:3] == ["W248"] * 3
            writer.close()

    run(main())


def test_a_connection_that_was_lost_before_it_was_taken_is_no_defect(run: Any, serve: Any) -> None:
    async def main() -> None:
        defects: list[Any] = []
        asyncio.get_running_loop().set_exception_handler(lambda loop, context: defects.append(context))
        async with serve() as running:
            with accepting(OSError(errno.EHOSTUNREACH, "no route"), running.server._listener) as tries:
                reader, writer = await running.connect()
                writer.write(framed(READ))
                async with asyncio.timeout(10):
                    while tries[0] < 3:
                        await asyncio.sleep(0.001)
            assert await reader.readexactly(13) == framed(READ_ANSWER)
            assert (running.log, defects) == ([], [])
            writer.close()

    run(main())


def test_a_connection_that_is_lost_while_it_is_taken_keeps_no_descriptor(run: Any, serve: Any) -> None:
    async def main() -> None:
        async with serve() as running:
            with socket.create_server(("127.0.0.1", 0)) as elsewhere:
                far = socket.create_connection(elsewhere.getsockname())
                far.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                accepted, _ = elsewhere.accept()
                far.close()
            with pytest.raises(OSError, match="not connected"):
                accepted.getpeername()
            running.server._listener._ready.add(accepted, running.server._listener._make())
            async with asyncio.timeout(10):
                while accepted.fileno() >= 0:
                    await asyncio.sleep(0)
            assert running.server.peers == ()

    run(main())


def test_closing_while_a_connection_is_refused_leaves_no_timer(run: Any, serve: Any) -> None:
    async def main() -> None:
        async with serve() as running:
            with no_descriptor_left(), socket.socket(fileno=_taken_before()) as late:
                late.connect(("127.0.0.1", running.port))
                await running.until(lambda: running.log)
            pauses = running.server._listener._pauses
            await running.server.close()
            assert pauses
            assert all(pause.cancelled() for pause in pauses)

    def _taken_before() -> int:
        return spare.detach()

    spare = socket.socket()
    run(main())


def test_both_families_listen_on_one_port_each_by_itself_and_never_wait() -> None:
    """A socket of IPv6 that took IPv4 too would keep the other from being opened, and know its callers by other names."""

    async def scene() -> None:
        try:
            six = await listener._bind("::", 0)
        except OSError:
            pytest.skip("no IPv6 here")
        port = six[0].getsockname()[1]
        four = await listener._bind("0.0.0.0", port)
        try:
            assert [one.getsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY) for one in six] == [1] * len(six)
            assert all(one.gettimeout() == 0.0 for one in (*six, *four))
            with pytest.raises(OSError, match="Address already in use"):
                await listener._bind("0.0.0.0", port)
        finally:
            for one in (*six, *four):
                one.close()

    asyncio.run(scene())
