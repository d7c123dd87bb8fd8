"""How a TLS connection ends, and its handshake: places are given back at once, nobody is served or judged behind the end."""

import ssl
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec

from gateway.cli.setup.certificates import make_client, store
from gateway.fieldbus.tls_server import _utc
from gateway.fieldbus.tls_settings import HANDSHAKE_S
from gateway.modbus import Role
from gateway.modbus.pdu import write_registers_request
from tests.certificates import DAYS, Folder, signed
from tests.fieldbus.by_hand import READ, READ_ANSWER, framed
from tests.fieldbus.tls.by_hand import VERSIONS, Face, Line, SocketInHand, client, face

__all__ = ["face"]


class SlowSocket(SocketInHand):
    """Takes its time to end, as one does whose far end reads nothing."""

    def _end(self, how: str) -> None:
        self.ended = how


def greeted(face: Face, folder: Folder, name: str = "setpoint") -> Line:
    line = Line(face, SlowSocket("127.0.0.1"))
    try:
        line.greet(client(folder, name))
    except ssl.SSLError:
        pass
    return line


def deliver(line: Line, data: bytes) -> int:
    """As a socket does, one that was told to stop too late as well; returns how much that was."""
    line.stream.data_received(data)
    return len(data)


@pytest.mark.parametrize("name", ["setpoint", "roleless"])
def test_a_handshake_that_is_over_holds_no_place_however_slowly_its_socket_goes(
    face: Face, folder: Folder, name: str
) -> None:
    """Eight that linger would keep everybody out."""
    line = greeted(face, folder, name)
    assert bool(line.socket.ended) is (name == "roleless")
    assert not face.handshakes.pending


def test_a_handshake_that_is_cut_holds_no_place_either(face: Face) -> None:
    line = Line(face, SlowSocket("127.0.0.1"))
    assert face.handshakes.pending
    line.stream.abort()
    assert not face.handshakes.pending


def test_the_bound_of_a_handshake_is_none_of_a_connection(face: Face, folder: Folder) -> None:
    line = greeted(face, folder)
    face.clock.advance(2.0 * HANDSHAKE_S)
    face.handshakes.sweep(face.clock.time())
    assert not line.socket.ended
    assert line.ask(framed(READ)) == framed(READ_ANSWER)


def test_behind_its_end_nobody_is_judged_again(face: Face, folder: Folder) -> None:
    line = greeted(face, folder, "roleless")
    told = list(face.log)
    deliver(line, b"\x16\x03\x03\x00\x02\x00\x00")
    assert face.log == told and len(told) == 1


def test_a_face_that_closes_begins_no_handshake(face: Face) -> None:
    face.shared.closing = True
    assert face.accept().socket.ended == "aborted"
    assert not face.handshakes.pending


def test_who_does_not_read_its_handshake_is_cut(face: Face) -> None:
    line = face.accept()
    line.stream.pause_writing()
    assert line.socket.ended == "aborted"


def signed_with_an_unreadable_name(path: Path) -> Folder:
    """Return the folder of a client whose name stands there as no text, as old tools wrote Latin-1."""
    ca, made = signed()["ca"], make_client(signed()["ca"], "cell-a", Role.SETPOINT, DAYS)
    names = made.certificate.tbs_certificate_bytes.replace(b"\x0c\x06cell-a", b"\x13\x06cell-\xe4")
    signature = b"\0" + ca.key.sign(names, ec.ECDSA(hashes.SHA256()))
    ecdsa_with_sha256 = bytes.fromhex("300a06082a8648ce3d040302")
    whole = names + ecdsa_with_sha256 + bytes((3, len(signature))) + signature
    pem = ssl.DER_cert_to_PEM_cert(b"\x30\x82" + len(whole).to_bytes(2) + whole)
    store({"unreadable": made, "ca": ca}, path)
    (path / "unreadable.crt").write_text(pem)
    return Folder(path)


def test_who_shows_a_certificate_that_cannot_be_read_is_told_of_and_let_go(face: Face, tmp_path: Path) -> None:
    """It would hold one of few places until its handshake had lasted too long."""
    line = face.accept()
    line.greet(client(signed_with_an_unreadable_name(tmp_path), "unreadable"))
    assert line.socket.ended and not face.handshakes.pending
    assert len(face.log) == 1 and face.log[0].startswith("W240 127.0.0.1:40000: not a certificate")


def test_who_cannot_be_written_to_any_more_is_cut(face: Face, folder: Folder) -> None:
    """Its answers would be nobody's, and its place be held until it has been idle for long enough."""

    class Refusing:
        def write(self, data: bytes) -> int:
            raise ssl.SSLError(1, "[SSL] protocol is shutdown")

    line = greeted(face, folder)
    line.stream._tls = Refusing()  # type: ignore[assignment]
    line.stream.write(framed(READ_ANSWER))
    assert line.socket.ended == "aborted"


@pytest.mark.parametrize("version", VERSIONS)
def test_an_end_is_told_to_the_far_end(face: Face, folder: Folder, version: ssl.TLSVersion) -> None:
    """Else it cannot tell an end from somebody who has cut the wire (truncation)."""
    line = face.accept()
    line.greet(client(folder, "setpoint", version))
    line.stream.close()
    line.incoming.write(line.socket.take())
    assert line.tls.read(1) == b""


@pytest.mark.parametrize("version", VERSIONS)
def test_who_says_goodbye_is_let_go_though_its_socket_stays_open(
    face: Face, folder: Folder, version: ssl.TLSVersion
) -> None:
    line = face.accept()
    line.greet(client(folder, "setpoint", version))
    with pytest.raises(ssl.SSLWantReadError):
        line.tls.unwrap()
    line.exchange()
    assert line.socket.ended and not face.shared.connections


def damaged(record: bytes) -> bytes:
    return record[:-1] + bytes((record[-1] ^ 1,))


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("broken", [damaged, lambda record: framed(READ), lambda record: 2 * record])
def test_who_goes_on_with_something_else_than_its_tls_is_told_of(
    face: Face, folder: Folder, version: ssl.TLSVersion, broken: Callable[[bytes], bytes]
) -> None:
    """As two threads of a client do that write to one connection: nobody said why it closes."""
    line = face.accept()
    line.greet(client(folder, "setpoint", version))
    assert line.ask(framed(READ)) == framed(READ_ANSWER)
    line.tls.write(framed(READ))
    line.send(broken(line.outgoing.read()))
    face.clock.advance(0.001)
    assert len(face.log) == 1 and face.log[0].startswith("W232 setpoint (127.0.0.1:40000): what came behind its last ")
    assert line.socket.ended and not face.shared.connections


def test_no_ticket_is_given_out_that_would_save_a_client_its_next_handshake(face: Face, folder: Folder) -> None:
    line = face.accept()
    line.greet(client(folder, "setpoint", ssl.TLSVersion.TLSv1_3))
    assert line.ask(framed(READ)) == framed(READ_ANSWER)
    assert not line.tls.session.has_ticket


def test_what_comes_while_a_connection_gives_way_waits_until_it_goes_on(face: Face, folder: Folder) -> None:
    """A limit of requests would else be none by TLS: what the socket had taken already was served."""
    line = greeted(face, folder)
    line.stream.pause_reading()
    line.tls.write(framed(READ))
    deliver(line, line.outgoing.read())
    assert not line.socket.take()
    line.stream.resume_reading()
    line.incoming.write(line.socket.take())
    assert line.tls.read(100) == framed(READ_ANSWER)


@pytest.fixture
def far_east(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("TZ", "XST-9")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@pytest.mark.usefixtures("far_east")
def test_certificates_are_judged_by_utc_wherever_the_machine_stands() -> None:
    # without an argument gmtime asks a clock that is a kernel's tick behind
    before, now, after = time.gmtime(time.time()), _utc(), time.gmtime(time.time())
    assert f"{time.strftime('%Y%m%d%H%M%S', before)}Z" <= now <= f"{time.strftime('%Y%m%d%H%M%S', after)}Z"


def send_pile(face: Face, folder: Folder, host: str, records: int, turn_s: float) -> None:
    """Have records of one request each wait in the socket, and the loop turn once in so long."""
    line = Line(face, SocketInHand(host))
    line.greet(client(folder, "setpoint"))
    for _ in range(records):
        line.tls.write(framed(write_registers_request(0, bytes(26))))
    stream = line.outgoing.read()
    while stream:
        if line.socket.reading:
            stream = stream[deliver(line, stream[:1024]) :]
        face.clock.advance(turn_s)


def test_what_waits_in_a_pile_of_records_of_one_request_each_is_known_as_asked_for_a_while_ago(
    face: Face, folder: Folder
) -> None:
    """None of them fills a connection's buffer: of a master that was long gone each heartbeat counted."""
    send_pile(face, folder, "192.0.2.7", 300, 0.005)
    face.clock.advance(1.0)
    behind = [peer.is_behind for _, _, peer in face.bank.writes]
    assert len(behind) == 300
    assert not any(behind[:60]) and all(behind[150:280]) and not behind[-1]


def test_that_is_known_of_a_client_of_this_machine_too(face: Face, folder: Folder) -> None:
    """One behind a tunnel, say, has no rate; its records went the way of a plain request that comes alone, and the force of one
    that had hung was kept for 13 s."""
    send_pile(face, folder, "127.0.0.1", 600, 0.02)
    behind = [peer.is_behind for _, _, peer in face.bank.writes]
    assert len(behind) == 600
    assert not any(behind[:100]) and all(behind[250:560])


def test_a_tls_client_with_forty_requests_under_way_is_not_late(
    face: Face, folder: Folder, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What waits is encrypted, more than half as much again: beside the plain bytes that were taken it was 0.3 s of them."""
    monkeypatch.setattr("gateway.fieldbus.connection.count_waiting", lambda transport: 40.0 * 61.0)
    line = Line(face, SocketInHand("192.0.2.7"))
    line.greet(client(folder, "setpoint"))
    for _ in range(400):
        line.tls.write(framed(write_registers_request(0, bytes(26))))
    stream = line.outgoing.read()
    while len(stream) > 1024:
        if line.socket.reading:
            stream = stream[deliver(line, stream[:1024]) :]
        face.clock.advance(0.005)
    assert len(face.bank.writes) > 300 and not any(peer.is_behind for _, _, peer in face.bank.writes)
