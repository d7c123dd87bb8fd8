"""Two ends of a TLS connection without a socket: the server's stream with a transport in hand, the client OpenSSL itself."""

import gc
import ssl
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

import pytest

from gateway.fieldbus.connection import ServerState
from gateway.fieldbus.peers import Peers
from gateway.fieldbus.rate_limits import LogLimiter
from gateway.fieldbus.settings import ServerSettings
from gateway.fieldbus.socket_transport import READ_BYTES
from gateway.fieldbus.tls_settings import TlsSettings, context_maker
from gateway.fieldbus.tls_stream import Handshakes, TlsStream
from gateway.modbus import Peer
from tests.certificates import Folder, serial_of
from tests.fieldbus.conftest import HandClock, HandTransport, NotingBank

NOW = "20270101000000Z"
VERSIONS = [ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3]
REFUSED = [
    ("foreign", "W240 127.0.0.1:40000: its certificate is not of our CA"),
    ("expired", "W241 127.0.0.1:40000: its certificate has expired"),
    ("roleless", "W242 127.0.0.1:40000: the certificate of 'roleless' names no role"),
    (
        "captain",
        "W242 127.0.0.1:40000: the certificate of 'captain' names the role 'captain', known are monitor, setpoint",
    ),
    ("nameless", "W242 127.0.0.1:40000: the certificate has no common name"),
    ("thief", "W245 127.0.0.1:40000: the certificate of 'thief' (serial "),
    ("gateway", "W240 127.0.0.1:40000: its certificate is not one for a client"),
    ("", "W240 127.0.0.1:40000: it showed no certificate"),
]
"""Whose certificates are turned away, and what is said of it."""


@dataclass(eq=False)
class SocketInHand(HandTransport):
    """As a socket: what was written can be taken, and the far end may leave."""

    def leave(self) -> None:
        if not self.ended:
            self._end("closed")

    def take(self) -> bytes:
        data = bytes(self.written)
        self.written.clear()
        return data


@dataclass
class Face:
    """A TLS face without a socket."""

    folder: Folder
    now: Callable[[], str]
    clock: HandClock = field(default_factory=HandClock)
    bank: NotingBank = field(default_factory=NotingBank)
    log: list[str] = field(default_factory=list)
    causes: list[str] = field(default_factory=list)
    closed: list[Peer] = field(default_factory=list)

    def __post_init__(self) -> None:
        server, folder = ServerSettings(), self.folder
        files = TlsSettings(server, folder.crt("gateway"), folder.key("gateway"), folder.crt("ca"), frozenset())
        log = LogLimiter(self._note)
        self.shared = ServerState(self.bank, server, self.clock, log, Peers(server, guarded=False), self.closed.append)
        self.handshakes = Handshakes(context_maker(files), frozenset((serial_of("thief"),)), self.now)

    def _note(self, cause: str, sentence: str) -> None:
        self.causes.append(cause)
        self.log.append(sentence)

    def accept(self, host: str = "127.0.0.1") -> "Line":
        return Line(self, SocketInHand(host))

    @property
    def left(self) -> int:
        """Streams that anybody still holds."""
        gc.collect()
        return sum(isinstance(each, TlsStream) for each in gc.get_objects())


class Line:
    """One connection. `greet` makes the handshake, `ask` sends bytes and returns what came back until then."""

    def __init__(self, face: Face, socket: SocketInHand) -> None:
        self.face, self.socket = face, socket
        self.stream = TlsStream(face.shared, face.handshakes)
        socket.connection = self.stream
        self.stream.connection_made(socket)  # type: ignore[arg-type]

    def greet(self, context: ssl.SSLContext) -> str:
        """Return the protocol agreed on; SSLError where the client's side fails."""
        self.incoming, self.outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        self.tls = context.wrap_bio(self.incoming, self.outgoing, server_hostname="127.0.0.1")
        while True:
            try:
                self.tls.do_handshake()
                self.exchange()
                return str(self.tls.version())
            except ssl.SSLWantReadError:
                if not self.exchange():
                    return ""

    def exchange(self) -> bool:
        """Carry bytes both ways; whether anything came back."""
        self.send(self.outgoing.read())
        back = self.socket.take()
        self.incoming.write(back)
        return bool(back)

    def send(self, data: bytes, step: int = 4096) -> None:
        """Bytes as the socket would bring them, at most `step` at a time."""
        while data and not self.socket.ended:
            if not self.socket.reading:
                self.face.clock.advance(0.0)  # who gave way goes on
            part, data = data[: min(step, READ_BYTES)], data[min(step, READ_BYTES) :]
            self.stream.data_received(part)

    def ask(self, data: bytes, step: int = 4096) -> bytes:
        self.tls.write(data)
        self.send(self.outgoing.read(), step)
        self.face.clock.advance(0.001)  # those that gave way go on
        self.incoming.write(self.socket.take())
        answers = b""
        while True:
            try:
                got = self.tls.read(65536)
            except ssl.SSLWantReadError:
                return answers
            answers += got
            if not got:
                return answers


def client(folder: Folder, name: str = "", version: ssl.TLSVersion | None = None, ca: str = "ca") -> Any:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.load_verify_locations(folder.crt(ca))
    if name:
        context.load_cert_chain(folder.crt(name), folder.key(name))
    if version is not None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            context.minimum_version = context.maximum_version = version
        if version < ssl.TLSVersion.TLSv1_2:
            context.set_ciphers("ALL:@SECLEVEL=0")
    return context


@pytest.fixture
def face(folder: Folder) -> Face:
    """A TLS face by today's date."""
    return Face(folder, lambda: f"{datetime.now(UTC):%Y%m%d%H%M%S}Z")
