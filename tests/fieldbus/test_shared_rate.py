"""Connections of one address share its rate: each in its turn, and one that leaves takes nothing with it."""

from collections.abc import Callable
from typing import Any

import pytest

from gateway.fieldbus import connection as connection_module
from gateway.modbus import pdu
from tests.fieldbus.by_hand import READ, READ_ANSWER, framed
from tests.fieldbus.conftest import HandClock, HandTimer

FAR = "192.0.2.7"
PIPELINE = framed(READ) * 80
STEP_S = 0.001


class WholeMilliseconds(HandClock):
    """uvloop's: two that wait for the same request come back in one moment, in the order in which they have begun to wait."""

    def call_later(self, delay: float, callback: Callable[[], None]) -> HandTimer:
        timer = super().call_later(delay, callback)
        timer.at_s = round(timer.at_s, 3)
        return timer

    def advance(self, seconds: float) -> None:
        super().advance(seconds + 1e-6)
        self.now_s = round(self.now_s, 3)


def limited(stand: Any, requests_per_s: float) -> Any:
    made = stand(requests_per_s=requests_per_s)
    made.clock = made.shared.clock = WholeMilliseconds()
    return made


class Flood:
    """A connection that has its next requests on the wire whenever it is read."""

    def __init__(self, made: Any, deliver: Any) -> None:
        self.connection, self.far = made.connect(FAR)
        self._deliver, self._stream = deliver, b""

    def go_on(self) -> None:
        self._stream = self._stream or PIPELINE
        self._stream = self._stream[self._deliver(self.connection, self.far, self._stream) :]


def pass_time(made: Any, floods: list[Flood], seconds: float) -> None:
    for _ in range(round(seconds / STEP_S)):
        for flood in floods:
            flood.go_on()
        made.clock.advance(STEP_S)


@pytest.mark.parametrize("floods", [1, 3])
def test_who_asks_now_and_then_has_its_turn_beside_those_who_never_end(stand: Any, deliver: Any, floods: int) -> None:
    """A heartbeat beside a panel on the same machine: 200 requests a second are for both, and a lease may be 0.2 s."""
    made = limited(stand, 200.0)
    others = [Flood(made, deliver) for _ in range(floods)]
    pass_time(made, others, 1.0)
    connection, far = made.connect(FAR)
    for beat in range(1, 11):
        deliver(connection, far, framed(READ))
        pass_time(made, others, (floods + 1) / 200.0)
        assert far.writes == beat
        pass_time(made, others, 0.02)
    assert far.written == framed(READ_ANSWER) * 10


def test_a_place_of_one_that_leaves_is_free_again(stand: Any, deliver: Any) -> None:
    made = limited(stand, 4.0)
    connection, far = made.connect(FAR)
    deliver(connection, far, framed(READ))
    for _ in range(50):
        leaving, end = made.connect(FAR)
        deliver(leaving, end, framed(READ))
        assert not end.written
        end.abort()
    deliver(connection, far, framed(READ))
    made.clock.advance(0.25)
    assert far.written == framed(READ_ANSWER) * 2


def test_four_that_never_end_get_the_rate_together_and_each_its_part(stand: Any, deliver: Any) -> None:
    made = limited(stand, 200.0)
    floods = [Flood(made, deliver) for _ in range(4)]
    pass_time(made, floods, 2.0)
    counts = [len(flood.far.written) // len(framed(READ_ANSWER)) for flood in floods]
    assert sum(counts) == pytest.approx(50 + 200 * 2, abs=4)
    assert max(counts) - min(counts) <= 16, "a turn"


def test_who_piles_up_requests_is_told_that_its_stop_is_late_and_a_burst_is_not(stand: Any, deliver: Any) -> None:
    """300 a second of the 200 that are answered, and no answer waited for: after 20 s a stop took 10 s, and no line said so."""
    made = stand(requests_per_s=200.0)
    connection, far = made.connect(FAR)
    for _ in range(5):
        stream = framed(READ) * 180
        while stream:
            stream = stream[deliver(connection, far, stream) :]
            made.clock.advance(0.005)
        made.clock.advance(1.0)
    assert not made.log
    began_s, stream = made.clock.now_s, framed(READ) * 60_000
    while made.clock.now_s < began_s + 65.0:
        stream = stream[deliver(connection, far, stream) :]
        made.clock.advance(0.005)
        if len(made.log) == 1:
            assert made.clock.now_s >= began_s + 1.0
    told = f"W237 {FAR}:40000: asks more than 200 requests/s and waits for no answer"
    assert [sentence.startswith(told) for _, sentence in made.log] == [True, True], "at most once a minute"
    assert not far.ended


def test_what_waits_in_a_pile_is_known_as_asked_for_a_while_ago(stand: Any, deliver: Any) -> None:
    """A master that dies behind ten seconds of heartbeats would keep its force for as long."""
    made = stand(requests_per_s=200.0)
    connection, far = made.connect(FAR)
    write = framed(pdu.write_registers_request(0, bytes(26)))

    def pile_up(writes: int) -> list[bool]:
        made.bank.writes.clear()
        stream = write * writes
        while len(made.bank.writes) < writes:
            stream = stream[deliver(connection, far, stream) :]
            made.clock.advance(0.005)
        return [peer.is_behind for _, _, peer in made.bank.writes]

    assert not any(pile_up(100)), "a burst"
    piled = pile_up(600)
    began, ended = piled.index(True), len(piled) - piled[::-1].index(True)
    assert all(piled[began:ended]), "as long as it lasts"
    assert began < 0.5 * 200 + 50 and len(piled) - ended < 50
    assert not any(pile_up(20)), "and no longer"


def test_who_has_some_requests_under_way_and_takes_each_answer_is_not_late(
    stand: Any, deliver: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What waits behind a full read is soon answered at the pace at which it is taken."""
    monkeypatch.setattr(connection_module, "count_waiting", lambda _: 3000.0)
    made = stand()
    connection, far = made.connect()
    write = framed(pdu.write_registers_request(0, bytes(26)))
    stream = write * 8000
    for _ in range(200):
        stream = stream[deliver(connection, far, stream) :]
        made.clock.advance(0.01)
    assert len(made.bank.writes) > 1000 and made.log == []
    assert not any(peer.is_behind for _, _, peer in made.bank.writes)


def test_what_several_connections_of_one_machine_have_sent_for_more_than_a_second_has_waited(
    stand: Any, deliver: Any
) -> None:
    """None of them fills its buffer: at 50 requests/s they kept a force for four seconds behind the end of their master."""
    made = stand(requests_per_s=50.0)
    heartbeat = framed(pdu.write_registers_request(4, bytes(2)))
    for _ in range(4):
        connection, far = made.connect(FAR)
        assert deliver(connection, far, heartbeat * 60) == 60 * len(heartbeat)
    made.clock.advance(0.9)
    fresh = len(made.bank.writes)
    assert 40 < fresh < 70 and not any(peer.is_behind for _, _, peer in made.bank.writes)
    made.clock.advance(0.2)
    late = len(made.bank.writes)
    made.clock.advance(5.0)
    assert len(made.bank.writes) == 240
    assert all(peer.is_behind for _, _, peer in made.bank.writes[late:])
    deliver(connection, far, heartbeat)
    assert not made.bank.writes[-1][2].is_behind, "it waits for its answers again"
