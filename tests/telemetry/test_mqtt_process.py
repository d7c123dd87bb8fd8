"""What the MQTT process makes of a rig file and tells its sessions: who is told what, how often, and by which certificates."""

import asyncio
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.profiles import Rig
from gateway.profiles.telemetry_sections import BrokerTls, Mqtt, SparkplugNode
from gateway.telemetry import mqtt_process
from gateway.telemetry.mqtt.broker_connection import Broker
from gateway.telemetry.mqtt.edge_node import EdgeNode
from gateway.telemetry.mqtt.json_topics import JsonTopics
from gateway.telemetry.mqtt_process import LOOK_S, Announcer, look_forever, make_sessions, publish
from tests.service.rigs import demo
from tests.telemetry.readings import holding


def rig_with(**mqtt: Any) -> Rig:
    return replace(demo(), mqtt=Mqtt(host="broker", **mqtt))


@pytest.mark.parametrize(
    ("mqtt", "names", "heard"),
    [
        ({}, ["force-gateway/demo"], ()),
        ({"base_topic": "hall/3"}, ["hall/3"], ()),
        ({"commands": True}, ["force-gateway/demo"], ("force-gateway/demo/command",)),
        ({"sparkplug": SparkplugNode(group="plant")}, ["force-gateway/demo", "spBv1.0/plant/demo"], ()),
        ({"sparkplug": SparkplugNode(group="plant", node="cell")}, ["force-gateway/demo", "spBv1.0/plant/cell"], ()),
    ],
)
def test_a_rig_says_who_is_told_and_whether_commands_are_heard(
    mqtt: dict[str, Any], names: list[str], heard: tuple[str, ...], tmp_path: Path
) -> None:
    link: Any = None
    sessions = make_sessions(rig_with(**mqtt), link, tmp_path)
    assert [type(one) for one in sessions] == [JsonTopics, EdgeNode][: len(names)]
    assert [one.name for one in sessions] == names
    assert tuple(sessions[0].subscriptions) == heard


def test_the_two_sessions_of_a_rig_have_two_names_at_the_broker_whatever_it_calls_them(tmp_path: Path) -> None:
    """As the page's own example has it: each took the other's place every two seconds, for ever."""
    link: Any = None
    rig = rig_with(base_topic="plant/cell-7", sparkplug=SparkplugNode(group="plant", node="cell-7"))
    assert len({one.name for one in make_sessions(rig, link, tmp_path)}) == 2


def test_each_session_is_told_at_each_look_what_control_says_and_that_it_says_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    answers: list[Any] = [holding().to_json(), ConnectionError("gone"), ValueError("busy"), holding().to_json()]
    offered: list[Any] = []
    now_s = [50.0]
    slept: list[float] = []

    async def ask(request: dict[str, Any]) -> dict[str, Any]:
        assert request == {"do": "state"}
        now_s[0] += 0.05
        answer = answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer  # type: ignore[no-any-return]

    async def sleep(duration_s: float) -> None:
        slept.append(duration_s)
        if not answers:
            raise asyncio.CancelledError

    clock = SimpleNamespace(monotonic=lambda: now_s[0], time=lambda: 1000.0)
    monkeypatch.setattr(mqtt_process, "time", clock)
    monkeypatch.setattr(mqtt_process, "asyncio", SimpleNamespace(sleep=sleep))
    sessions: Any = [SimpleNamespace(offer=lambda state, at_s, k=k: offered.append((k, state, at_s))) for k in (0, 1)]
    link: Any = SimpleNamespace(ask=ask)
    with pytest.raises(asyncio.CancelledError):
        asyncio.run(look_forever(link, sessions))
    assert [state.state if state else None for k, state, _ in offered if k == 0] == ["holding", None, None, "holding"]
    assert [state for _, state, _ in offered[::2]] == [state for _, state, _ in offered[1::2]]
    assert {at_s for _, _, at_s in offered} == {1000.0}
    assert slept == pytest.approx([LOOK_S - 0.05] * 4)


def test_what_both_connections_say_is_said_once_until_it_is_another() -> None:
    said: list[str] = []
    announcer = Announcer(said.append)
    for text in ("away", "away", "back", "back", "away"):
        announcer.say(text)
    assert said == ["away", "back", "away"]


@pytest.mark.parametrize(
    ("tls", "files"),
    [
        (None, (None, None, None)),
        (BrokerTls(ca="/ca.pem"), ("/ca.pem", None, None)),
        (BrokerTls(ca="/ca.pem", certificate="/own.pem", key="/key.pem"), ("/ca.pem", "/own.pem", "/key.pem")),
    ],
)
def test_the_broker_is_asked_with_the_password_of_its_file_and_the_certificates_of_the_rig(
    tls: BrokerTls | None, files: tuple[str | None, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    secret = tmp_path / "password"
    secret.write_text("a secret\n")
    rig = rig_with(port=8883, username="me", password_file=str(secret), tls=tls, sparkplug=SparkplugNode(group="p"))
    asked: list[tuple[Broker, Any]] = []
    said: list[tuple[str, str]] = []

    async def keep(broker: Broker, session: Any, say: Any) -> None:
        asked.append((broker, session))
        say("E181 away")

    async def look(link: Any, sessions: Any) -> None:
        assert len(sessions) == 2

    monkeypatch.setattr("gateway.profiles.kept_rig.load_rig", lambda name, simulated: rig)
    monkeypatch.setattr(mqtt_process, "keep_connected", keep)
    monkeypatch.setattr(mqtt_process, "look_forever", look)
    log: Any = lambda cause, sentence: said.append((cause, sentence))  # noqa: E731
    options = {"rig": "demo", "simulated": True, "fingerprint": rig.fingerprint, "state": str(tmp_path)}
    asyncio.run(publish(options, log))
    assert said == [("broker", "E181 away")], "both say the same"
    assert {broker for broker, _ in asked} == {Broker("broker", 8883, "me", "a secret", *files)}
    assert len({session.name for _, session in asked}) == 2


@pytest.mark.parametrize(("content", "why"), [(b"gehe\xeemnis", "is no text in UTF-8"), (None, "No such file")])
def test_a_password_that_cannot_be_read_is_told_by_its_file_and_not_shown(
    content: bytes | None, why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It ended in a traceback, four times, and then in the sentence that MQTT stays off."""
    secret = tmp_path / "password"
    if content:
        secret.write_bytes(content)
    rig = rig_with(password_file=str(secret))
    monkeypatch.setattr("gateway.profiles.kept_rig.load_rig", lambda name, simulated: rig)
    options = {"rig": "demo", "simulated": True, "fingerprint": rig.fingerprint, "state": str(tmp_path)}
    log: Any = None
    with pytest.raises(OSError, match=rf"^E181 mqtt\.password_file {secret}.*{why}") as raised:
        asyncio.run(publish(options, log))
    assert "gehe" not in str(raised.value)


def test_a_password_is_shown_to_nobody() -> None:
    assert "secret" not in repr(Broker("b", 1883, "me", "secret"))
