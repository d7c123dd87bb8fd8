"""A broker that takes its time to answer: what it brings meanwhile is old, and presses nothing."""

import asyncio

import pytest

from gateway.live.standstill import Standstill
from gateway.telemetry.mqtt import broker_connection
from gateway.telemetry.mqtt.broker_session import BrokerMessage
from gateway.telemetry.mqtt.command_queue import ROOM, CommandQueue
from gateway.telemetry.mqtt.round_trips import SLOW_S, RoundTrips
from tests.telemetry.mqtt.test_broker_connection import Library, Session, play, turns

JUST_S = SLOW_S - 0.01


class Clock:
    now_s = 50.0

    def __call__(self) -> float:
        return self.now_s


def test_what_comes_is_late_from_a_second_without_an_answer_until_a_quick_one() -> None:
    clock = Clock()
    trips = RoundTrips(clock)
    assert not trips.is_slow, "nothing was asked yet"
    for answered_s, is_slow in ((JUST_S, False), (SLOW_S + 0.01, True), (8.0, True), (JUST_S, False)):
        trips.note_asked()
        clock.now_s += answered_s
        trips.note_answered()
        assert trips.is_slow == is_slow
        clock.now_s += 60.0
        assert trips.is_slow == is_slow, "nothing is asked"
    trips.note_asked()
    clock.now_s += JUST_S
    assert not trips.is_slow
    clock.now_s += 0.02
    assert trips.is_slow, "before the answer has come"


def test_of_what_is_late_a_stop_alone_has_a_place() -> None:
    """Heartbeats that a publisher had piled up kept the force for 23 s after it had hung: as long as they took to be read."""
    clock = Clock()
    trips = RoundTrips(clock)

    async def scene() -> None:
        queue = CommandQueue(lambda payload: payload == b"stop", Standstill(clock), trips)
        queue.put("command", b"1")
        trips.note_asked()
        clock.now_s += 8.0
        for payload in (b"2", b"stop", b"3"):
            queue.put("command", payload)
        assert (await queue.get())[0].payload == b"stop"
        assert (queue.take_late(), queue.take_late(), queue.take_dropped()) == (2, 0, 1)
        trips.note_answered()
        queue.put("command", b"4")
        trips.note_asked()
        trips.note_answered()
        queue.put("command", b"5")
        assert (await queue.get())[0].payload == b"5" and queue.take_late() == 1

    asyncio.run(scene())


@pytest.mark.parametrize("may_press", [True, False])
def test_an_enable_that_the_broker_has_held_up_is_told_and_not_carried_out(
    monkeypatch: pytest.MonkeyPatch, may_press: bool
) -> None:
    """Its broker stood still for eight seconds, and the force began behind that. What asks for a birth may be old."""
    clock = Clock()
    monkeypatch.setattr(broker_connection, "RoundTrips", lambda _clock: RoundTrips(clock))
    monkeypatch.setattr(broker_connection, "ASK_S", 0.0)
    monkeypatch.setattr(Session, "may_press", may_press)

    async def scene(session: Session, library: Library, said: list[bytes]) -> None:
        await turns()
        library.answering.clear()
        await turns()
        clock.now_s += 8.0
        library.bring(b"enable", retain=False)
        await turns()
        library.answering.set()
        await turns()
        if not may_press:
            assert session.answered == [b"enable"]
            return
        (told,) = session.answered
        assert told.startswith(b"1 commands were not carried out: the broker took over 1 s")
        library.bring(b"now", retain=False)
        await turns()
        assert session.answered[1:] == [b"now"]

    play(monkeypatch, scene)


def test_a_broker_that_keeps_the_connection_and_never_answers_is_told_and_so_are_its_commands(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It answered PINGREQ and no UNSUBSCRIBE: no command was carried out, and neither log nor result said a word."""
    clock, told = Clock(), list[str]()
    monkeypatch.setattr(broker_connection, "RoundTrips", lambda _clock: RoundTrips(clock))
    monkeypatch.setattr(broker_connection, "ASK_S", 0.0)
    monkeypatch.setattr(broker_connection, "_KEEPALIVE_S", 0.0)

    async def scene(session: Session, library: Library, said: list[bytes]) -> None:
        for silence in (1, 2):
            library.answering.clear()
            await turns()
            clock.now_s += 29.9
            library.bring(b"enable", retain=False)
            await turns()
            assert len(told) == silence - 1 and len(session.answered) == silence - 1
            clock.now_s += 0.2
            await turns()
            assert len(told) == silence and told[-1].startswith("E181 the MQTT broker b:1883 has not answered")
            assert session.answered[-1].startswith(b"1 commands were not carried out")
            clock.now_s += 600.0
            await turns()
            assert len(told) == silence, "once"
            library.answering.set()
            await turns()

    play(monkeypatch, scene, say=told.append)
    assert len(told) == 2


def test_what_nobody_has_asked_the_broker_for_is_not_carried_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """A broker that brought `{"force_setpoint": 12, "control_word": 1}` on any topic at all had the tool pressed."""

    async def scene(session: Session, library: Library, said: list[bytes]) -> None:
        for topic in ("else", "cell", "cell/command/result", "cell/commandx", "other/cell/command", "cell/command"):
            library.bring(topic.encode(), retain=False, topic=topic)
        await turns()
        assert session.answered == [b"cell/command"]

    play(monkeypatch, scene)


def test_nothing_waits_in_the_library_where_nobody_sees_how_old_it_is() -> None:
    """Its own queue has no bound: 60 000 heartbeats of a publisher that was gone waited there for five minutes."""
    aiomqtt = pytest.importorskip("aiomqtt")
    paho = pytest.importorskip("paho.mqtt.client")
    clock = Clock()

    async def scene() -> None:
        queue = CommandQueue(lambda payload: payload == b"stop", Standstill(clock), RoundTrips(clock))
        will, kind = BrokerMessage("cell/online", b"false"), broker_connection._queue_type(queue, ("cell/command",))
        client = broker_connection._client(aiomqtt, broker_connection.Broker("b", 1883), "cell", will, kind)
        for payload, retain in ((b"yesterday", True), *((b"%d" % number, False) for number in range(5000))):
            message = paho.MQTTMessage(topic=b"cell/command")
            message.payload, message.retain = payload, retain
            client._on_message(None, None, message)
        assert len(client.messages) == 0
        heard = [(await queue.get())[0] for _ in range(ROOM)]
        assert [one.payload for one in heard] == [b"%d" % number for number in range(5000 - ROOM, 5000)]
        assert heard[0].topic == "cell/command" and queue.take_dropped() == 5000 - ROOM

    asyncio.run(scene())
