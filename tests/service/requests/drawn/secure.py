"""Clients of the TLS face, with OpenSSL's own bytes: whole handshakes with good certificates, and whatever strangers send."""

import socket
import ssl
from collections.abc import Callable
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

from gateway.fieldbus import ServerSettings, TlsSettings
from gateway.fieldbus.tls_settings import context_maker
from tests.certificates import store_all
from tests.fieldbus.tls.by_hand import REFUSED, client

ROLES = {"monitor": 0, "setpoint": 1, "calibration": 2, "admin": 3}
"""Certificates that are let in, by their names, with the role that each names."""


@cache
def contexts() -> tuple[ssl.SSLContext, dict[str, ssl.SSLContext]]:
    """The server's, and those of clients by the names of their certificates; "" shows none."""
    with TemporaryDirectory() as path:
        folder = store_all(Path(path))
        files = TlsSettings(ServerSettings(), folder.crt("gateway"), folder.key("gateway"), folder.crt("ca"))
        clients = {name: client(folder, name) for name in (*ROLES, *(name for name, _ in REFUSED))}
        return context_maker(files)(), clients


class SecureWire:
    """A client's end of a connection, as a socket that reads without waiting. poll: lets the other end act."""

    def __init__(self, far: socket.socket, name: str, poll: Callable[[], None]) -> None:
        self._far, self._poll, self._ended = far, poll, False
        self._incoming, self._outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        self._tls = contexts()[1][name].wrap_bio(self._incoming, self._outgoing, server_hostname="127.0.0.1")
        self.is_greeted = self._greet()

    def _greet(self) -> bool:
        for _ in range(8):
            try:
                self._tls.do_handshake()
            except ssl.SSLWantReadError:
                pass
            except (ssl.SSLError, OSError):
                return False
            else:
                return self._push()
            if not self._push() or not self._pull():
                return False
        raise AssertionError("a handshake without an end")

    def _push(self) -> bool:
        data = self._outgoing.read()
        try:
            assert self._far.send(data) == len(data), "a test's own buffer is too small"
        except OSError:
            return False
        self._poll()
        return True

    def _pull(self) -> bool:
        """Whether anything has come."""
        try:
            data = self._far.recv(1 << 20)
        except BlockingIOError:
            return False
        except OSError:
            data = b""
        self._ended = self._ended or not data
        self._incoming.write(data)
        return bool(data)

    def send(self, data: bytes) -> int:
        try:
            size = self._tls.write(data)
        except ssl.SSLError as error:
            raise OSError(str(error)) from error
        self._push()
        return size

    def recv(self, size: int) -> bytes:
        while not self._ended and self._pull():
            self._poll()
        try:
            return self._tls.read(size)
        except ssl.SSLWantReadError:
            if self._ended:
                return b""
            raise BlockingIOError from None
        except ssl.SSLError:
            return b""

    def send_raw(self, data: bytes) -> None:
        """Bytes that are no TLS of this connection."""
        self._far.send(data)

    def shutdown(self, _how: int) -> None:
        """Say goodbye."""
        try:
            self._tls.unwrap()
        except ssl.SSLError:
            pass
        self._push()

    def close(self) -> None:
        self._far.close()


def draw_stranger(draw: Random) -> tuple[str, Any]:
    """What somebody does who is not let in: the name of a certificate that he shows, or bytes."""
    if draw.random() < 0.5:
        return "shows", draw.choice(REFUSED)[0]
    hello = _hello()
    return "sends", draw.choice(
        (
            draw.randbytes(draw.randrange(1, 300)),
            b"GET / HTTP/1.1\r\nHost: a\r\n\r\n",
            bytes.fromhex("000100000006010300640010"),
            b"\x16\x03\x01\x40\x01" + draw.randbytes(50),
            b"\x16\x03\x01\x00\x05" + draw.randbytes(5),
            hello[: draw.randrange(1, len(hello))],
            hello[: draw.randrange(1, len(hello))] + draw.randbytes(draw.randrange(1, 40)),
            hello + hello,
            hello + bytes.fromhex("140303000101") + b"\x17\x03\x03\x00\x20" + draw.randbytes(32),
            b"\x15\x03\x03\x00\x02\x02\x28",
        )
    )


@cache
def _hello() -> bytes:
    """One for all plays: what OpenSSL draws is of no seed."""
    incoming, outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
    tls = contexts()[1]["setpoint"].wrap_bio(incoming, outgoing, server_hostname="127.0.0.1")
    try:
        tls.do_handshake()
    except ssl.SSLWantReadError:
        pass
    return outgoing.read()
