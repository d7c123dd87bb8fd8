"""Connections to the OPC UA server are bounded in number, silence and length, whatever the library's own bounds are."""

import asyncio
from collections.abc import Callable
from importlib import import_module
from types import SimpleNamespace
from typing import Any
from unittest.mock import AsyncMock

import pytest

from gateway.fieldbus.settings import ServerSettings
from gateway.telemetry.opcua_connections import MOST_SUBSCRIPTIONS, SilenceTimer, bound_connections, bound_publishing

IDLE_S = 0.02


class Wire(asyncio.Transport):
    """What the library has of a client."""

    is_cut = False

    def __init__(self, host: str = "10.0.0.9") -> None:
        super().__init__()
        self._host = host

    def get_extra_info(self, name: str, default: Any = None) -> Any:
        return (self._host, 40000) if name == "peername" else default

    def abort(self) -> None:
        self.is_cut = True

    close = abort


@pytest.fixture
def connect(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Return what makes a bounded protocol; its server is one for all."""
    asyncua = pytest.importorskip("asyncua")
    wire = import_module("asyncua.server.binary_server_asyncio")
    monkeypatch.setattr(wire, "OPCUAProtocol", wire.OPCUAProtocol)
    said: list[str] = []
    bound_connections(wire, lambda _, sentence: said.append(sentence), ServerSettings(connections=6, idle_s=IDLE_S))
    inner = asyncua.Server().iserver

    def make(transport: Wire) -> Any:
        one = wire.BinaryServer(inner, "127.0.0.1", 0, None)._make_protocol()
        one.connection_made(transport)
        return one

    make.said = said  # type: ignore[attr-defined]
    return make


async def leave(*protocols: Any) -> None:
    """As the loop does it for a transport that is closed; the library's tasks end."""
    for one in protocols:
        one.connection_lost(None)
    for task in {task for one in protocols for task in one.closing_tasks}:
        await task
    await asyncio.sleep(0)


@pytest.mark.parametrize("header", [b"HELF\xff\xff\xff\x7f", b"OPNF\xff\xff\xff\x7f"])
def test_a_request_that_has_no_end_is_cut_and_holds_no_memory(connect: Callable[..., Any], header: bytes) -> None:
    """The library waited for the 2 GB that a header promises: 120 MB sent were 120 MB held, of anybody who connects."""

    async def scene() -> None:
        transport = Wire()
        one = connect(transport)
        one.data_received(header)
        for _ in range(16):
            one.data_received(bytes(65536))
            assert len(one._buffer) <= 1 << 20
        assert transport.is_cut
        await leave(one)

    asyncio.run(scene())


def test_one_address_has_four_connections_and_all_have_the_most_allowed(connect: Callable[..., Any]) -> None:
    async def scene() -> None:
        transports = [Wire("10.0.0.9" if place < 5 else f"10.0.1.{place}") for place in range(8)]
        all_of_them = [connect(transport) for transport in transports]
        assert [transport.is_cut for transport in transports] == [False] * 4 + [True, False, False, True]
        assert [sentence.split(":")[0] for sentence in connect.said] == ["W230 10.0.0.9", "W230 10.0.1.7"]  # type: ignore[attr-defined]
        await leave(*all_of_them)
        again = connect(Wire())
        assert not again.transport.is_cut, "places are given back"
        await leave(again)

    asyncio.run(scene())


def test_who_is_silent_is_cut_and_who_speaks_is_not(connect: Callable[..., Any]) -> None:
    async def scene() -> None:
        silent, speaking = Wire("10.0.0.1"), Wire("10.0.0.2")
        first, second = connect(silent), connect(speaking)
        assert first._silence._longest_s == IDLE_S, "as the settings say"
        now, pauses_s = asyncio.get_running_loop().time, list[float]()
        while not silent.is_cut:
            spoke_s = now()
            second.data_received(b"H")
            await asyncio.sleep(0.001)
            pauses_s.append(now() - spoke_s)
        assert not speaking.is_cut or max(pauses_s) >= IDLE_S, "unless this machine stood still for as long"
        await leave(first, second)

    asyncio.run(asyncio.wait_for(scene(), 20.0))


def test_whose_connection_is_lost_leaves_no_subscription_behind(connect: Callable[..., Any]) -> None:
    """The library kept it for ten minutes, for a client to come back to: a program that died every second had a whole core
    publish to nobody, and then no other had a place."""
    ua = pytest.importorskip("asyncua").ua

    async def scene() -> None:
        gone, stays = connect(Wire("10.0.0.1")), connect(Wire("10.0.0.2"))
        server = gone.processor.iserver
        for one in (gone, stays):
            session = one.processor.session = server.create_session("far", external=True)
            session.state = type(session.state).Activated
            await session.create_subscription(ua.CreateSubscriptionParameters(), None)
        await leave(gone)
        await asyncio.sleep(0)
        left = [one.session_id for one in server.subscription_service.subscriptions.values()]
        assert left == [stays.processor.session.session_id]
        await leave(stays)

    asyncio.run(scene())


def test_no_session_takes_the_subscriptions_of_all(connect: Callable[..., Any]) -> None:
    """By a thousand of them one client shut all others out, and each was published to five times a second."""
    asyncua = pytest.importorskip("asyncua")

    async def scene() -> None:
        greedy, other = connect(Wire("10.0.0.1")), connect(Wire("10.0.0.2"))
        server = greedy.processor.iserver
        bound_publishing(server.subscription_service, 0.2)
        for one in (greedy, other):
            one.processor.session = server.create_session("far", external=True)
            one.processor.session.state = type(one.processor.session.state).Activated
        published, wanted = AsyncMock(), asyncua.ua.CreateSubscriptionParameters()
        for _ in range(MOST_SUBSCRIPTIONS):
            await greedy.processor.session.create_subscription(wanted, published)
        with pytest.raises(asyncua.ua.uaerrors.BadTooManySubscriptions):
            await greedy.processor.session.create_subscription(wanted, published)
        await other.processor.session.create_subscription(wanted, published)
        assert len(server.subscription_service.subscriptions) == MOST_SUBSCRIPTIONS + 1
        await leave(greedy, other)
        await asyncio.gather(greedy._ending, other._ending)

    asyncio.run(scene())


class Timers:
    """A loop of which only the timers count, moved by hand."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.waiting: list[tuple[float, Callable[[], None]]] = []

    def time(self) -> float:
        return self.now_s

    def call_later(self, delay_s: float, what: Callable[[], None]) -> Any:
        entry = (self.now_s + delay_s, what)
        self.waiting.append(entry)
        return SimpleNamespace(cancel=lambda: self.waiting.remove(entry))

    def pass_to(self, now_s: float) -> None:
        self.now_s = now_s
        due = [entry for entry in self.waiting if entry[0] <= now_s]
        self.waiting = [entry for entry in self.waiting if entry[0] > now_s]
        for _, what in due:
            what()


def test_silence_is_counted_from_the_last_word_and_a_closed_timer_waits_for_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    timers, called = Timers(), list[float]()
    monkeypatch.setattr(asyncio, "get_running_loop", lambda: timers)
    timer, other = (SilenceTimer(10.0, lambda: called.append(timers.now_s)) for _ in range(2))
    timers.pass_to(106.0)
    timer.note_heard()
    timers.pass_to(110.0)
    assert called == [110.0], "the other one has heard nothing"
    timers.pass_to(116.0)
    assert called == [110.0, 116.0]
    third = SilenceTimer(10.0, lambda: called.append(timers.now_s))
    third.note_heard()
    timers.pass_to(120.0)
    third.note_heard()
    timers.pass_to(126.0)  # it has looked, and waits for the rest
    third.close()
    assert timers.waiting == [] and other is not timer
    timers.pass_to(200.0)
    assert called == [110.0, 116.0]


@pytest.mark.parametrize(("wanted_ms", "given_ms"), [(0.001, 200.0), (199.0, 200.0), (1000.0, 1000.0)])
def test_no_client_is_told_more_often_than_there_is_something_new(wanted_ms: float, given_ms: float) -> None:
    """An interval is in milliseconds: by one of a microsecond a client took a whole core."""
    service = SimpleNamespace(create_subscription=AsyncMock(), subscriptions={})
    create, params = service.create_subscription, SimpleNamespace(RequestedPublishingInterval=wanted_ms)
    bound_publishing(service, 0.2)
    asyncio.run(service.create_subscription(params, None, 7))
    assert create.await_count == 1 and params.RequestedPublishingInterval == given_ms
