"""The Modbus/TCP Security face: the rules of plain Modbus TCP behind mutual TLS, the role out of the certificate."""

import asyncio
from collections.abc import Callable
from datetime import UTC, datetime

from gateway.fieldbus.connection import Clock, ServerState
from gateway.fieldbus.tcp_server import ModbusTcpServer
from gateway.fieldbus.tls_settings import TlsSettings, context_maker
from gateway.fieldbus.tls_stream import Handshakes, TlsStream
from gateway.modbus.peer import Peer
from gateway.modbus.server import DataBank


class ModbusTlsServer(ModbusTcpServer):
    """As ModbusTcpServer. OSError or ssl.SSLError when made with files that cannot be used."""

    def __init__(
        self,
        bank: DataBank,
        settings: TlsSettings,
        *,
        on_peer_closed: Callable[[Peer], None],
        log: Callable[[str, str], None],
        clock: Clock | None = None,
    ) -> None:
        super().__init__(bank, settings.server, on_peer_closed=on_peer_closed, log=log, clock=clock)
        self._handshakes = Handshakes(context_maker(settings), settings.revoked, _utc_now)

    @property
    def pending(self) -> int:
        """Number of handshakes that are under way."""
        return len(self._handshakes.pending)

    def _make_protocol(self, shared: ServerState) -> Callable[[], asyncio.BaseProtocol]:
        return lambda: TlsStream(shared, self._handshakes)

    def _sweep_handshakes(self, now_s: float) -> None:
        self._handshakes.sweep(now_s)

    async def close(self) -> None:
        """Stop listening, cut the handshakes and end every connection."""
        for stream in tuple(self._handshakes.pending):
            stream.abort()
        await super().close()


def _utc_now() -> str:
    return f"{datetime.now(UTC):%Y%m%d%H%M%S}Z"
