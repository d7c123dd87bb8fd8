"""Checks of the TLS faces of a rig: who may reach them, and whether their files can be used, today and next month. And of the
files by which its MQTT broker is known: without them there is no MQTT, and everything else.

The files are looked at as the gateway will load them: a key that does not fit its certificate, a certificate that has
expired, a key that others may read. All of it is told before the gateway starts.
"""

import contextlib
import errno
import ssl
import stat
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path
from typing import Final

from gateway.modbus.certificate import (
    HAS_EXPIRED,
    KEY_MISMATCHES,
    NO_ISSUER,
    NOT_YET_VALID,
    WRONG_PURPOSE,
    PeerCertificate,
    read_certificates,
)
from gateway.modbus.expiry import CURES, SOON_DAYS, day_of, end_of, expiry_sentence
from gateway.plain_file import read_plain
from gateway.profiles.rigs.checks.network import find_everybody, find_open_face
from gateway.profiles.rigs.checks.parts import Check, Found, Parts
from gateway.profiles.rigs.faces import TlsFace
from gateway.profiles.rigs.rig_file import Network

_FLIGHTS: Final = 3  # of a handshake: hello, certificate, end
_MAKE: Final = "`force-gateway certs DIR` makes a CA, a server and clients"
_REFUSALS: Final = {
    NO_ISSUER: "is of a CA that another one has signed, which the file of `ca` lacks (add it there)",
    WRONG_PURPOSE: "is not one for a server (a client's?)",
    HAS_EXPIRED: "is of a CA that has expired, as all that it has signed",
}
_CURES: Final[dict[type[OSError], str]] = {
    FileNotFoundError: _MAKE,
    NotADirectoryError: _MAKE,
}


def tls_faces(parts: Parts) -> Iterator[tuple[str, TlsFace]]:
    """Yield (path in the file, face) of every TLS face without a fault of its own."""
    for index, face in enumerate(parts.fieldbus):
        if isinstance(face, TlsFace):
            yield f"fieldbus.{index}", face


def check_tls_exposure(parts: Parts) -> Found:
    """Yield a fault for a TLS face beyond loopback without an allow-list, and for one on the plain face's port."""
    for path, face in tls_faces(parts):
        yield from find_open_face(path, face)
        network = parts.network
        if network and network.plain and _meet(face, network):
            yield f"{path}.port", f"{face.port} is the port of plain Modbus TCP too: 802 is that of Modbus/TCP Security"
        for other, first in tls_faces(parts):
            if other < path and _meet(face, first):
                yield f"{path}.port", f"{face.port} is the port of another TLS face too: each needs its own"


def _meet(one: TlsFace, other: TlsFace | Network) -> bool:
    """Decide whether two faces want one port of one address: that of all addresses is everybody's."""
    ours, theirs = ip_address(one.bind), ip_address(other.bind)
    is_shared = ours == theirs or (ours.version == theirs.version and (ours.is_unspecified or theirs.is_unspecified))
    return bool(one.port) and one.port == other.port and is_shared


def check_tls_allow(parts: Parts) -> Found:
    """Yield a warning for an allow-list that lets everybody begin a handshake."""
    for path, face in tls_faces(parts):
        yield from find_everybody(path, face)


def check_tls_files(parts: Parts) -> Found:
    """Yield a fault for each file that is missing, is not what it should be, or does not fit the others."""
    for path, face in tls_faces(parts):
        faults = list(_unreadable(path, face))
        yield from faults or _unfit(path, face)


def check_tls_days(parts: Parts) -> Found:
    """Yield a warning for a server's certificate that is about to expire, or has, and for its CA's: with that all go. And for
    one whose days have not begun: as a rule nobody has set the clock yet. No fault: behind one nobody would start a service
    again, whose other faces and page need no certificate."""
    for path, face in tls_faces(parts):
        yield from _over(path, face)
        for name in CURES:
            file = str(getattr(face, name))
            shown = _certificates(file)
            begins = min((each.begins for each in shown[: None if name == "ca" else 1]), default="")
            if _utc() < begins:
                cure = "look at this machine's clock, or wait; until then no client connects"
                yield f"{path}.{name}", f"E173 {file} is not valid before {day_of(begins)}: {cure}"
            elif _utc() <= (ends := end_of(name, shown)) <= _utc(SOON_DAYS):
                yield f"{path}.{name}", expiry_sentence(name, file, ends)


def check_broker_files(parts: Parts) -> Found:
    """Yield a warning for each file of `mqtt` that is missing or is not what it should be."""
    mqtt = parts.mqtt
    if mqtt is None:
        return
    named = {"password_file": mqtt.password_file}
    if tls := mqtt.tls:
        named |= {"tls.ca": tls.ca, "tls.certificate": tls.certificate, "tls.key": tls.key}
    for name, file in named.items():
        if file is not None and (why := _why_no_broker_file(name, file)):
            yield f"mqtt.{name}", f"E181 {file}{why}; until then there is no MQTT"


def _why_no_broker_file(name: str, file: str) -> str:
    try:
        text = read_plain(file)
    except OSError as error:
        return f": {error.strerror or error}; name the right one, or let the gateway's user read it"
    kind = {"tls.key": b"PRIVATE KEY-----", "password_file": b""}.get(name, b"-----BEGIN CERTIFICATE-----")
    if kind not in text:
        return f" holds no {'private key' if name == 'tls.key' else 'certificate'} in PEM form: name the right one"
    if name == "tls.key" and b"ENCRYPTED" in text:
        return f" has a password: openssl pkey -in {file} -out NEW.key takes it off"
    return ""


def _unreadable(path: str, face: TlsFace) -> Found:
    for name in ("certificate", "key", "ca"):
        file = Path(getattr(face, name))
        try:
            text = read_plain(file)
        except OSError as error:
            yield f"{path}.{name}", f"E171 {file}: {error.strerror or error}{_cure(error)}"
            continue
        kind = b"PRIVATE KEY-----" if name == "key" else b"-----BEGIN CERTIFICATE-----"
        if kind not in text:
            what = "private key" if name == "key" else "certificate"
            yield f"{path}.{name}", f"E174 {file} holds no {what} in PEM form; {_MAKE}"
        elif name == "key" and b"ENCRYPTED" in text:
            cure = (
                f"nobody is there to type it when the gateway starts: openssl pkey -in {file} -out NEW.key takes it off"
            )
            yield f"{path}.key", f"E174 {file} has a password, and {cure}"
        mode = stat.S_IMODE(file.stat().st_mode)
        if name == "key" and mode & (stat.S_IRWXO | stat.S_IWGRP):
            by = "used by everybody on this machine" if mode & stat.S_IRWXO else "changed by its group"
            yield f"{path}.key", f"E172 {file} can be {by} (mode {mode:03o}): chmod 600 {file}"


def _cure(error: OSError) -> str:
    if error.errno in (errno.EINVAL, errno.EISDIR):  # no plain file: it says so itself
        return ""
    return "; " + _CURES.get(type(error), "let the gateway's user read it")


def _unfit(path: str, face: TlsFace) -> Found:
    try:
        server = _server_of(face)
    except (ssl.SSLError, OSError, ValueError) as error:
        yield _unfit_key(path, face, error)
        return
    try:
        client = _client_of(face)
    except (ssl.SSLError, OSError) as error:
        yield f"{path}.ca", f"E174 {face.ca} cannot be used: {_reason(error)}; {_MAKE}"
        return
    if _is_in_its_days(face) and (code := _refusal(server, client)) and code != HAS_EXPIRED:
        yield f"{path}.certificate", _unwanted(face, code)


def _over(path: str, face: TlsFace) -> Found:
    shown = next(iter(_certificates(face.certificate)), None)
    if shown and _utc() > shown.ends:
        cure = f"until there is a new one no client connects; {_MAKE}"
        yield f"{path}.certificate", f"E173 {face.certificate} expired on {day_of(shown.ends)}: {cure}"
    elif _is_in_its_days(face) and not list(_unreadable(path, face)):
        with contextlib.suppress(ssl.SSLError, OSError, ValueError):  # a fault, and told as one
            if _refusal(_server_of(face), _client_of(face)) == HAS_EXPIRED:
                yield f"{path}.certificate", _unwanted(face, HAS_EXPIRED)


def _unwanted(face: TlsFace, code: int) -> str:
    why = _REFUSALS.get(code) or _why_unsigned(face)
    return f"E175 {face.certificate} {why}: no client that trusts {face.ca} would connect; {_MAKE}"


def _why_unsigned(face: TlsFace) -> str:
    own = _certificates(face.certificate)  # none of one that OpenSSL alone can read
    above = {each.subject for each in (*own[1:], *_certificates(face.ca))}
    if not own or own[0].issuer in above:
        return "is not signed by the CA of this face"
    cure = "if it is one between the two, put its certificate behind this one, in the same file"
    return f"is of a CA that is not in the file of `ca` ({cure})"


def _is_in_its_days(face: TlsFace) -> bool:
    shown = next(iter(_certificates(face.certificate)), None)
    return shown is None or shown.begins <= _utc() <= shown.ends


def _server_of(face: TlsFace) -> ssl.SSLContext:
    server = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    server.load_cert_chain(face.certificate, face.key, password=lambda: b"")
    return server


def _client_of(face: TlsFace) -> ssl.SSLContext:
    client = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    client.load_verify_locations(face.ca)
    return client


def _unfit_key(path: str, face: TlsFace, error: Exception) -> tuple[str, str]:
    if isinstance(error, ssl.SSLError) and error.reason in KEY_MISMATCHES:
        return f"{path}.key", f"E172 {face.key} does not fit {face.certificate}: take the two that were made together"
    what = f"E174 {face.certificate} with {face.key} cannot be used: {_reason(error)}; {_MAKE}"
    return f"{path}.certificate", what


def _refusal(server: ssl.SSLContext, client: ssl.SSLContext) -> int:
    """Shake hands in memory, as a client will that has the CA's file; return OpenSSL's number of why it would refuse, 0 where
    it would not, or nobody need tell it here."""
    client.check_hostname = False  # by which name it will be reached, nobody knows here
    to_client, to_server = ssl.MemoryBIO(), ssl.MemoryBIO()
    ends = (client.wrap_bio(to_client, to_server), server.wrap_bio(to_server, to_client, server_side=True))
    for end in ends * _FLIGHTS:
        try:
            end.do_handshake()
        except ssl.SSLWantReadError:
            continue
        except ssl.SSLCertVerificationError as error:
            return 0 if error.verify_code == NOT_YET_VALID else error.verify_code  # of its CA: told as its days are
        except ssl.SSLError:  # nothing that the files are to blame for
            break
    return 0


def _certificates(file: str) -> list[PeerCertificate]:
    """Return the certificates of a PEM file, in order; none where one cannot be read."""
    try:
        return read_certificates(read_plain(file))
    except (OSError, ValueError):
        return []


def _reason(error: Exception) -> str:
    if isinstance(error, ssl.SSLError) and error.reason:
        return error.reason.lower().replace("_", " ")
    return f"{error}"


def _utc(days: int = 0) -> str:
    return f"{datetime.now(UTC) + timedelta(days=days):%Y%m%d%H%M%S}Z"


FAULTS: Final[tuple[Check, ...]] = (check_tls_exposure, check_tls_files)
WARNINGS: Final[tuple[Check, ...]] = (check_tls_days, check_tls_allow, check_broker_files)
