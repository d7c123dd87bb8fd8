"""Modbus/TCP Security: who gets in and as what, what is said of those who do not, and that they leave nothing behind."""

import ssl
from contextlib import suppress
from datetime import UTC, datetime
from ipaddress import ip_network
from pathlib import Path

import pytest

from gateway.fieldbus import ServerSettings
from gateway.fieldbus.peers import Peers
from gateway.fieldbus.tls_settings import certificate_refusal, handshake_failure
from gateway.modbus import Role, pdu
from gateway.modbus.certificate import ROLES, PeerCertificate, read_certificate, read_certificates
from tests.certificates import Folder, serial_of
from tests.fieldbus.by_hand import READ, READ_ANSWER, framed
from tests.fieldbus.tls.by_hand import NOW, REFUSED, VERSIONS, Face, client, face

__all__ = ["face"]

READ_TWO = framed(READ, 7)


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("step", [1, 7, 4096])
def test_requests_by_tls_are_answered_however_their_bytes_come(
    face: Face, folder: Folder, version: ssl.TLSVersion, step: int
) -> None:
    line = face.accept()
    assert line.greet(client(folder, "setpoint", version)) == {"TLSv1_2": "TLSv1.2", "TLSv1_3": "TLSv1.3"}[version.name]
    assert line.ask(READ_TWO, step) == framed(READ_ANSWER, 7)
    many = b"".join(framed(READ, number) for number in range(300))
    assert line.ask(many, step) == b"".join(framed(READ_ANSWER, number) for number in range(300))


@pytest.mark.parametrize("role", list(Role))
def test_the_role_and_the_name_come_out_of_the_certificate(face: Face, folder: Folder, role: Role) -> None:
    line = face.accept()
    line.greet(client(folder, role.name.lower()))
    line.ask(framed(pdu.write_register_request(1, 500), 8))
    (peer,) = [peer for *_, peer in face.bank.writes]
    assert (peer.role, peer.name, peer.identity) == (role, role.name.lower(), f"certificate {role.name.lower()}")
    assert face.shared.settings.role is Role.SETPOINT, "what a plain face gives counts for nothing"
    line.socket.leave()
    assert face.closed == [peer] and not face.shared.connections


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize(("name", "sentence"), REFUSED)
def test_who_may_not_is_told_apart_and_leaves_nothing(
    face: Face, folder: Folder, name: str, sentence: str, version: ssl.TLSVersion
) -> None:
    line = face.accept()
    try:
        line.greet(client(folder, name, version))
    except ssl.SSLError:
        pass
    assert [told[: len(sentence)] for told in face.log] == [sentence]
    assert line.socket.ended and not face.handshakes.pending and not face.shared.connections
    assert face.closed == []


@pytest.mark.parametrize(
    "name", ["robot\n    18  2026-11-26T10:00:00.000Z  accepted  panel", "\x1b[2J", "tobor\u202e", 65 * "r"]
)
def test_who_has_a_name_that_would_forge_a_line_or_fill_the_log_is_turned_away(name: str) -> None:
    """Log, audit and owner tell of a client by its common name."""
    shown = PeerCertificate(name, "setpoint", "01", NOW, NOW)
    refusal = certificate_refusal(shown, frozenset(), NOW)
    assert refusal and refusal.startswith("W242 the certificate's common name is '") and refusal.isprintable()
    assert certificate_refusal(shown._replace(name=64 * "é"), frozenset(), NOW) is None


def test_a_certificate_that_is_not_yet_valid_and_one_that_ends_are_judged_at_each_connection(folder: Folder) -> None:
    """Resumed sessions show the certificate of the first handshake: our own look at its days counts."""
    for now in ("20000101000000Z", "20990101000000Z"):
        face = Face(folder, lambda now=now: now)
        face.accept().greet(client(folder, "setpoint"))
        assert face.log[0].startswith("W241 127.0.0.1:40000: the certificate of 'setpoint' is valid from 20")


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (READ_TWO, "it does not speak TLS"),
        (b"GET / HTTP/1.0\r\n\r\n", "it does not speak TLS"),
        (
            b"\x16\x03\x01\x00\x05garbage and more of it",
            "it does not speak TLS",
        ),
    ],
)
def test_what_is_no_tls_is_told(face: Face, data: bytes, sentence: str) -> None:
    line = face.accept()
    line.send(data + bytes(64))
    assert face.log and face.log[0].startswith("W244 127.0.0.1:40000: ")
    assert sentence in face.log[0]
    assert line.socket.ended and not face.handshakes.pending


def test_a_handshake_that_was_damaged_on_its_way_is_told_as_such(face: Face, folder: Folder) -> None:
    line = face.accept()
    line.incoming, line.outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
    line.tls = client(folder, "setpoint", VERSIONS[0]).wrap_bio(
        line.incoming, line.outgoing, server_hostname="127.0.0.1"
    )
    for carry in line.exchange, lambda: None:
        with suppress(ssl.SSLWantReadError):
            line.tls.do_handshake()
        carry()
    damaged = bytearray(line.outgoing.read())
    damaged[-1] ^= 1
    line.send(bytes(damaged))
    (told,) = face.log
    assert told.startswith("W244 127.0.0.1:40000: the handshake failed (") and "): it speaks no TLS" in told
    assert line.socket.ended


@pytest.mark.parametrize("version", [ssl.TLSVersion.TLSv1, ssl.TLSVersion.TLSv1_1])
def test_old_versions_are_refused(face: Face, folder: Folder, version: ssl.TLSVersion) -> None:
    with pytest.raises(ssl.SSLError):
        face.accept().greet(client(folder, "setpoint", version))
    assert face.log == [
        "W244 127.0.0.1:40000: it offers TLS 1.1 or older, or no cipher of ours: TLS 1.2 or 1.3 with P-256 is needed"
    ]


def test_a_client_that_does_not_trust_us_is_told(face: Face, folder: Folder) -> None:
    with pytest.raises(ssl.SSLCertVerificationError):
        line = face.accept()
        line.greet(client(folder, "foreign", ca="other-ca"))
    line.exchange()
    assert face.log[0].startswith("W240 127.0.0.1:40000: it refused our certificate")


def test_a_client_that_finds_us_expired_is_not_told_to_look_for_another_ca() -> None:
    error = ssl.SSLError(1, "sslv3 alert certificate expired")
    error.reason = "SSLV3_ALERT_CERTIFICATE_EXPIRED"
    told = handshake_failure(error)
    assert told.startswith("W240 ") and "expired" in told and "clock" in told and "give the client" not in told
    assert "start the gateway with it" in told, "a new one was made, and the old one served on"


def test_a_stranger_to_the_allow_list_begins_no_handshake(face: Face) -> None:
    face.shared.peers = Peers(ServerSettings(allow=(ip_network("10.0.0.0/8"),)), guarded=True)
    stranger, friend = face.accept("192.168.1.9"), face.accept("10.0.0.9")
    assert list(face.handshakes.pending) == [friend.stream] and stranger.socket.ended == "aborted"
    assert face.log == ["W230 192.168.1.9:40000: its address is in none of the allowed networks"]
    friend.socket.leave()


def test_nobody_renegotiates_and_a_resumed_session_is_judged_anew(face: Face, folder: Folder) -> None:
    context = client(folder, "setpoint", ssl.TLSVersion.TLSv1_2)
    line = face.accept()
    line.greet(context)
    assert face.handshakes.context.options & ssl.OP_NO_RENEGOTIATION
    face.handshakes.revoked = frozenset((serial_of("setpoint"),))
    again = face.accept()
    again.incoming, again.outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
    again.tls = context.wrap_bio(again.incoming, again.outgoing, server_hostname="127.0.0.1", session=line.tls.session)
    for _ in range(3):
        try:
            again.tls.do_handshake()
        except ssl.SSLError:
            pass
        again.exchange()
    assert again.tls.session_reused
    assert face.log[0].startswith("W245 ") and again.socket.ended and len(face.shared.connections) == 1


def test_our_reading_of_a_certificate_is_that_of_openssl(folder: Folder) -> None:
    for name in ("ca", "gateway", "setpoint", "roleless", "captain", "expired"):
        shown = read_certificate(ssl.PEM_cert_to_DER_cert(Path(folder.crt(name)).read_text()))
        theirs = ssl._ssl._test_decode_cert(folder.crt(name))  # type: ignore[attr-defined]
        subject = dict(pair for relative in theirs["subject"] for pair in relative)
        assert (shown.name, shown.serial) == (subject["commonName"], theirs["serialNumber"])
        moment = datetime.fromtimestamp(ssl.cert_time_to_seconds(theirs["notAfter"]), UTC)
        assert shown.ends == f"{moment:%Y%m%d%H%M%S}Z"
    assert {name: role_of(folder, name) for name in ("setpoint", "captain", "roleless", "gateway")} == {
        "setpoint": "setpoint",
        "captain": "captain",
        "roleless": None,
        "gateway": None,
    }


@pytest.mark.parametrize(
    ("kind", "written"),
    [(b"\x14", b"M\xfcnchen7"), (b"\x1c", "Mü".encode("utf-32-be")), (b"\x1e", "Münc".encode("utf-16-be"))],
)
def test_a_name_is_read_as_its_kind_of_text_is_written(folder: Folder, kind: bytes, written: bytes) -> None:
    """One of an old tool, in Latin-1, was turned away as no certificate at all."""
    der = ssl.PEM_cert_to_DER_cert(Path(folder.crt("setpoint")).read_text())
    name = b"\x55\x04\x03\x0c\x08setpoint"
    assert der.count(name) == 1
    shown = read_certificate(der.replace(name, name[:3] + kind + b"\x08" + written))
    assert "München7".startswith(shown.name) and len(shown.name) > 1 and shown.role == "setpoint"


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_notes_in_a_file_of_certificates_hide_none_of_them(folder: Folder, encoding: str) -> None:
    """As `openssl pkcs12` writes them. Nobody was told that such a certificate is about to end."""
    pem = Path(folder.crt("gateway")).read_bytes()
    noted = "Bag Attributes\n    friendlyName: Zelle Süd\n".encode(encoding) + pem
    assert read_certificates(noted + noted) == read_certificates(pem) * 2


def role_of(folder: Folder, name: str) -> str | None:
    return read_certificate(ssl.PEM_cert_to_DER_cert(Path(folder.crt(name)).read_text())).role


@pytest.mark.parametrize("said", [b"\x0c\x08\xff\xfetpoint", b"\x0c\x03setpoint", b"\x13\x08setpoint"])
def test_a_role_that_cannot_be_read_is_none_that_is_known(folder: Folder, said: bytes) -> None:
    """No UTF-8, more than it says, another kind of string: it is a certificate all the same, refused for its role."""
    der = ssl.PEM_cert_to_DER_cert(Path(folder.crt("setpoint")).read_text())
    assert der.count(b"\x04\x0a\x0c\x08setpoint") == 1
    shown = read_certificate(der.replace(b"\x04\x0a\x0c\x08setpoint", b"\x04\x0a" + said))
    assert shown.role is not None and shown.role not in ROLES


@pytest.mark.parametrize("der", ["3080", "30850000000000", "30850000000001ff"])
def test_a_length_of_no_bytes_or_of_more_than_four_is_none(der: str) -> None:
    with pytest.raises(ValueError, match="a length that no certificate has"):
        read_certificate(bytes.fromhex(der))


def test_a_certificate_that_is_cut_is_told_so() -> None:
    with pytest.raises(ValueError, match=r"not a certificate \(it ends too early\)"):
        read_certificate(bytes.fromhex("30050101"))


def test_no_bytes_break_the_reading(folder: Folder) -> None:
    der = ssl.PEM_cert_to_DER_cert(Path(folder.crt("setpoint")).read_text())
    for cut in range(len(der)):
        with pytest.raises(ValueError, match="not a certificate"):
            read_certificate(der[:cut])
    for place in range(0, len(der) - 2, 3):
        try:
            shown = read_certificate(der[:place] + b"\xff\xff" + der[place + 2 :])
        except ValueError:
            continue
        assert isinstance(shown.name, str)


@pytest.mark.parametrize(
    ("code", "message", "begins", "holds"),
    [
        (7, "certificate signature failure", "is not of our CA (", "same CA"),
        (20, "unable to get local issuer certificate", "is not of our CA, or comes without", "whole chain"),
        (34, "unhandled critical extension", "is not accepted (", "force-gateway certs"),
        (66, "EE certificate key too weak", "is not accepted (", "force-gateway certs"),
    ],
)
def test_who_has_a_certificate_of_our_ca_is_not_sent_to_look_for_another(
    code: int, message: str, begins: str, holds: str
) -> None:
    error = ssl.SSLCertVerificationError(1, message)
    error.reason, error.verify_code, error.verify_message = "CERTIFICATE_VERIFY_FAILED", code, message
    told = handshake_failure(error)
    assert told.startswith(f"W240 its certificate {begins}") and f"({message}): " in told and holds in told
