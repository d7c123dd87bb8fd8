"""A connection to an MQTT broker that is opened again for ever, and carries what a session has to say."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Any, Final

from gateway.extras import import_library
from gateway.live.standstill import Standstill
from gateway.plain_file import read_plain, tell_refusal
from gateway.telemetry.mqtt.broker_session import BrokerMessage, BrokerSession
from gateway.telemetry.mqtt.command_queue import CommandQueue
from gateway.telemetry.mqtt.round_trips import ASK_S, SLOW_S, RoundTrips

AGAIN_S: Final = 2.0
_KEEPALIVE_S: Final = 10
_SILENT_S: Final = 3.0 * _KEEPALIVE_S  # by then the keepalive has ended a connection that is dead
_SHORT_S: Final = 10.0
_CONNACK: Final = 2  # a type of packet (MQTT 3.1.1, 2.2.1)
_MOST_SHORT: Final = 3  # connections in a row; then it is no broker that comes and goes


@dataclass(frozen=True, slots=True)
class Broker:
    """Where it is, who we are there, and by which certificates it is known: paths of PEM files; no ca: no TLS."""

    host: str
    port: int
    username: str | None = None
    password: str | None = field(default=None, repr=False)
    ca: str | None = None
    certificate: str | None = None
    key: str | None = None


async def keep_connected(
    broker: Broker, session: BrokerSession, say: Callable[[str], None], again_s: float = AGAIN_S
) -> None:
    """Keep a connection, opened again when it is lost; say when the broker is away, and when it is back.

    MissingExtraError without aiomqtt.
    """
    aiomqtt = import_library("aiomqtt")
    loop = asyncio.get_running_loop()
    _tell_no_loss_twice(loop, aiomqtt.MqttError)
    news = BrokerNews(f"the MQTT broker {broker.host}:{broker.port}", _name_at_broker(session.name), say, loop.time)
    while True:
        will, queue = session.begin(), CommandQueue(session.is_stop, Standstill(), RoundTrips(loop.time))
        try:
            kind = _queue_type(queue, session.subscriptions)
            async with _client(aiomqtt, broker, session.name, will, kind) as client:
                unheard = await _subscribe(client, session)
                news.note_connected()  # one that does not answer a subscription is no broker that is back
                news.note_unheard(unheard)
                await _carry(client, session, queue, news)
        except* (aiomqtt.MqttError, OSError, UnicodeError) as lost:
            first = _first(lost)
            (news.note_refused if _is_refusal(first) else news.note_lost)(_reason(first))
        finally:
            session.lose()
        await asyncio.sleep(again_s)


class BrokerNews:
    """Says that the broker is away and back. Where it ends each connection at once, that is said instead, and once: two
    gateways of one name, by a copied rig file say, take each other's place every few seconds, and it was never away.
    clock: seconds."""

    def __init__(self, broker: str, name: str, say: Callable[[str], None], clock: Callable[[], float]) -> None:
        self._broker, self._name, self._say, self._clock = broker, name, say, clock
        self._is_away = self._is_silent = False
        self._refused = ""
        self._unheard: list[str] = []
        self._connected_s: float | None = None
        self._short = 0

    def note_connected(self) -> None:
        """Note that there is a connection."""
        self._connected_s = self._clock()
        if self._is_away:
            self._say(f"{self._broker} is back")
        self._is_away, self._refused = False, ""

    def note_unheard(self, topics: list[str]) -> None:
        """Note which topics the broker does not let us listen to; told once, for each connection says it again."""
        if topics and topics != self._unheard:
            self._say(
                f"E181 {self._broker} does not let this gateway listen to {' and '.join(topics)}: what is asked there is not "
                "heard. Allow its user to read there"
            )
        self._unheard = topics

    def note_waiting(self, waits_s: float) -> None:
        """Note for how long the answer is missing that says how old commands are: told once, until one is quick again."""
        if waits_s > _SILENT_S and not self._is_silent:
            self._say(
                f"E181 {self._broker} has not answered an UNSUBSCRIBE for {_SILENT_S:g} s: how old its commands are is not "
                "known, and none but a stop is carried out. A broker of MQTT 3.1.1 answers it (3.10.4): look at its log"
            )
        self._is_silent = waits_s > SLOW_S and (self._is_silent or waits_s > _SILENT_S)

    def note_refused(self, reason: str) -> None:
        """Note that it is there, and does not let us in: told, too, where it was away before, and once for each reason."""
        if reason != self._refused:
            self._say(
                f"E181 {self._broker} does not let this gateway in ({reason}): look at mqtt.username, password_file and tls, "
                "and at its log; data is kept meanwhile"
            )
        self._is_away, self._refused, self._short = True, reason, 0

    def note_lost(self, reason: str) -> None:
        """Note that it is lost, or that there was none to be had."""
        connected_s, self._connected_s = self._connected_s, None
        is_short = connected_s is not None and self._clock() - connected_s < _SHORT_S
        self._short = self._short + 1 if is_short else 0
        if self._short == _MOST_SHORT:
            self._say(
                f"E181 {self._broker} ends each connection within seconds ({reason}): has another gateway the name "
                f'"{self._name}" there, or may this one not publish? Data is kept meanwhile; not told again until one lasts'
            )
        elif self._short < _MOST_SHORT and not self._is_away:
            self._is_away = True
            self._say(f"E181 {self._broker} is away ({reason}); data is kept meanwhile")


def _tell_no_loss_twice(loop: asyncio.AbstractEventLoop, loss: type[Exception]) -> None:
    """Where the broker goes away in a subscription, or right behind its acceptance, aiomqtt leaves the loss on a future that
    nobody asks any more, and asyncio tells that as a traceback. It is told as E181."""

    def handle(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        is_forgotten = str(context.get("message", "")).startswith("Future exception was never retrieved")
        if not (is_forgotten and isinstance(context.get("exception"), loss)):
            loop.default_exception_handler(context)

    loop.set_exception_handler(handle)


def _name_at_broker(name: str) -> str:
    """Return a name under which a second gateway takes our place, and is not mixed with us."""
    return f"force-gateway {name}"


def _queue_type(queue: CommandQueue, topics: Sequence[str]) -> type[asyncio.Queue[Any]]:
    """Return the kind of queue that the library is to have for what it hears: one that hands all on at once. In its own, which
    has no bound, the heartbeats of a publisher that had hung waited for minutes, and none of them was late. topics: those
    that were asked for: what a broker brings of another one is somebody else's command."""

    class Handed(asyncio.Queue[Any]):
        def put_nowait(self, message: Any) -> None:
            topic = str(message.topic)
            if topic in topics and not message.retain:  # retained: of yesterday, which must never be carried out
                queue.put(topic, bytes(message.payload or b""))

    return Handed


def _client(aiomqtt: Any, broker: Broker, name: str, will: BrokerMessage, queue_type: type[asyncio.Queue[Any]]) -> Any:
    for file in filter(None, (broker.ca, broker.certificate, broker.key)):
        _check_readable(file)
    return aiomqtt.Client(
        broker.host,
        broker.port,
        identifier=_name_at_broker(name),
        tls_params=aiomqtt.TLSParameters(broker.ca, broker.certificate, broker.key) if broker.ca else None,
        username=broker.username,
        password=broker.password,
        keepalive=_KEEPALIVE_S,
        clean_session=True,
        queue_type=queue_type,
        will=aiomqtt.Will(will.topic, will.payload, qos=will.qos, retain=will.retain),
    )


def _check_readable(file: str) -> None:
    """Read a PEM file, as OpenSSL will, which does not say which of them it was. OSError with a sentence."""
    try:
        text = read_plain(file)
    except OSError as error:
        raise OSError(f"{file}: {tell_refusal(error)}") from None
    if b"ENCRYPTED" in text:  # OpenSSL asks for it at the terminal, and waits there
        raise OSError(f"{file} has a password: openssl pkey -in {file} -out NEW.key takes it off")


async def _subscribe(client: Any, session: BrokerSession) -> list[str]:
    """Listen to the session's topics; return those that the broker refuses. The library takes its no for an answer as well."""
    answers = [(topic, await client.subscribe(topic, qos=1)) for topic in session.subscriptions]
    return [topic for topic, codes in answers if any(code.is_failure for code in codes)]


async def _carry(client: Any, session: BrokerSession, queue: CommandQueue, news: BrokerNews) -> None:
    """Say what the session has, and have it answer, until the connection is lost."""
    turn = asyncio.Lock()  # messages carry numbers in order: nobody speaks between the making of one and its sending
    for message in session.announce():
        await _publish(client, message)
    async with asyncio.TaskGroup() as group:
        group.create_task(_send_messages(client, session, turn))
        group.create_task(_listen(client))
        group.create_task(_answer(client, session, queue, turn))
        group.create_task(queue.standstill.keep_time())
        if session.may_press:
            group.create_task(_keep_asking(client, session, queue, turn))
            group.create_task(_tell_silence(client, session, queue, turn, news))


async def _send_messages(client: Any, session: BrokerSession, turn: asyncio.Lock) -> None:
    while True:
        session.ready.clear()
        while True:
            async with turn:
                message = session.next_message()
                if message is None:
                    break
                await _publish(client, message)
                session.drop_sent()
        await session.ready.wait()


async def _listen(client: Any) -> None:
    """Wait for the end of the connection, which is told here; the messages have gone another way."""
    async for _ in client.messages:
        pass


async def _keep_asking(client: Any, session: BrokerSession, queue: CommandQueue, turn: asyncio.Lock) -> None:
    """Ask the broker for what it answers without effect (MQTT 3.1.1, 3.10.4): the end of a subscription that never was."""
    while True:
        queue.trips.note_asked()
        await client.unsubscribe("force-gateway/round-trip", timeout=inf)
        queue.trips.note_answered()
        await _tell_late(client, session, queue, turn)
        await asyncio.sleep(ASK_S)


async def _tell_silence(
    client: Any, session: BrokerSession, queue: CommandQueue, turn: asyncio.Lock, news: BrokerNews
) -> None:
    """Tell of a broker that keeps the connection alive and never answers that question: its commands came to nothing without
    a word."""
    while True:
        await asyncio.sleep(_KEEPALIVE_S)
        news.note_waiting(queue.trips.waits_s)
        if queue.trips.waits_s > _SILENT_S:
            await _tell_late(client, session, queue, turn)


async def _tell_late(client: Any, session: BrokerSession, queue: CommandQueue, turn: asyncio.Lock) -> None:
    if late := queue.take_late():
        why = f"{late} commands were not carried out: the broker took over {SLOW_S:g} s to answer, as old they may be"
        async with turn:
            for answer in await session.answer("", b"", why):
                await _publish(client, answer)


async def _answer(client: Any, session: BrokerSession, queue: CommandQueue, turn: asyncio.Lock) -> None:
    while True:
        message, why_not = await queue.get()
        async with turn:
            answers = [*await session.answer(message.topic, message.payload, why_not)]
            if dropped := queue.take_dropped():
                why = (
                    f"{dropped} commands were not carried out: more came than control takes, or a stop came behind them"
                )
                answers += await session.answer(message.topic, b"", why)
            for answer in answers:
                await _publish(client, answer)


async def _publish(client: Any, message: BrokerMessage) -> None:
    await client.publish(message.topic, message.payload, qos=message.qos, retain=message.retain)


def _first(lost: BaseException) -> BaseException:
    while isinstance(lost, BaseExceptionGroup):
        lost = lost.exceptions[0]
    return lost


def _is_refusal(first: BaseException) -> bool:
    """Decide whether the broker has answered our hello, by a no; the library's own class for it is not public."""
    return getattr(getattr(first, "rc", None), "packetType", 0) == _CONNACK


def _reason(first: BaseException) -> str:
    is_no_name = isinstance(first, UnicodeError)  # `a..b`, or a part of over 63 characters
    return "no such host name" if is_no_name else str(first)
