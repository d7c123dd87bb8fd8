"""TLS between a socket and a Modbus connection, which does not know of it.

Towards the socket this is a protocol, towards the connection a transport. The handshake is OpenSSL's with memory on both sides,
so that each end of it is seen here: why it failed, how long it has lasted, how many are under way. asyncio's own TLS tells a
server nothing of handshakes that fail, and has no bound for their number. What is left of a failed one is nothing.
"""

import asyncio
import ssl
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final, cast

from gateway.fieldbus.connection import Connection, ServerState
from gateway.fieldbus.peers import address_of
from gateway.fieldbus.rate_limits import RequestRate
from gateway.fieldbus.socket_transport import READ_BYTES
from gateway.fieldbus.tls_settings import (
    HANDSHAKE_BYTES,
    HANDSHAKE_S,
    HANDSHAKES_PER_S,
    MOST_PENDING,
    MOST_PENDING_OF_ONE,
    MOST_SESSIONS,
    certificate_refusal,
    handshake_failure,
)
from gateway.modbus.certificate import ROLES, read_certificate
from gateway.modbus.peer import Peer

LONGEST_RECORD: Final = (1 << 14) + 2048
"""Bytes of TLS that may come before a byte of Modbus is in them (RFC 5246, 6.2.3)."""
_BYTES_FOR_ONE: Final = 100
"""Of TLS, for a byte of Modbus that is sent by itself. What is beyond are messages of TLS: 150 changes of the keys in 4 KB took
7 ms of the control loop, and whoever may only read could send them without end."""


@dataclass(slots=True)
class Handshakes:
    """What all connections of one TLS face share. utc: the time of now as certificates have it (YYYYMMDDHHMMSSZ). pending:
    in the order in which they came."""

    make_context: Callable[[], ssl.SSLContext]
    revoked: frozenset[str]
    utc: Callable[[], str]
    pending: dict["TlsStream", None] = field(default_factory=dict)
    rates: dict[str, RequestRate] = field(default_factory=dict)
    context: ssl.SSLContext = field(init=False)

    def __post_init__(self) -> None:
        self.context = self.make_context()

    def refusal(self, host: str, now_s: float) -> str | None:
        """Return why no further handshake may begin; None: it may."""
        if len(self.pending) >= MOST_PENDING:
            return f"{MOST_PENDING} handshakes are under way, the most allowed"
        if address_of(host).is_loopback:
            return None
        if sum(stream.peer.host == host for stream in self.pending) >= MOST_PENDING_OF_ONE:
            return f"{MOST_PENDING_OF_ONE} handshakes of this address are under way, the most allowed"
        rate = self.rates.setdefault(host, RequestRate(HANDSHAKES_PER_S, now_s))
        if rate.wait_s(now_s) > 0.0:
            return f"more than {HANDSHAKES_PER_S:g} handshakes a second"
        rate.spend()
        return None

    def sweep(self, now_s: float) -> None:
        """Cut handshakes that last too long, and forget who has been quiet, and sessions where there are many."""
        if self.context.session_stats()["number"] > MOST_SESSIONS:
            self.context = self.make_context()
        for stream in tuple(self.pending):
            stream.sweep(now_s)
        for host in [host for host, rate in self.rates.items() if rate.is_full(now_s)]:
            del self.rates[host]


class TlsStream(asyncio.Protocol):
    """Made for each accepted socket."""

    def __init__(self, shared: ServerState, handshakes: Handshakes) -> None:
        self._shared, self._handshakes = shared, handshakes
        self._connection: Connection | None = None
        self._is_paused = self._is_closing = self._is_more = False
        self._shaken_bytes = self._taken_bytes = 0
        self._allowed_bytes = LONGEST_RECORD

    # -- towards the socket

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin the handshake, unless this peer may not."""
        shared, now_s = self._shared, self._shared.clock.time()
        self._socket = cast(asyncio.Transport, transport)
        self._peername = transport.get_extra_info("peername")
        self._began_s = now_s
        if self._peername is None or shared.closing:
            self._socket.abort()
            return
        host = str(address_of(self._peername[0]))
        self.peer = Peer(host, self._peername[1])
        if (refusal := shared.refusal(host, now_s)) is not None:
            self._refuse("refused", f"W230 {self.peer}: {refusal}")
            return
        if (refusal := self._handshakes.refusal(host, now_s)) is not None:
            self._refuse("handshake", f"W243 {self.peer}: {refusal}")
            return
        self._incoming, self._outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        self._tls = self._handshakes.context.wrap_bio(self._incoming, self._outgoing, server_side=True)
        self._handshakes.pending[self] = None

    def data_received(self, data: bytes) -> None:
        """Take encrypted bytes on."""
        size = len(data)
        if self._is_closing:
            return
        if self._connection is None and not self._is_short(size):
            return
        self._incoming.write(data)
        self._is_more, self._taken_bytes = size == READ_BYTES, self._taken_bytes + size
        if self._connection is None:
            self._shake_hands()
        else:
            self._allowed_bytes -= size
        if self._connection is not None:
            self._deliver()

    def pause_writing(self) -> None:
        """Tell the connection that its answers are not read; before there is one, cut the peer."""
        if self._connection is not None:
            self._connection.pause_writing()
        else:
            self.abort()

    def resume_writing(self) -> None:
        """Pass: whoever was told to pause has closed."""

    def connection_lost(self, error: Exception | None) -> None:
        """Give everything back."""
        self._is_closing = True
        self._handshakes.pending.pop(self, None)
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.connection_lost(error)

    def sweep(self, now_s: float) -> None:
        """Cut a handshake that lasts too long."""
        if now_s - self._began_s >= HANDSHAKE_S:
            self._refuse("handshake", f"W243 {self.peer}: the handshake was not finished within {HANDSHAKE_S:g} s")

    # -- towards the connection

    def get_extra_info(self, name: str, default: Any = None) -> Any:
        """Return what is known of the far end: `socket`, `peername`, as `modbus_peer` who its certificate says that it is, as
        `modbus_taken` the bytes of TLS that were read, and as `modbus_more` whether more may wait than that: records of one
        request each never fill a connection's buffer."""
        if name == "socket":
            return self._socket.get_extra_info(name, default)
        known = {"peername": self._peername, "modbus_peer": self.peer}
        known |= {"modbus_taken": self._taken_bytes, "modbus_more": self._is_more}
        return known.get(name, default)

    def set_write_buffer_limits(self, high: int) -> None:
        """Set what the socket may hold."""
        self._socket.set_write_buffer_limits(high=high)

    def write(self, data: bytes) -> None:
        """Send bytes, encrypted."""
        if self._is_closing:
            return
        try:
            self._tls.write(data)
        except ssl.SSLError:  # the far end has broken the protocol meanwhile
            self.abort()
            return
        self._flush()

    def pause_reading(self) -> None:
        """Stop taking bytes on."""
        self._is_paused = True
        self._socket.pause_reading()

    def resume_reading(self) -> None:
        """Take on what waits, then what comes."""
        if self._is_closing:
            return
        self._is_paused = False
        self._deliver()
        if not self._is_paused and not self._is_closing:
            self._socket.resume_reading()

    def close(self) -> None:
        """Say goodbye and close, once what was written is sent."""
        if self._is_closing:
            return
        self._is_closing = True
        try:
            self._tls.unwrap()
        except ssl.SSLError:  # the far end need not answer the goodbye
            pass
        self._flush()
        self._socket.close()

    def abort(self) -> None:
        """Cut the connection."""
        self._is_closing = True
        self._handshakes.pending.pop(self, None)
        self._socket.abort()

    # -- between the two

    def _is_short(self, size: int) -> bool:
        """Count what has come before there is a connection; cut who sends too much of it."""
        self._shaken_bytes += size
        if self._shaken_bytes > HANDSHAKE_BYTES:
            self._refuse(
                "handshake", f"W243 {self.peer}: more than {HANDSHAKE_BYTES} bytes of handshake, a short chain will do"
            )
            return False
        return True

    def _shake_hands(self) -> None:
        try:
            self._tls.do_handshake()
        except ssl.SSLWantReadError:
            self._flush()
            return
        except ssl.SSLError as error:
            self._flush()  # the alert that says why
            self._fail(handshake_failure(error))
            return
        self._flush()
        try:
            shown = read_certificate(self._tls.getpeercert(binary_form=True) or b"")
        except ValueError as error:
            self._fail(f"W240 {error}")
            return
        if (refusal := certificate_refusal(shown, self._handshakes.revoked, self._handshakes.utc())) is not None:
            self._fail(refusal)
            return
        self._handshakes.pending.pop(self, None)
        self.peer = Peer(self.peer.host, self.peer.port, shown.name, ROLES[str(shown.role)])
        connection = self._connection = Connection(self._shared)
        connection.connection_made(cast(asyncio.Transport, self))

    def _deliver(self) -> None:
        """Hand decrypted bytes to the connection, until there are none or it pauses. Each record is a turn: by records of one
        request each its own bound of a turn was none, and 120 refused writes were 7 ms of the control loop."""
        while not self._is_paused and not self._is_closing and (connection := self._connection) is not None:
            try:
                data = self._tls.read(READ_BYTES)
            except ssl.SSLWantReadError:
                break
            except ssl.SSLError as error:
                why = (error.reason or str(error)).lower().replace("_", " ")
                sentence = (
                    f"W232 {self.peer}: what came behind its last request is no TLS of this connection ({why}), closed"
                )
                self._shared.log("framing", sentence, self._shared.clock.time())
                self.close()
                return
            if not data:  # a goodbye
                self.close()
                return
            self._allowed_bytes = min(LONGEST_RECORD, self._allowed_bytes + _BYTES_FOR_ONE * len(data))
            connection.data_received(data)
            if self._incoming.pending and not (self._is_paused or self._is_closing):
                self.pause_reading()
                self._shared.clock.call_later(0.0, self.resume_reading)
        if self._allowed_bytes < 0 and not (self._is_paused or self._is_closing):
            self._refuse("framing", f"W232 {self.peer}: TLS without end, and hardly a byte of Modbus in it, closed")
            return
        self._flush()

    def _flush(self) -> None:
        if self._outgoing.pending:
            self._socket.write(self._outgoing.read())

    def _fail(self, sentence: str) -> None:
        code, _, text = sentence.partition(" ")
        self._shared.log(f"handshake {code}", f"{code} {self.peer}: {text}", self._shared.clock.time())
        self._is_closing = True
        self._handshakes.pending.pop(self, None)
        self._socket.close()

    def _refuse(self, cause: str, sentence: str) -> None:
        self._shared.log(cause, sentence, self._shared.clock.time())
        self.abort()
