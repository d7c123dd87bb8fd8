"""Changes of the keys of a TLS 1.3 connection, as many as one likes: no client library sends one without a reason.

RFC 8446: 4.6.3 (the message), 5.2 (the record), 7.1 to 7.3 (keys). The client's library does not know of them, so that it can
say nothing more itself.
"""

import ssl
import struct
from collections.abc import Iterator
from pathlib import Path

from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.ciphers.aead import AESGCM
from cryptography.hazmat.primitives.kdf.hkdf import HKDFExpand

_APPLICATION_DATA, _HANDSHAKE = 23, 22
_KEY_UPDATE = bytes((24, 0, 0, 1))
_REQUESTED = 1


class ClientKeys:
    """The client's half of a connection, from the log of its secrets. Its cipher: AES in GCM."""

    def __init__(self, log: Path, cipher: str) -> None:
        (line,) = (line for line in log.read_text().splitlines() if line.startswith("CLIENT_TRAFFIC_SECRET_0 "))
        self._secret, self._sequence = bytes.fromhex(line.split()[2]), 0
        self._hash = hashes.SHA384() if cipher.endswith("384") else hashes.SHA256()
        self._key_bytes = 32 if "256_GCM" in cipher else 16

    def updates(self, answered: bool) -> Iterator[bytes]:
        """Yield records, each a change of the keys. answered: the server shall change its own, too."""
        while True:
            record = self._record(_KEY_UPDATE + bytes((_REQUESTED if answered else 0,)), _HANDSHAKE)
            self._secret, self._sequence = self._expand(b"traffic upd", len(self._secret)), 0
            yield record

    def say(self, data: bytes) -> bytes:
        """Return a record of application data."""
        return self._record(data, _APPLICATION_DATA)

    def _record(self, content: bytes, kind: int) -> bytes:
        key, iv = self._expand(b"key", self._key_bytes), self._expand(b"iv", 12)
        nonce = bytes(a ^ b for a, b in zip(iv, self._sequence.to_bytes(12), strict=True))
        self._sequence += 1
        inner = content + bytes((kind,))
        head = struct.pack(">BHH", _APPLICATION_DATA, 0x0303, len(inner) + 16)
        return head + AESGCM(key).encrypt(nonce, inner, head)

    def _expand(self, label: bytes, length: int) -> bytes:
        name = b"tls13 " + label
        info = struct.pack(">HB", length, len(name)) + name + b"\0"
        return HKDFExpand(self._hash, length, info).derive(self._secret)


def noting_secrets(context: ssl.SSLContext, log: Path) -> ssl.SSLContext:
    """Have a client note its secrets."""
    context.keylog_filename = str(log)
    return context
