"""A connection's laws with time and transport in the test's hand: cuts, limits, deadlines."""

import socket
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.fieldbus.socket_transport import READ_BYTES
from gateway.modbus import Adu, RequestFault, answer, pdu
from gateway.modbus.mbap import encode
from tests.fieldbus.by_hand import READ, framed
from tests.modbus.memory_bank import MemoryBank

FAR = "192.0.2.7"


def reads(count: int) -> bytes:
    return b"".join(framed(READ, transaction=number) for number in range(count))


def answered(transport: Any) -> list[int]:
    """Transaction ids of the reads that were answered, in order."""
    size = 6 + 3 + 4
    assert len(transport.written) % size == 0
    return [int.from_bytes(transport.written[at : at + 2], "big") for at in range(0, len(transport.written), size)]


requests = st.one_of(
    st.builds(pdu.read_request, st.sampled_from([3, 4]), st.integers(0, 220), st.integers(1, 125)),
    st.builds(pdu.write_register_request, st.integers(0, 220), st.integers(0, 0xFFFF)),
    st.builds(pdu.write_registers_request, st.integers(0, 220), st.just(bytes(26))),
    st.binary(min_size=1, max_size=20),
)
adus = st.builds(Adu, st.integers(0, 0xFFFF), st.sampled_from([0, 1, 255, 9]), requests)


@given(st.lists(adus, max_size=30), st.lists(st.integers(1, READ_BYTES), max_size=40))
def test_cutting_the_stream_elsewhere_changes_no_answer(
    stand: Any, deliver: Any, sent: list[Adu], sizes: list[int]
) -> None:
    """One frame per segment takes the short cuts, other cuts take the framer: same answers, same writes."""
    whole, cut = stand(), stand()
    (a, far_a), (b, far_b) = whole.connect(), cut.connect()
    for adu in sent:
        deliver(a, far_a, encode(adu))
    stream = b"".join(map(encode, sent))
    while stream:
        stream = stream[deliver(b, far_b, stream[: sizes.pop() if sizes else len(stream)]) :]
        cut.clock.advance(0.0)
    assert far_a.written == far_b.written
    assert whole.bank.writes == cut.bank.writes


@given(st.lists(adus, max_size=12))
def test_a_limited_peer_gets_the_answers_of_an_unlimited_one_only_later(
    stand: Any, deliver: Any, sent: list[Adu]
) -> None:
    slow = stand(requests_per_s=5.0)
    connection, far = slow.connect(FAR)
    stream = b"".join(map(encode, sent))
    while stream:
        stream = stream[deliver(connection, far, stream) :]
        slow.clock.advance(0.1)
    slow.clock.advance(10.0)
    bank, expected = MemoryBank(200, 16, slow.bank.identity), b""
    for adu in sent:
        served = adu.unit != 9
        reply = answer(adu.pdu, bank, connection.peer) if served else bytes((adu.pdu[0] | 0x80, 0x0B))
        expected += encode(Adu(adu.transaction, adu.unit, reply))
    assert far.written == expected


def test_half_a_request_is_acknowledged_at_once_and_a_whole_one_by_its_answer(stand: Any, deliver: Any) -> None:
    """Who sends single bytes waits for that with the rest of each request: 40 ms, unless it is told to acknowledge now."""
    connection, far = stand().connect()
    deliver(connection, far, framed(READ) * 2)
    assert far.options == []
    deliver(connection, far, framed(READ)[:1])
    assert far.options == [(socket.IPPROTO_TCP, socket.TCP_QUICKACK)]
    deliver(connection, far, framed(READ)[1:])
    assert answered(far) == [1, 1, 1] and len(far.options) == 1


def test_requests_in_one_segment_are_answered_in_one_write(stand: Any, deliver: Any) -> None:
    connection, far = stand().connect()
    deliver(connection, far, reads(5))
    assert (answered(far), far.writes) == ([0, 1, 2, 3, 4], 1)


def test_a_unit_that_is_not_served_is_a_silent_target(stand: Any, deliver: Any) -> None:
    connection, far = stand().connect()
    deliver(connection, far, framed(READ, transaction=7, unit=2))
    assert far.written == bytes.fromhex("0007 0000 0003 02 83 0b")


def test_a_write_is_in_the_bank_before_its_answer_is_sent(stand: Any, deliver: Any) -> None:
    made = stand()
    connection, far = made.connect()
    send, order = far.write, []
    connection._write = lambda data: (order.append(len(made.bank.writes)), send(data))
    deliver(connection, far, framed(pdu.write_register_request(1, 1200)))
    assert order == [1]
    assert made.bank.writes[0][2] == connection.peer


@pytest.mark.parametrize("seconds", [1.0, 5.0])
def test_a_client_gets_its_rate_and_no_exception(stand: Any, deliver: Any, seconds: float) -> None:
    made = stand(requests_per_s=200.0)
    connection, far = made.connect(FAR)
    stream = reads(4000)
    for _ in range(round(seconds / 0.005)):
        stream = stream[deliver(connection, far, stream) :]
        made.clock.advance(0.005)
    assert answered(far) == list(range(len(answered(far))))
    assert len(answered(far)) == pytest.approx(50 + 200 * seconds, abs=2), "a quarter second's burst, then the rate"


def test_what_waits_for_the_rate_is_one_buffer_at_most(stand: Any, deliver: Any) -> None:
    made = stand(requests_per_s=10.0)
    connection, far = made.connect(FAR)
    stream = reads(4000)
    for _ in range(50):
        stream = stream[deliver(connection, far, stream) :]
        assert not far.reading
        assert len(connection._framer) <= READ_BYTES
        made.clock.advance(0.1)


def test_a_client_below_its_rate_is_never_paused(stand: Any, deliver: Any) -> None:
    made = stand(requests_per_s=200.0)
    connection, far = made.connect(FAR)
    for number in range(400):
        deliver(connection, far, framed(READ, transaction=number))
        assert far.reading
        made.clock.advance(0.0051)
    assert answered(far) == list(range(400))


def test_connections_of_one_address_share_its_rate(stand: Any, deliver: Any) -> None:
    made = stand(requests_per_s=40.0)
    ends = [made.connect(FAR) for _ in range(2)]
    for connection, far in ends:
        deliver(connection, far, reads(30))
    assert sum(len(answered(far)) for _connection, far in ends) == 10


def test_loopback_has_no_rate(stand: Any, deliver: Any) -> None:
    made = stand(requests_per_s=1.0)
    connection, far = made.connect("127.0.0.1")
    deliver(connection, far, reads(80))
    made.clock.advance(0.0)
    assert answered(far) == list(range(80))


def test_after_sixteen_requests_the_others_have_their_turn(stand: Any, deliver: Any) -> None:
    """A turn of 85 refused writes took milliseconds, and 32 peers took it one after the other."""
    made = stand()
    connection, far = made.connect("127.0.0.1")
    deliver(connection, far, reads(80))
    assert len(answered(far)) == 16 and not far.reading
    made.clock.advance(0.0)
    assert answered(far) == list(range(80)) and far.reading


def test_a_full_buffer_gives_way_however_few_requests_it_holds(stand: Any, deliver: Any) -> None:
    made = stand()
    connection, far = made.connect()
    longest = framed(pdu.write_registers_request(0, bytes(246)))
    assert deliver(connection, far, 5 * longest) == READ_BYTES and not far.reading
    made.clock.advance(0.0)
    assert far.reading


def test_a_flood_gives_way_after_each_buffer_and_loses_nothing(stand: Any, deliver: Any) -> None:
    made = stand()
    connection, far = made.connect()
    stream, rounds = reads(1000), 0
    while stream:
        taken = deliver(connection, far, stream)
        assert taken <= READ_BYTES
        stream, rounds = stream[taken:], rounds + 1
        made.clock.advance(0.0)
    assert answered(far) == list(range(1000))
    assert rounds == -(-12000 // READ_BYTES)


def test_a_client_that_does_not_read_is_cut_at_the_cap(stand: Any, deliver: Any) -> None:
    made = stand(write_buffer_bytes=65536)
    connection, far = made.connect(stuck=True)
    largest = framed(pdu.read_request(3, 0, 125))
    for _ in range(10_000):
        deliver(connection, far, largest)
    assert far.ended == "aborted"
    assert 65536 < len(far.written) <= 65536 + 300
    assert [cause for cause, _sentence in made.log] == ["unread"]
    assert not made.shared.connections


def test_waiting_for_the_rate_is_not_the_client_s_delay(stand: Any, deliver: Any) -> None:
    made = stand(requests_per_s=0.1, partial_s=5.0, idle_s=8.0)
    connection, far = made.connect(FAR)
    deliver(connection, far, reads(2) + framed(READ)[:6])
    made.wait(9.0)
    assert (answered(far), far.ended) == ([0], "")
    made.wait(2.0)
    assert (answered(far), far.ended) == ([0, 1], "")


def test_nothing_after_lost_framing_is_executed(stand: Any, deliver: Any) -> None:
    made = stand()
    connection, far = made.connect(stuck=True)
    deliver(connection, far, framed(READ) + b"\x00\x01\x00\x07\x00\x06" + framed(pdu.write_register_request(0, 1)))
    connection.data_received(framed(READ))
    assert (answered(far), made.bank.writes) == ([1], [])


def test_a_request_inside_another_one_s_data_is_data(stand: Any, deliver: Any) -> None:
    """The rest of a split write looks exactly like a whole read, which the short cuts would answer."""
    made = stand()
    connection, far = made.connect()
    write = framed(pdu.write_registers_request(0, framed(READ)))
    deliver(connection, far, write[:-12])
    deliver(connection, far, write[-12:])
    assert far.written == framed(bytes.fromhex("10 0000 0006"))
    assert [data for _address, data, _peer in made.bank.writes] == [framed(READ)]


def test_what_comes_after_closing_is_not_executed(stand: Any, deliver: Any) -> None:
    made = stand(idle_s=1.0)
    connection, far = made.connect(stuck=True)
    made.wait(2.0)
    assert far.ended == "closed"
    far.reading = True
    deliver(connection, far, framed(pdu.write_register_request(0, 1)))
    assert (far.written, made.bank.writes) == (b"", [])


def test_a_bug_in_the_bank_cuts_the_connection_and_is_told(stand: Any, deliver: Any) -> None:
    made = stand(requests_per_s=1.0)
    connection, far = made.connect(FAR)

    def broken(*_: object) -> bytes:
        raise ZeroDivisionError

    made.bank.read_registers = broken
    with pytest.raises(ZeroDivisionError):
        deliver(connection, far, framed(READ))
    assert far.ended == "aborted"


def test_a_bug_found_while_going_on_after_a_pause_is_told_too(stand: Any, deliver: Any) -> None:
    made = stand(requests_per_s=1.0)
    connection, far = made.connect(FAR)
    deliver(connection, far, framed(READ) + framed(b"\x03\x00\x00\x00\x01"))

    def broken(*_: object) -> bytes:
        raise ZeroDivisionError

    made.bank.read_registers = broken
    with pytest.raises(ZeroDivisionError):
        made.clock.advance(2.0)
    assert far.ended == "aborted"
    made.clock.advance(5.0)


def test_a_foreign_unit_is_told_to_the_bank_with_its_peer(stand, deliver):
    made = stand()
    heard = []
    made.bank.note_refusal = lambda refusal, peer: heard.append(
        (refusal.fault, refusal.value, refusal.address, peer.host)
    )
    near, far = made.connect("10.0.0.5")
    deliver(near, far, framed(READ, unit=9) + framed(READ, unit=1))
    assert bytes(far.written[:9]) == bytes.fromhex("0001 0000 0003 09 83 0b")
    assert heard == [(RequestFault.UNIT, 9, 0, "10.0.0.5")]


@pytest.mark.parametrize(
    ("data", "code"), [(b"GET / HTTP/1.1\r\n\r\n", "W232 "), (b"\x00\x01\x00\x00\x00\x06", "W233 ")]
)
def test_a_connection_that_is_closed_for_its_peer_s_fault_says_so_with_a_code(stand, deliver, data, code):
    made = stand(partial_s=1.0)
    near, far = made.connect("10.0.0.5")
    deliver(near, far, data)
    made.wait(2.0)
    assert made.log[0][1].startswith(f"{code}10.0.0.5:40000: ")
