"""Who may hold a connection to the OPC UA server, how many and for how long: by the bounds of the Modbus faces.

The library has bounds of its own since 2.0 only, and wide ones: a thousand connections, ten minutes of silence.
"""

import asyncio
from collections.abc import Callable
from typing import Any, Final

from gateway.fieldbus.peers import Peers
from gateway.fieldbus.settings import ServerSettings

LONGEST_REQUEST: Final = 1 << 20
"""Bytes: a request for every variable has a hundredth of that."""

Log = Callable[[str, str], None]


class IdleTimer:
    """Calls back once when nothing has been heard for longest_s; to be made in a running loop."""

    def __init__(self, longest_s: float, on_silence: Callable[[], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._longest_s, self._on_silence = longest_s, on_silence
        self.note_heard()
        self._timer = self._loop.call_later(longest_s, self._look)

    def note_heard(self) -> None:
        """Note that something has been heard now. No timer moves for it."""
        self._heard_s = self._loop.time()

    def close(self) -> None:
        """Wait no longer."""
        self._timer.cancel()

    def _look(self) -> None:
        left_s = self._heard_s + self._longest_s - self._loop.time()
        if left_s <= 0.0:
            self._on_silence()
        else:
            self._timer = self._loop.call_later(left_s, self._look)


class _Admission:
    """Knows who is connected, and refuses more than the bounds allow."""

    def __init__(self, bounds: ServerSettings, log: Log) -> None:
        self._peers, self._log = Peers(bounds, guarded=False), log
        self.leave = self._peers.leave

    def admit(self, transport: asyncio.BaseTransport) -> str:
        """Return the host of a client that may stay; empty for another one, which is told and closed."""
        host, port = (transport.get_extra_info("peername") or ("", 0))[:2]
        if refusal := self._peers.refusal(host) if host else "it has left already":
            self._log("refused", f"W230 {host}:{port}: {refusal} (OPC UA)")
            transport.close()
            return ""
        self._peers.join(host)
        return str(host)


def bound_connections(wire: Any, log: Log, settings: ServerSettings | None = None) -> None:
    """Have the library refuse connections beyond the most allowed, cut those that are silent, and a client whose request is
    longer than any could be: it waits for as many bytes as a header says, which may be 2 GB. wire: its protocol's module."""
    bounds = settings or ServerSettings()
    admission = _Admission(bounds, log)

    class BoundedProtocol(wire.OPCUAProtocol):  # type: ignore[misc]
        _buffer: bytes
        _idle_timer: IdleTimer | None = None  # of an admitted client

        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            self._host = admission.admit(transport)
            if self._host:
                super().connection_made(transport)
                self._idle_timer = IdleTimer(bounds.idle_s, self._cut)

        def connection_lost(self, ex: BaseException | None) -> None:
            if self._idle_timer:
                self._idle_timer.close()
                admission.leave(self._host)
                super().connection_lost(ex)

        def data_received(self, data: bytes) -> None:
            if self._idle_timer is None:
                return
            self._idle_timer.note_heard()
            if len(self._buffer) + len(data) > LONGEST_REQUEST:
                self._buffer = b""
                self._cut()
                return
            super().data_received(data)

        def _cut(self) -> None:
            if self.transport is not None:
                self.transport.abort()

    wire.OPCUAProtocol = BoundedProtocol
