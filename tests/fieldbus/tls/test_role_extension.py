"""Role and number as a plant's own CA may have written them: what is not one UTF8String is no role, and is told as such."""

from collections.abc import Sequence
from datetime import UTC, datetime

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec

from gateway.fieldbus.tls_settings import certificate_refusal
from gateway.modbus.certificate import ROLE_OID, PeerCertificate, _common_name, read_certificate, read_certificates
from tests.certificates import signed

UNIX = datetime(1970, 1, 1, tzinfo=UTC)


def shown_by(
    *roles: bytes,
    serial: int = 0x77,
    begins: datetime | None = None,
    is_critical: bool = False,
    names: Sequence[str] = ("cell-7",),
) -> PeerCertificate:
    """Return what is read of a certificate with these values of the extension."""
    key, ca = ec.generate_private_key(ec.SECP256R1()), signed()["ca"]
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, each) for each in names])
    builder = x509.CertificateBuilder(name, name, key.public_key(), serial)
    builder = builder.not_valid_before(begins or ca.certificate.not_valid_before_utc)
    builder = builder.not_valid_after(max(ca.certificate.not_valid_after_utc, begins or UNIX))
    oid = x509.ObjectIdentifier(ROLE_OID)
    values = [x509.Extension(oid, is_critical, x509.UnrecognizedExtension(oid, role)) for role in roles]
    builder._extensions = values  # `add_extension` refuses a second one; other CAs do not
    return read_certificate(builder.sign(key, hashes.SHA256()).public_bytes(serialization.Encoding.DER))


def refusal_of(*roles: bytes) -> str | None:
    """Return what is said of it."""
    shown = shown_by(*roles)
    return certificate_refusal(shown, frozenset(), shown.ends)


def test_one_role_as_the_specification_has_it_is_taken() -> None:
    assert refusal_of(b"\x0c\x08setpoint") is None
    assert shown_by(b"\x0c\x08setpoint", is_critical=True).role == "setpoint", "as OpenSSL makes one with `critical`"


def test_of_two_common_names_the_last_is_the_one_of_the_device() -> None:
    """As OpenSSL and browsers take it: names go from the whole to the part."""
    assert shown_by(names=("plant", "cell-7")).name == "cell-7"


@pytest.mark.parametrize(
    "values",
    [
        (b"\x0c\x07monitor", b"\x0c\x05admin"),
        (b"\x0c\x05admin", b"\x0c\x05admin"),
        (b"\x13\x05admin",),
        (b"\x16\x05admin",),
        (b"\x1e\x0a\0a\0d\0m\0i\0n",),
        (b"admin",),
        (b"\x0c\x06admin",),
        (b"",),
    ],
)
def test_two_roles_or_one_in_another_encoding_are_told_as_such(values: tuple[bytes, ...]) -> None:
    """Of two the first one counted; of a PrintableString it was said that the certificate names the role ''."""
    told = str(refusal_of(*values))
    assert told.startswith("W242 the certificate of 'cell-7' has a role that is not one UTF8String")
    assert "''" not in told and f"{ROLE_OID} = ASN1:UTF8String:ROLE" in told


def test_an_unknown_role_is_named() -> None:
    assert "names the role 'Admin'" in str(refusal_of(b"\x0c\x05Admin"))
    assert "names no role" in str(refusal_of())


def test_a_number_that_openssl_prints_with_a_zero_ahead_is_revoked_as_it_stands_there() -> None:
    shown = shown_by(b"\x0c\x08setpoint", serial=0xABC12)
    assert shown.serial == "0ABC12"
    assert "(serial 0ABC12) is revoked" in str(certificate_refusal(shown, frozenset(("0ABC12",)), shown.ends))


@pytest.mark.parametrize("year", [1950, 1999, 2000, 2020, 2049])
def test_a_year_of_two_digits_is_of_the_century_that_the_standard_says(year: int) -> None:
    assert shown_by(begins=datetime(year, 3, 1, tzinfo=UTC)).begins.startswith(f"{year}0301")


def test_a_name_in_two_bytes_a_letter_is_read_as_it_stands() -> None:
    """BMPString, as some tools write any name that is no ASCII: another name would own the setpoint."""
    value = "Zelle Süd".encode("utf-16-be")
    parts = bytes((0x06, 3)) + bytes.fromhex("550403") + bytes((0x1E, len(value))) + value
    pair = bytes((0x30, len(parts))) + parts
    assert _common_name(bytes((0x31, len(pair))) + pair) == "Zelle Süd"


def test_what_is_no_certificate_is_told_and_notes_beside_one_are_passed_over() -> None:
    for der in (b"", b"\x30", b"\x30\x82\x01", bytes(40)):
        with pytest.raises(ValueError, match="not a certificate"):
            read_certificate(der)
    assert read_certificates("für Zelle 7".encode("latin-1")) == []
