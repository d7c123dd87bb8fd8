"""How a connection ends: deadlines, too many of one address, and who is told."""

from dataclasses import replace
from ipaddress import ip_network
from typing import Any

import pytest

from gateway.fieldbus.connection import GIVES_WAY_S
from gateway.fieldbus.peers import Peers
from gateway.fieldbus.socket_transport import READ_BYTES
from gateway.modbus import Role, pdu
from tests.fieldbus.by_hand import READ, framed

FAR = "192.0.2.7"


def test_half_a_request_is_waited_for_no_longer_than_partial_s(stand: Any, deliver: Any) -> None:
    made = stand(partial_s=5.0)
    connection, far = made.connect()
    deliver(connection, far, framed(READ)[:7])
    made.clock.advance(0.5)
    connection.sweep(made.clock.time())
    made.clock.advance(4.25)
    connection.sweep(made.clock.time())
    assert not far.ended
    made.clock.advance(0.25)
    connection.sweep(made.clock.time())
    assert (far.ended, made.log[0][0]) == ("closed", "partial")


@pytest.mark.parametrize("every_s", [1.0, 0.5])
def test_a_byte_now_and_then_does_not_keep_half_a_request_alive(stand: Any, deliver: Any, every_s: float) -> None:
    """Nor one for each look at the connection."""
    made = stand(partial_s=8.0 * every_s)
    connection, far = made.connect()
    for byte in framed(READ)[:11]:
        deliver(connection, far, bytes((byte,)))
        made.wait(every_s)
    assert (far.ended, made.log[0][0]) == ("closed", "partial")


def test_a_frame_that_ends_late_starts_the_next_one_s_time_anew(stand: Any, deliver: Any) -> None:
    made = stand(partial_s=5.0)
    connection, far = made.connect()
    for number in range(6):
        deliver(connection, far, framed(READ, transaction=number)[:6])
        made.wait(3.0)
        deliver(connection, far, framed(READ, transaction=number)[6:])
    assert (far.writes, far.ended) == (6, "")


def test_so_does_one_whose_end_comes_with_the_next_one_s_beginning(stand: Any, deliver: Any) -> None:
    made = stand(partial_s=5.0)
    connection, far = made.connect()
    stream = framed(READ) * 7
    deliver(connection, far, stream[:6])
    for number in range(6):
        made.wait(3.0)
        deliver(connection, far, stream[12 * number + 6 : 12 * number + 18])
    assert (far.writes, far.ended) == (6, "")


def test_an_idle_connection_is_closed_and_a_busy_one_is_not(stand: Any, deliver: Any) -> None:
    made = stand(idle_s=60.0)
    (busy, near), (_quiet, far) = made.connect(), made.connect()
    for number in range(13):
        deliver(busy, near, framed(READ, transaction=number))
        made.wait(5.0)
    assert (near.ended, far.ended, made.log[0][0]) == ("", "closed", "idle")


def test_connections_are_looked_at_in_the_order_in_which_they_came(stand: Any) -> None:
    """By their places in memory the log, and the masters that are shown, had another order in each process."""
    made = stand(idle_s=60.0)
    ports = list(range(40020, 40000, -1))
    ends = [made.connect(port=port) for port in ports]
    assert [one.peer.port for one in made.shared.connections] == ports
    ends[3][1].close()
    made.wait(60.5)
    assert len(made.log) == 10  # of a cause and second
    assert [sentence.split(":")[1] for _, sentence in made.log] == [str(port) for port in ports if port != ports[3]][
        :10
    ]


def test_who_begins_a_request_at_the_end_of_its_idle_time_is_heard_out(stand: Any, deliver: Any) -> None:
    """The other half of it came a moment later: the request was not executed, and who had just asked was told idle."""
    made = stand(idle_s=60.0, partial_s=5.0)
    connection, far = made.connect()
    made.wait(59.9)
    deliver(connection, far, framed(READ)[:7])
    made.wait(1.0)
    deliver(connection, far, framed(READ)[7:])
    assert (far.writes, far.ended) == (1, "")


def test_a_peer_that_does_not_let_go_is_cut(stand: Any, deliver: Any) -> None:
    made = stand(partial_s=5.0)
    connection, far = made.connect(stuck=True)
    deliver(connection, far, framed(READ) + b"\x00\x01\x00\x07\x00\x06")
    assert far.ended == "closed"
    made.wait(5.5)
    assert far.ended == "aborted"
    assert not made.shared.connections


def test_a_host_is_gone_with_its_last_connection(stand: Any) -> None:
    made = stand()
    ends = [made.connect(FAR) for _ in range(3)]
    for _connection, far in ends[:2]:
        far.close()
    assert made.closed == []
    ends[2][1].close()
    assert [peer.host for peer in made.closed] == [FAR]


def test_a_fifth_connection_of_one_address_is_refused_and_is_nobody_s_loss(stand: Any) -> None:
    made = stand()
    ends = [made.connect(FAR)[1] for _ in range(5)]
    assert [far.ended for far in ends] == ["", "", "", "", "aborted"]
    assert (made.closed, made.log[0][0]) == ([], "refused")
    assert len(made.shared.connections) == 4
    assert "4 connections from its address" in made.log[0][1]


def test_the_33rd_connection_is_refused_even_on_loopback(stand: Any) -> None:
    made = stand()
    ends = [made.connect()[1] for _ in range(33)]
    assert [far.ended for far in ends] == [""] * 32 + ["aborted"]


def test_a_master_that_lost_its_power_gets_the_place_of_its_silent_connection_back(stand: Any, deliver: Any) -> None:
    """Nobody is told of such an end: after four a robot was kept out for a minute."""
    made = stand()
    ends = [made.connect(FAR) for _ in range(4)]
    made.wait(GIVES_WAY_S + 1.0)
    for number in (0, 1, 3):
        deliver(*ends[number], framed(READ))
    made.wait(1.0)
    again = made.connect(FAR)[1]
    assert [far.ended for _, far in ends] == ["", "", "closed", ""]
    assert (again.ended, made.closed, len(made.shared.connections)) == ("", [], 4)
    assert "no request for 12 s, and another connection needs its place" in made.log[0][1]


def test_silent_connections_of_many_keep_nobody_out_and_who_has_only_one_keeps_it(stand: Any, deliver: Any) -> None:
    made = stand(connections=4)
    alone, many = made.connect("192.0.2.1")[1], [made.connect("192.0.2.2")[1] for _ in range(3)]
    made.wait(GIVES_WAY_S - 1.0)
    assert made.connect(FAR)[1].ended == "aborted", "none has been silent for long enough"
    made.wait(2.0)
    assert made.connect(FAR)[1].ended == ""
    assert (alone.ended, sorted(far.ended for far in many)) == ("", ["", "", "closed"])
    for name in ("192.0.2.3", "192.0.2.4"):
        made.connect(name)
    assert sorted(far.ended for far in many) == ["", "closed", "closed"]
    assert alone.ended == "" and len(made.shared.connections) == 4


def test_one_that_is_closing_already_gives_way_once(stand: Any, deliver: Any) -> None:
    made = stand()
    (closing, stuck), *others = made.connect(FAR, stuck=True), *(made.connect(FAR) for _ in range(3))
    made.wait(1.0)
    for connection, far in others:
        deliver(connection, far, framed(READ))
    made.wait(GIVES_WAY_S + 1.0)
    closing.give_way(made.clock.time())
    assert (stuck.ended, made.connect(FAR)[1].ended) == ("closed", "")
    assert sorted(far.ended for _, far in others) == ["", "", "closed"]


def test_who_has_been_silent_for_longest_gives_way_and_only_where_there_is_no_room(stand: Any, deliver: Any) -> None:
    made = stand(connections=4)
    ends = [made.connect("192.0.2.2") for _ in range(3)]
    made.wait(1.0)
    deliver(*ends[0], framed(READ))
    deliver(*ends[2], framed(READ))
    made.wait(GIVES_WAY_S + 1.0)
    made.connect("192.0.2.3")
    assert [far.ended for _, far in ends] == ["", "", ""], "there is room"
    made.connect("192.0.2.4")
    assert [far.ended for _, far in ends] == ["", "closed", ""]


def test_who_is_amid_a_request_does_not_give_way(stand: Any, deliver: Any) -> None:
    made = stand(connections=2, partial_s=60.0)
    ends = [made.connect("192.0.2.2") for _ in range(2)]
    made.wait(1.0)
    for connection, far in ends:
        deliver(connection, far, framed(READ)[:7])
    made.wait(GIVES_WAY_S + 1.0)
    assert (made.connect(FAR)[1].ended, [far.ended for _, far in ends]) == ("aborted", ["", ""])


def test_a_master_that_takes_its_own_silent_place_was_never_away(stand: Any) -> None:
    """Its command would be nobody's for a moment, and a lease of its own begins with that."""
    made = stand(per_address=1)
    silent = made.connect(FAR)[1]
    made.wait(GIVES_WAY_S + 1.0)
    assert (made.connect(FAR)[1].ended, silent.ended, made.closed) == ("", "closed", [])


def test_a_master_is_gone_with_the_last_of_its_connections_and_no_sooner(stand: Any) -> None:
    """A program that reads on one and writes on the other keeps its force where the first one ends."""
    made = stand()
    one, other = (made.connect(FAR, port=port)[1] for port in (40001, 40002))
    one.close()
    assert made.closed == []
    other.close()
    assert [(peer.host, peer.port) for peer in made.closed] == [(FAR, 40002)]


def test_who_is_not_allowed_takes_nobody_s_place(stand: Any) -> None:
    made = stand(connections=2, allow=(ip_network("192.0.2.0/24"),))
    made.shared.peers = Peers(made.settings, guarded=True)
    ends = [made.connect("192.0.2.1")[1] for _ in range(2)]
    made.wait(GIVES_WAY_S + 1.0)
    assert made.connect("198.51.100.1")[1].ended == "aborted"
    assert [far.ended for far in ends] == ["", ""]


def test_a_place_that_becomes_free_is_used_again(stand: Any) -> None:
    made = stand(connections=1)
    made.connect()[1].close()
    assert made.connect()[1].ended == ""


def test_what_waited_for_its_rate_is_not_executed_behind_the_end(stand: Any, deliver: Any) -> None:
    """The master is told as gone, and what it owned is free: a write of its own would come from nobody."""
    for end in ("close", "abort"):
        made = stand(requests_per_s=1.0)
        connection, far = made.connect(FAR)
        deliver(connection, far, framed(pdu.write_register_request(0, 1)) * 3)
        assert len(made.bank.writes) == 1 and not far.reading
        getattr(connection, end)()
        made.clock.advance(10.0)
        assert len(made.bank.writes) == 1 and made.closed == [connection.peer]


def test_lost_framing_is_told_once_also_where_it_fills_the_buffer(stand: Any, deliver: Any) -> None:
    made = stand()
    connection, far = made.connect(stuck=True)
    deliver(connection, far, framed(READ) + b"\x00\x01\x00\x07" * (READ_BYTES // 4))
    made.clock.advance(1.0)
    assert [cause for cause, _ in made.log] == ["framing"]


def test_nobody_is_admitted_while_the_server_closes(stand: Any) -> None:
    made = stand()
    made.shared.closing = True
    assert made.connect()[1].ended == "aborted" and not made.shared.connections


def test_a_peer_without_a_certificate_has_the_role_of_its_face(stand: Any) -> None:
    for role in Role:
        assert stand(role=role).connect()[0].peer.role is role


def test_of_two_certificates_on_one_machine_each_goes_with_its_own_last_connection(stand: Any) -> None:
    """Whose lease it is: another program beside it keeps nobody there."""
    made = stand()
    ends = []
    for name in ("robot", "robot", "plc"):
        connection, _ = made.connect(FAR)
        connection.peer = replace(connection.peer, name=name)
        ends.append(connection)
    ends[0].connection_lost(None)
    assert made.closed == []
    ends[1].connection_lost(None)
    assert [peer.name for peer in made.closed] == ["robot"]
