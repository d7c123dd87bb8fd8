"""The Modbus TCP face: binds, accepts, sweeps, closes. The rules are in gateway.modbus, the values in the bank.

One repeating timer serves every connection's deadlines. close() returns when every connection has ended, so nothing of
it is left in the loop.
"""

import asyncio
from collections.abc import Callable
from typing import Final

from gateway.fieldbus.connection import Clock, Connection, ServerState, Timer
from gateway.fieldbus.listener import Listener
from gateway.fieldbus.peers import Peers, is_loopback
from gateway.fieldbus.rate_limits import LogLimiter
from gateway.fieldbus.settings import ServerSettings
from gateway.modbus.peer import Peer
from gateway.modbus.server import DataBank

_LAST_ANSWERS_S: Final = 0.25  # what a closing server gives its peers to read what it has answered


class BindError(Exception):
    """E122: the address can be reached from the network and nobody said who may connect."""

    code = "E122"

    def __init__(self, host: str) -> None:
        super().__init__(f"E122 {host} can be reached from the network: name those that may connect (network.allow)")


class ModbusTcpServer:
    """Serves one bank. Call start() and close() in the same event loop; clock replaces that loop's time in tests."""

    def __init__(
        self,
        bank: DataBank,
        settings: ServerSettings,
        *,
        on_peer_closed: Callable[[Peer], None],
        log: Callable[[str, str], None],
        clock: Clock | None = None,
    ) -> None:
        self._bank = bank
        self._settings = settings
        self._on_peer_closed = on_peer_closed
        self._log = LogLimiter(log)
        self._clock = clock
        self._shared: ServerState | None = None
        self._listener: Listener | None = None
        self._sweep_timer: Timer | None = None

    @property
    def peers(self) -> tuple[Peer, ...]:
        """Peers that are connected now."""
        return tuple(connection.peer for connection in self._shared.connections) if self._shared else ()

    async def start(self, host: str, port: int) -> tuple[str, int]:
        """Listen; returns the address and port really bound (port 0 asks for a free one).

        Raises BindError without an allow-list, PermissionError below port 1024, other OSErrors for what is taken or not ours.
        """
        loopback = is_loopback(host)
        if not loopback and not self._settings.allow:
            raise BindError(host)
        clock: Clock = self._clock or asyncio.get_running_loop()
        peers = Peers(self._settings, guarded=not loopback)
        shared = ServerState(self._bank, self._settings, clock, self._log, peers, self._on_peer_closed)
        self._listener = await Listener.open(
            self._make_protocol(shared), host, port, lambda sentence: self._log("refused", sentence, clock.time())
        )
        self._shared = shared
        self._sweep()
        return self._listener.address

    async def close(self) -> None:
        """Stop listening and end every connection; returns when all have ended. Who does not read the last answers is cut."""
        if self._listener is None or self._shared is None:
            return
        listener, self._listener = self._listener, None
        listener.close()
        self._shared.closing = True
        if self._sweep_timer is not None:
            self._sweep_timer.cancel()
        if self._shared.connections:
            await self._end_connections(self._shared)

    def _make_protocol(self, shared: ServerState) -> Callable[[], asyncio.Protocol]:
        return lambda: Connection(shared)

    def _sweep_handshakes(self, now_s: float) -> None:
        """Plain Modbus TCP has none."""

    async def _end_connections(self, shared: ServerState) -> None:
        gone = asyncio.get_running_loop().create_future()
        shared.on_last_gone = lambda: None if gone.done() else gone.set_result(None)
        for connection in tuple(shared.connections):
            connection.close()
        await asyncio.wait((gone,), timeout=_LAST_ANSWERS_S)
        for connection in tuple(shared.connections):
            connection.abort()
        await gone

    def _sweep(self) -> None:
        """Look at every connection's deadlines; four times within the shortest, at most every half second."""
        assert self._shared is not None
        clock = self._shared.clock
        now_s = clock.time()
        for connection in tuple(self._shared.connections):
            connection.sweep(now_s)
        self._sweep_handshakes(now_s)
        self._shared.peers.forget(now_s)
        period_s = min(2.0, self._settings.partial_s, self._settings.idle_s) / 4
        self._sweep_timer = clock.call_later(period_s, self._sweep)
