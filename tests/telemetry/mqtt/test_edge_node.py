"""The Sparkplug edge node without a broker, its payloads read by Google's protobuf."""

import asyncio
import itertools
import struct
import time
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.processes.state_lock import hold_state_lock
from gateway.telemetry.mqtt import kept_bd_seq
from gateway.telemetry.mqtt.broker_session import BrokerMessage
from gateway.telemetry.mqtt.edge_node import REBIRTH, EdgeNode
from gateway.telemetry.mqtt.kept_bd_seq import KeptBdSeq
from gateway.telemetry.sparkplug_metrics import TYPES, values_of
from gateway.telemetry.sparkplug_payload import DataType, SparkplugMetric, decode_values, encode_payload
from tests.telemetry.readings import at, holding
from tests.telemetry.sparkplug_schema import Payload, decoded, values

NODE_NAME = "cell"


def drain(node: EdgeNode) -> list[BrokerMessage]:
    sent = []
    while (message := node.next_message()) is not None:
        sent.append(message)
        node.drop_sent()
    return sent


def forces(messages: list[BrokerMessage]) -> list[float]:
    return [values(message.payload)["Force/Measured N"] for message in messages]


def test_a_birth_names_all_with_types_and_its_death_has_its_bd_seq() -> None:
    node = EdgeNode("plant", NODE_NAME, itertools.count().__next__)
    for bd_seq in range(3):
        node.offer(holding(), 1000.0)
        will = node.begin()
        (birth,) = node.announce()
        assert (will.topic, will.qos, birth.topic) == ("spBv1.0/plant/NDEATH/cell", 1, "spBv1.0/plant/NBIRTH/cell")
        assert values(will.payload) == {"bdSeq": bd_seq} and not decoded(will.payload).HasField("seq")
        said = decoded(birth.payload)
        assert said.HasField("seq") and said.seq == 0 and said.timestamp == 1_000_000
        told = values(birth.payload)
        assert told["bdSeq"] == bd_seq and told[REBIRTH] is False
        assert set(told) == set(TYPES) | {"bdSeq", REBIRTH}
        assert told["Force/Measured N"] == 11.5 and told["State"] == "holding" and told["Alarms/Warnings"] == "W301"
        assert {one.name: one.datatype for one in said.metrics}["Force/Measured N"] == 10
        node.lose()


def test_no_old_word_to_an_edge_node_presses_so_that_its_broker_is_not_asked_for_signs_of_life() -> None:
    assert EdgeNode("plant", NODE_NAME, itertools.count().__next__).may_press is False


def test_no_force_is_told_under_the_name_of_another() -> None:
    state, told = holding(), values_of(holding())
    for name in ("measured", "requested", "accepted", "applied"):
        assert told[f"Force/{name.capitalize()} N"] == getattr(state.force, f"{name}_n")


def test_data_tells_what_changed_and_seq_goes_round() -> None:
    node = EdgeNode("plant", NODE_NAME, itertools.count().__next__)
    node.begin()
    node.announce()
    node.offer(at(0.0), 0.0)
    drain(node)
    seqs = []
    for number in range(1, 600):
        node.offer(at(float(number)), float(number))
        node.offer(at(float(number)), number + 0.5)
        (message,) = drain(node)
        assert values(message.payload) == {"Force/Measured N": float(number)}, "what did not change is not told"
        seqs.append(decoded(message.payload).seq)
    assert seqs == [number % 256 for number in range(2, 601)]


def test_what_came_while_the_broker_was_away_follows_the_birth_in_order_as_historical() -> None:
    node = EdgeNode("plant", NODE_NAME, itertools.count().__next__, room=5)
    node.begin()
    node.announce()
    node.offer(at(0.0), 0.0)
    drain(node)
    node.offer(at(1.0), 1.0)
    assert forces([node.next_message()]) == [1.0], "on its way when the connection breaks: it stays"
    node.lose()
    for number in range(2, 5):
        node.offer(at(float(number)), float(number))
    node.begin()
    (birth,) = node.announce()
    node.offer(at(9.0), 9.0)
    sent = drain(node)
    assert values(birth.payload)["Force/Measured N"] == 4.0
    assert forces(sent) == [1.0, 2.0, 3.0, 4.0, 9.0]
    assert [decoded(message.payload).metrics[0].is_historical for message in sent] == [True] * 4 + [False]
    assert [decoded(message.payload).seq for message in sent] == [1, 2, 3, 4, 5]
    assert [decoded(message.payload).metrics[0].timestamp for message in sent] == [1000, 2000, 3000, 4000, 9000]


def test_a_full_store_loses_the_oldest_and_never_one_that_was_not_sent() -> None:
    node = EdgeNode("plant", NODE_NAME, itertools.count().__next__, room=3)
    for number in range(10):
        node.offer(at(float(number)), float(number))
    node.next_message()
    node.offer(at(10.0), 10.0)
    node.drop_sent()
    assert forces(drain(node)) == [8.0, 9.0, 10.0]


def test_only_a_rebirth_that_is_asked_for_is_answered() -> None:
    node = EdgeNode("plant", NODE_NAME, itertools.count().__next__)
    node.begin()
    node.announce()

    def asked(payload: bytes) -> list[BrokerMessage]:
        return list(asyncio.run(node.answer("spBv1.0/plant/NCMD/cell", payload, "")))

    command = Payload(timestamp=5)
    command.metrics.add(name=REBIRTH, datatype=11, boolean_value=True)
    node.offer(holding(), 7.0)
    drain(node)
    (birth,) = asked(command.SerializeToString())
    assert decoded(birth.payload).seq == 0 and values(birth.payload)["bdSeq"] == 0
    command.metrics[0].boolean_value = False
    assert asked(command.SerializeToString()) == asked(b"\xff\xff") == asked(b"") == []
    other = Payload(timestamp=5)
    other.metrics.add(name=REBIRTH, datatype=10, double_value=1.0)
    assert asked(other.SerializeToString()) == [], "a number is no wish"


def test_where_control_does_not_answer_nothing_old_is_told() -> None:
    node = EdgeNode("plant", NODE_NAME, itertools.count().__next__)
    node.offer(holding(), 1.0)
    node.offer(None, 2.0)
    node.begin()
    (birth,) = node.announce()
    told = {name: value for name, value in values(birth.payload).items() if value is not None}
    assert told == {"bdSeq": 0, REBIRTH: False, "Control/Answers": False}


@pytest.mark.parametrize(
    ("datatype", "value"),
    [
        (DataType.UINT64, 2**64 - 1),
        (DataType.DOUBLE, -1.5e-300),
        (DataType.BOOLEAN, True),
        (DataType.STRING, "Größe"),
        (DataType.STRING, ""),
        (DataType.STRING, None),
    ],
)
def test_each_type_reads_as_it_was_written(datatype: DataType, value: object) -> None:
    payload = encode_payload(2**41, [SparkplugMetric("a/b", datatype, value, 2**40, True)], 255)
    (metric,) = decoded(payload).metrics
    assert values(payload) == {"a/b": value} == decode_values(payload)
    assert (metric.timestamp, metric.datatype, metric.is_historical) == (2**40, datatype, True)
    assert (decoded(payload).timestamp, decoded(payload).seq) == (2**41, 255)


@given(st.binary(max_size=60))
def test_bytes_of_strangers_are_read_or_refused(payload: bytes) -> None:
    try:
        told = decode_values(payload)
    except ValueError:
        return
    assert isinstance(told, dict)


def test_bd_seq_goes_on_where_the_process_before_has_ended(tmp_path: Path) -> None:
    first = KeptBdSeq(tmp_path)
    assert [first.next() for _ in range(300)] == [*range(256), *range(44)]
    first.note_connected()
    assert KeptBdSeq(tmp_path).next() == 44
    for damage in ("", "[", "[" * 100_000, '{"bdSeq": null}', '{"bdSeq": 1e999}', '{"other": 1}'):
        (tmp_path / "sparkplug.json").write_text(damage)
        assert KeptBdSeq(tmp_path).next() == 0
    assert [KeptBdSeq(tmp_path / "nowhere").next() for _ in range(2)] == [0, 0], "no disk: counts in memory only"


def test_a_broker_that_is_away_costs_the_disk_one_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One for each attempt, every two seconds, was 43 200 a day and their syncs: a memory card that wears out."""
    writes = []
    replace_durably = kept_bd_seq.replace_durably
    monkeypatch.setattr(kept_bd_seq, "replace_durably", lambda *told: (writes.append(told[2]), replace_durably(*told)))
    kept = KeptBdSeq(tmp_path)
    node = EdgeNode("plant", NODE_NAME, kept.next, on_connected=kept.note_connected)
    for bd_seq in range(100):
        assert values(node.begin().payload) == {"bdSeq": bd_seq}
        node.lose()
    assert len(writes) == 1
    node.begin()
    node.announce()
    assert KeptBdSeq(tmp_path).next() == 101, "behind the one with which it was connected"
    for _ in range(2):
        node.lose()
        node.begin()
        node.announce()
    assert KeptBdSeq(tmp_path).next() == 103 and len(writes) == 1 + 1 + 1 + 2 + 1
    (tmp_path / "sparkplug.json").unlink()
    node.lose()
    node.begin()
    assert KeptBdSeq(tmp_path).next() == 104, "a number is kept before it is told, behind a connection as at first"


def test_bd_seq_is_kept_while_a_gateway_has_the_state_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its lock was waited for, in the loop: of each connection nothing was said, heard or looked at for ten seconds, a stop
    neither, and behind them the number was not kept."""

    def wait(seconds: float) -> None:
        raise AssertionError("it waits for the guardian's lock")

    monkeypatch.setattr(time, "sleep", wait)
    with hold_state_lock(tmp_path) as is_ours:
        assert is_ours
        assert [KeptBdSeq(tmp_path).next() for _ in range(3)] == [0, 1, 2]


def field(number: int, wire_type: int, content: bytes) -> bytes:
    return bytes([number << 3 | wire_type]) + content


def metric(*fields: bytes) -> bytes:
    body = b"".join(fields)
    return field(2, 2, bytes([len(body)]) + body)


NAME = field(1, 2, b"\x01a")


@pytest.mark.parametrize(
    ("content", "value"),
    [
        (field(10, 0, b"\x05"), 5),
        (field(14, 0, b"\x01"), True),
        (field(12, 5, struct.pack("<f", 1.5)), 1.5),
        (field(13, 1, struct.pack("<d", 2.5)), 2.5),
        (field(15, 2, b"\x02hi"), "hi"),
        (field(12, 1, struct.pack("<d", 2.5)), None),
        (field(13, 5, struct.pack("<f", 1.5)), None),
        (field(12, 0, b"\x05"), None),
    ],
)
def test_a_value_is_read_as_its_field_and_one_of_another_width_is_none(content: bytes, value: object) -> None:
    assert decode_values(metric(NAME, content)) == {"a": value}


@pytest.mark.parametrize(
    "payload",
    [
        metric(field(1, 0, b"\x05")),
        metric(NAME)[:-1],
        field(2, 2, b"\x05" + NAME),
        field(3, 1, bytes(7)),
        field(3, 3, b""),
        field(3, 0, b"\xff" * 11),
        field(3, 0, b"\xff" * 10 + b"\x01"),
        field(3, 0, b""),
    ],
)
def test_what_is_no_payload_is_refused_whole(payload: bytes) -> None:
    with pytest.raises(ValueError, match=r"no text|beyond the payload|wire type|without an end|within a number"):
        decode_values(payload)


def test_a_number_in_the_place_of_a_metric_is_none() -> None:
    assert decode_values(field(2, 0, b"\x05") + metric(NAME, field(10, 0, b"\x01"))) == {"a": 1}


def test_numbers_of_every_length_are_written_as_they_are_read() -> None:
    numbers = [0, 1, 0x7F, 0x80, 0x3FFF, 0x4000, 2**32, 2**64 - 1]
    metrics = [SparkplugMetric(str(number), DataType.UINT64, number, 0) for number in numbers]
    assert decode_values(encode_payload(0, metrics, 0)) == {str(number): number for number in numbers}


def test_the_errors_of_a_line_are_its_own() -> None:
    state = holding()
    state = replace(
        state, output=replace(state.output, garbled=3), load_cell=replace(state.load_cell, garbled=8), refusals=5
    )
    shown = values_of(state)
    assert (shown["Output/Errors"], shown["Load Cell/Errors"], shown["Refusals"]) == (3, 8, 5)
