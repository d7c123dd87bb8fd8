"""A profile whose two ends could never understand each other is refused with a sentence, not met by a running cell."""

import json
from pathlib import Path
from typing import Any

import pytest

from gateway.profiles import ProfileError, shipped_profiles_folder
from gateway.profiles.strict_yaml.text import parse
from tests.profile_files import load_device


def loaded(folder: Path, name: str, **changes: Any) -> list[str]:
    """Faults of a shipped profile with other words; a dotted key changes a group, None leaves it out."""
    value = parse((shipped_profiles_folder() / "devices" / f"{name}.yaml").read_bytes(), name).value
    for key, new in changes.items():
        *groups, last = key.split("__")
        group = value
        for step in groups:
            group = group[step]
        group.pop(last, None)
        if new is not None:
            group[last] = new
    path = folder / "own.yaml"
    path.write_text(json.dumps(value, indent=1))
    try:
        load_device(path)
    except ProfileError as error:
        return [str(fault) for fault in error.faults]
    return []


PRESSURE = {"ask": "P?", "answer": "{p:d}", "range": {"device": [0, 10], "pressure_pa": [0, 10]}}


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"set_voltage__answer": None, "read_voltage": None}, "set_voltage has no answer and there is no read_voltage"),
        ({"set_voltage__ask": "SET {counts:03d}"}, "set_voltage: 10 V: counts = 1023: does not fit in 3 characters"),
        ({"set_voltage__answer": "{counts:03d}"}, "set_voltage: 10 V: counts = 1023: does not fit in 3 characters"),
        ({"read_pressure__ask": "REQ"}, "read_pressure: the device reads 'REQ\\r\\n' as the question of read_voltage"),
        ({"read_voltage__ask": "SET 12"}, "read_voltage: the device reads 'SET 12\\r\\n' as a setting"),
        ({"set_voltage__answer": "OK", "refusals__unknown": "OK"}, "is read as a refusal"),
        ({"refusals__unknown": "512"}, "5 V: the answer '512\\r\\n' to 'SET 512\\r\\n' is read as a refusal"),
        ({"refusals__unknown": "nö"}, "refusals are ASCII text, 'nö' is not"),
        ({"refusals__unknown": "NO\r\nWAY"}, "refusals.unknown: 'NO\\r\\nWAY' has the terminator in its middle"),
        ({"read_pressure__answer": "1\r\n{counts:d}"}, "read_pressure.answer: '1\\r\\n{counts:d}' has the terminator"),
        (
            {"terminator": "CRLF"},
            "terminator: 'CRLF' would be 4 characters on the wire: between double quotes CR LF is",
        ),
        ({"terminator": "\\r"}, "terminator: '\\r' would be 2 characters"),
        ({"terminator": "é"}, "terminator and question_terminator are ASCII text"),
        ({"terminator": "\n\r"}, None),
        ({"terminator": ";FF", "question_terminator": "*"}, None),
        ({"terminator": ";FF", "question_terminator": "*", "read_voltage__ask": "RE*Q"}, "has the terminator in its"),
        ({"terminator": ";FF", "question_terminator": "*", "refusals__unknown": "NO*"}, None),
        ({"refusals__unknown": "ERR {code:d}"}, None),
        ({"refusals__others": ["LOCAL MODE", "BUSY {left:d} S"]}, None),
        ({"refusals__others": ["LOCAL MODE", "512"]}, "the answer '512\\r\\n' to 'SET 512\\r\\n' is read as a refusal"),
        (
            {"refusals__others": ["BUSY", "NO\r\nWAY"]},
            "refusals.others[1]: 'NO\\r\\nWAY' has the terminator in its middle",
        ),
        (
            {"set_voltage__answer": "OK {counts:d}", "refusals__unknown": "{word:OK|NO} {code:d}"},
            "is read as a refusal",
        ),
        (
            {
                "set_voltage__ask": "SET {volts:.3f}",
                "set_voltage__answer": "{volts:.1E}",
                "set_voltage__range__device": [0, 100],
            },
            None,
        ),
        (
            {"set_voltage__answer": None, "read_voltage__range__voltage_v": [0, 5]},
            "the ranges do not fit",
        ),
        ({"set_voltage__answer": "{counts:+.3E}"}, None),
        (
            {"set_voltage__ask": "SET {a:02X}{counts:d}", "constants": {"a": 300}},
            "set_voltage: 0 V: a = 12C: does not fit in 2 characters",
        ),
        (
            {"set_voltage__ask": "SET {channel:d},{value:d}"},
            "{channel:...} would go out as nothing: say it under `const",
        ),
        ({"set_voltage__ask": "SET {channel:d},{value:d}", "constants": {"channel": 2}}, None),
        ({"read_voltage__ask": "REQ {channel:d}"}, "must not carry one but under `constants`"),
        ({"set_voltage__ask": "S" * 130 + "{counts:d}"}, "a line has at most 128 characters"),
        (
            {"read_voltage__answer": "S" * 130 + "{counts:d}"},
            "is read as nothing that it knows: a line has at most 128",
        ),
        ({"serial__baud": 57600}, None),
        ({"serial__baud": 57601}, "serial.baud: 57601 is not one of 300, 600, "),
        ({"read_voltage": None, "read_pressure": None, "steps": None}, None),
        ({"set_voltage__answer": None}, None),
    ],
)
def test_an_output_that_could_not_work_is_told(changes: dict[str, Any], told: str | None, tmp_path: Path) -> None:
    faults = loaded(tmp_path, "smc-itv-rc", **changes)
    if told is None:
        assert faults == []
    else:
        assert any(told in fault for fault in faults), faults
        assert all(":" in fault and fault.split(":")[1].isdecimal() for fault in faults), "file:line:column"


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        (
            {"read_voltage__range__voltage_v": [0, 5]},
            "read_voltage.range.voltage_v: reads 0 .. 5 V, and set_voltage sets 0 .. 10 V: what is beyond is read as anot",
        ),
        ({"read_voltage__range__voltage_v": [1, 10]}, "reads 1 .. 10 V, and set_voltage sets 0 .. 10 V"),
        ({"read_voltage__range__voltage_v": [-1, 9.95]}, None),
        ({"read_voltage__range__voltage_v": [-1, 9.8]}, "reads -1 .. 9.8 V, and set_voltage sets 0 .. 10 V"),
        (
            {"set_voltage__range__voltage_v": [0, 10000], "read_voltage": None},
            "set_voltage.range.voltage_v: 10000 V: a voltage is in volts here, and an input of 10 V ends at 10",
        ),
        ({"set_voltage__range__voltage_v": [0, 101], "read_voltage": None}, "101 V: a voltage is in volts here"),
        ({"set_voltage__range__voltage_v": [0, 24], "read_voltage__range__voltage_v": [0, 24]}, None),
        (
            {"read_pressure__range__pressure_pa": [0, 9]},
            "read_pressure.range.pressure_pa: 9 Pa are 9e-05 bar: a pressure is in pascals here, and 1 bar is 100000",
        ),
        ({"read_pressure__range__pressure_pa": [0, 1900]}, "1900 Pa are 0.019 bar: a pressure is in pascals here"),
        ({"read_pressure__range__pressure_pa": [-1e5, 1e3]}, None),
    ],
)
def test_a_range_that_fits_no_other_or_no_unit_is_told(
    changes: dict[str, Any], told: str | None, tmp_path: Path
) -> None:
    faults = loaded(tmp_path, "smc-itv-rc", **changes)
    assert faults == [] if told is None else any(told in fault for fault in faults), faults


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"stream__frame": "{force:4.2f}", "stream__quality": None, "stream__blank_is_overload": None},
         "stream: -0.0981 N cannot be shown by '{force:4.2f}': there is no room for a minus sign"),
        ({"stream__frame": "{force:3.2f}", "stream__quality": None, "stream__blank_is_overload": None},
         "stream: force = 0.09: does not fit in 3 characters"),
        ({"stream__quality": {"ST": "overload", "US": "overload", "OL": "overload"}}, "no word for a good reading"),
        ({"stream__quality": {"ST": "unstable", "US": "unstable", "OL": "overload"}}, None),
        ({"stream__frame": "{status:ST|US|OL},{mode:GS|NT},{force:+08.2f}{unit:lb|N}"}, "never says kg: unit is one of lb, N"),
        ({"stream__frame": "{status:ST|US|OL},{force:+08.2f}{unit:lb|N} {n:04X} {text:8s}", "stream__unit": None}, None),
        ({"stream": None, "read_force": {"ask": "#{address:02X}", "frame": "{force:+08.2f}"}}, "address is not given: say"),
        ({"stream__frame": "{status:02X}{force:+08.2f}", "stream__quality": None}, "{status:...} is words, each with its"),
        ({"stream__frame": "{status:1s}{force:+08.2f}", "stream__quality": None}, "{status:...} is words, each with its"),
        ({"stream": {"frame": "{force:04X}", "newton_per_count": 1, "rate_hz": 10}}, "{force:+04X} is the two's complement"),
        ({"stream": {"frame": "{force:+04X}", "newton_per_count": 1, "rate_hz": 10, "end_count": 32767}}, None),
        ({"stream": {"frame": "{force:+04X}", "newton_per_count": 1, "rate_hz": 10, "end_count": 99999}},
         "stream.end_count: 99999 does not fit into '{force:+04X}'"),
        ({"stream__frame": "{status:ST|US|OL},{force:08.2f}", "stream__negative": ["UL"]}, "negative names words of {status"),
        ({"stream__frame": "{status:ST|US|OL},{force:08.2f}", "stream__negative": ["US"]}, None),
        ({"stream__frame": "{status:ST|US|OL},{force:+08.2f}", "stream__negative": ["US"]}, "the force stands here twice"),
        ({"stream": {"frame": "{force:+04X}", "newton_per_count": 1, "rate_hz": 10}}, None),
        ({"stream": None, "read_force": {"ask": "W?", "frame": "{force:+08.2f}"}}, None),
        ({"stream__rate_hz": 0.5}, None),
        ({"stream__rate_hz": 0}, "rate_hz of stream is missing"),
        ({"stream": None}, "a load cell has either stream or read_force"),
        ({"read_force": {"ask": "W?", "frame": "{force:+08.2f}", "unit": "N"}}, "has either stream or read_force"),
        ({"steps": [{"ask": "INC", "by": 1}]}, "steps belong to an output"),
        ({"read_pressure": PRESSURE}, "read_pressure and steps belong to an output"),
    ],
)  # fmt: skip
def test_a_load_cell_that_could_not_work_is_told(changes: dict[str, Any], told: str | None, tmp_path: Path) -> None:
    faults = loaded(tmp_path, "stream-st-gs", **changes)
    assert (faults == []) if told is None else any(told in fault for fault in faults), faults


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"constants": None, "read_valve__ask": "V{address:02X}"}, "read_valve: address is not given: say it under"),
        ({"read_valve__answer": "V {state:PUSH|PULL},{inputs:04X}"}, None),  # what else stands in an answer is read over
    ],
)  # fmt: skip
def test_a_valve_that_could_not_work_is_told(changes: dict[str, Any], told: str | None, tmp_path: Path) -> None:
    faults = loaded(tmp_path, "mcu-valve", **changes)
    assert (faults == []) if told is None else any(told in fault for fault in faults), faults


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"identity__ask": "${address:02X}6C{channel:1d}"}, "identity: identity: the device reads '$016C0\\r'"),
        (
            {"watchdog__verify__ask": "${address:02X}6C{channel:1d}"},
            "watchdog: watchdog verification: the device reads",
        ),
    ],
)
def test_a_question_beside_the_work_that_could_not_be_told_apart_is_told_where_it_stands(
    changes: dict[str, Any], place: str, tmp_path: Path
) -> None:
    faults = loaded(tmp_path, "adam-4024", **changes)
    assert any(place in fault for fault in faults), faults


@pytest.mark.parametrize("name", ["waveshare-ao8b", "waveshare-relay", "laumas-tlb", "hbm-aed-binary"])
def test_seven_data_bits_are_told_of_a_device_that_sends_whole_bytes(name: str, tmp_path: Path) -> None:
    """Each byte above 127 would be another one, and the device silent at any speed."""
    (fault,) = loaded(tmp_path, name, serial__data_bits=7)
    assert "serial.data_bits: 7: " in fault and fault.endswith(" sends whole bytes: 8 data bits")
    assert loaded(tmp_path, "stream-st-gs", serial__data_bits=7) == []


def test_a_weight_in_registers_without_a_sign_is_told_by_its_type(tmp_path: Path) -> None:
    registers = {"function": 4, "first": 0, "last": 1, "weight": 0, "type": "uint32", "decimals": 2}
    (fault,) = loaded(tmp_path, "laumas-tlb", read_force={"modbus": registers, "unit": "kg"})
    assert "cannot be shown by a weight of type uint32: there is no room for a minus sign" in fault
    assert fault.endswith("say int32, or which bit is the sign in `negative`")


@pytest.mark.parametrize(
    "words",
    [
        {"terminator": "\r\n"},
        {"question_terminator": "*"},
        {"checksum": "dcon-sum"},
        {"read_over": ["alive"]},
    ],
)
def test_a_frame_that_has_its_own_end_is_told_no_other(words: dict[str, Any], tmp_path: Path) -> None:
    (told,) = loaded(tmp_path, "laumas-tlb", **words)
    assert "has its own end: leave terminator, checksum and read_over out" in told
