"""What waits for a broker: forgotten once it was sent, never in its place; and payloads that are no command of numbers."""

import asyncio
import itertools
from dataclasses import replace
from typing import Any

import pytest

from gateway.profiles import load_rig
from gateway.telemetry.mqtt.edge_node import EdgeNode
from gateway.telemetry.mqtt.json_topics import JsonTopics
from gateway.telemetry.mqtt.register_commands import RegisterCommands
from tests.telemetry.readings import at, holding
from tests.telemetry.sparkplug_schema import decoded, values


@pytest.mark.parametrize(
    ("payload", "words"),
    [
        (b'{"force_setpoint": 1}' + b" " * 16_364, "16385 bytes"),
        (b"{}", "a command is JSON such as"),
        (b"[1]", "a command is JSON such as"),
        (b"junk", "a command is JSON such as"),
        (b"\xff", "a command is JSON such as"),
        (b'{"force_setpoint": "12"}', "force_setpoint is no number"),
        (b'{"force_setpoint": null}', "force_setpoint is no number"),
        (b'{"force_setpoint": 5, "force_setpoint": 30}', "force_setpoint stands twice"),
        (b'{"control_word": true}', "control_word is no number"),
        (b'{"force_setpoint": NaN}', "a finite number"),
    ],
)
def test_what_is_no_command_of_numbers_is_told_and_asks_nobody(payload: bytes, words: str) -> None:
    class Link:
        async def ask(self, request: dict[str, Any]) -> dict[str, Any]:
            raise AssertionError(request)

    commands = RegisterCommands(load_rig("demo").register_map, Link(), 1)  # type: ignore[arg-type]
    told = asyncio.run(commands.carry_out(payload))
    assert (told["ok"], told["written"]) == (False, []) and words in told["error"]


def test_the_longest_command_is_one() -> None:
    asked: list[dict[str, Any]] = []

    class Link:
        async def ask(self, request: dict[str, Any]) -> dict[str, Any]:
            asked.append(request)
            return {"pdu": request["pdu"][:10]}

    payload = b'{"force_setpoint": 1}'
    commands = RegisterCommands(load_rig("demo").register_map, Link(), 1)  # type: ignore[arg-type]
    assert asyncio.run(commands.carry_out(payload + b" " * (16_384 - len(payload))))["ok"] and len(asked) == 1


def test_a_change_wakes_who_sends_and_none_does_not() -> None:
    for session in (EdgeNode("plant", "cell", itertools.count().__next__), JsonTopics("cell", None)):
        session.begin()
        session.announce()
        session.offer(at(1.0), 1.0)
        assert session.ready.is_set()
    node = EdgeNode("plant", "cell", itertools.count().__next__)
    node.offer(at(1.0), 1.0)
    node.ready.clear()
    node.offer(at(1.0), 2.0)
    assert not node.ready.is_set()


def test_what_comes_while_nobody_is_connected_is_historical_from_the_loss_on() -> None:
    node = EdgeNode("plant", "cell", itertools.count().__next__)
    node.begin()
    node.announce()
    node.lose()
    node.offer(at(7.0), 1.0)
    node.begin()
    node.announce()
    node.offer(at(8.0), 2.0)
    told = []
    while (message := node.next_message()) is not None:
        force = values(message.payload)["Force/Measured N"]
        told.append((force, all(one.is_historical for one in decoded(message.payload).metrics)))
        node.drop_sent()
    assert told == [(7.0, True), (8.0, False)]
    node.drop_sent()  # nothing is left: a second end of the same message takes nothing


def test_a_message_that_a_loss_has_dropped_takes_no_event_with_it() -> None:
    session = JsonTopics("cell", None)
    session.begin()
    session.announce()
    session.offer(holding(), 1.0)
    offered = session.next_message()
    assert offered and not offered.topic.endswith("/events")
    session.lose()
    session.offer(replace(holding(), state="fault"), 2.0)
    session.drop_sent()
    first = session.next_message()
    assert first and first.topic == "cell/events"
    empty = JsonTopics("cell", None)
    empty.drop_sent()


def test_commands_are_heard_and_answered_where_there_is_one_who_carries_them_out() -> None:
    async def carry_out(payload: bytes) -> dict[str, Any]:
        return {"ok": True, "said": payload.decode()}

    hearing, deaf = JsonTopics("cell", carry_out), JsonTopics("cell", None)
    assert (tuple(hearing.subscriptions), tuple(deaf.subscriptions)) == (("cell/command",), ())
    (answer,) = asyncio.run(hearing.answer("cell/command", b"x", ""))  # type: ignore[arg-type]
    assert answer.topic == "cell/command/result" and b'"said": "x"' in answer.payload
    assert tuple(asyncio.run(deaf.answer("cell/command", b"x", ""))) == ()  # type: ignore[arg-type]


def test_an_alarm_is_raised_once_and_ages_alone_are_no_new_state() -> None:
    session = JsonTopics("cell", None)
    session.begin()
    session.announce()
    raised = []
    for time_s in (1.0, 1.1, 1.2):
        state = replace(holding(), warnings=() if time_s == 1.0 else holding().warnings)
        session.offer(replace(state, load_cell=replace(state.load_cell, age_s=time_s)), time_s)
        while (message := session.next_message()) is not None:
            raised.append((time_s, message.topic.removeprefix("cell/")))
            session.drop_sent()
    assert [one for one in raised if one[1] == "events"] == [(1.1, "events")]
    assert (1.2, "state") not in raised
