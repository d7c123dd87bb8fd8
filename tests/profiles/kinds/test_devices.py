"""What the author of a device file is told: one sentence for one slip, at its place, with what may stand there."""

from pathlib import Path

import pytest

from gateway.profiles.find import list_shipped
from gateway.profiles.kinds.any_file import check_file
from gateway.profiles.kinds.devices import read_device
from gateway.profiles.strict_yaml.text import parse

DAC = r"""name: my-dac
description: 12 bit DAC
role: output
source: manual of the maker, page 12
certainty: manual
hardware: never run on hardware
serial: {baud: 19200}
terminator: "\r\n"
constants: {address: 3}
identity: {ask: "@{address:d} ID", answer: "@{address:d} ID {model:s}", models: [DAC12]}
watchdog:
  time_s: 1.0
  tick_s: 0.001
  arm: {ask: "@{address:d} W{time:d}", answer: "@{address:d} OK"}
  disarm: {ask: "@{address:d} W0", answer: "@{address:d} OK"}
  verify: {ask: "@{address:d} W?", answer: "@{address:d} W{time:d}"}
set_voltage:
  ask: "@{address:d} V{counts:d}"
  answer: "@{address:d} OK"
  range: {device: [0, 4095], voltage_v: [0.0, 10.0]}
"""


def told(*edits: tuple[str, str], source: str = DAC) -> list[str]:
    """The faults of a file after `old -> new` edits, each without the file's name."""
    for old, new in edits:
        assert source.count(old) == 1, old
        source = source.replace(old, new)
    return [str(fault).removeprefix("my-dac.yaml:") for fault in read_device(parse(source.encode(), "my-dac.yaml"))[1]]


def test_the_file_itself_is_right() -> None:
    assert told() == []


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("models: [DAC12]", "models: []", "10:81 identity.models: has 0 entries, at least 1 are needed"),
        (", models: [DAC12]", "", "10:1 identity.models: is missing"),
        ("  tick_s: 0.001\n", "", "11:1 watchdog.tick_s: is missing (a value in s)"),
        ("time_s: 1.0", "time_s: 0", "12:11 watchdog.time_s: 0 s is not above 0 s"),
        ('answer: "@{address:d} W{time:d}"}', "}", "16:3 watchdog.verify.answer: is missing"),
        ("tick_s: 0.001", "tick_ms: 1", "13:3 watchdog.tick_ms: is not a known key; this quantity is given as tick_s: 0.001"),
        ("{address: 3}", "{address: {a: 3}}", "9:22 constants.address: a group of keys is not a whole number"),
        ("{address: 3}", "{address: 1.5}", "9:22 constants.address: 1.5 is not a whole number"),
        ('identity: {ask: "@{address:d} ID"', "identity: {ask: 5", '10:17 identity.ask: 5 is not text: write "5" in quotes'),
        ("models: [DAC12]", "models: DAC12", '10:81 identity.models: "DAC12" is not a list: write ["DAC12"]'),
    ],
)  # fmt: skip
def test_a_slip_where_a_word_or_a_group_may_stand_is_told_once(old: str, new: str, sentence: str) -> None:
    """Each finding inside `watchdog` or `identity` had `literal['none']: has no value` beside it."""
    assert told((old, new)) == [sentence]


def test_what_the_whole_group_lacks_is_told_at_the_group() -> None:
    (fault,) = told(('  verify: {ask: "@{address:d} W?", answer: "@{address:d} W{time:d}"}\n', ""))
    assert fault.startswith("12:3 watchdog: a watchdog needs verify or status")


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('ask: "@{address:d} V{counts:d}"', "ask: V", "18:8 set_voltage.ask: 'V' carries no number"),
        ('ask: "@{address:d} V{counts:d}"', 'ask: "@{address:d} V{counts:d"',
         "18:8 set_voltage.ask: '@{address:d} V{counts:d': a field is {name:shape}; a brace that is sent itself "),
        ("disarm: {", 'feed: "W{"\n  disarm: {',
         "15:9 watchdog.feed: 'W{': a field is {name:shape}; a brace that is sent itself "),
        ("device: [0, 4095]", "device: [4095, 0]",
         "20:10 set_voltage.range: 4095 .. 0 and 0 .. 10 must rise on both sides: "),
    ],
)  # fmt: skip
def test_what_a_rule_of_the_whole_profile_refuses_is_told_at_its_line(old: str, new: str, sentence: str) -> None:
    """'1:1: V carries no number' named no key, and a brace was told in the words of a library."""
    (fault,) = told((old, new))
    assert fault.startswith(sentence)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("serial: {baud: 19200}", "serial: 9600 8N1",
         '7:9 serial: "9600 8N1" is not a group of keys: baud, data_bits, parity, stop_bits'),
        ("range: {device: [0, 4095], voltage_v: [0.0, 10.0]}", "range: 10",
         "20:10 set_voltage.range: 10 is not a group of keys: device, voltage_v"),
        ('identity: {ask: "@{address:d} ID", answer: "@{address:d} ID {model:s}", models: [DAC12]}', "identity: DAC12",
         "10:11 identity: DAC12 is not none, nor a group of keys: ask, answer, modbus, models"),
    ],
)  # fmt: skip
def test_a_word_in_place_of_a_group_is_told_the_keys(old: str, new: str, sentence: str) -> None:
    assert told((old, new)) == [sentence]


STREAM = r"""name: my-cell
description: amplifier
role: load cell
source: manual of the maker, page 3
certainty: manual
hardware: never run on hardware
serial: {baud: 19200}
terminator: "\r\n"
stream:
  frame: "{force:8.2f}"
  unit: N
  rate_hz: 10
"""


@pytest.mark.parametrize(
    ("new", "sentence"),
    [
        ("  rate_hz: 0", "rate_hz of stream is missing: how many readings a second it sends"),
        ("", "rate_hz of stream is missing"),
        ("  rate_hz: 10\n  ask: W", "a stream is not asked: leave `ask` out, or say read_force in place of stream"),
    ],
)
def test_a_stream_has_a_pace_and_no_question(new: str, sentence: str) -> None:
    (fault,) = told(("  rate_hz: 10", new), source=STREAM)
    assert sentence in fault


def test_a_comment_that_may_be_the_end_of_a_device_s_words_is_warned_of(tmp_path: Path) -> None:
    """`ask: V #1` asked `V`, and nobody was told."""
    path = tmp_path / "my-dac.yaml"
    text = DAC.replace('ask: "@{address:d} V{counts:d}"', "ask: V{counts:d} #1").replace("19200}", "19200} #fast")
    path.write_text(text.replace("reading", "reading # noise") + "# the end\n")
    (warning,) = check_file(path).warnings
    assert str(warning).removeprefix(f"{path}:") == (
        "18:8 set_voltage.ask: is V{counts:d} alone, for `#1` is a comment: quote the text where it belongs to it, or "
        "write `# 1`"
    )
    path.write_text(text.replace("#1", "# 1"))
    assert check_file(path).warnings == ()


@pytest.mark.parametrize("name", list_shipped("device"))
def test_no_shipped_device_is_warned_of(name: str) -> None:
    checked = check_file(name)
    assert checked.value is not None and checked.warnings == ()


REGISTERS = (
    "codec: modbus-rtu\nread_force: {modbus: {function: 3, first: 0, last: 0, weight: 0}, unit: N, rate_hz: 9}\n"
)


@pytest.mark.parametrize(
    ("old", "new", "line", "sentence"),
    [
        ("  rate_hz: 10", "  rate_hz: 0", "stream:", "rate_hz of stream is missing"),
        ("stream:", "read_force:", "read_force:", "read_force needs an ask"),
        ("stream:", "codec: modbus-rtu\nstream:", "stream:", "stream of codec modbus-rtu needs `modbus`"),
        (
            STREAM[STREAM.index("stream:") :],
            REGISTERS,
            "terminator:",
            "a frame of Modbus RTU or of raw bytes has its own",
        ),
        (
            "stream:",
            "steps: [{ask: A, by: 1}]\nstream:",
            "steps:",
            "set_voltage, read_voltage, read_pressure and steps",
        ),
        ('terminator: "\\r\\n"\n', "", "stream:", "terminator is missing"),
        ('terminator: "\\r\\n"\n', 'terminator: ""\n', "terminator:", "terminator is missing"),
        ('terminator: "\\r\\n"\n', 'terminator: "é"\n', "terminator:", "terminator and question_terminator are ASCII"),
    ],
)
def test_what_does_not_fit_the_rest_of_a_profile_is_told_at_its_line(
    old: str, new: str, line: str, sentence: str
) -> None:
    """Each of these was told at 1:1, in a file of sixty lines, too."""
    (fault,) = told((old, new), source=STREAM)
    place, _, said = fault.partition(": ")
    here = STREAM.replace(old, new).splitlines()[int(place.split(":")[0]) - 1]
    assert (here[: len(line)], said[: len(sentence)]) == (line, sentence)


RELAY = r"""name: my-relay
description: relay
role: valve
source: manual of the maker, page 3
certainty: manual
hardware: never run on hardware
codec: modbus-rtu
serial: {baud: 9600}
constants: {address: 1}
set_valve:
  push: {ask: "0500000000", answer: "0500000000"}
  pull: {ask: "050000FF00", answer: "050000FF00"}
read_valve: {ask: "0100000008", answer: "0101{state:00|01}", words: {"00": push, "01": pull}}
"""


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('answer: "050000FF00"', 'answer: "05{"', "12:37 set_valve.pull.answer: '05{': a field is {name:shape}; a brace "),
        ('answer: "050000FF00"', 'answer: "050000{relay}FF00"', "12:37 set_valve.pull.answer: {relay:} is none of d, 04d, 02X"),
        ('ask: "0500000000"', 'ask: "05{address:d}00"', "11:15 set_valve.push.ask: '05{address:d}00': nothing marks the end"),
        ('ask: "0100000008"', 'ask: "01{a!r}"', "13:19 read_valve.ask: '01{a!r}': a field is {name:shape}"),
        ('answer: "050000FF00"', 'answer: "050000{x:kg|lb}FF00"', "set_valve.pull.answer: '050000{x:kg|lb}FF00' is no PDU"),
        ('answer: "050000FF00"', 'answer: "050000FF0"', "'050000FF0' is no PDU: hexadecimal digits in capitals, two for a"),
        ('ask: "0100000008"', 'ask: "{address:04x}"', "13:19 read_valve.ask: '{address:04x}' is no PDU"),
        ("{state:00|01}", "{state:0|1}", "'0101{state:0|1}' is no PDU"),
    ],
)  # fmt: skip
def test_a_sentence_of_a_relay_that_means_nothing_is_told(old: str, new: str, sentence: str) -> None:
    """Each of these ended `check` with an internal error."""
    words = [('{"00": push, "01": pull}', '{"0": push, "1": pull}')] if "{state:0|1}" in new else []
    assert any(sentence in fault for fault in told((old, new), *words, source=RELAY)), told(
        (old, new), *words, source=RELAY
    )


def test_a_number_in_quotes_is_told_so() -> None:
    """It was `19200 is not one of ..., 19200, ...; did you mean 19200?`."""
    (fault,) = told(("baud: 19200", 'baud: "19200"'))
    assert fault.endswith('serial.baud: "19200" is text: write 19200 (take the quotes away)')


@pytest.mark.parametrize("codec", ["modbus-tcp", "Modbus TCP"])
def test_modbus_tcp_of_a_device_is_told_to_be_none(codec: str) -> None:
    """It was told to be Modbus RTU, by which a serial port was looked for that a coupler with Ethernet alone has not."""
    setting = "set_voltage: {modbus: {function: 6, register: 0}, range: {device: [0, 10000], voltage_v: [0, 10]}}\n"
    about = RELAY.split("set_valve")[0].replace("role: valve", "role: output")
    (fault,) = told(("codec: modbus-rtu", f"codec: {codec}"), source=about + setting)
    assert "Modbus TCP is not spoken to devices, which are on serial lines" in fault
