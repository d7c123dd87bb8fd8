"""Modbus TCP without a kernel: connections between two loops, whose bytes arrive after a delay, in pieces, in order."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from gateway.fieldbus.socket_transport import READ_BYTES
from gateway.modbus import Peer, Role
from tests.simulation.kernel.virtual_time import VirtualLoop

DELAY_S = 0.0002


class MemoryListener:
    """Stands for `Listener`: only `Line` reaches it."""

    def __init__(self, make: Callable[[], Any], port: int, loop: VirtualLoop) -> None:
        self.make, self.port, self._loop = make, port, loop
        self.address = "127.0.0.1", port

    @classmethod
    async def open(cls, make: Callable[[], Any], host: str, port: int, on_shortage: object) -> "MemoryListener":
        loop = asyncio.get_running_loop()
        assert isinstance(loop, VirtualLoop)
        loop.servers[port] = listener = cls(make, port, loop)
        return listener

    def close(self) -> None:
        self._loop.servers.pop(self.port, None)


@dataclass(frozen=True)
class Caller:
    """Who connects. name, role: of the certificate that a TLS face has checked, for which it stands here; "": a plain face."""

    host: str
    port: int
    name: str = ""
    role: str = ""

    @property
    def shown(self) -> dict[str, Any]:
        """What the transport tells of the far end, as `TlsStream` does where there is a certificate."""
        peername = {"peername": (self.host, self.port)}
        if not self.name:
            return peername
        return peername | {"modbus_peer": Peer(self.host, self.port, self.name, Role[self.role.upper()])}


class MemoryTransport(asyncio.Transport):
    """The server's end of one connection."""

    def __init__(
        self, inside: VirtualLoop, outside: VirtualLoop, caller: "Caller", hear: Callable[[bytes], None]
    ) -> None:
        super().__init__(caller.shown)
        self._inside, self._outside, self._hear = inside, outside, hear
        self._protocol: Any = None
        self._is_closing = self._is_paused = False
        self._waiting = bytearray()

    def attach(self, protocol: Any) -> None:
        self._protocol = protocol
        protocol.connection_made(self)

    def feed(self, data: bytes) -> None:
        """Bytes from the other end, in the server's loop."""
        self._waiting += data
        self._deliver()

    def end(self) -> None:
        """The other end has closed."""
        if not self._is_closing:
            self._protocol.eof_received()
            self.close()

    def write(self, data: Any) -> None:
        if not self._is_closing:
            self._outside.call_later(DELAY_S, self._hear, bytes(data))

    def get_write_buffer_size(self) -> int:
        return 0

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None: ...

    def is_closing(self) -> bool:
        return self._is_closing

    def close(self) -> None:
        if not self._is_closing:
            self._is_closing = True
            self._inside.call_soon(self._protocol.connection_lost, None)
            self._outside.call_later(DELAY_S, self._hear, b"")

    def abort(self) -> None:
        self.close()

    def pause_reading(self) -> None:
        self._is_paused = True

    def resume_reading(self) -> None:
        self._is_paused = False
        self._inside.call_soon(self._deliver)

    def is_reading(self) -> bool:
        return not self._is_paused

    def _deliver(self) -> None:
        while self._waiting and not self._is_paused and not self._is_closing:
            piece = bytes(self._waiting[:READ_BYTES])
            del self._waiting[:READ_BYTES]
            self._protocol.data_received(piece)


class Line:
    """A master's end of one connection. hear(b"") tells that the other end has closed."""

    def __init__(
        self, inside: VirtualLoop, outside: VirtualLoop, caller: Caller, hear: Callable[[bytes], None]
    ) -> None:
        self._inside, self._outside = inside, outside
        self._held: bytearray | None = None
        self._transport = MemoryTransport(inside, outside, caller, hear)
        (server,) = inside.servers.values()
        inside.call_soon(lambda: self._transport.attach(server.make()))

    def send(self, data: bytes) -> None:
        if self._held is not None:
            self._held += data
        else:
            self._inside.call_later(DELAY_S, self._transport.feed, data)

    def stall(self, duration_s: float) -> None:
        """Let nothing through for so long: what is sent meanwhile arrives then, in one piece."""
        if self._held is None:
            self._held = bytearray()
            self._outside.call_later(duration_s, self._go_on)

    def vanish(self) -> None:
        """What is on its way is lost, and the other end is not told."""
        self._held = None

    def close(self) -> None:
        if self._held is not None:
            self._go_on()  # what was sent before comes before
        self._inside.call_later(DELAY_S, self._transport.end)

    def _go_on(self) -> None:
        held, self._held = self._held, None
        if held:
            self._inside.call_later(DELAY_S, self._transport.feed, bytes(held))
