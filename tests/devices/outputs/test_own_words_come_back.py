"""An adapter that hears itself brings every question back: there must be one that this does not answer."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gateway.devices import (
    DeviceProfile,
    ValveDevice,
    ValveDirection,
    ValveHost,
    cell_device,
    cell_host,
    output_device,
    output_host,
)
from gateway.devices.binary.register_access import Function, RegisterAccess
from gateway.devices.exchange import VoltageExchange
from gateway.devices.messages import (
    Accepted,
    ForceSample,
    Garbage,
    OutputReply,
    OutputRequest,
    Pressure,
    ReadPressure,
    ReadVoltage,
    SetVoltage,
)
from gateway.devices.profile import DeviceRole
from gateway.profiles import list_shipped
from tests.devices.test_rehearsal import loaded
from tests.profile_files import load_device

Receive = Callable[[bytes], Sequence[object]]
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


def asked_and_answered(profile: DeviceProfile) -> list[tuple[Receive, bytes, bytes]]:
    """Each question of a profile that is answered: our end, what went out, and what the device says to it."""
    if profile.role is DeviceRole.VALVE:
        valve, relay = ValveHost(profile), ValveDevice(profile)
        asked = valve.request(None)
        return [(valve.receive, asked, relay.reply(None, ValveDirection.PULL))]
    if profile.role is DeviceRole.LOAD_CELL:
        unit = None if profile.reading.newton_per_unit else "N"
        cell, amplifier = cell_host(profile, unit=unit), cell_device(profile, unit)
        asked = cell.poll() or cell.start
        return [(lambda chunk: cell.receive(chunk, 0.0), asked, amplifier.frame(5.0))] if asked else []
    found: list[tuple[Receive, bytes, bytes]] = []
    answers: dict[OutputRequest, OutputReply] = {SetVoltage(5.0): Accepted(5.0)}
    answers |= {ReadVoltage(): Accepted(5.0)} if profile.read_voltage else {}
    answers |= {ReadPressure(): Pressure(1e5)} if profile.read_pressure else {}
    for question, answer in answers.items():
        host, device = output_host(profile), output_device(profile)
        asked = host.request(question)
        heard = (one for one in device.receive(asked, 0.0) if not isinstance(one, Garbage))
        answered = b"".join(device.reply(answer, to=one) for one in heard)
        found.append((lambda chunk, host=host: host.receive(chunk, 0.0), asked, answered))  # type: ignore[misc]
    return found


OTHER_ENDS = (  # an answer ends otherwise than a question: what an adapter hears of us is no line of its own
    replace(load_device("smc-itv-rc"), name="dac with lf", question_terminator="\n"),
    replace(
        load_device("mantracourt-dsc"), name="amplifier with semicolon", question_terminator=";", terminator="\r\n"
    ),
    replace(load_device("mcu-valve"), name="relay with cr", question_terminator="\r"),
)


def of_two_bytes() -> DeviceProfile:
    """A value is shorter than the question for it."""
    amplifier = load_device("hbm-aed-binary")
    assert amplifier.read_force
    reading = replace(amplifier.read_force, frame="{force:int16}", end_count=32767)
    return replace(amplifier, name="amplifier with two bytes", read_force=reading)


@pytest.mark.parametrize("profile", [*SHIPPED, *OTHER_ENDS, of_two_bytes()], ids=lambda one: one.name)
def test_what_an_adapter_hears_of_us_is_read_over_and_is_no_noise(profile: DeviceProfile) -> None:
    """It was counted as bytes that nobody can read, and motor cables were blamed (A341); where a question ends otherwise than
    an answer, no answer was understood."""
    for (receive, asked, answered), (receive_next, *_) in zip(
        *(asked_and_answered(profile) for _ in range(2)), strict=True
    ):
        told = receive(asked + answered)
        assert [one for byte in asked + answered for one in receive_next(bytes([byte]))] == [*told], "byte by byte"
        assert told and not any(isinstance(one, Garbage) for one in told if asked != answered), asked
        assert len(told) == 1


@pytest.mark.parametrize("function", [3, 4])
@pytest.mark.parametrize("register", [0, 6, 0x0103, 0x0104, 0x0201, 0x0304, 0x1001])
@pytest.mark.parametrize("voltage_v", [0.0, 0.001, 2.59, 5.0, 10.0])
def test_a_question_of_modbus_is_read_over_whatever_it_looks_like(
    function: Function, register: int, voltage_v: float
) -> None:
    """With three for its first byte it is a whole answer; others would be the beginning of a long one."""
    dac = load_device("waveshare-ao8b")
    assert dac.read_voltage
    access = RegisterAccess(function=function, register=register)
    dac = replace(dac, read_voltage=VoltageExchange(modbus=access, range=dac.read_voltage.range))
    host, device = output_host(dac), output_device(dac)
    for chunk_bytes in (1, 3, 64):
        asked = host.request(ReadVoltage())
        heard = asked + device.reply(Accepted(voltage_v), to=ReadVoltage())
        chunks = [heard[at : at + chunk_bytes] for at in range(0, len(heard), chunk_bytes)]
        assert [one for chunk in chunks for one in host.receive(chunk, 0.0)] == [Accepted(pytest.approx(voltage_v))]


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
