"""The files of a TLS face made into a context, and what is said of a handshake that failed.

TLS 1.2 and 1.3 only; both sides show a certificate of the one CA. No renegotiation. A resumed session (TLS 1.2 tickets, which
cost no memory; TLS 1.3 gives none out) shows the certificate of the first handshake: its days, its serial and its role are
judged at each connection anew (`certificate_refusal`), so that resumption is no way around them.

Keys are agreed on over P-256 alone, which every client of TLS 1.3 must have (RFC 8446, 9.1). The client chooses the group
before it has shown who it is, and what OpenSSL offers by itself goes up to ffdhe8192: 150 ms of processor in the control loop
for one hello (measured), more than the time after which the guardian takes it for dead. Price: a TLS 1.2 client
cannot show an ECDSA certificate of another curve; one with RSA, or by TLS 1.3, it can.
"""

import os
import ssl
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Final

from gateway.fieldbus.settings import ServerSettings
from gateway.modbus.certificate import (
    HAS_EXPIRED,
    NO_ISSUER,
    NOT_YET_VALID,
    ROLE_OID,
    ROLES,
    WRONG_PURPOSE,
    PeerCertificate,
)
from gateway.plain_file import read_plain

HANDSHAKE_S: Final = 5.0
MOST_PENDING: Final = 8
MOST_PENDING_OF_ONE: Final = 4
"""Of one address, loopback exempt: one machine that begins handshakes and says nothing must not keep the others out."""
HANDSHAKE_BYTES: Final = 12288
"""Of a client: room for two hellos and a chain of three RSA certificates. OpenSSL takes 100 KiB of certificates from anybody,
and 50 ms of processor in the control loop to find that 240 of one name lead nowhere (measured); eight such make a stall."""
MOST_SESSIONS: Final = 200
"""Kept for resumption: a TLS 1.2 client without tickets leaves one of 10 kB with each connection that it closes well, OpenSSL
keeps 20 480 for two hours, and Python cannot say otherwise. A new context has none."""
HANDSHAKES_PER_S: Final = 20.0
"""Of one address; each costs the control loop about a millisecond of processor. Loopback is exempt."""
LONGEST_NAME: Final = 64
"""Characters of a client's common name (RFC 5280, ub-common-name), which stands in lines of log and audit."""
CURVE: Final = "prime256v1"
_NO_COMPRESSED_CERTIFICATE: Final = 1 << 33
"""SSL_OP_NO_RX_CERTIFICATE_COMPRESSION of OpenSSL from 3.2 on, nothing before: a chain without end would come in few bytes."""
_NO_WAY: Final = (NO_ISSUER, 20, 21)
"""And X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT_LOCALLY, X509_V_ERR_UNABLE_TO_VERIFY_LEAF_SIGNATURE."""
_STRANGER: Final = (7, 18, 19)
"""X509_V_ERR_CERT_SIGNATURE_FAILURE, X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT, X509_V_ERR_SELF_SIGNED_CERT_IN_CHAIN."""
_NOT_TLS: Final = (
    "HTTP_REQUEST",
    "WRONG_VERSION_NUMBER",
    "HTTPS_PROXY_REQUEST",
    "BAD_RECORD_TYPE",
    "UNEXPECTED_MESSAGE",
)
_TOO_OLD: Final = ("UNSUPPORTED_PROTOCOL", "VERSION_TOO_LOW", "NO_SHARED_CIPHER", "TLSV1_ALERT_PROTOCOL_VERSION")
_NO_GROUP: Final = ("NO_SUITABLE_KEY_SHARE", "NO_SUITABLE_GROUPS")


@dataclass(frozen=True, slots=True)
class TlsSettings:
    """certificate, key, ca: paths of PEM files; revoked: serial numbers in upper-case hex that are refused."""

    server: ServerSettings
    certificate: str
    key: str
    ca: str
    revoked: frozenset[str] = field(default_factory=frozenset)


def context_maker(settings: TlsSettings) -> Callable[[], ssl.SSLContext]:
    """Return what makes the server's context of the files as they are now, and asks no disk. OSError for files that cannot be
    read; who makes one gets ssl.SSLError for those that are of no use."""
    return partial(_make_context, *(read_plain(file) for file in (settings.certificate, settings.key, settings.ca)))


def _make_context(certificate: bytes, key: bytes, ca: bytes) -> ssl.SSLContext:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.verify_mode = ssl.CERT_REQUIRED
    context.num_tickets = 0
    context.options |= ssl.OP_NO_RENEGOTIATION | ssl.OP_NO_COMPRESSION | _NO_COMPRESSED_CERTIFICATE
    context.set_ecdh_curve(CURVE)
    with _in_memory(certificate) as own, _in_memory(key) as secret, _in_memory(ca) as trusted:
        context.load_cert_chain(own, secret, password=lambda: b"")  # else OpenSSL asks for it at the terminal
        context.load_verify_locations(trusted)
    return context


@contextmanager
def _in_memory(data: bytes) -> Iterator[str]:
    """Lend the path of a file that only this process has: certificates and keys Python loads from files alone."""
    with os.fdopen(os.memfd_create("tls"), "wb") as file:
        file.write(data)
        file.flush()
        yield f"/proc/self/fd/{file.fileno()}"


def certificate_refusal(shown: PeerCertificate, revoked: frozenset[str], now: str) -> str | None:
    """Return why this certificate may not connect, as a sentence with its code; None: it may. now: as its times."""
    if len(shown.name) > LONGEST_NAME or not shown.name.isprintable():
        name = f"{shown.name[:LONGEST_NAME]!r}{' ...' * (len(shown.name) > LONGEST_NAME)}"
        return f"W242 the certificate's common name is {name}: one of at most {LONGEST_NAME} printable characters is needed"
    who = f"the certificate of {shown.name!r}"
    if not shown.begins <= now <= shown.ends:
        return f"W241 {who} is valid from {shown.begins} to {shown.ends}, now is {now}"
    if shown.serial in revoked:
        return f"W245 {who} (serial {shown.serial}) is revoked in the rig file"
    if not shown.name.strip():
        return "W242 the certificate has no common name: nobody could say who owns the setpoint"
    known = ", ".join(ROLES)
    if shown.role is None:
        return f"W242 {who} names no role: make one with force-gateway certs --client NAME:ROLE (ROLE: {known})"
    if not shown.role:
        cure = f"{ROLE_OID} = ASN1:UTF8String:ROLE in the extensions of openssl, once"
        return f"W242 {who} has a role that is not one UTF8String ({cure}; ROLE: {known})"
    if shown.role not in ROLES:
        return f"W242 {who} names the role {shown.role!r}, known are {known}"
    return None


def handshake_failure(error: ssl.SSLError) -> str:
    """Return what a failed handshake was about, as a sentence with its code."""
    reason = error.reason or ""
    if isinstance(error, ssl.SSLCertVerificationError):
        if error.verify_code in (HAS_EXPIRED, NOT_YET_VALID):
            state = "has expired" if error.verify_code == HAS_EXPIRED else "is not yet valid"
            cure = "make a new one; force-gateway check says if it is our CA's that is outside its days"
            return f"W241 its certificate {state} (or its clock, or ours, is wrong): {cure}"
        if error.verify_code == WRONG_PURPOSE:
            return "W240 its certificate is not one for a client (a server's?)"
        return _doubt(error.verify_code, error.verify_message)
    if reason == "PEER_DID_NOT_RETURN_A_CERTIFICATE":
        return "W240 it showed no certificate: give the client its certificate and key"
    if reason in _NOT_TLS:
        return "W244 it does not speak TLS: choose Modbus/TCP Security in the client, or the plain port"
    if reason in _TOO_OLD:
        return "W244 it offers TLS 1.1 or older, or no cipher of ours: TLS 1.2 or 1.3 with P-256 is needed"
    if reason in _NO_GROUP:
        return "W244 it offers no group of ours: allow P-256 (secp256r1) for its key exchange"
    if reason == "WRONG_CURVE":
        return "W240 its certificate is of another curve than P-256, of no use to TLS 1.2: make one of P-256, or use TLS 1.3"
    if "CERTIFICATE_EXPIRED" in reason:
        return (
            "W240 it finds our certificate expired or not valid yet (or its clock, or ours, is wrong): make a new one and "
            "start the gateway with it; it goes on with the files that it was started with"
        )
    if "ALERT" in reason:
        return (
            f"W240 it refused our certificate ({reason.lower()}): give the client our CA, and the name it connects to"
        )
    said = reason.lower().replace("_", " ") or error
    return (
        f"W244 the handshake failed ({said}): it speaks no TLS 1.2 or 1.3, or what stands between damages what it sends"
    )


def _doubt(code: int, message: str) -> str:
    """Return what is wrong with a certificate that OpenSSL does not verify, within its days and of the right kind."""
    if code in _STRANGER:
        return f"W240 its certificate is not of our CA ({message}): make one with the same CA"
    if code in _NO_WAY:
        cure = "make one with the same CA, or have it send its whole chain"
        return f"W240 its certificate is not of our CA, or comes without those between the two ({message}): {cure}"
    return f"W240 its certificate is not accepted ({message}): force-gateway certs makes one that is"
