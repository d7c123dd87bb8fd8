"""A connection to an MQTT broker that is opened again for ever, and carries what a session has to say."""

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

from gateway.extras import import_library
from gateway.live.standstill import Standstill
from gateway.plain_file import check_plain
from gateway.telemetry.broker_session import BrokerMessage, BrokerSession
from gateway.telemetry.command_queue import CommandQueue

AGAIN_S: Final = 2.0
_KEEPALIVE_S: Final = 10
_LASTS_S: Final = 10.0  # a connection that was not taken away at once by another client of our name
_SHORT_ONES: Final = 3


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
    _tell_no_loss_twice(asyncio.get_running_loop(), aiomqtt.MqttError)
    losses = _Losses(f"the MQTT broker {broker.host}:{broker.port}", session.name, say)
    while True:
        will = session.begin()
        try:
            async with _client(aiomqtt, broker, session.name, will) as client:
                losses.note_open()
                await _carry(client, session)
        except* (aiomqtt.MqttError, OSError) as lost:
            losses.note_loss(_reason(lost))
        finally:
            session.lose()
        await asyncio.sleep(again_s)


class _Losses:
    """Says when the broker is away and back; and once, instead of that each two seconds for ever, that it ends connections as
    soon as they are open, as it does where two clients have one name: each takes the other's place."""

    def __init__(self, broker: str, name: str, say: Callable[[str], None]) -> None:
        self._broker, self._name, self._say = broker, name, say
        self._is_away = False
        self._opened_s: float | None = None
        self._short = 0  # connections without one that lasted between them

    def note_open(self) -> None:
        """Note that a connection is open."""
        self._opened_s = time.monotonic()
        if self._is_away and self._short < _SHORT_ONES:
            self._say(f"{self._broker} is back")
        self._is_away = False

    def note_loss(self, reason: str) -> None:
        """Note that it is lost, or that none was opened."""
        opened_s, self._opened_s = self._opened_s, None
        is_short = opened_s is not None and time.monotonic() - opened_s < _LASTS_S
        self._short = self._short + 1 if is_short else 0
        if self._short == _SHORT_ONES:
            ended = f"{self._broker} has ended {_SHORT_ONES} connections, each as soon as it was open ({reason})"
            cure = "Give each gateway a rig name, mqtt.base_topic and sparkplug.node of its own"
            who = f"does another gateway use the name {self._name!r} there, or does it forbid us a topic (see its log)?"
            self._say(f"E181 {ended}: {who} {cure}; what they send may be mixed up until then")
        elif self._short < _SHORT_ONES and not self._is_away:
            self._say(f"E181 {self._broker} is away ({reason}); data is kept meanwhile")
        self._is_away = True


def _tell_no_loss_twice(loop: asyncio.AbstractEventLoop, loss: type[Exception]) -> None:
    """Where the broker goes away in a subscription, or right behind its acceptance, aiomqtt leaves the loss on a future that
    nobody asks any more, and asyncio tells that as a traceback. It is told as E181."""

    def handle(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        is_forgotten = str(context.get("message", "")).startswith("Future exception was never retrieved")
        if not (is_forgotten and isinstance(context.get("exception"), loss)):
            loop.default_exception_handler(context)

    loop.set_exception_handler(handle)


def _client(aiomqtt: Any, broker: Broker, name: str, will: BrokerMessage) -> Any:
    for file in filter(None, (broker.ca, broker.certificate, broker.key)):
        check_plain(file)
    return aiomqtt.Client(
        broker.host,
        broker.port,
        identifier=f"force-gateway {name}",  # a second gateway of this name takes its place, and is not mixed with it
        tls_params=aiomqtt.TLSParameters(broker.ca, broker.certificate, broker.key) if broker.ca else None,
        username=broker.username,
        password=broker.password,
        keepalive=_KEEPALIVE_S,
        clean_session=True,
        will=aiomqtt.Will(will.topic, will.payload, qos=will.qos, retain=will.retain),
    )


async def _carry(client: Any, session: BrokerSession) -> None:
    """Say what the session has, and have it answer, until the connection is lost."""
    turn = asyncio.Lock()  # messages carry numbers in order: nobody speaks between the making of one and its sending
    for topic in session.subscriptions:
        await client.subscribe(topic, qos=1)
    for message in session.greet():
        await _publish(client, message)
    standstill = Standstill(asyncio.get_running_loop().time)
    queue = CommandQueue(session.is_stop, standstill)
    async with asyncio.TaskGroup() as group:
        group.create_task(_speak(client, session, turn))
        group.create_task(_listen(client, queue))
        group.create_task(_answer(client, session, queue, turn))
        group.create_task(standstill.keep_time())


async def _speak(client: Any, session: BrokerSession, turn: asyncio.Lock) -> None:
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


async def _listen(client: Any, queue: CommandQueue) -> None:
    async for message in client.messages:
        if not message.retain:  # of yesterday: a command that waits in the broker must never be carried out
            queue.put(str(message.topic), bytes(message.payload or b""))


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


def _reason(lost: BaseExceptionGroup[BaseException]) -> str:
    first: BaseException = lost
    while isinstance(first, BaseExceptionGroup):
        first = first.exceptions[0]
    return str(first)
