"""What strangers may cost a TLS face: processor, places for handshakes, memory."""

import gc
import resource
import ssl
from collections.abc import Iterator
from contextlib import suppress
from itertools import islice
from pathlib import Path

import pytest

from gateway.fieldbus import tls_stream
from gateway.fieldbus.connection import _REQUESTS_IN_A_TURN, GIVES_WAY_S
from gateway.fieldbus.tls_settings import HANDSHAKE_S, MOST_PENDING, MOST_PENDING_OF_ONE
from gateway.fieldbus.tls_stream import LONGEST_RECORD
from gateway.modbus import pdu
from tests.certificates import Folder
from tests.fieldbus.by_hand import framed
from tests.fieldbus.tls.by_hand import REFUSED, VERSIONS, Face, client, face
from tests.fieldbus.tls.key_updates import ClientKeys, noting_secrets

__all__ = ["face"]
PYTHONS_OWN = 700, 10, 10


def test_a_stranger_cannot_choose_dear_arithmetic(face: Face, folder: Folder) -> None:
    """One hello with ffdhe8192 stalled the control loop by a quarter of a second, and its guardian replaced it."""
    dear, usual = client(folder, "setpoint"), client(folder, "setpoint")
    dear.set_ecdh_curve("secp521r1")
    usual.set_ecdh_curve("prime256v1")
    with pytest.raises(ssl.SSLError):
        face.accept().greet(dear)
    assert face.accept().greet(usual) == "TLSv1.3"
    assert face.log == [
        "W244 127.0.0.1:40000: it offers no group of ours: allow P-256 (secp256r1) for its key exchange"
    ]


@pytest.mark.parametrize("version", VERSIONS)
def test_requests_in_records_of_their_own_have_the_turns_of_others(
    face: Face, folder: Folder, version: ssl.TLSVersion
) -> None:
    """A record each, 120 refused writes came in one wake-up and took 7 ms; 32 peers made a stall, and the force was let go."""
    line = face.accept()
    line.greet(client(folder, "setpoint", version))
    for number in range(20):
        line.tls.write(framed(pdu.write_register_request(1, number)))
    line.stream.data_received(line.outgoing.read())
    assert len(face.bank.writes) <= _REQUESTS_IN_A_TURN and not line.socket.reading
    face.clock.advance(0.0)
    assert [int.from_bytes(words) for _, words, _ in face.bank.writes] == [*range(20)] and line.socket.reading


@pytest.mark.parametrize("answered", [False, True])
def test_who_changes_the_keys_without_end_is_cut(face: Face, folder: Folder, tmp_path: Path, answered: bool) -> None:
    """150 of them in 4 KB took 7 ms of the control loop, and each of 32 connections could send them for ever, only to read."""
    line = face.accept()
    line.greet(noting_secrets(client(folder, "monitor", ssl.TLSVersion.TLSv1_3), tmp_path / "secrets"))
    keys = ClientKeys(tmp_path / "secrets", line.tls.cipher()[0])
    for _ in range(50):  # what it has asked in hours is no credit
        line.send(keys.say(framed(pdu.read_request(3, 0, 2))))
        face.clock.advance(0.0)
    sent = 0
    for record in islice(keys.updates(answered), 1000):
        line.send(record)
        sent += len(record)
        if line.socket.ended:
            break
    assert LONGEST_RECORD < sent < LONGEST_RECORD + 100 and line.socket.ended == "aborted"
    assert face.log == ["W232 monitor (127.0.0.1:40000): TLS without end, and hardly a byte of Modbus in it, closed"]
    assert face.causes == ["framing"], "what else cannot be framed has its share of the log's lines, and no more"
    assert not face.shared.connections


def test_who_changes_the_keys_with_each_request_may(face: Face, folder: Folder, tmp_path: Path) -> None:
    line = face.accept()
    line.greet(noting_secrets(client(folder, "setpoint", ssl.TLSVersion.TLSv1_3), tmp_path / "secrets"))
    keys = ClientKeys(tmp_path / "secrets", line.tls.cipher()[0])
    updates = keys.updates(False)
    for number in range(1000):
        line.send(next(updates) + keys.say(framed(pdu.write_register_request(1, number))))
        face.clock.advance(0.0)
    assert len(face.bank.writes) == 1000 and not line.socket.ended


@pytest.mark.parametrize("version", VERSIONS)
def test_who_sends_byte_by_byte_in_records_of_their_own_may(
    face: Face, folder: Folder, version: ssl.TLSVersion
) -> None:
    line = face.accept()
    line.greet(client(folder, "setpoint", version))
    for number in range(200):
        for byte in framed(pdu.write_register_request(1, number)):
            line.tls.write(bytes((byte,)))
    line.send(line.outgoing.read())
    face.clock.advance(0.0)
    assert len(face.bank.writes) == 200 and not line.socket.ended


def test_eight_handshakes_at_a_time_each_at_most_five_seconds(face: Face) -> None:
    lines = [face.accept() for _ in range(MOST_PENDING)]
    face.accept()
    assert face.log == [f"W243 127.0.0.1:40000: {MOST_PENDING} handshakes are under way, the most allowed"]
    face.clock.advance(HANDSHAKE_S - 0.01)
    face.handshakes.sweep(face.clock.time())
    assert list(face.handshakes.pending) == [line.stream for line in lines]
    face.clock.advance(0.02)
    face.handshakes.sweep(face.clock.time())
    assert not face.handshakes.pending
    assert [line.socket.ended for line in lines] == ["aborted"] * MOST_PENDING
    assert face.log[1:] == ["W243 127.0.0.1:40000: the handshake was not finished within 5 s"] * MOST_PENDING


def test_who_shows_certificates_without_end_is_cut_before_they_are_judged(
    face: Face, folder: Folder, tmp_path: Path
) -> None:
    """240 of one name took 50 ms of the control loop to lead nowhere, and eight connections may shake hands at a time."""
    chain, own = tmp_path / "chain.pem", Path(folder.crt("foreign")).read_text()
    for copies, sentence in (
        (1, "W240 127.0.0.1:40000: its certificate is not of our CA"),
        (60, "W243 127.0.0.1:40000: more"),
    ):
        chain.write_text(copies * own)
        context = client(folder)
        context.load_cert_chain(chain, folder.key("foreign"))
        line = face.accept()
        with suppress(ssl.SSLError):
            line.greet(context)
        assert line.socket.ended and not face.handshakes.pending
        assert face.log.pop().startswith(sentence) and not face.log


def test_a_master_that_lost_its_power_gets_the_place_of_its_silent_connection_back(face: Face, folder: Folder) -> None:
    lines = [face.accept("10.0.0.7") for _ in range(4)]
    for line in lines:
        line.greet(client(folder, "setpoint"))
    face.clock.advance(1.0)
    for connection in tuple(face.shared.connections):
        connection.sweep(face.clock.time())
    assert face.accept("10.0.0.7").socket.ended == "aborted", "none has been silent for long enough"
    face.clock.advance(GIVES_WAY_S + 1.0)
    again = face.accept("10.0.0.7")
    assert [line.socket.ended for line in lines] == 4 * [""], "who has not shown a certificate takes nobody's place"
    again.greet(client(folder, "setpoint"))
    assert sorted(line.socket.ended for line in lines) == ["", "", "", "closed"] and not again.socket.ended
    assert len(face.shared.connections) == 4 and face.closed == []


def test_one_address_that_says_nothing_does_not_keep_the_others_out(face: Face) -> None:
    silent = [face.accept("10.0.0.7") for _ in range(MOST_PENDING)]
    assert [line.socket.ended for line in silent].count("aborted") == MOST_PENDING - MOST_PENDING_OF_ONE
    assert set(face.log) == {"W243 10.0.0.7:40000: 4 handshakes of this address are under way, the most allowed"}
    assert not face.accept("10.0.0.8").socket.ended


def test_one_address_has_twenty_handshakes_a_second_and_costs_no_other_any(face: Face) -> None:
    for _ in range(30):
        face.accept("10.0.0.7").socket.leave()
    assert face.log and all("more than 20 handshakes a second" in told for told in face.log)
    assert not face.accept("10.0.0.8").socket.ended
    face.clock.advance(0.06)  # of one
    face.handshakes.sweep(face.clock.time())
    again = [face.accept("10.0.0.7").socket for _ in range(2)]
    assert [each.ended for each in again] == ["", "aborted"], "a sweep gives none that were used back"
    again[0].leave()
    face.clock.advance(1.0)
    face.handshakes.sweep(face.clock.time())
    assert not face.handshakes.rates
    assert not face.accept("10.0.0.7").socket.ended


def failures(face: Face, folder: Folder, rounds: int) -> None:
    """Handshakes that fail in each way, and some that are begun and left."""
    contexts = [client(folder, name, version) for name, _ in REFUSED for version in VERSIONS]
    for number in range(rounds):
        line = face.accept()
        try:
            if number % 5 == 4:
                line.send(b"\x16\x03\x01\x02\x00\x01")
            else:
                line.greet(contexts[number % len(contexts)])
        except ssl.SSLError:
            pass
        line.socket.leave()


def test_sessions_of_clients_without_tickets_do_not_pile_up(
    face: Face, folder: Folder, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each took 10 kB for two hours: 76 MB for a PLC that connects anew every second."""
    monkeypatch.setattr(tls_stream, "MOST_SESSIONS", 10)
    context = client(folder, "setpoint", ssl.TLSVersion.TLSv1_2)
    context.options |= ssl.OP_NO_TICKET
    kept = []
    for _ in range(25):
        line = face.accept()
        line.greet(context)
        with suppress(ssl.SSLError):
            line.tls.unwrap()  # a client that closes well: its session is kept
        line.exchange()
        kept.append(face.handshakes.context.session_stats()["number"])
        face.handshakes.sweep(face.clock.time())
    assert kept == [*range(1, 12), *range(1, 12), 1, 2, 3]
    assert face.accept().greet(client(folder, "setpoint")) == "TLSv1.3"


def test_failed_handshakes_leave_nothing_behind(face: Face, folder: Folder) -> None:
    before = face.left
    failures(face, folder, 150)
    assert (len(face.handshakes.pending), len(face.shared.connections), face.left - before) == (0, 0, 0)
    assert face.shared.peers._open == {} and face.closed == []


@pytest.fixture
def collecting_as_usual() -> Iterator[None]:
    """Garbage is collected as often as in a gateway, not as seldom as in the gate (`conftest.py`)."""
    seldom = gc.get_threshold()
    gc.set_threshold(*PYTHONS_OWN)
    yield
    gc.set_threshold(*seldom)


@pytest.mark.long
def test_twenty_thousand_failed_handshakes_take_no_memory(
    face: Face, folder: Folder, collecting_as_usual: None
) -> None:
    failures(face, folder, 2000)
    before_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    failures(face, folder, 20_000)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kib <= 10 * 1024
