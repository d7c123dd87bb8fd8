"""The listening sockets of a face, and how connections come off them: one at a time, at no cost to those that run.

A system without a free descriptor or memory (one neighbour may have taken them all) has none for a new connection, and
accept(2) passes on network errors of the new connection, too. Neither is a defect of this process: who waits stays in the
kernel's queue, the shortage is told once, and it is tried again. Rejected: asyncio's own server, which calls the loop's
exception handler for it, as for a defect, and uvloop's, which cuts the new connections or stops listening, without a word.
"""

import asyncio
import contextlib
import errno
import os
import socket
from collections.abc import Callable
from functools import partial
from math import inf
from typing import Any, Final, Self

from gateway.fieldbus.socket_transport import ReadySockets

_BACKLOG: Final = 100
_PAUSE_S: Final = 0.25
_QUIET_S: Final = 60.0  # a shortage that comes back within this is the one that was told
_SHORTAGES: Final = frozenset({errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM})

MakeProtocol = Callable[[], asyncio.Protocol]


class Listener:
    """Accepts on its sockets from the moment it is made, in the running loop. on_shortage: told the sentence of a shortage."""

    def __init__(self, sockets: list[socket.socket], make: MakeProtocol, on_shortage: Callable[[str], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._sockets, self._make, self._on_shortage = sockets, make, on_shortage
        self._ready = ReadySockets()
        self._pauses: set[asyncio.TimerHandle] = set()
        self._short_s = -inf
        for each in sockets:
            self._await_connection(each)

    @classmethod
    async def open(cls, make: MakeProtocol, host: str, port: int, on_shortage: Callable[[str], None]) -> Self:
        """Listen on every address of a host; port 0 asks for a free one. OSError where one of them is taken or not ours."""
        return cls(await _bind(host, port), make, on_shortage)

    @property
    def address(self) -> tuple[str, int]:
        """Return the first address and the port that are bound."""
        host, port = self._sockets[0].getsockname()[:2]
        return host, port

    def close(self) -> None:
        """Accept nothing more."""
        for pause in self._pauses:
            pause.cancel()
        for each in self._sockets:
            self._loop.remove_reader(each)
            each.close()
        self._sockets.clear()
        self._ready.close()

    def _await_connection(self, listening: socket.socket) -> None:
        if listening.fileno() >= 0:
            self._loop.add_reader(listening, self._accept, listening)

    def _accept(self, listening: socket.socket) -> None:
        try:
            accepted, _ = listening.accept()
        except OSError as error:
            if error.errno in _SHORTAGES:
                self._pause(listening, error)
            return  # else a connection that is gone already, or never was one
        self._ready.add(accepted, self._make())

    def _pause(self, listening: socket.socket, error: OSError) -> None:
        """The waiting connection would wake us again at once: leave it alone for a moment."""
        self._loop.remove_reader(listening)
        self._pauses = {pause for pause in self._pauses if pause.when() > self._loop.time()}
        self._pauses.add(self._loop.call_later(_PAUSE_S, partial(self._await_connection, listening)))
        now_s, before_s = self._loop.time(), self._short_s
        self._short_s = now_s
        if now_s - before_s > _QUIET_S:
            self._on_shortage(f"W248 new connections wait, those that are open go on: {error.strerror}")


async def _bind(host: str, port: int) -> list[socket.socket]:
    found = await _find_addresses(host, port)
    sockets: list[socket.socket] = []
    try:
        for family, kind, protocol, _, address in dict.fromkeys(found):
            listening = socket.socket(family, kind, protocol)
            sockets.append(listening)
            listening.setblocking(False)
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if family == socket.AF_INET6:
                listening.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
            listening.bind(address)
            listening.listen(_BACKLOG)
    except OSError as error:
        for each in sockets:
            each.close()
        raise OSError(error.errno, os.strerror(error.errno or 0)) from error
    return sockets


async def _find_addresses(host: str, port: int) -> list[Any]:
    """An address as it stands, and nothing is waited for; a name is asked for in a thread. OSError, also where the machine
    refuses us one."""
    kind, bound = socket.SOCK_STREAM, socket.AI_PASSIVE
    with contextlib.suppress(socket.gaierror):
        return socket.getaddrinfo(host or None, port, type=kind, flags=bound | socket.AI_NUMERICHOST)
    try:
        return await asyncio.get_running_loop().getaddrinfo(host, port, type=kind, flags=bound)
    except RuntimeError as error:
        raise OSError(errno.EAGAIN, f"no thread to ask for {host}: {error}") from None
