"""Bytes of the SMC ITV regulator as public drivers know them: a misread grammar would be wrong at both of our ends."""

import pytest

from gateway.devices import DeviceProfile, output_device, output_host
from gateway.devices.messages import (
    Accepted,
    Garbage,
    Pressure,
    ReadPressure,
    ReadVoltage,
    Refused,
    SetVoltage,
)

VOLTS_PER_COUNT = 10.0 / 1023


def answer_of_an_obedient_device(profile: DeviceProfile, data: bytes) -> bytes:
    """What a device that measures 300 counts of pressure answers."""
    device = output_device(profile)
    answer = b""
    setting_v = 0.0
    for request in device.receive(data, 0.0):
        match request:
            case SetVoltage(voltage_v):
                setting_v = voltage_v
                answer += device.reply(Accepted(voltage_v))
            case ReadVoltage():
                answer += device.reply(Accepted(setting_v), to=ReadVoltage())
            case ReadPressure():
                answer += device.reply(Pressure(300 * 0.9e6 / 1023))
            case Garbage():
                answer += device.reply(device.refusal(request))
    return answer


@pytest.mark.parametrize(
    ("asked", "answered"),
    [
        (b"SET 512\r\n", b"512\r\n"),
        (b"SET 0\r\n", b"0\r\n"),
        (b"SET 1023\r\n", b"1023\r\n"),
        (b"SET 1024\r\n", b"OUT OF RANGE\r\n"),
        (b"SET 9999\r\n", b"OUT OF RANGE\r\n"),
        (b"SET 10000\r\n", b"UNKNOWN COMMAND\r\n"),
        (b"SET -1\r\n", b"UNKNOWN COMMAND\r\n"),
        (b"SET 5.0\r\n", b"UNKNOWN COMMAND\r\n"),
        (b"SET\r\n", b"UNKNOWN COMMAND\r\n"),
        (b"set 512\r\n", b"UNKNOWN COMMAND\r\n"),
        (b"\r\n", b"UNKNOWN COMMAND\r\n"),
        (b"SET 51SET 0\r\n", b"UNKNOWN COMMAND\r\n"),
        (b"SET 300\r\nREQ\r\n", b"300\r\n300\r\n"),
        (b"SET 300\r\nINC\r\nINC\r\nDEC\r\nREQ\r\n", b"300\r\n302\r\n304\r\n302\r\n302\r\n"),
        (b"DEC\r\n", b"0\r\n"),
        (b"SET 1022\r\nINC\r\n", b"1022\r\n1023\r\n"),
        (b"MON\r\n", b"300\r\n"),
    ],
)
def test_the_device_answers_as_drivers_know_it(itv: DeviceProfile, asked: bytes, answered: bytes) -> None:
    assert answer_of_an_obedient_device(itv, asked) == answered


def test_a_refused_setting_leaves_the_old_one(itv: DeviceProfile) -> None:
    assert answer_of_an_obedient_device(itv, b"SET 300\r\nSET 2000\r\nREQ\r\n") == b"300\r\nOUT OF RANGE\r\n300\r\n"


@pytest.mark.parametrize(
    ("message", "wire"),
    [
        (SetVoltage(512 * VOLTS_PER_COUNT), b"SET 512\r\n"),
        (SetVoltage(5.0), b"SET 512\r\n"),
        (SetVoltage(0.0), b"SET 0\r\n"),
        (SetVoltage(10.0), b"SET 1023\r\n"),
        (ReadVoltage(), b"REQ\r\n"),
        (ReadPressure(), b"MON\r\n"),
    ],
)
def test_the_host_asks_as_drivers_do(itv: DeviceProfile, message: SetVoltage, wire: bytes) -> None:
    assert output_host(itv).request(message) == wire


def test_the_host_understands_a_conversation(itv: DeviceProfile) -> None:
    host = output_host(itv)
    host.request(SetVoltage(5.0))
    assert host.receive(b"512\r\n", 0.0) == [Accepted(pytest.approx(5.0, abs=0.01))]
    host.request(ReadPressure())
    assert host.receive(b"1023\r\n", 0.0) == [Pressure(pytest.approx(0.9e6))]
    host.request(SetVoltage(5.0))
    assert host.receive(b"OUT OF RANGE\r\n", 0.0) == [Refused("OUT OF RANGE")]
    host.request(SetVoltage(5.0))
    assert host.receive(b"UNKNOWN COMMAND\r\n", 0.0) == [Refused("UNKNOWN COMMAND")]


def test_what_the_guardian_writes_and_waits_for(itv: DeviceProfile) -> None:
    host = output_host(itv)
    assert (host.safe_frame(0.0), host.safe_reply) == (b"SET 0\r\n", b"0\r\n")
    assert (host.safe_frame(1.0), host.safe_reply) == (b"SET 102\r\n", b"102\r\n")
    assert host.receive(b"0\r\n", 0.0) == [Garbage(b"0\r\n")], "no answer is expected"
