"""A sentence that could never be heard, and a constant that nobody would send, are told where they stand."""

from pathlib import Path
from typing import Any

import pytest

from tests.devices.test_rehearsal import loaded


@pytest.mark.parametrize(
    ("name", "changes", "told"),
    [
        ("waveshare-relay", {"set_valve__push__ask": "050000ff00"}, "set_valve.push.ask: '050000ff00' is no PDU"),
        ("waveshare-relay", {"read_valve__ask": "01 00000001"}, "read_valve.ask: '01 00000001' is no PDU"),
        ("waveshare-relay", {"set_valve__pull__ask": "01050000FF008C3A"}, "set_valve.pull.ask: '01050000FF008C3A' has its"),
        ("waveshare-ao8b", {"read_voltage__modbus": {"function": 3, "register": 2}}, None),  # its request ends as a frame does
        ("mcu-line", {"constants": {"who": 7}, "refusals__others": ["BUSY {who:d}"]}, None),
        ("adam-4016", {"constants": {"address": 300}, "read_over": ["#"]}, "answer: address = 12C: does not fit"),
        ("adam-4016", {"constants": {"address": "07"}, "read_over": ["#"]}, "answer: address = 07: not a number"),
        ("waveshare-relay", {"constants": {"unit": 7}}, "constants.unit: no sentence has a field {unit:...}; a Modbus"),
        ("waveshare-relay", {"constants": {"address": 7}}, None),
        ("adam-4024", {"constants": {"address": 1, "channel": 0, "adress": 2}}, "constants.adress: no sentence has a field"),
        ("smc-itv-rc", {"constants": {"adress": 3}}, "constants.adress: no sentence has a field {adress:...}"),
    ],
)  # fmt: skip
def test_what_nobody_would_hear_or_send_is_told(
    name: str, changes: dict[str, Any], told: str | None, tmp_path: Path
) -> None:
    faults = loaded(tmp_path, name, **changes)
    assert (faults == []) if told is None else any(told in fault for fault in faults), faults
    assert all(fault.split(":")[1].isdecimal() for fault in faults), "file:line:column"


def test_a_constant_that_only_an_answer_or_an_overload_carries_is_sent(tmp_path: Path) -> None:
    frame = {"stream__frame": "{station:02d} {force:+08.2f}", "stream__quality": None, "constants": {"station": 4}}
    assert loaded(tmp_path, "stream-st-gs", **frame) == []
    overload = {"stream__frame": "{force:+08.2f}", "stream__overload": ["{station:02d} OL"]}
    assert loaded(tmp_path, "stream-st-gs", **(frame | overload)) == []
