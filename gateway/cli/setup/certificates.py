"""A CA of one's own, a gateway's certificate and those of its clients: what `certs` writes.

Keys are ECDSA P-256: a handshake costs the control loop a third of what RSA costs it. cryptography is imported here only, never
in a process that controls.
"""

import os
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from gateway.modbus import Role
from gateway.modbus.certificate import ROLE_OID, encode_role
from gateway.plain_file import read_plain

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

CA_NAME: Final = "force-gateway test CA"
_SKEW: Final = timedelta(hours=1)  # a client's clock may be behind


@dataclass(frozen=True, slots=True)
class Signed:
    """A certificate with its private key."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey


def make_ca(days: int) -> Signed:
    """Return a new CA that signs for itself."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = _name(CA_NAME)
    builder = _begin(name, name, key, days)
    builder = builder.add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
    builder = builder.add_extension(_usage(signs=True), critical=True)
    return Signed(builder.sign(key, hashes.SHA256()), key)


def make_server(ca: Signed, hosts: "Sequence[str]", days: int) -> Signed:
    """Return a gateway's certificate for these names and addresses."""
    names = x509.SubjectAlternativeName([_host(host) for host in hosts])
    return _sign(ca, "force-gateway", days, (names, x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH])))


def make_client(ca: Signed, name: str, role: Role | str, days: int) -> Signed:
    """Return a client's certificate with its role; an empty text as the role leaves the extension out (for tests)."""
    extensions: list[x509.ExtensionType] = [x509.ExtendedKeyUsage([ExtendedKeyUsageOID.CLIENT_AUTH])]
    if role != "":
        value = encode_role(role) if isinstance(role, Role) else b"\x0c" + bytes((len(role),)) + role.encode()
        extensions.append(x509.UnrecognizedExtension(x509.ObjectIdentifier(ROLE_OID), value))
    return _sign(ca, name, days, extensions)


def load_ca(folder: Path) -> Signed:
    """Return the CA of a folder. ValueError or OSError where it cannot be read, or would sign for nothing."""
    certificate = x509.load_pem_x509_certificate(read_plain(folder / "ca.crt"))
    try:
        key = serialization.load_pem_private_key(read_plain(folder / "ca.key"), None)
    except TypeError:
        raise ValueError("ca.key has a password: openssl pkey -in ca.key -out NEW.key takes it off") from None
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise ValueError("ca.key is none over an elliptic curve, as certs makes them")
    if key.public_key() != certificate.public_key():
        raise ValueError("ca.key does not fit ca.crt")
    if certificate.not_valid_after_utc < datetime.now(UTC):
        raise ValueError(
            f"it expired on {certificate.not_valid_after_utc:%Y-%m-%d}, and all that it has signed with it"
        )
    return Signed(certificate, key)


def store(signed: "Mapping[str, Signed]", folder: Path) -> None:
    """Write NAME.crt of each, and NAME.key for its owner's eyes only: all of them or none, for half of a CA would stand in
    the way of the next. FileExistsError rather than to overwrite."""
    written: list[Path] = []
    try:
        for name, one in signed.items():
            for kind, data, mode in (("key", _key_of(one), 0o600), ("crt", _certificate_of(one), 0o644)):
                path = folder / f"{name}.{kind}"
                descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, mode)
                written.append(path)
                with os.fdopen(descriptor, "wb") as stream:
                    stream.write(data)
    except OSError:
        for path in written:
            path.unlink()
        raise


def _key_of(signed: Signed) -> bytes:
    return signed.key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )


def _certificate_of(signed: Signed) -> bytes:
    return signed.certificate.public_bytes(serialization.Encoding.PEM)


def _sign(ca: Signed, name: str, days: int, extensions: "Sequence[x509.ExtensionType]") -> Signed:
    key = ec.generate_private_key(ec.SECP256R1())
    builder = _begin(_name(name), ca.certificate.subject, key, days, ca.certificate.not_valid_after_utc)
    builder = builder.add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
    builder = builder.add_extension(_usage(signs=False), critical=True)
    authority = x509.AuthorityKeyIdentifier.from_issuer_public_key(ca.key.public_key())
    builder = builder.add_extension(authority, critical=False)
    for extension in extensions:
        builder = builder.add_extension(extension, critical=False)
    return Signed(builder.sign(ca.key, hashes.SHA256()), key)


def _begin(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePrivateKey, days: int, latest: datetime | None = None
) -> x509.CertificateBuilder:
    """latest: the end of who signs, for behind it nobody takes what it has signed."""
    now = datetime.now(UTC)
    ends = now + timedelta(days=days)
    ends = min(ends, latest) if latest else ends
    builder = x509.CertificateBuilder(subject_name=subject, issuer_name=issuer, public_key=key.public_key())
    builder = builder.serial_number(x509.random_serial_number())
    builder = builder.not_valid_before(min(now, ends) - _SKEW).not_valid_after(ends)
    return builder.add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)


def _usage(*, signs: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs, key_cert_sign=signs, crl_sign=signs, content_commitment=False,
        key_encipherment=False, data_encipherment=False, key_agreement=False, encipher_only=False, decipher_only=False,
    )  # fmt: skip


def _name(common_name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common_name)])


def _host(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(host))
    except ValueError:
        return x509.DNSName(host)
