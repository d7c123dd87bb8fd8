"""Where the server listens, who gets in, and how it ends, on both event loops."""

import asyncio
import socket
import threading
from ipaddress import ip_network
from typing import Any

import pytest

from gateway.fieldbus import BindError, ModbusTcpServer, ServerSettings
from gateway.fieldbus.listener import Listener
from gateway.modbus import pdu
from tests.fieldbus.by_hand import READ, READ_ANSWER, end_of, exchange, framed
from tests.modbus.memory_bank import MemoryBank


@pytest.mark.parametrize("host", ["127.0.0.1", "127.0.0.2"])
def test_it_listens_where_it_was_told_to_and_nowhere_else(run: Any, serve: Any, host: str) -> None:
    """A server for this machine alone that heard the network would need no allow-list for it."""

    async def main() -> None:
        async with serve(host) as running:
            listening = running.server._listener._sockets
            assert [each.getsockname()[0] for each in listening] == [host]

    run(main())


def test_a_machine_that_refuses_every_thread_is_listened_on_all_the_same(
    run: Any, serve: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The address was looked up in a thread, and the refusal of one was a traceback; a name still needs it, and says so."""

    def refuse(thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    async def main() -> None:
        with monkeypatch.context() as machine:
            machine.setattr(threading.Thread, "start", refuse)
            async with serve() as running:
                assert (await exchange(running.port, framed(READ), 13))[7:] == READ_ANSWER
            if isinstance(asyncio.get_running_loop(), asyncio.BaseEventLoop):  # uvloop has threads of its own
                with pytest.raises(OSError, match="no thread to ask for no-such-name: can't start new thread"):
                    await Listener.open(asyncio.Protocol, "no-such-name", 0, print)

    run(main())


def test_closing_leaves_nothing_behind_and_frees_the_port(run: Any, serve: Any) -> None:
    async def main() -> None:
        async with serve() as running:
            ends = [await running.connect() for _ in range(5)]
            for reader, writer in ends:
                writer.write(framed(READ))
                await reader.readexactly(13)
            await running.server.close()
            assert running.server.peers == ()
            assert all([await end_of(reader) == b"" for reader, _writer in ends])
            assert asyncio.all_tasks() == {asyncio.current_task()}
            again = ModbusTcpServer(MemoryBank(), ServerSettings(), on_peer_closed=print, log=print)
            assert (await again.start("127.0.0.1", running.port))[1] == running.port
            await again.close()
            await again.close()
            for _reader, writer in ends:
                writer.close()

    run(main())


def test_a_client_that_does_not_read_cannot_hold_up_closing(run: Any, serve: Any) -> None:
    async def main() -> None:
        async with serve(write_buffer_bytes=1 << 30) as running:
            raw = socket.socket()
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            raw.setblocking(False)
            loop = asyncio.get_running_loop()
            await loop.sock_connect(raw, ("127.0.0.1", running.port))
            while not running.server.peers or not _waiting_bytes(running):
                await loop.sock_sendall(raw, framed(pdu.read_request(3, 0, 125)) * 500)
                await exchange(running.port, framed(READ), 13)
            await running.server.close()
            assert running.server.peers == ()
            raw.close()

    def _waiting_bytes(running: Any) -> int:
        return max(len(c._transport._waiting) for c in running.server._shared.connections)

    run(main())


def test_the_last_answer_is_sent_when_the_server_closes_at_once(run: Any, serve: Any) -> None:
    async def main() -> None:
        async with serve() as running:
            closing: list[asyncio.Task[None]] = []

            def close_at_once(*_: object) -> None:
                closing.append(asyncio.ensure_future(running.server.close()))

            running.bank.write_registers = close_at_once
            reader, writer = await running.connect()
            writer.write(framed(pdu.write_register_request(0, 1)))
            assert await end_of(reader) == framed(pdu.write_register_request(0, 1))
            await closing[0]
            writer.close()

    run(main())


def test_a_bind_beyond_loopback_needs_an_allow_list(run: Any, serve: Any) -> None:
    async def main() -> None:
        with pytest.raises(BindError, match=r"E122 0\.0\.0\.0"):
            async with serve("0.0.0.0"):
                pass

    run(main())


def test_beyond_loopback_whoever_is_not_in_the_list_is_closed(run: Any, serve: Any) -> None:
    async def main() -> None:
        async with serve("0.0.0.0", allow=(ip_network("192.0.2.0/24"),)) as running:
            reader, writer = await running.connect()
            assert await end_of(reader) == b""
            assert "none of the allowed networks" in running.log[0][1]
            writer.close()
        async with serve("0.0.0.0", allow=(ip_network("127.0.0.0/8"),)) as running:
            assert await exchange(running.port, framed(READ), 13) == framed(READ_ANSWER)

    run(main())


def test_a_port_that_is_taken_is_an_oserror_and_leaves_nothing(run: Any, serve: Any) -> None:
    async def main() -> None:
        async with serve() as running:
            second = ModbusTcpServer(MemoryBank(), ServerSettings(), on_peer_closed=print, log=print)
            with pytest.raises(OSError, match="in use"):
                await second.start("127.0.0.1", running.port)
            await second.close()

    run(main())
