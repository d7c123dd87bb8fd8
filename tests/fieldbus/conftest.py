"""A connection with its transport and its clock in hand, and a server on loopback; their bank remembers its writes."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

import pytest

from gateway.fieldbus import ModbusTcpServer, ServerSettings
from gateway.fieldbus.connection import Connection, ServerState
from gateway.fieldbus.peers import Peers
from gateway.fieldbus.rate_limits import LogLimiter
from gateway.fieldbus.socket_transport import READ_BYTES
from gateway.modbus import Peer
from tests.certificates import Folder, store_all
from tests.modbus.memory_bank import MemoryBank


class HandClock:
    """Time that a test moves; has what a connection needs of an event loop."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self._waiting: list[HandTimer] = []

    def time(self) -> float:
        return self.now_s

    def call_later(self, delay: float, callback: Callable[[], None]) -> "HandTimer":
        timer = HandTimer(self.now_s + delay, callback)
        self._waiting.append(timer)
        return timer

    def advance(self, seconds: float) -> None:
        end_s = self.now_s + seconds
        while due := sorted((timer for timer in self._waiting if timer.at_s <= end_s), key=lambda timer: timer.at_s):
            self._waiting.remove(due[0])
            self.now_s = max(self.now_s, due[0].at_s)
            due[0].run()
        self.now_s = end_s


@dataclass(eq=False)
class HandTimer:
    at_s: float
    callback: Callable[[], None]
    cancelled: bool = False

    def cancel(self) -> None:
        self.cancelled = True

    def run(self) -> None:
        if not self.cancelled:
            self.callback()


@dataclass(eq=False)
class HandTransport:
    """What a connection does to its transport, noted. stuck: the peer does not read, so nothing leaves the buffer."""

    host: str
    port: int = 40000
    stuck: bool = False
    written: bytearray = field(default_factory=bytearray)
    writes: int = 0
    reading: bool = True
    ended: str = ""
    high_bytes: int = 0
    connection: Any = None
    options: list[tuple[int, int]] = field(default_factory=list)

    def get_extra_info(self, name: str, _default: Any = None) -> Any:
        return {"peername": (self.host, self.port), "socket": self}.get(name)

    def fileno(self) -> int:
        return -1  # how much waits nobody knows

    def setsockopt(self, level: int, option: int, _value: int) -> None:
        self.options.append((level, option))

    def set_write_buffer_limits(self, high: int) -> None:
        self.high_bytes = high

    def write(self, data: bytes) -> None:
        assert not self.ended, "wrote after the end"
        self.written += data
        self.writes += 1
        if self.stuck and len(self.written) > self.high_bytes:
            self.connection.pause_writing()

    def pause_reading(self) -> None:
        self.reading = False

    def resume_reading(self) -> None:
        self.reading = not self.ended

    def close(self) -> None:
        self._end("closed")

    def abort(self) -> None:
        self._end("aborted")

    def _end(self, how: str) -> None:
        self.reading = False
        if not (self.ended == "closed" and how == "closed"):
            self.ended = how
        if how == "aborted" or not self.stuck:
            self.connection.connection_lost(None)


class NotingBank(MemoryBank):
    """200 words, 16 coils; writes lists what was written, by whom."""

    def __init__(self) -> None:
        super().__init__(words=200, bits=16, identity={0: b"Company", 1: b"Product", 2: b"V2.11", 4: b"Name"})
        self.writes: list[tuple[int, bytes, Peer]] = []

    def write_registers(self, address: int, data: bytes, peer: Peer) -> None:
        super().write_registers(address, data, peer)
        self.writes.append((address, data, peer))


class Stand:
    """Connections of one make-believe server, by hand."""

    def __init__(self, **settings: Any) -> None:
        self.settings = ServerSettings(**settings)
        self.clock = HandClock()
        self.bank = NotingBank()
        self.log: list[tuple[str, str]] = []
        self.closed: list[Peer] = []
        gate = LogLimiter(lambda cause, sentence: self.log.append((cause, sentence)))
        peers = Peers(self.settings, guarded=False)
        self.shared = ServerState(self.bank, self.settings, self.clock, gate, peers, self.closed.append)

    def connect(
        self, host: str = "127.0.0.1", *, port: int = 40000, stuck: bool = False
    ) -> tuple[Connection, HandTransport]:
        connection, transport = Connection(self.shared), HandTransport(host, port, stuck)
        transport.connection = connection
        connection.connection_made(transport)  # type: ignore[arg-type]
        return connection, transport

    def sweep(self) -> None:
        for connection in tuple(self.shared.connections):
            connection.sweep(self.clock.now_s)

    def wait(self, seconds: float, every_s: float = 0.5) -> None:
        """Let time pass as a running server does: with a sweep now and then."""
        for _ in range(round(seconds / every_s)):
            self.clock.advance(every_s)
            self.sweep()


def put(connection: Connection, transport: HandTransport, data: bytes) -> int:
    """Deliver as much as the connection reads now, in segments as large as a read; returns how much that was."""
    taken = 0
    while taken < len(data) and transport.reading:
        segment = data[taken : taken + READ_BYTES]
        taken += len(segment)
        connection.data_received(segment)
    return taken


@dataclass(eq=False)
class Running:
    """A server on loopback, what it told, and a way to wait for it to tell more."""

    server: ModbusTcpServer
    bank: NotingBank
    port: int
    log: list[tuple[str, str]] = field(default_factory=list)
    closed: list[Peer] = field(default_factory=list)
    told: asyncio.Event = field(default_factory=asyncio.Event)

    async def connect(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        return await asyncio.open_connection("127.0.0.1", self.port)

    async def until(self, condition: Callable[[], bool]) -> None:
        async with asyncio.timeout(10):
            while not condition():
                self.told.clear()
                await self.told.wait()


@asynccontextmanager
async def serving(bind: str = "127.0.0.1", **settings: Any) -> AsyncIterator[Running]:
    def note(into: list[Any]) -> Callable[..., None]:
        def noted(*found: Any) -> None:
            into.append(found if len(found) > 1 else found[0])
            running.told.set()

        return noted

    bank, log, closed = NotingBank(), [], []  # type: ignore[var-annotated]
    running = Running(None, bank, 0, log, closed)  # type: ignore[arg-type]
    running.server = ModbusTcpServer(bank, ServerSettings(**settings), on_peer_closed=note(closed), log=note(log))
    _host, running.port = await running.server.start(bind, 0)
    try:
        yield running
    finally:
        await running.server.close()


@pytest.fixture(scope="session")
def stand() -> type[Stand]:
    return Stand


@pytest.fixture(scope="session")
def deliver() -> Callable[[Connection, HandTransport, bytes], int]:
    return put


@pytest.fixture(scope="session")
def serve() -> Callable[..., AbstractAsyncContextManager[Running]]:
    return serving


@pytest.fixture(scope="session", autouse=True)
def _uvloop_s_own_pipe() -> None:
    """uvloop opens one pipe for the whole process with its first loop, and keeps it: no leak of any one test."""
    try:
        import uvloop
    except ImportError:
        return
    uvloop.run(asyncio.sleep(0))


@pytest.fixture(params=["asyncio", "uvloop"])
def run(request: pytest.FixtureRequest) -> Callable[[Any], Any]:
    """asyncio.run on either loop, with an end."""
    uvloop = pytest.importorskip("uvloop") if request.param == "uvloop" else None

    async def bounded(main: Any) -> Any:
        async with asyncio.timeout(20):
            return await main

    def run_one(main: Any) -> Any:
        factory = uvloop.new_event_loop if uvloop else None
        with asyncio.Runner(loop_factory=factory) as runner:
            return runner.run(bounded(main))

    return run_one


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Folder:
    """Certificates of all kinds, each with its key."""
    return store_all(tmp_path_factory.mktemp("certificates"))
