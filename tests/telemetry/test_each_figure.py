"""Each figure that is published is read from its own field: one that takes its neighbour's looks right until they differ."""

import asyncio
import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.live.live_state import LiveAlarm, LiveForce, LiveLimits, LiveLine
from gateway.profiles.telemetry_sections import Mqtt
from gateway.telemetry.exposition import exposition
from gateway.telemetry.mqtt.json_topics import JsonTopics
from gateway.telemetry.mqtt_process import make_sessions
from gateway.telemetry.series import SERIES, GatewayReading
from gateway.telemetry.sparkplug_metrics import values_of
from tests.service.rigs import demo
from tests.telemetry.readings import holding

FAULTS = tuple(LiveAlarm(code=code, title="x", cure="look", since_unix_s=1.0) for code in ("A313", "A311"))


def test_of_each_series() -> None:
    """With all its digits: a counter of months has more than six."""
    force = LiveForce(
        requested_n=1.0,
        accepted_n=2.0,
        applied_n=3.0,
        model_residual_n=4.0,
        voltage_v=5.0,
        feedforward_v=6.0,
        trim_v=7.0,
    )
    state = replace(holding(), force=force, limits=LiveLimits(force_max_n=8.0, tolerance_n=9.0), faults=FAULTS)
    residual = {
        "looks": 10,
        "judged": 11,
        "skipped": 12,
        "warnings": 13,
        "age_s": 14.0,
        "floor_n": 15.0,
        "pause_s": 16.0,
    }
    health = {"ticks": 123_456_789, "missed_ticks": 18, "loop_time_us": 19.0, "residual": residual}
    health |= {"late_p50_us": 20.0, "late_p99_us": 21.0}
    lines = [line for line in exposition(GatewayReading(state, health)) if not line.startswith("#")]
    bare = [line.split() for line in lines if "{" not in line]
    plain = {name.removeprefix("force_gateway_"): float(value) for name, value in bare}
    expected = {
        "setpoint_requested_newtons": 1.0, "setpoint_accepted_newtons": 2.0, "setpoint_applied_newtons": 3.0,
        "model_residual_newtons": 4.0, "voltage_volts": 5.0, "feedforward_volts": 6.0, "trim_volts": 7.0,
        "force_max_newtons": 8.0, "tolerance_newtons": 9.0, "residual_looks_total": 10.0, "residual_judged_total": 11.0,
        "residual_skipped_total": 12.0, "residual_warnings_total": 13.0, "residual_age_seconds": 14.0,
        "residual_floor_newtons": 15.0, "residual_pause_seconds": 16.0, "loop_ticks_total": 123_456_789.0,
        "loop_missed_ticks_total": 18.0, "loop_step_seconds": 19.0e-6, "loop_late_p50_seconds": 20.0e-6,
        "loop_late_p99_seconds": 21.0e-6, "faults": 2.0, "warnings": 1.0,
        "calibration_number": 3.0,
    }  # fmt: skip
    assert {name: plain[name] for name in expected} == pytest.approx(expected, rel=1e-9)
    alarms = {name: [labels["code"] for labels, _ in read] for name, read in labelled(state).items()}
    assert alarms == {"fault": ["A313", "A311"], "warning": ["W301"]}


def test_of_each_line_that_the_rig_has() -> None:
    """A relay that garbles each answer was to be seen nowhere."""
    (errors,) = (one for one in SERIES if one.name == "force_gateway_serial_errors_total")
    valve = LiveLine(port="/dev/c", device="relay", garbled=7)
    told = [list(errors.read(GatewayReading(state, {}))) for state in (holding(), replace(holding(), valve=valve))]
    assert [[labels["line"] for labels, _ in each] for each in told] == [
        ["output", "load_cell"],
        ["output", "load_cell", "valve"],
    ]
    assert told[1][-1][1] == 7


def labelled(state: Any) -> dict[str, list[tuple[dict[str, str], float]]]:
    wanted = {series.name.removeprefix("force_gateway_"): series for series in SERIES}
    return {name: list(wanted[name].read(GatewayReading(state, {}))) for name in ("fault", "warning")}


def test_of_each_force_over_mqtt_and_each_change_is_an_event() -> None:
    session = JsonTopics("cell", None)
    session.announce()
    session.offer(holding(), 1.0)
    force = replace(holding().force, voltage_v=1.5)
    session.offer(replace(holding(), force=force, mode="voltage", owner="10.0.0.5"), 2.0)
    told: list[tuple[str, Any]] = []
    while message := session.next_message():
        told.append((message.topic, json.loads(message.payload)))
        session.drop_sent()
    expected = {"measured_n": 11.5, "applied_n": 12.0, "accepted_n": 12.5, "requested_n": 13.0, "voltage_v": 1.5}
    assert [content for topic, content in told if topic == "cell/force"][-1] == {"time_unix_s": 2.0, **expected}
    events = [(content["event"], content["value"]) for topic, content in told if topic == "cell/events"]
    assert events == [("mode", "voltage"), ("owner", "10.0.0.5")]


def test_of_each_alarm_of_the_edge_node_a_word() -> None:
    told = values_of(replace(holding(), faults=FAULTS))
    assert (told["Alarms/Faults"], told["Alarms/Warnings"]) == ("A313 A311", "W301")


def test_a_command_over_mqtt_asks_for_a_unit_that_the_rig_answers(tmp_path: Path) -> None:
    asked: list[Any] = []

    async def ask(request: dict[str, Any]) -> dict[str, Any]:
        asked.append(request["unit"])
        return {"pdu": "0f00000001"}

    rig = replace(demo(), mqtt=Mqtt(host="broker", commands=True), network=replace(demo().network, units=(7, 9)))
    link: Any = SimpleNamespace(ask=ask)
    (session,) = make_sessions(rig, link, tmp_path)
    asyncio.run(session.answer("", b'{"control_word": 0}', ""))
    assert asked == [7]
