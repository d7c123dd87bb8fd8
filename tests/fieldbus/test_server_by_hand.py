"""The one timer of a server: how often it looks, what it forgets, and that it ends with the server; and how that lets go."""

import asyncio

import pytest

from gateway.fieldbus import ModbusTcpServer, ServerSettings
from gateway.fieldbus.connection import Connection
from tests.fieldbus.by_hand import READ, READ_ANSWER, framed
from tests.fieldbus.conftest import HandClock, HandTransport, put
from tests.modbus.memory_bank import MemoryBank

FAR = "192.0.2.7"


async def started(clock: HandClock, settings: ServerSettings) -> ModbusTcpServer:
    server = ModbusTcpServer(MemoryBank(words=10), settings, on_peer_closed=print, log=print, clock=clock)
    await server.start("127.0.0.1", 0)
    return server


def test_a_deadline_is_looked_at_four_times_within_itself_until_the_server_ends() -> None:
    async def scene(settings: ServerSettings, period_s: float) -> None:
        clock = HandClock()
        server = await started(clock, settings)
        for _ in range(3):
            (timer,) = clock._waiting
            assert timer.at_s - clock.now_s == pytest.approx(period_s)
            clock.advance(period_s)
        await server.close()
        assert all(timer.cancelled for timer in clock._waiting)

    for settings, period_s in (
        (ServerSettings(), 0.5),
        (ServerSettings(partial_s=1.0), 0.25),
        (ServerSettings(idle_s=0.2), 0.05),
    ):
        asyncio.run(scene(settings, period_s))


def test_the_rates_of_those_who_left_are_forgotten_while_it_runs() -> None:
    """An allowed network may have many addresses, and none of them is to leave something for good."""

    async def scene() -> None:
        clock = HandClock()
        server = await started(clock, ServerSettings())
        assert server._shared
        peers = server._shared.peers
        rate = peers.rate(FAR, clock.time())
        assert rate
        rate.spend()
        clock.advance(10.0)
        assert peers.rate(FAR, clock.time()) is not rate
        await server.close()

    asyncio.run(scene())


def test_who_is_closed_gets_a_moment_to_read_its_answers_and_is_cut_then() -> None:
    async def scene() -> None:
        server = await started(HandClock(), ServerSettings())
        assert server._shared
        connection, far = Connection(server._shared), HandTransport("127.0.0.1", stuck=True)
        far.connection = connection
        connection.connection_made(far)  # type: ignore[arg-type]
        put(connection, far, framed(READ))
        closing = asyncio.create_task(server.close())
        while not far.ended:
            await asyncio.sleep(0)
        assert far.ended == "closed" and far.written == framed(READ_ANSWER)
        await closing
        assert far.ended == "aborted" and not server.peers

    asyncio.run(scene())


def test_who_was_still_arriving_when_it_closed_is_not_let_in() -> None:
    async def scene() -> None:
        server = await started(HandClock(), ServerSettings())
        shared = server._shared
        assert shared
        await server.close()
        late, far = Connection(shared), HandTransport("127.0.0.1")
        far.connection = late
        late.connection_made(far)  # type: ignore[arg-type]
        assert far.ended == "aborted" and not shared.connections

    asyncio.run(scene())
