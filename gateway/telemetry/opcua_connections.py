"""Who may hold a connection to the OPC UA server, how many and for how long: by the bounds of the Modbus faces.

The library has bounds of its own since 2.0 only, and wide ones: a thousand connections, ten minutes of silence.
"""

import asyncio
from collections.abc import Callable
from typing import Any, Final

from gateway.extras import import_library
from gateway.fieldbus.peers import Peers
from gateway.fieldbus.settings import ServerSettings

LONGEST_REQUEST: Final = 1 << 20
"""Bytes: a request for every variable has a hundredth of that."""
MOST_SUBSCRIPTIONS: Final = 20
"""Of one session; a client has one, or one for each rate that it wants."""

Log = Callable[[str, str], None]


class SilenceTimer:
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


def _judge(transport: asyncio.BaseTransport, peers: Peers) -> tuple[str, str]:
    """Return the client's address, and why it may not connect now; empty: it may."""
    host, port = (transport.get_extra_info("peername") or ("", 0))[:2]
    refusal = peers.refusal(host) if host else "it has left already"
    return host, f"W230 {host}:{port}: {refusal} (OPC UA)" if refusal else ""


def _end_session(protocol: Any) -> asyncio.Task[None] | None:
    """End a lost connection's session: the library keeps what it subscribed to for ten minutes, and publishes to nobody."""
    session = getattr(getattr(protocol, "processor", None), "session", None)
    return None if session is None else asyncio.create_task(session.close_session())


def bound_connections(wire: Any, log: Log, settings: ServerSettings | None = None) -> None:
    """Have the library refuse connections beyond the most allowed, cut those that are silent, and a client whose request is
    longer than any could be: it waits for as many bytes as a header says, which may be 2 GB. wire: its protocol's module."""
    bounds = settings or ServerSettings()
    peers = Peers(bounds, guarded=False)

    class BoundedProtocol(wire.OPCUAProtocol):  # type: ignore[misc]
        _buffer: bytes
        transport: Any
        _silence: SilenceTimer | None = None  # of an admitted client

        def connection_made(self, transport: Any) -> None:
            self._host, refusal = _judge(transport, peers)
            if refusal:
                log("refused", refusal)
                transport.close()
            else:
                peers.join(self._host)
                super().connection_made(transport)
                self._silence = SilenceTimer(bounds.idle_s, transport.abort)

        def connection_lost(self, ex: BaseException | None) -> None:
            if self._silence:
                self._silence.close()
                peers.leave(self._host)
                super().connection_lost(ex)
                self._ending = _end_session(self)

        def data_received(self, data: bytes) -> None:
            if self._silence is None:
                return
            self._silence.note_heard()
            if len(self._buffer) + len(data) > LONGEST_REQUEST:
                self._buffer = b""
                self.transport.abort()
                return
            super().data_received(data)

    wire.OPCUAProtocol = BoundedProtocol


def bound_publishing(service: Any, least_s: float) -> None:
    """Have no client be told more often than there is something new: by an interval of a microsecond one took a whole core.
    Nor have one take the places of all: the library has a thousand. service: the library's, for subscriptions."""
    create = service.create_subscription

    async def create_bounded(params: Any, callback: Any, session_id: Any, **options: Any) -> Any:
        if sum(one.session_id == session_id for one in service.subscriptions.values()) >= MOST_SUBSCRIPTIONS:
            raise import_library("asyncua").ua.uaerrors.BadTooManySubscriptions
        params.RequestedPublishingInterval = max(1000.0 * least_s, params.RequestedPublishingInterval)
        return await create(params, callback, session_id, **options)

    service.create_subscription = create_bounded
