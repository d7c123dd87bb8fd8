"""The Modbus/TCP Security face: the rules of plain Modbus TCP behind mutual TLS, the role out of the certificate.

That its own certificate or its CA's is about to end a start tells; a gateway that runs for longer tells it on that day.
"""

import asyncio
from collections.abc import Callable, Iterator
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path

from gateway.fieldbus.connection import Clock, ServerState
from gateway.fieldbus.tcp_server import ModbusTcpServer
from gateway.fieldbus.tls_settings import TlsSettings, context_maker
from gateway.fieldbus.tls_stream import Handshakes, TlsStream
from gateway.modbus.certificate import read_certificates
from gateway.modbus.expiry import CURES, SOON_DAYS, end_of, expiry_sentence
from gateway.modbus.peer import Peer
from gateway.modbus.server import DataBank
from gateway.plain_file import read_plain


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
        self._handshakes = Handshakes(context_maker(settings), settings.revoked, _utc)
        soon = _utc(SOON_DAYS)
        self._to_tell = [(ends, told) for ends, told in _ends(settings) if ends > soon]

    def _make_protocol(self, shared: ServerState) -> Callable[[], asyncio.Protocol]:
        return lambda: TlsStream(shared, self._handshakes)

    def _sweep_handshakes(self, now_s: float) -> None:
        self._handshakes.sweep(now_s)
        soon = _utc(SOON_DAYS) if self._to_tell else ""
        for due in [each for each in self._to_tell if each[0] <= soon]:
            self._to_tell.remove(due)
            self._log(f"certificate {due[1]}", due[1], now_s)  # each is a cause of its own

    async def close(self) -> None:
        """Stop listening, cut the handshakes and end every connection."""
        for stream in tuple(self._handshakes.pending):
            stream.abort()
        await super().close()


def _ends(settings: TlsSettings) -> Iterator[tuple[str, str]]:
    """Return when each of these files ends and what is told of it; nothing of one that OpenSSL alone can read."""
    for name in CURES:
        file: str = getattr(settings, name)
        with suppress(ValueError):
            if ends := end_of(name, read_certificates(read_plain(Path(file)))):
                yield ends, expiry_sentence(name, file, ends)


def _utc(days: int = 0) -> str:
    """Return the moment so many days from now, as a certificate has it."""
    return f"{datetime.now(UTC) + timedelta(days=days):%Y%m%d%H%M%S}Z"
