"""Plain JSON over MQTT: what is retained, what waits for the broker, what is heard, and what a rig file may say of it."""

import asyncio
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gateway.live.control_link import ANSWER_S, ControlLink
from gateway.live.live_state import LiveAlarm
from gateway.processes.json_socket.server import JsonLineServer
from gateway.profiles import ProfileError, load_rig, shipped_profiles_folder
from gateway.telemetry.mqtt.broker_session import BrokerMessage
from gateway.telemetry.mqtt.json_topics import JsonTopics
from gateway.telemetry.mqtt.register_commands import RegisterCommands, is_stop
from tests.telemetry.readings import holding


def drain(session: JsonTopics) -> list[tuple[str, Any, bool]]:
    sent = []
    while (message := session.next_message()) is not None:
        sent.append(told(message))
        session.drop_sent()
    return sent


def told(message: BrokerMessage) -> tuple[str, Any, bool]:
    return message.topic.removeprefix("cell/"), json.loads(message.payload), message.retain


def test_state_is_retained_and_force_comes_with_every_look() -> None:
    session = JsonTopics("cell", None)
    assert told(session.begin()) == ("online", False, True)
    session.offer(holding(), 1.0)
    online, state = (told(message) for message in session.announce())
    assert online == ("online", True, True)
    assert state[0] == "state" and state[1]["state"] == "holding" and state[2] is True
    drain(session)
    session.offer(replace(holding(), time_unix_s=5.0), 1.2)
    ((topic, force, retain),) = drain(session)
    assert (topic, force["measured_n"], force["time_unix_s"], retain) == ("force", 11.5, 1.2, False)
    for time_s, topics in ((10.9, ["force"]), (11.0, ["online", "state", "force"]), (20.9, ["force"])):
        session.offer(holding(), time_s)  # unchanged, and told again: somebody may have cleared what is retained
        assert [name for name, _, _ in drain(session)] == topics


def test_a_clock_that_is_set_back_keeps_nobody_from_being_told() -> None:
    """By a year, say: until then the state would have been told on changes only."""
    session = JsonTopics("cell", None)
    session.begin()
    session.announce()
    for time_s, topics in ((1e6, ["online", "state", "force"]), (9.0, ["online", "state", "force"]), (18.9, ["force"])):
        session.offer(holding(), time_s)
        assert [name for name, _, _ in drain(session)] == topics


def test_events_wait_for_the_broker_and_forces_do_not() -> None:
    session = JsonTopics("cell", None)
    session.begin()
    session.announce()
    session.offer(holding(), 1.0)
    session.lose()
    session.offer(replace(holding(), state="fault", warnings=()), 2.0)
    assert [one for one in drain(session) if one[0] != "online"] == [
        ("events", {"time_unix_s": 2.0, "event": "state", "value": "fault"}, False),
        ("events", {"time_unix_s": 2.0, "event": "cleared", "code": "W301"}, False),
    ]


def test_an_event_that_a_lost_connection_has_not_taken_is_told_by_the_next_one_and_nothing_else_of_then() -> None:
    session = JsonTopics("cell", None)
    session.announce()
    session.offer(holding(), 1.0)
    session.offer(replace(holding(), state="fault"), 2.0)
    session.lose()
    assert drain(session) == [("events", {"time_unix_s": 2.0, "event": "state", "value": "fault"}, False)]


def test_that_control_was_away_while_the_broker_was_is_no_news_behind_the_greeting() -> None:
    """`online` false of then was retained behind `online` true of now, until true came behind it."""
    session = JsonTopics("cell", None)
    session.begin()
    session.announce()
    session.offer(holding(), 1.0)
    session.lose()
    for time_s, state in ((2.0, None), (3.0, holding()), (4.0, None), (5.0, holding())):
        session.offer(state, time_s)
    session.begin()
    online, _ = (told(message) for message in session.announce())
    assert online == ("online", True, True)
    assert [content for name, content, _ in drain(session) if name == "online"] == []


def test_what_a_restart_of_control_has_changed_is_told_as_events() -> None:
    """Who keeps an alarm log by the events hears of the restart, and that nothing presses any more."""
    session = JsonTopics("cell", None)
    session.begin()
    session.announce()
    for state, time_s in ((holding(), 1.0), (None, 2.0)):
        session.offer(state, time_s)
    drain(session)
    restarted = LiveAlarm(code="W302", title="restarted", cure="look", since_unix_s=2.5)
    session.offer(replace(holding(), state="off", warnings=(restarted,)), 3.0)
    events = [content for name, content, _ in drain(session) if name == "events"]
    assert [{key: event[key] for key in ("event", "value", "code") if key in event} for event in events] == [
        {"event": "state", "value": "off"},
        {"event": "raised", "code": "W302"},
        {"event": "cleared", "code": "W301"},
    ]


def test_a_control_that_does_not_answer_is_offline_without_an_old_state() -> None:
    session = JsonTopics("cell", None)
    session.begin()
    session.offer(holding(), 1.0)
    session.announce()
    drain(session)
    session.offer(None, 2.0)
    assert drain(session) == [("online", False, True), ("state", None, True)]


def test_commands_are_off_unless_the_rig_says_so(tmp_path: Path) -> None:
    assert JsonTopics("cell", None).subscriptions == ()
    text = (shipped_profiles_folder() / "rigs" / "demo.yaml").read_text(encoding="utf-8")
    file = tmp_path / "rig.yaml"
    file.write_text(text + "mqtt: {host: broker.plant, sparkplug: {group: a}}\n", encoding="utf-8")
    mqtt = load_rig(str(file)).mqtt
    assert mqtt and (mqtt.commands, mqtt.port, mqtt.sparkplug and mqtt.sparkplug.group) == (False, 1883, "a")


@pytest.mark.parametrize(
    "section", ["{}", "{host: a, sparkplug: {group: a/b}}", "{host: a, password: b}", "{host: a, base_topic: 'a/#'}"]
)
def test_a_section_that_cannot_work_is_refused(tmp_path: Path, section: str) -> None:
    text = (shipped_profiles_folder() / "rigs" / "demo.yaml").read_text(encoding="utf-8")
    file = tmp_path / "rig.yaml"
    file.write_text(f"{text}mqtt: {section}\n", encoding="utf-8")
    with pytest.raises(ProfileError, match="mqtt"):
        load_rig(str(file))


@pytest.mark.parametrize(
    ("payload", "result", "pdus"),
    [
        (
            b'{"force_setpoint": 12.0, "control_word": 1}',
            {"ok": True, "written": ["force_setpoint", "control_word"]},
            ["100000000204" + "0001" + "04b0"],
        ),
        (
            b'{"force_ramp": 5, "control_word@float_abcd": 1}',
            {"ok": False, "written": [], "error": "force_ramp: E999 not now"},
            ["100002000102" + "0032"],
        ),
        (
            b'{"force_ramp": 0, "control_word": 0}',
            {"ok": False, "written": ["control_word"], "error": "force_ramp: E999 not now"},
            ["100000000102" + "0000", "100002000102" + "0000"],  # a stop is one, whatever stands before it
        ),
        (
            b'{"no_such": 0, "control_word@float_abcd": 0}',
            {
                "ok": False,
                "written": ["control_word@float_abcd"],
                "error": "no_such is not a register; force-gateway registers lists them",
            },
            ["1000c8000204" + "00000000"],
        ),
        (
            b'{"heartbeat": 7, "control_word": 0}',
            {"ok": True, "written": ["control_word", "heartbeat"]},
            ["100000000102" + "0000", "100004000102" + "0007"],  # of a guest the heartbeat is refused, the stop is not
        ),
        (
            b'{"force_setpoint@float_abcd": 30, "control_word": 0}',
            {
                "ok": False,
                "written": ["control_word"],
                "error": "force_setpoint@float_abcd: 30 is not written beside control_word 0, which stops and clears it",
            },
            ["100000000102" + "0000"],
        ),
        (
            b'{"voltage_setpoint": 2.5, "mode": 1, "control_word": 0}',
            {
                "ok": False,
                "written": ["control_word"],
                "error": "voltage_setpoint: 2.5 is not written beside control_word 0, which stops and clears it",
            },
            ["100000000102" + "0000"],
        ),
        (
            b'{"by": "panel 3", "control_word": 0}',
            {"ok": False, "written": ["control_word"], "error": "by is no number"},
            ["100000000102" + "0000"],  # it stopped nothing
        ),
        (
            b'{"tilt_angle": NaN, "control_word": 0.0}',
            {"ok": False, "written": ["control_word"], "error": "tilt_angle: a finite number is wanted"},
            ["100000000102" + "0000"],
        ),
        (
            b'{"control_word": 1, "force_setpoint": 5, "force_setpoint": 30, "control_word": 0}',
            {"ok": False, "written": ["control_word"], "error": "force_setpoint stands twice"},
            ["100000000102" + "0000"],  # the last of a name counted: with the words in another order it enabled
        ),
        (b'{"heartbeat": 7, "control_word": false}', None, []),
        (b'{"control_word": 0, "control_word@float_abcd": null}', None, []),
        (b'{"control_word": 0.7}', None, []),
        (b'{"control_word": 1.5}', None, []),
        (b'{"heartbeat": 0.5}', None, []),
        (
            b'{"heartbeat": 7}',
            {"ok": True, "written": ["heartbeat"]},
            ["100004000102" + "0007"],
        ),  # late it is no sign of life
        (b"[1]", None, []),
        (b"{", None, []),
        (b'{"force_setpoint": true}', None, []),
        (b'{"no_such": 1}', None, []),
        (b"[" * 100_000, None, []),
        (b"[" * 10_000, None, []),
        (b'{"force_setpoint": -Infinity}', None, []),
        (b'{"force_setpoint": 1e999}', None, []),
        (
            b'{"force_setpoint": 1' + b"0" * 400 + b"}",
            {"ok": False, "written": [], "error": "force_setpoint: a finite number is wanted"},
            [],
        ),
        (
            b'{"force_setpoint@float_abcd": 1' + b"0" * 39 + b"}",
            {"ok": False, "written": [], "error": "force_setpoint: 1e+39 does not fit in float32"},
            [],
        ),
        (
            b'{"control_word": 65536}',
            {"ok": False, "written": [], "error": "control_word: 65536 does not fit in uint16: 0 .. 65535"},
            [],
        ),
    ],
)
def test_a_command_is_written_in_order_until_the_first_refusal(
    tmp_path: Path, payload: bytes, result: Any, pdus: list[str]
) -> None:
    asked: list[dict[str, Any]] = []

    def modbus(request: dict[str, Any]) -> dict[str, Any]:
        asked.append(request)
        if request["pdu"].startswith("100002"):
            return {"pdu": "9003", "refusal": "E999 not now"}
        return {"pdu": request["pdu"][:10]}

    async def scene() -> dict[str, Any]:
        control, link = JsonLineServer(tmp_path / "control.sock", {"modbus": modbus}), ControlLink(tmp_path)
        await control.start()
        told = await RegisterCommands(load_rig("demo").register_map, link, 1).carry_out(payload)
        await link.close()
        await control.close()
        return told

    answer = asyncio.run(scene())
    assert answer == result if result else answer["ok"] is False and answer["written"] == [] and answer["error"]
    assert [request["pdu"] for request in asked] == pdus
    assert {request["via"] for request in asked} <= {"mqtt"}
    assert all(("until_s" in request) is not is_stop(payload) for request in asked), "a stop is wanted however late"


def test_of_a_stop_that_comes_late_the_stop_alone_is_carried_out(tmp_path: Path) -> None:
    """A ramp beside it would stand for whoever enables next: nobody waits for that any more, and a heartbeat moves nothing."""
    late_s, carried_out = 100.0, list[str]()

    def modbus(request: dict[str, Any]) -> dict[str, Any]:
        if request.get("until_s", late_s) < late_s:
            raise ValueError("it waited for longer than whoever asked: nothing was done")
        carried_out.append(request["pdu"])
        return {"pdu": request["pdu"][:10]}

    async def scene() -> dict[str, Any]:
        control, link = JsonLineServer(tmp_path / "control.sock", {"modbus": modbus}), ControlLink(tmp_path)
        await control.start()
        commands = RegisterCommands(load_rig("demo").register_map, link, 1, clock=lambda: late_s - 10.0 * ANSWER_S)
        told = await commands.carry_out(b'{"heartbeat": 7, "force_ramp": 5, "control_word": 0}')
        await link.close()
        await control.close()
        return told

    answer = asyncio.run(scene())
    assert answer["ok"] is False and answer["written"] == ["control_word", "heartbeat"]
    assert "it waited for longer" in answer["error"]
    assert carried_out == ["100000000102" + "0000", "100004000102" + "0007"]


def test_what_must_not_be_carried_out_is_told_and_asks_nobody() -> None:
    async def command(payload: bytes) -> dict[str, Any]:
        raise AssertionError(payload)

    (told_of,) = asyncio.run(JsonTopics("cell", command).answer("cell/command", b"{}", "too late"))
    assert told(told_of) == ("command/result", {"ok": False, "written": [], "error": "too late"}, False)
