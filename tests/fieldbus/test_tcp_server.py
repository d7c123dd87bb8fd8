"""The server on a real loopback socket, on both event loops."""

import asyncio
import socket
from typing import Any

import pytest

from gateway.modbus import pdu
from tests.fieldbus.by_hand import READ, READ_ANSWER, end_of, exchange, framed


def test_five_reads_in_one_segment_get_five_answers_in_order(run: Any, serve: Any) -> None:
    async def main() -> bytes:
        async with serve() as running:
            return await exchange(running.port, b"".join(framed(READ, number) for number in range(5)), 5 * 13)

    assert run(main()) == b"".join(framed(READ_ANSWER, number) for number in range(5))


def test_two_writes_in_one_segment_are_both_applied(run: Any, serve: Any) -> None:
    async def main() -> None:
        async with serve() as running:
            first, second = pdu.write_register_request(1, 500), pdu.write_registers_request(5, b"\x00\x07\x00\x08")
            found = await exchange(running.port, framed(first, 8) + framed(second, 9), 12 + 12)
            assert found == framed(first, 8) + framed(second[:5], 9)
            assert [write[:2] for write in running.bank.writes] == [(1, b"\x01\xf4"), (5, b"\x00\x07\x00\x08")]

    run(main())


def test_a_request_split_at_every_byte_is_answered(run: Any, serve: Any) -> None:
    async def main() -> None:
        request = framed(pdu.write_registers_request(0, bytes(6)), 3)
        async with serve() as running:
            reader, writer = await running.connect()
            for place in range(1, len(request)):
                writer.write(request[:place])
                await writer.drain()
                await exchange(running.port, framed(READ), 13)  # the server has been round: the first part has arrived
                writer.write(request[place:])
                assert await reader.readexactly(12) == framed(bytes.fromhex("10 0000 0003"), 3)
            writer.close()
            await writer.wait_closed()

    run(main())


@pytest.mark.parametrize(
    "broken_hex",
    [
        "0001 0000 0000 01 03",
        "0001 0000 0001 01 03",
        "0001 0000 ffff 01 03",
        "0001 0000 00ff 01 03",
        "0001 0007 0006 01 03",
    ],
)
def test_what_is_no_modbus_is_closed_after_the_answers_before_it(run: Any, serve: Any, broken_hex: str) -> None:
    async def main() -> None:
        async with serve() as running:
            reader, writer = await running.connect()
            writer.write(framed(READ) + bytes.fromhex(broken_hex))
            assert await end_of(reader) == framed(READ_ANSWER)
            assert running.log[0][0] == "framing"
            assert await exchange(running.port, framed(READ), 13) == framed(READ_ANSWER), "others go on"
            writer.close()

    run(main())


def test_half_a_request_is_not_waited_for_for_ever(run: Any, serve: Any) -> None:
    async def main() -> None:
        async with serve(partial_s=0.05) as running:
            reader, writer = await running.connect()
            writer.write(framed(READ)[:5])
            assert await end_of(reader) == b""
            assert running.log[0][0] == "partial"
            writer.close()

    run(main())


def test_an_idle_connection_is_closed(run: Any, serve: Any) -> None:
    async def main() -> None:
        async with serve(idle_s=0.05) as running:
            reader, writer = await running.connect()
            assert await end_of(reader) == b""
            assert running.log[0][0] == "idle"
            writer.close()

    run(main())


def test_one_connection_too_many_is_closed_and_the_others_live(run: Any, serve: Any) -> None:
    async def main() -> None:
        async with serve(connections=2) as running:
            ends = [await running.connect() for _ in range(2)]
            for reader, writer in ends:
                writer.write(framed(READ))
                await reader.readexactly(13)
            extra_reader, extra_writer = await running.connect()
            assert await end_of(extra_reader) == b""
            for reader, writer in ends:
                writer.write(framed(READ))
                assert await reader.readexactly(13) == framed(READ_ANSWER)
            for writer in (extra_writer, *(writer for _reader, writer in ends)):
                writer.close()

    run(main())


def test_a_client_that_never_reads_is_cut_and_holds_no_memory(run: Any, serve: Any) -> None:
    async def main() -> None:
        async with serve() as running:
            raw = socket.socket()
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            raw.setblocking(False)
            loop = asyncio.get_running_loop()
            await loop.sock_connect(raw, ("127.0.0.1", running.port))
            flood = b"".join(framed(pdu.read_request(3, 0, 125)) for _ in range(500))
            with pytest.raises(ConnectionError):
                while True:
                    await loop.sock_sendall(raw, flood)
            await running.until(lambda: bool(running.closed))
            assert running.log[0][0] == "unread"
            assert running.server.peers == ()
            raw.close()

    run(main())


def test_a_patient_pipeliner_that_reads_gets_everything(run: Any, serve: Any) -> None:
    async def main() -> None:
        async with serve() as running:
            reader, writer = await running.connect()
            count = 3000
            writer.write(b"".join(framed(READ, number) for number in range(count)))
            found = await reader.readexactly(13 * count)
            assert found == b"".join(framed(READ_ANSWER, number) for number in range(count))
            writer.close()

    run(main())


def test_answers_are_sent_without_waiting_for_more(run: Any, serve: Any) -> None:
    async def main() -> None:
        async with serve() as running:
            reader, writer = await running.connect()
            writer.write(framed(READ))
            await reader.readexactly(13)
            (connection,) = running.server._shared.connections
            found = connection._transport.get_extra_info("socket")
            assert found.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
            writer.close()

    run(main())


def test_a_peer_is_known_by_address_and_told_when_it_leaves(run: Any, serve: Any) -> None:
    async def main() -> None:
        async with serve() as running:
            reader, writer = await running.connect()
            writer.write(framed(pdu.write_register_request(0, 1)))
            await reader.readexactly(12)
            host, port = writer.get_extra_info("sockname")
            assert (running.bank.writes[0][2].host, running.bank.writes[0][2].port) == (host, port)
            assert str(running.server.peers[0]) == f"{host}:{port}"
            writer.close()
            await running.until(lambda: bool(running.closed))
            assert running.closed[0].port == port

    run(main())


def test_a_client_that_sends_and_hangs_up_still_has_its_write_applied(run: Any, serve: Any) -> None:
    async def main() -> None:
        async with serve() as running:
            reader, writer = await running.connect()
            writer.write(framed(pdu.write_register_request(0, 9)))
            writer.write_eof()
            assert await end_of(reader) == framed(pdu.write_register_request(0, 9))
            writer.close()

    run(main())


def test_a_bug_in_the_bank_reaches_the_loop_and_only_its_connection_ends(run: Any, serve: Any) -> None:
    async def main() -> None:
        caught: list[Any] = []
        asyncio.get_running_loop().set_exception_handler(lambda _loop, found: caught.append(found["exception"]))
        async with serve() as running:
            running.bank.write_bits = lambda *_: 1 // 0
            other_reader, other_writer = await running.connect()
            reader, writer = await running.connect()
            writer.write(framed(bytes.fromhex("05 0000 ff00")))
            assert await end_of(reader) == b""
            other_writer.write(framed(READ))
            assert await other_reader.readexactly(13) == framed(READ_ANSWER)
            assert [type(error) for error in caught] == [ZeroDivisionError]
            writer.close()
            other_writer.close()

    run(main())
