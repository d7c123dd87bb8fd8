"""The accepted sockets of a listener under one epoll: one wake-up of the loop serves all that have something to read.

A loop's own transports cost a callback for each socket, with a turn of its selector and of its contexts: as much as the request
itself. Towards a protocol these are what asyncio's are, but for two things: a read has a bound, and a protocol that is told to
pause writing ends the connection, so none is told to resume.
"""

import asyncio
import select
import socket
from collections.abc import Callable
from contextlib import suppress
from time import monotonic
from typing import Any, Final

READ_BYTES: Final = 1024  # of one socket at once: 85 reads of registers, or four of the longest requests
_READABLE: Final = 1  # EPOLLIN; with it come EPOLLERR and EPOLLHUP, which a read explains
_WRITABLE: Final = 4  # EPOLLOUT
_MOST_AT_ONCE: Final = 64
_BUSY: Final = 8  # at once: others have something by then, and a turn of the loop costs as much as a request
IN_A_ROW_S: Final = 500e-6  # so long at most: control waits meanwhile
_MOST_WAITING_BYTES: Final = 65536


class ReadySockets:
    """Serves those of its sockets that have something, in the running loop. has_epoll: else each wakes the loop by itself, as
    off Linux."""

    def __init__(self, *, has_epoll: bool = hasattr(select, "epoll")) -> None:
        self.loop = asyncio.get_running_loop()
        self._serve_by_descriptor: dict[int, Callable[[int], None]] = {}
        self._is_closing = False
        self._epoll = select.epoll() if has_epoll else None
        if self._epoll is not None:
            self.loop.add_reader(self._epoll.fileno(), self._serve, self._epoll.poll)

    def add(self, wire: socket.socket, protocol: asyncio.Protocol) -> None:
        """Serve a socket from now on by this protocol."""
        SocketTransport(self, wire, protocol)

    def close(self) -> None:
        """Release the epoll, once no socket is left."""
        self._is_closing = True
        if self._epoll is not None and not self._serve_by_descriptor:
            self.loop.remove_reader(self._epoll.fileno())
            self._epoll.close()

    def join(self, descriptor: int, serve: Callable[[int], None]) -> None:
        """Remember by what a socket is served once it is watched."""
        self._serve_by_descriptor[descriptor] = serve

    def leave(self, descriptor: int) -> None:
        """Forget a socket that is watched no more, before it is closed."""
        del self._serve_by_descriptor[descriptor]
        if self._is_closing:
            self.close()

    def watch(self, descriptor: int, before: int, events: int) -> None:
        """Serve a socket when one of these events has come, in the place of those before; 0: of none."""
        if self._epoll is None:
            self._watch_by_loop(descriptor, events)
        elif not before:
            self._epoll.register(descriptor, events)
        elif events:
            self._epoll.modify(descriptor, events)
        else:
            self._epoll.unregister(descriptor)

    def _watch_by_loop(self, descriptor: int, events: int) -> None:
        serve, loop = self._serve_by_descriptor[descriptor], self.loop
        loop.add_reader(descriptor, serve, _READABLE) if events & _READABLE else loop.remove_reader(descriptor)
        loop.add_writer(descriptor, serve, _WRITABLE) if events & _WRITABLE else loop.remove_writer(descriptor)

    def _serve(self, poll: Callable[[float, int], list[tuple[int, int]]]) -> None:
        serve_by_descriptor, ends_s = self._serve_by_descriptor, monotonic() + IN_A_ROW_S
        while True:
            ready = poll(0, _MOST_AT_ONCE)
            for descriptor, events in ready:
                serve_by_descriptor[descriptor](events)
            if len(ready) < _BUSY or monotonic() >= ends_s:
                return


class SocketTransport:
    """One accepted socket, as its protocol and `ReadySockets` have it."""

    def __init__(self, ready: ReadySockets, wire: socket.socket, protocol: asyncio.Protocol) -> None:
        wire.setblocking(False)
        with suppress(OSError):  # it has gone already
            wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._ready, self._wire, self._protocol = ready, wire, protocol
        self._receive, self._send, self._take = wire.recv, wire.send, protocol.data_received
        self._waiting, self._most_waiting = bytearray(), _MOST_WAITING_BYTES
        self._is_reading, self._is_closing, self._is_ended = True, False, False
        self._watched = 0
        ready.join(wire.fileno(), self.serve)
        protocol.connection_made(self)  # type: ignore[arg-type]  # what it asks of a transport this one has
        self._watch()

    def get_extra_info(self, name: str, default: Any = None) -> Any:
        """Return the `socket`, or as `peername` the address at its far end, None where it has left already."""
        if name == "peername":
            with suppress(OSError):
                return self._wire.getpeername()
            return None
        return self._wire if name == "socket" else default

    def serve(self, events: int) -> None:
        """Read once, and send what waits: called when one of these events has come."""
        if events != _READABLE and self._waiting:
            self._flush()
        if not self._is_reading:
            return
        try:
            data = self._receive(READ_BYTES)
        except BlockingIOError:
            return
        except OSError as error:
            self._end(error)
            return
        if not data:
            self.close()
            return
        try:
            self._take(data)
        except Exception as error:
            self.abort()
            message = "a protocol failed at what its peer has sent"
            self._ready.loop.call_exception_handler({"message": message, "exception": error})

    def write(self, data: bytes) -> None:
        """Send, now as much as the socket takes."""
        if not (self._waiting or self._is_closing):
            try:
                sent = self._send(data)
            except BlockingIOError:
                sent = 0
            except OSError as error:
                self._end(error)
                return
            if sent == len(data):
                return
            data = data[sent:]
        self._hold(data)

    def set_write_buffer_limits(self, high: int) -> None:
        """Set how many bytes may wait until the protocol is told to pause writing."""
        self._most_waiting = high

    def pause_reading(self) -> None:
        """Read nothing more."""
        self._is_reading = False
        self._watch()

    def resume_reading(self) -> None:
        """Read again."""
        self._is_reading = not self._is_closing
        self._watch()

    def close(self) -> None:
        """Read nothing more, and close once what waits is sent."""
        self._is_closing, self._is_reading = True, False
        if not self._waiting:
            self._end(None)
        else:
            self._watch()

    def abort(self) -> None:
        """Close now."""
        self._end(None)

    def _watch(self) -> None:
        wanted = (_READABLE if self._is_reading else 0) | (_WRITABLE if self._waiting else 0)
        if wanted != self._watched:
            self._ready.watch(self._wire.fileno(), self._watched, wanted)
            self._watched = wanted

    def _hold(self, data: bytes) -> None:
        if self._is_closing:
            return
        self._waiting += data
        self._watch()
        if len(self._waiting) > self._most_waiting:
            self._protocol.pause_writing()

    def _flush(self) -> None:
        try:
            del self._waiting[: self._send(self._waiting)]
        except BlockingIOError:
            return
        except OSError as error:
            self._end(error)
            return
        if self._is_closing and not self._waiting:
            self._end(None)
        else:
            self._watch()

    def _end(self, error: OSError | None) -> None:
        if self._is_ended:
            return
        self._is_ended = self._is_closing = True
        self._is_reading = False
        self._waiting.clear()
        self._watch()
        self._ready.loop.call_soon(self._lose, error)

    def _lose(self, error: OSError | None) -> None:
        self._ready.leave(self._wire.fileno())
        self._wire.close()
        self._protocol.connection_lost(error)
