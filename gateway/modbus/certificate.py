"""What a certificate says of a peer of Modbus/TCP Security: name, role, number and days. Bytes (DER) in, values out.

The role is the extension 1.3.6.1.4.1.50316.802.1, a UTF8String (MODBUS/TCP Security Protocol Specification, V36).
TLS has verified signature, chain and days before anybody asks here, so this reads the few places that it needs and no more.
Own code, because the control process must stay small: cryptography's x509 adds 13 MB to it, this nothing.
"""

from collections.abc import Iterator
from ssl import PEM_cert_to_DER_cert
from typing import Final, NamedTuple

from gateway.modbus.peer import Role

ROLE_OID: Final = "1.3.6.1.4.1.50316.802.1"
ROLES: Final = {role.name.lower(): role for role in Role}
"""What the extension may say."""
KEY_MISMATCHES: Final = ("KEY_VALUES_MISMATCH", "KEY_TYPE_MISMATCH", "NO_CERTIFICATE_ASSIGNED")
"""What OpenSSL says of a private key that is another certificate's, the last one of RSA beside EC: each has its own place."""
NO_ISSUER, NOT_YET_VALID, HAS_EXPIRED, WRONG_PURPOSE = 2, 9, 10, 26
"""What OpenSSL finds when it verifies: X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT, X509_V_ERR_CERT_NOT_YET_VALID,
X509_V_ERR_CERT_HAS_EXPIRED, X509_V_ERR_INVALID_PURPOSE. Python has no names for them."""
_BEGIN, _END = "-----BEGIN CERTIFICATE-----", "-----END CERTIFICATE-----"
_ROLE_OID_BYTES: Final = bytes.fromhex("2b060104018389 0c8622 01".replace(" ", ""))
_COMMON_NAME_BYTES: Final = bytes.fromhex("550403")
_UTF8, _UTC_TIME = 0x0C, 0x17
_ENCODINGS: Final = {0x14: "latin-1", 0x1C: "utf-32-be", 0x1E: "utf-16-be"}
"""Of a name, by its tag: TeletexString, in which old tools wrote Latin-1, UniversalString, BMPString; of all others UTF-8."""
_VERSION, _EXTENSIONS = 0xA0, 0xA3


class PeerCertificate(NamedTuple):
    """name: the subject's common name; role: what the extension says, empty where that is not one UTF8String, None without
    one; serial: in hex, as `openssl x509 -serial` has it; begins, ends: UTC as YYYYMMDDHHMMSSZ, which sort as the times do;
    subject, issuer: the whole names as the bytes stand there, to see which of several has signed which."""

    name: str
    role: str | None
    serial: str
    begins: str
    ends: str
    subject: bytes = b""
    issuer: bytes = b""


def read_certificate(der: bytes) -> PeerCertificate:
    """Return what a certificate says. ValueError for bytes that are none."""
    try:
        return _read_certificate(der)
    except (IndexError, ValueError) as error:
        raise ValueError(f"not a certificate ({error})") from None


def read_certificates(pem: bytes) -> list[PeerCertificate]:
    """Return what each certificate of a PEM text says, in order. ValueError where one cannot be read."""
    text = pem.decode("latin-1")  # notes between them may be in any encoding, OpenSSL passes over them
    _, *found = text.split(_BEGIN)
    return [read_certificate(PEM_cert_to_DER_cert(_BEGIN + each.split(_END, 1)[0] + _END)) for each in found]


def encode_role(role: Role) -> bytes:
    """Return the value of the role extension: a DER UTF8String."""
    text = role.name.lower().encode()
    return bytes((_UTF8, len(text))) + text


def _read_certificate(der: bytes) -> PeerCertificate:
    (_, whole), *_ = _parts(der)
    (_, signed), *_ = _parts(whole)
    fields = [part for part in _parts(signed) if part[0] != _VERSION]
    serial, _, issuer, validity, subject = (body for _, body in fields[:5])
    begins, ends = (_time(tag, body) for tag, body in _parts(validity))
    extensions = next((body for tag, body in fields[5:] if tag == _EXTENSIONS), b"")
    number = f"{int.from_bytes(serial, 'big'):X}"
    number = number.zfill(len(number) + len(number) % 2)
    return PeerCertificate(_common_name(subject), _role(extensions), number, begins, ends, subject, issuer)


def _parts(der: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield (tag, content) of each element. ValueError for lengths that do not fit."""
    at = 0
    while at < len(der):
        tag, length, at = der[at], der[at + 1], at + 2
        if length & 0x80:
            count = length & 0x7F
            if not 1 <= count <= 4:
                raise ValueError("a length that no certificate has")
            length, at = int.from_bytes(der[at : at + count], "big"), at + count
        if at + length > len(der):
            raise ValueError("it ends too early")
        yield tag, der[at : at + length]
        at += length


def _time(tag: int, body: bytes) -> str:
    """UTCTime has two digits of the year: below 50 they are 20.. (RFC 5280, section 4.1.2.5.1)."""
    text = body.decode("ascii")
    return text if tag != _UTC_TIME else ("20" if text < "50" else "19") + text


def _common_name(subject: bytes) -> str:
    """Of several the last, which is the most specific one (RFC 2818, section 3.1)."""
    name = ""
    for _, relative in _parts(subject):
        for _, pair in _parts(relative):
            (_, kind), (tag, value) = _parts(pair)
            if kind == _COMMON_NAME_BYTES:
                name = value.decode(_ENCODINGS.get(tag, "utf-8"))
    return name


def _role(extensions: bytes) -> str | None:
    found = []
    for _, listed in _parts(extensions):
        for _, extension in _parts(listed):
            (_, kind), *rest = _parts(extension)
            if kind == _ROLE_OID_BYTES:
                found.append(_utf8_string(rest[-1][1]))
    return found[0] if len(found) == 1 else "" if found else None  # each may stand there once (RFC 5280, 4.2)


def _utf8_string(der: bytes) -> str:
    """Empty for anything else: a role that cannot be read is none that is known, and the certificate still is one."""
    is_one = len(der) >= 2 and der[0] == _UTF8 and der[1] == len(der) - 2
    return der[2:].decode("utf-8", "backslashreplace") if is_one else ""
