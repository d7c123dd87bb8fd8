"""A connection to a broker, without one: what is sent is not lost, what was sent before is not obeyed, and nobody spins."""

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.telemetry.mqtt import broker_connection
from gateway.telemetry.mqtt.broker_connection import Broker, keep_connected
from gateway.telemetry.mqtt.broker_session import BrokerMessage


class MqttError(Exception):
    """The library's."""


class Session:
    """Says what is in `waiting`; answers every command with itself."""

    name, subscriptions, may_press = "cell", ("cell/command",), True

    def __init__(self, *payloads: bytes) -> None:
        self.ready = asyncio.Event()
        self.waiting = deque(BrokerMessage("cell/state", payload) for payload in payloads)
        self.lost = self.asked = 0
        self.answered: list[bytes] = []

    def begin(self) -> BrokerMessage:
        return BrokerMessage("cell/online", b"false", retain=True)

    def announce(self) -> Sequence[BrokerMessage]:
        return ()

    def next_message(self) -> BrokerMessage | None:
        self.asked += 1
        assert self.asked < 1000, "it spins"
        return self.waiting[0] if self.waiting else None

    def drop_sent(self) -> None:
        self.waiting.popleft()

    def lose(self) -> None:
        self.lost += 1

    def is_stop(self, payload: bytes) -> bool:
        return payload == b"stop"

    async def answer(self, topic: str, payload: bytes, why_not: str) -> Sequence[BrokerMessage]:
        self.answered.append(why_not.encode() or payload)
        return (BrokerMessage("cell/result", payload),)


class Library:
    """Stands for aiomqtt. publish: what becomes of what is said; heard: messages that the broker brings."""

    MqttError = MqttError

    def __init__(self, publish: Callable[[bytes], Awaitable[None]]) -> None:
        self.heard: asyncio.Queue[Any] = asyncio.Queue()
        self.answering = asyncio.Event()
        self.answering.set()
        self.told: list[tuple[str, int, bool]] = []
        self._publish = publish

    def Will(self, *words: Any, **more: Any) -> None: ...  # noqa: N802  the library's name

    def Client(self, *words: Any, queue_type: Any, **more: Any) -> "Library":  # noqa: N802
        self._queue = queue_type()
        return self

    async def __aenter__(self) -> "Library":
        return self

    async def __aexit__(self, *_: object) -> None: ...

    async def subscribe(self, topic: str, qos: int) -> tuple[()]:
        return ()

    async def unsubscribe(self, topic: str, timeout: float) -> None:
        await self.answering.wait()

    async def publish(self, topic: str, payload: bytes, qos: int, retain: bool) -> None:
        self.told.append((topic, qos, retain))
        await self._publish(payload)

    @property
    async def messages(self) -> AsyncIterator[Any]:
        while True:
            yield self._queue.put_nowait(await self.heard.get())

    def bring(self, payload: bytes, *, retain: bool, topic: str = "cell/command") -> None:
        self.heard.put_nowait(SimpleNamespace(topic=topic, payload=payload, retain=retain))


Scene = Callable[[Session, Library, list[bytes]], Awaitable[None]]


def play(
    monkeypatch: pytest.MonkeyPatch,
    scene: Scene,
    *payloads: bytes,
    publish: Callable[[bytes], Awaitable[None]] | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> Session:
    """Keep a connection while the scene is played. publish: instead of noting what is said."""

    async def run() -> Session:
        said = list[bytes]()

        async def note(payload: bytes) -> None:
            if publish:
                await publish(payload)
            said.append(payload)

        session, library = Session(*payloads), Library(note)
        monkeypatch.setattr(broker_connection, "import_library", lambda name: library)
        keeping = asyncio.create_task(keep_connected(Broker("b", 1883), session, say, again_s=0.0))
        async with asyncio.timeout(5.0):
            await scene(session, library, said)
        keeping.cancel()
        await asyncio.gather(keeping, return_exceptions=True)
        return session

    return asyncio.run(run())


async def turns(count: int = 50) -> None:
    for _ in range(count):
        await asyncio.sleep(0)


def test_a_command_of_yesterday_is_not_carried_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """One that waits in the broker, retained, would enable at each start of ours."""

    async def scene(session: Session, library: Library, said: list[bytes]) -> None:
        library.bring(b"yesterday", retain=True)
        library.bring(b"now", retain=False)
        await turns()
        assert session.answered == [b"now"] and said == [b"now"]

    play(monkeypatch, scene)


def test_a_stop_waits_for_the_command_that_is_carried_out_and_for_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """A flow that sent 5000 setpoints at once had its stop behind them carried out 110 s later."""
    held, going = asyncio.Event(), asyncio.Event()

    async def publish(payload: bytes) -> None:
        if payload == b"first":
            held.set()
            await going.wait()

    async def scene(session: Session, library: Library, said: list[bytes]) -> None:
        library.bring(b"first", retain=False)
        await held.wait()
        for number in range(5000):
            library.bring(b"%d" % number, retain=False)
        library.bring(b"stop", retain=False)
        await turns(20_000)
        going.set()
        await turns()
        assert session.answered[:2] == [b"first", b"stop"]
        assert session.answered[2].startswith(b"5000 commands were not carried out") and len(session.answered) == 3

    play(monkeypatch, scene, publish=publish)


def test_what_the_broker_has_not_taken_is_said_again(monkeypatch: pytest.MonkeyPatch) -> None:
    failures = [MqttError("broken pipe")]

    async def publish(payload: bytes) -> None:
        if failures:
            raise failures.pop()

    async def scene(session: Session, library: Library, said: list[bytes]) -> None:
        await turns()
        assert said == [b"1", b"2"]
        assert session.lost == 1, "and the session knows that there was none meanwhile"

    play(monkeypatch, scene, b"1", b"2", publish=publish)


def test_between_the_making_of_a_message_and_its_sending_nobody_speaks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Messages carry numbers in order: a host would take the gap for a loss."""
    gate = asyncio.Event()

    async def publish(payload: bytes) -> None:
        if payload == b"slow":
            await gate.wait()

    async def scene(session: Session, library: Library, said: list[bytes]) -> None:
        await turns()
        library.bring(b"command", retain=False)
        await turns()
        assert session.answered == []
        gate.set()
        await turns()
        assert said == [b"slow", b"command"]

    play(monkeypatch, scene, b"slow", publish=publish)


def test_who_has_nothing_to_say_waits_until_there_is_something(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(session: Session, library: Library, said: list[bytes]) -> None:
        session.ready.set()
        await turns()
        asked = session.asked
        await turns(500)
        assert session.asked == asked
        session.waiting.append(BrokerMessage("cell/state", b"later"))
        session.ready.set()
        await turns()
        assert said == [b"1", b"later"]

    play(monkeypatch, scene, b"1")


def test_who_comes_later_is_told_by_the_broker_what_is_to_stay_there(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(session: Session, library: Library, said: list[bytes]) -> None:
        session.waiting += [BrokerMessage("cell/state", b"{}", retain=True), BrokerMessage("cell/force", b"1", qos=1)]
        session.ready.set()
        await turns()
        assert library.told == [("cell/state", 0, True), ("cell/force", 1, False)]

    play(monkeypatch, scene)


class Told(Library):
    """The library, as far as it is told who connects; it never has a broker."""

    def __init__(self, *ends: Exception | None) -> None:
        self.ends = deque(ends)
        self.clients: list[dict[str, Any]] = []

    def TLSParameters(self, *files: str | None, **more: Any) -> Any:  # noqa: N802
        return (*files, *more.values())

    Will = TLSParameters

    def Client(self, host: str, port: int, **more: Any) -> "Told":  # noqa: N802
        self.clients.append(more | {"host": host, "port": port})
        return self

    async def __aenter__(self) -> "Told":
        end = self.ends.popleft()
        if end is not None:
            raise end
        return self

    async def publish(self, *words: Any, **more: Any) -> None:
        raise MqttError("broken pipe") if self.ends else asyncio.CancelledError


def connected(monkeypatch: pytest.MonkeyPatch, broker: Broker, library: Told) -> list[str]:
    """What is said while the library goes through its ends."""
    said = list[str]()
    monkeypatch.setattr(broker_connection, "import_library", lambda name: library)
    monkeypatch.setattr(broker_connection, "read_plain", lambda file: b"a key")
    monkeypatch.setattr(Session, "announce", lambda self: (BrokerMessage("cell/online", b"true"),))
    with pytest.raises(asyncio.CancelledError):
        asyncio.run(keep_connected(broker, Session(), said.append, again_s=0.0))
    return said


def test_a_broker_is_told_who_connects_and_known_by_its_certificate(monkeypatch: pytest.MonkeyPatch) -> None:
    library = Told(None)
    connected(monkeypatch, Broker("b", 8883, "me", "secret", "/ca", "/own", "/key"), library)
    (told,) = library.clients
    assert (told["host"], told["port"], told["username"], told["password"]) == ("b", 8883, "me", "secret")
    assert told["identifier"] == "force-gateway cell"
    assert told["tls_params"] == ("/ca", "/own", "/key")
    assert (told["clean_session"], told["keepalive"]) == (True, 10), "nothing of yesterday waits there for us"
    assert told["will"] == ("cell/online", b"false", 0, True)
    plain = Told(None)
    connected(monkeypatch, Broker("b", 1883), plain)
    assert plain.clients[0]["tls_params"] is None


def test_a_broker_that_goes_and_comes_is_told_once_each_time(monkeypatch: pytest.MonkeyPatch) -> None:
    away, back = "E181 the MQTT broker b:1883 is away", "the MQTT broker b:1883 is back"
    refused = ConnectionRefusedError("nobody listens")
    said = connected(monkeypatch, Broker("b", 1883), Told(None, refused, refused, None, MqttError("no"), None))
    assert [sentence.partition(" (")[0] for sentence in said] == [away, back, away, back]
    assert "(broken pipe)" in said[0]
    at_first = connected(monkeypatch, Broker("b", 1883), Told(refused, None))
    assert [sentence.partition(" (")[0] for sentence in at_first] == [away, back]


def test_a_name_that_another_gateway_has_as_well_is_told_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each took the other's place, and both said each two seconds, for ever, that the broker is away and back."""
    said = connected(monkeypatch, Broker("b", 1883), Told(*[None] * 40))
    away, back = "E181 the MQTT broker b:1883 is away", "the MQTT broker b:1883 is back"
    assert [sentence.partition(" (")[0] for sentence in said[:-1]] == [away, back, away, back]
    assert 'has another gateway the name "force-gateway cell" there' in said[-1]
