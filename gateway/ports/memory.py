"""Two ports joined in memory, with the interface of a serial port: for tests, and for simulations without ptys.

What the wire does to bytes is a channel: whole, byte by byte, lossy, delayed. All of them are deterministic.
"""

import asyncio
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from gateway.ports.errors import PortError
from gateway.ports.port import WRITE_DEADLINE_S, OnBytes, OnLost, OnOpen, monotonic_s

Channel = Callable[[bytes], Iterable[tuple[float, bytes]]]
"""One write -> what arrives of it: (delay in s, chunk) in order."""


def whole(data: bytes) -> Iterable[tuple[float, bytes]]:
    """Each write arrives as it is."""
    return [(0.0, data)]


def byte_by_byte(data: bytes) -> Iterable[tuple[float, bytes]]:
    """Each byte arrives alone: what a slow line does."""
    return [(0.0, bytes([byte])) for byte in data]


def delayed(delay_s: float) -> Channel:
    """Each write arrives whole, delay_s later."""
    return lambda data: [(delay_s, data)]


def lossy(every: int) -> Channel:
    """Each `every`-th byte of the line is lost."""
    count = 0

    def channel(data: bytes) -> Iterable[tuple[float, bytes]]:
        nonlocal count
        kept = bytearray()
        for byte in data:
            count += 1
            if count % every:
                kept.append(byte)
        return [(0.0, bytes(kept))] if kept else []

    return channel


@dataclass
class Listener:
    """What a memory port calls; by default nobody listens."""

    on_bytes: OnBytes = lambda chunk, now_s: None
    on_lost: OnLost = lambda failure: None
    on_open: OnOpen = lambda descriptor: None


class MemoryPort:
    """See port.Port. `unplug` and `replug` do to both ends what a cable does."""

    def __init__(self, path: str, channel: Channel, listener: Listener, clock: Callable[[], float]) -> None:
        self.path = path
        self.listener = listener
        self.written = b""  # everything that was written, lost or not
        self._channel = channel
        self._clock = clock
        self._peer: MemoryPort | None = None
        self._is_open = False
        self._is_plugged = True

    @property
    def is_open(self) -> bool:
        return self._is_open and self._is_plugged

    async def open(self) -> None:
        if not self._is_plugged:
            raise PortError("E102", f"{self.path} is not there")
        self._is_open = True
        self.listener.on_open(-1)

    def write(self, data: bytes) -> bool:
        if not self.is_open:
            return False
        self.written += data
        assert self._peer
        for delay_s, chunk in self._channel(data):
            loop = asyncio.get_running_loop()
            if delay_s:
                loop.call_later(delay_s, self._peer._arrived, chunk)
            else:
                loop.call_soon(self._peer._arrived, chunk)
        return True

    async def drain(self, deadline_s: float = WRITE_DEADLINE_S) -> None:
        await asyncio.sleep(0)

    async def write_last(self, data: bytes, deadline_s: float = WRITE_DEADLINE_S) -> None:
        if not self.write(data):
            raise PortError("E102", f"{self.path} is not open")
        await self.drain(deadline_s)

    def close(self) -> None:
        self._is_open = False

    def unplug(self) -> None:
        """Both ends lose the line."""
        for end in (self, self._peer):
            if end and end._is_plugged:
                end._is_plugged = False
                if end._is_open:
                    end.listener.on_lost(PortError("E102", f"{end.path} is gone: unplugged?"))

    def replug(self) -> None:
        """Both ends find the line again."""
        for end in (self, self._peer):
            if end and not end._is_plugged:
                end._is_plugged = True
                if end._is_open:
                    end.listener.on_open(-1)

    def _arrived(self, chunk: bytes) -> None:
        if self.is_open:
            self.listener.on_bytes(chunk, self._clock())


def memory_pair(
    near: Listener, far: Listener, *, channel: Channel = whole, clock: Callable[[], float] = monotonic_s
) -> tuple[MemoryPort, MemoryPort]:
    """Two joined ports. channel: what the line does to bytes, in both directions."""
    first = MemoryPort("memory:near", channel, near, clock)
    second = MemoryPort("memory:far", channel, far, clock)
    first._peer, second._peer = second, first
    return first, second
