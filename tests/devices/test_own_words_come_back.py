"""An adapter that hears itself brings every question back: there must be one that this does not answer."""

from pathlib import Path
from typing import Any

import pytest

from gateway.devices import DeviceProfile, ValveHost, cell_host, output_host
from gateway.devices.messages import ForceSample, Garbage, ReadPressure, ReadVoltage
from gateway.devices.profile import DeviceRole
from gateway.profiles import list_shipped
from tests.devices.test_rehearsal import loaded
from tests.profile_files import load_device

SHIPPED = [load_device(name) for name in list_shipped("device")]


def readings_of(profile: DeviceProfile) -> list[object]:
    """What the gateway reads out of its own questions for what is so."""
    if profile.role is DeviceRole.VALVE:
        valve = ValveHost(profile)
        return list(valve.receive(valve.request(None)))
    if profile.role is DeviceRole.LOAD_CELL:
        cell = cell_host(profile, unit=None if profile.reading.newton_per_unit else "N")
        return list(cell.receive(cell.poll() or cell.start, 0.0))
    exchanges = {ReadVoltage(): profile.read_voltage, ReadPressure(): profile.read_pressure}
    hosts = [(output_host(profile), question) for question, exchange in exchanges.items() if exchange]
    return [reply for host, question in hosts for reply in host.receive(host.request(question), 0.0)]


@pytest.mark.parametrize("profile", SHIPPED, ids=[one.name for one in SHIPPED])
def test_a_question_that_comes_back_is_no_reading(profile: DeviceProfile) -> None:
    assert all(isinstance(one, Garbage) for one in readings_of(profile))


def test_what_is_echoed_ahead_of_an_answer_does_no_harm() -> None:
    profile = load_device("hbm-aed")
    host = cell_host(profile, unit="N")
    echo, found = host.receive(host.poll().replace(b";", b"\r\n") + b"+0012345\r\n", 0.0)
    assert isinstance(echo, Garbage) and isinstance(found, ForceSample)


@pytest.mark.parametrize(
    ("changes", "is_told"),
    [
        ({"read_voltage": None}, True),
        ({"read_voltage": None, "question_terminator": "\r"}, False),  # what comes back is no line
        ({"read_voltage": None, "set_voltage__answer": "{counts:d}"}, False),
        ({}, False),
    ],
)
def test_a_setting_that_its_own_echo_would_confirm_needs_a_reading(
    changes: dict[str, Any], is_told: bool, tmp_path: Path
) -> None:
    own = {"set_voltage__answer": "SET {counts:d}", "read_pressure": None, "refusals": {}, "steps": None}
    faults = loaded(tmp_path, "smc-itv-rc", **(own | changes))
    assert [("an adapter that echoes would answer" in fault) for fault in faults] == [True] * is_told, faults
