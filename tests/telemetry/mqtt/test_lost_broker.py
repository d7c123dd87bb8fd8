"""A broker that goes away at a bad moment of a connection is told once, as E181: futures that the library forgets are not."""

import asyncio
import gc
import logging
from typing import Any

import pytest

from gateway.telemetry.mqtt import broker_connection
from gateway.telemetry.mqtt.broker_connection import Broker, BrokerNews, keep_connected
from tests.telemetry.mqtt.test_broker_connection import Session

aiomqtt = pytest.importorskip("aiomqtt")

CONNACK, SUBACK = b"\x20\x02\x00\x00", b"\x90\x03\x00\x01\x01"
MOMENTS = {
    "at the subscription": [CONNACK, b""],
    "while the first message waits for its acknowledgement": [CONNACK, SUBACK, b""],
}
"""What the broker answers to each packet, before it closes."""


async def meet_once(answers: list[bytes], *, goes_away: bool = True) -> list[str]:
    """Let a session meet a broker that goes away like this, or stays; return what is said until the first is told."""
    said: list[str] = []
    told = asyncio.Event()

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        for answer in answers:
            await reader.read(1024)
            writer.write(answer)
        while not goes_away and await reader.read(1024):
            pass
        writer.close()

    def say(sentence: str) -> None:
        said.append(sentence)
        told.set()

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    host, port = server.sockets[0].getsockname()
    keeping = asyncio.create_task(keep_connected(Broker(host, port), Session(b"one"), say, again_s=60.0))  # type: ignore[arg-type]
    async with asyncio.timeout(20):
        await told.wait()
    server.close()
    keeping.cancel()
    await asyncio.gather(keeping, return_exceptions=True)
    return said


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """The library waits for an acknowledgement for 10 s."""
    make = broker_connection._client

    def make_impatient(*words: Any) -> Any:
        client = make(*words)
        client.timeout = 0.3
        return client

    monkeypatch.setattr(broker_connection, "_client", make_impatient)


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize("moment", MOMENTS)
def test_no_loss_is_told_a_second_time_by_a_future_that_nobody_asked(
    moment: str, caplog: pytest.LogCaptureFixture
) -> None:
    """A traceback stood in the log: Future exception was never retrieved."""
    with caplog.at_level(logging.ERROR, "asyncio"):
        (sentence,) = asyncio.run(meet_once(MOMENTS[moment]))
        gc.collect()
    assert sentence.startswith("E181")
    assert "never retrieved" not in caplog.text


def test_any_other_forgotten_exception_is_told_as_ever(caplog: pytest.LogCaptureFixture) -> None:
    async def forget() -> None:
        loop = asyncio.get_running_loop()
        broker_connection._tell_no_loss_twice(loop, aiomqtt.MqttError)
        loop.create_future().set_exception(KeyError("ours"))
        loop.call_exception_handler({"message": "Task was destroyed", "exception": aiomqtt.MqttError("its own")})

    with caplog.at_level(logging.ERROR, "asyncio"):
        asyncio.run(forget())
        gc.collect()
    assert "Future exception was never retrieved" in caplog.text and "ours" in caplog.text
    assert "Task was destroyed" in caplog.text


def test_a_topic_that_the_broker_does_not_let_us_hear_is_told() -> None:
    """By its access list, say. The gateway went on as if it listened, and commands came to nothing without a word."""
    (sentence,) = asyncio.run(meet_once([CONNACK, b"\x90\x03\x00\x01\x80"], goes_away=False))
    assert (
        sentence.startswith("E181 the MQTT broker") and "does not let this gateway listen to cell/command" in sentence
    )


@pytest.mark.usefixtures("impatient")
def test_a_broker_that_answers_no_subscription_is_away_and_that_is_told_once() -> None:
    """Every twelve seconds it was back, and away again, as long as it lasted."""

    async def meet() -> list[str]:
        said, met = list[str](), 0

        async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            nonlocal met
            met += 1
            await reader.read(1024)
            writer.write(CONNACK)
            while await reader.read(1024):
                pass
            writer.close()

        server = await asyncio.start_server(serve, "127.0.0.1", 0)
        host, port = server.sockets[0].getsockname()
        keeping = asyncio.create_task(keep_connected(Broker(host, port), Session(), said.append, again_s=0.0))  # type: ignore[arg-type]
        async with asyncio.timeout(20):
            while met < 3:
                await asyncio.sleep(0.05)
        server.close()
        keeping.cancel()
        await asyncio.gather(keeping, return_exceptions=True)
        return said

    (sentence,) = asyncio.run(meet())
    assert sentence.startswith("E181 the MQTT broker") and "is away" in sentence


def first_word(broker: Broker) -> str:
    """What is said first of this broker."""

    async def meet() -> str:
        said: asyncio.Queue[str] = asyncio.Queue()
        keeping = asyncio.create_task(keep_connected(broker, Session(), said.put_nowait, again_s=60.0))  # type: ignore[arg-type]
        saying = asyncio.create_task(said.get())
        try:
            async with asyncio.timeout(10):
                await asyncio.wait((keeping, saying), return_when=asyncio.FIRST_COMPLETED)
            return saying.result() if saying.done() else str(keeping.result())
        finally:
            keeping.cancel()
            saying.cancel()
            await asyncio.gather(keeping, saying, return_exceptions=True)

    return asyncio.run(meet())


@pytest.mark.parametrize("kind", ["a pipe", "a device"])
def test_a_certificate_that_is_no_file_is_told_and_not_waited_for(kind: str, tmp_path: Any) -> None:
    from tests.other_kinds import put

    put(kind, tmp_path / "ca.crt")

    sentence = first_word(Broker("127.0.0.1", 1, ca=str(tmp_path / "ca.crt")))
    assert sentence.startswith("E181") and f"it is {kind}" in sentence


@pytest.mark.parametrize("host", ["broker..plant", f"{'x' * 64}.plant"])
def test_a_name_that_no_host_can_have_is_told_and_does_not_end_the_process(host: str) -> None:
    assert first_word(Broker(host, 1)).startswith(f"E181 the MQTT broker {host}:1 is away (no such host name)")


@pytest.mark.parametrize("place", range(3))
def test_a_file_that_cannot_be_read_is_named(place: int, tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """OpenSSL does not say which: of a key that belongs to root a service said `Permission denied` and no more."""
    files = [str(tmp_path / name) for name in ("ca.crt", "cell.crt", "cell.key")]

    def read(file: str) -> bytes:
        if file == files[place]:
            raise PermissionError(13, "Permission denied", file)
        return b"of PEM"

    monkeypatch.setattr(broker_connection, "read_plain", read)
    assert f"is away ({files[place]}: Permission denied" in first_word(Broker("127.0.0.1", 1, None, None, *files))


def test_nobody_is_asked_for_the_password_of_a_key(tmp_path: Any) -> None:
    """OpenSSL asks at the terminal that the gateway was started in, and the client waits for the answer for ever."""
    key = tmp_path / "cell.key"
    key.write_text(
        "-----BEGIN ENCRYPTED PRIVATE KEY-----\nMA==\n-----END ENCRYPTED PRIVATE KEY-----\n", encoding="ascii"
    )
    for name in ("ca.crt", "cell.crt"):
        (tmp_path / name).touch()
    sentence = first_word(
        Broker("127.0.0.1", 1, None, None, *(f"{tmp_path}/{n}" for n in ("ca.crt", "cell.crt", "cell.key")))
    )
    assert sentence.startswith("E181") and f"{key} has a password: openssl pkey -in {key}" in sentence


def test_a_broker_that_ends_each_connection_at_once_is_not_away_and_is_told_once() -> None:
    """Two gateways of one name, a copied rig file, took each other's place: away and back were told every four seconds."""
    now_s, said = 100.0, list[str]()
    news = BrokerNews("the MQTT broker b:1883", "force-gateway cell", said.append, lambda: now_s)

    def connection(lasts_s: float) -> None:
        nonlocal now_s
        news.note_connected()
        now_s += lasts_s
        news.note_lost("Disconnected")

    for _ in range(100):
        connection(2.0)
    assert len(said) == 5
    assert said[-1].startswith("E181") and 'the name "force-gateway cell"' in said[-1]
    connection(60.0)
    assert said[-1].startswith("E181 the MQTT broker b:1883 is away (Disconnected)")
    connection(60.0)
    assert [sentence.partition(" (")[0] for sentence in said[5:]] == [
        "E181 the MQTT broker b:1883 is away",
        "the MQTT broker b:1883 is back",
        "E181 the MQTT broker b:1883 is away",
    ]
    news.note_lost("nobody listens")
    assert len(said) == 8, "it is away still"


def test_a_broker_that_refuses_who_we_are_is_not_away() -> None:
    """'is away (not authorized)' sent people to the network, and behind a broker that had come back with other passwords
    nothing more was said at all."""
    (sentence,) = asyncio.run(meet_once([b"\x20\x02\x00\x05"]))
    assert "does not let this gateway in ([code:135] Not authorized)" in sentence and "away" not in sentence
    said = list[str]()
    news = BrokerNews("the MQTT broker b:1883", "force-gateway cell", said.append, lambda: 0.0)
    news.note_lost("nobody listens")
    for reason in ("not authorized", "not authorized", "banned"):
        news.note_refused(reason)
        news.note_lost("nobody listens")
    news.note_connected()
    news.note_refused("banned")
    assert [sentence.removeprefix("E181 ").partition(";")[0][23:] for sentence in said] == [
        "is away (nobody listens)",
        "does not let this gateway in (not authorized): look at mqtt.username, password_file and tls, and at its log",
        "does not let this gateway in (banned): look at mqtt.username, password_file and tls, and at its log",
        "is back",
        "does not let this gateway in (banned): look at mqtt.username, password_file and tls, and at its log",
    ]


def test_a_refusal_between_them_begins_the_count_of_short_connections_anew() -> None:
    """By its users somebody has just looked after: what comes behind is another story, and gets three connections again."""
    said = list[str]()
    news = BrokerNews("the MQTT broker b:1883", "force-gateway cell", said.append, lambda: 0.0)
    for lost in (news.note_lost, news.note_lost, news.note_refused, news.note_lost, news.note_lost):
        news.note_connected()
        lost("gone")
    assert not [sentence for sentence in said if "within seconds" in sentence]
    news.note_connected()
    news.note_lost("gone")
    assert len([sentence for sentence in said if "within seconds" in sentence]) == 1


def test_what_the_broker_lets_nobody_hear_is_told_once_and_again_where_it_was_allowed_between() -> None:
    said = list[str]()
    news = BrokerNews("the MQTT broker b:1883", "force-gateway cell", said.append, lambda: 0.0)
    for topics in (["cell/command"], ["cell/command"], [], ["cell/command"]):
        news.note_unheard(topics)
    assert len(said) == 2
