"""Who asks for nothing, or for half of something, keeps no place from others."""

import asyncio
import socket
from contextlib import suppress

import pytest
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse
from starlette.routing import Route
from uvicorn import Config
from uvicorn.server import ServerState

from gateway.web import bounded_http

WHOLE = b"GET / HTTP/1.1\r\nHost: a\r\n\r\n"
CHUNKED, BAD_CHUNK = WHOLE[:-2] + b"Transfer-Encoding: chunked\r\n\r\n", b"zz\r\n"


async def connected() -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """A caller of a page that answers."""

    async def index(request: object) -> PlainTextResponse:
        return PlainTextResponse("here")

    config = Config(Starlette(routes=[Route("/", index)]), ws="none", lifespan="off", log_config=None)
    config.load()
    ours, far = socket.socketpair()
    await asyncio.get_running_loop().connect_accepted_socket(
        lambda: bounded_http.BoundedHttpProtocol(config, ServerState(), {}), ours
    )
    return await asyncio.open_connection(sock=far)


async def heard(said: bytes, then: bytes = b"") -> bytes:
    """What a caller reads until it is hung up on, which says one thing, and then a byte of another again and again."""
    reader, writer = await connected()
    writer.write(said)

    async def drip() -> None:
        while then:
            writer.write(then)
            await asyncio.sleep(0.002)

    dripping = asyncio.create_task(drip())
    answer = b""
    with suppress(ConnectionError):  # what was still said to somebody who had hung up
        async with asyncio.timeout(5.0):
            while piece := await reader.read(1024):
                answer += piece
    dripping.cancel()
    writer.close()
    return answer


@pytest.mark.parametrize(
    ("said", "then"),
    [
        (b"", b""),
        (WHOLE[:20], b""),
        (WHOLE[:20], b"X"),
        (b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 99\r\n\r\nabc", b""),
    ],
)
def test_half_a_request_is_hung_up_on(monkeypatch: pytest.MonkeyPatch, said: bytes, then: bytes) -> None:
    monkeypatch.setattr(bounded_http, "WHOLE_REQUEST_S", 0.05)
    assert b"here" not in asyncio.run(heard(said, then))


def test_a_whole_request_is_answered_and_half_of_the_next_one_is_not_waited_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(bounded_http, "WHOLE_REQUEST_S", 0.05)
    assert asyncio.run(heard(WHOLE + WHOLE, b"GET ")).count(b"here") == 2


@pytest.mark.parametrize("takes", [False, True])
def test_who_takes_nothing_of_an_answer_is_hung_up_on_and_who_takes_it_is_not(
    monkeypatch: pytest.MonkeyPatch, takes: bool
) -> None:
    """A frozen page kept its place among the connections, and its stream, for as long as its machine was awake."""
    monkeypatch.setattr(bounded_http, "UNREAD_S", 5.0 if takes else 0.05)
    size = 4_000_000

    class Noted(bounded_http.BoundedHttpProtocol):
        def connection_lost(self, exc: Exception | None) -> None:
            super().connection_lost(exc)
            self.lost.set()

    async def large(request: object) -> PlainTextResponse:
        return PlainTextResponse(size * "x")

    async def scene() -> None:
        config = Config(Starlette(routes=[Route("/", large)]), ws="none", lifespan="off", log_config=None)
        config.load()
        server = Noted(config, ServerState(), {})
        server.lost = asyncio.Event()
        ours, far = socket.socketpair()
        far.setblocking(False)
        loop = asyncio.get_running_loop()
        await loop.connect_accepted_socket(lambda: server, ours)
        await loop.sock_sendall(far, WHOLE)
        async with asyncio.timeout(10.0):
            taken = 0
            while takes and taken < size:
                taken += len(await loop.sock_recv(far, 100_000))
            if takes:
                assert server._unread_timer is None and not server.lost.is_set()
                far.close()
            await server.lost.wait()
        far.close()

    asyncio.run(scene())


def test_who_opens_connections_and_asks_for_nothing_shuts_nobody_out() -> None:
    """Two hundred and fifty-six, opened again every ten seconds, and each Stop of the page was refused as one too many."""
    most = 4

    async def index(request: object) -> PlainTextResponse:
        return PlainTextResponse("here")

    async def scene() -> None:
        app = Starlette(routes=[Route("/", index)])
        config = Config(app, ws="none", lifespan="off", log_config=None, limit_concurrency=most)
        config.load()
        state, loop = ServerState(), asyncio.get_running_loop()

        async def connect() -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
            ours, far = socket.socketpair()
            await loop.connect_accepted_socket(lambda: bounded_http.BoundedHttpProtocol(config, state, {}), ours)
            return await asyncio.open_connection(sock=far)

        silent = [await connect() for _ in range(3 * most)]
        assert len(state.connections) < most
        for each, _ in silent[: 1 - most]:
            assert await each.read() == b"", "those that were silent for longest have gone"
        reader, writer = await connect()
        writer.write(WHOLE)
        assert b"here" in await reader.readuntil(b"here")
        writer.write(WHOLE)  # who asks stays, whoever comes behind
        more = [await connect() for _ in range(most - 2)]
        for one, _ in tuple(more):
            assert b"here" in await reader.readuntil(b"here")
            more.append(await connect())
            assert await one.read() == b"", "and not who has asked since"
            writer.write(WHOLE)
        assert b"here" in await reader.readuntil(b"here")
        for _, each in (*silent, (reader, writer), *more):
            each.close()
        while state.connections:
            await asyncio.sleep(0)

    asyncio.run(asyncio.wait_for(scene(), 10.0))


def test_who_takes_nothing_of_an_answer_shuts_nobody_out_either() -> None:
    """The login's style, asked for without end and not read, kept every place for half a minute, and then anew."""
    most = 4

    async def answer(request: Request) -> PlainTextResponse:
        return PlainTextResponse("x" * 4_000_000 if request.query_params else "here")

    async def scene() -> bytes:
        app = Starlette(routes=[Route("/", answer)])
        config = Config(app, ws="none", lifespan="off", log_config=None, limit_concurrency=most)
        config.load()
        state, loop = ServerState(), asyncio.get_running_loop()
        pairs = [socket.socketpair() for _ in range(most)]
        for ours, far in pairs:
            far.setblocking(False)
            await loop.connect_accepted_socket(lambda: bounded_http.BoundedHttpProtocol(config, state, {}), ours)
            await loop.sock_sendall(far, WHOLE if far is pairs[-1][1] else 2 * WHOLE.replace(b"/ ", b"/?large=1 ", 1))
            await asyncio.sleep(0.01)
        heard = await loop.sock_recv(pairs[-1][1], 1000)
        for _, far in pairs:
            far.close()
        while state.connections:
            await asyncio.sleep(0)
        return heard

    assert b"here" in asyncio.run(asyncio.wait_for(scene(), 10.0))


@pytest.mark.parametrize("upgrade", [b"websocket", b"h2c"])
def test_who_offers_another_protocol_is_answered_in_this_one(upgrade: bytes, caplog: pytest.LogCaptureFixture) -> None:
    """As some HTTP clients do in each request: the events told the gateway's owner to install a WebSocket library."""
    offering = WHOLE[:-2] + b"Connection: Upgrade, close\r\nUpgrade: " + upgrade + b"\r\n\r\n"
    assert b"here" in asyncio.run(heard(offering))
    assert caplog.messages == []


@pytest.mark.parametrize(
    ("said", "answered"),
    [(b"no HTTP at all\r\n\r\n", 1), (CHUNKED + BAD_CHUNK, 1), (CHUNKED.replace(b"GET", b"HEAD") + BAD_CHUNK, 0)],
)
def test_what_turns_out_to_be_no_http_is_answered_once_at_most_and_is_no_fault_of_this_program(
    said: bytes, answered: int, caplog: pytest.LogCaptureFixture
) -> None:
    """A bad chunk was answered twice: the log told of errors of the application, with their whole tracebacks."""
    heard_of_it = asyncio.run(heard(said))
    assert (heard_of_it.count(b"HTTP/1.1 400"), heard_of_it.count(b"HTTP/1.1")) == (answered, answered)
    assert [record.getMessage() for record in caplog.records if record.levelname == "ERROR"] == []


def test_who_is_answered_and_goes_on_with_no_http_is_hung_up_on_without_a_word(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async def scene() -> bytes:
        reader, writer = await connected()
        writer.write(CHUNKED)
        await reader.readuntil(b"here")
        writer.write(BAD_CHUNK)
        rest = await reader.read()
        writer.close()
        return rest

    assert b"HTTP/1.1" not in asyncio.run(asyncio.wait_for(scene(), 10.0))
    assert [record.getMessage() for record in caplog.records if record.levelname == "ERROR"] == []
