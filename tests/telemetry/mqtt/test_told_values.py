"""Each figure of the JSON topics is the one that its name says, and a command names each register once."""

import asyncio
import json
from dataclasses import replace
from typing import Any, cast

import pytest

from gateway.live.control_link import ControlLink
from gateway.profiles import load_rig
from gateway.telemetry.mqtt.json_topics import JsonTopics
from gateway.telemetry.mqtt.register_commands import RegisterCommands
from tests.telemetry.mqtt.test_json_topics import drain
from tests.telemetry.readings import holding


def test_each_force_is_told_under_its_name() -> None:
    session, state = JsonTopics("cell", None), holding()
    session.announce()
    session.offer(replace(state, force=replace(state.force, voltage_v=2.5)), 1.0)
    told = {name: content for name, content, _ in drain(session)}["force"]
    assert told == {
        "time_unix_s": 1.0,
        "requested_n": 13.0,
        "accepted_n": 12.5,
        "applied_n": 12.0,
        "measured_n": 11.5,
        "voltage_v": 2.5,
    }


def test_a_state_that_only_grows_older_is_not_told_again() -> None:
    """Five times a second, retained: each broker would keep and send all of it."""
    session, state = JsonTopics("cell", None), holding()
    session.announce()
    session.offer(state, 1.0)
    drain(session)
    session.offer(replace(state, calibration=replace(state.calibration, age_s=61.0)), 1.2)
    assert [name for name, _, _ in drain(session)] == ["force"]


@pytest.mark.parametrize(
    ("command", "why"),
    [
        ({"force_setpoint": 5, "force_setpoint@command": 30}, "force_setpoint@command stands twice"),
        ({}, "a command is JSON such as"),
        ('{"control_word": 1, "control_word": 3}', "control_word stands twice"),
        ('{"force_setpoint": 0, "force_setpoint": 30}', "force_setpoint stands twice"),
    ],
)
def test_a_command_that_means_two_things_or_none_asks_nobody(command: Any, why: str) -> None:
    payload = command if isinstance(command, str) else json.dumps(command)
    commands = RegisterCommands(load_rig("demo").register_map, cast(ControlLink, None), 1)
    told = asyncio.run(commands.carry_out(payload.encode()))
    assert (told["ok"], told["written"]) == (False, []) and told["error"].startswith(why)
