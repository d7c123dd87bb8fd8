"""Frames of Waveshare's Modbus RTU Analog Output 8CH: its wiki's sample, and the same table in millivolts."""

import pytest

from gateway.devices import DeviceProfile, output_device, output_host
from gateway.devices.messages import Accepted, Garbage, ReadVoltage, Refused, SetVoltage
from gateway.modbus.crc import crc_bytes
from tests.profile_files import load_device

FIVE_VOLTS = bytes.fromhex("0106000013888 49C".replace(" ", ""))
READ = bytes.fromhex("010300000001840A")


def with_crc(body: str) -> bytes:
    return bytes.fromhex(body) + crc_bytes(bytes.fromhex(body))


@pytest.fixture(scope="module")
def profile() -> DeviceProfile:
    return load_device("waveshare-ao8b")


def test_a_setting_and_its_echo(profile: DeviceProfile) -> None:
    host = output_host(profile)
    assert host.request(SetVoltage(5.0)) == FIVE_VOLTS
    assert host.receive(FIVE_VOLTS, 0.0) == [Accepted(5.0)]
    assert host.request(SetVoltage(1.0)) == bytes.fromhex("01060000 03E8 8974"), "the sample of the maker"


def test_the_setting_is_read_back(profile: DeviceProfile) -> None:
    host = output_host(profile)
    assert host.request(ReadVoltage()) == READ
    assert host.receive(bytes.fromhex("0103021388B512"), 0.0) == [Accepted(5.0)]


def test_an_exception_is_a_refusal_in_words(profile: DeviceProfile) -> None:
    host = output_host(profile)
    host.request(SetVoltage(5.0))
    assert host.receive(with_crc("018603"), 0.0) == [Refused("exception 3 (illegal data value)")]


def test_an_answer_of_another_unit_and_a_torn_one_are_garbage(profile: DeviceProfile) -> None:
    host = output_host(profile)
    host.request(ReadVoltage())
    foreign = with_crc("0203021388")
    assert host.receive(foreign, 0.0) == [Garbage(foreign)]
    assert host.receive(bytes.fromhex("01030213"), 0.0) == []
    assert host.receive(bytes.fromhex("88B512"), 0.0) == [Accepted(5.0)]


def test_the_simulated_module_obeys_and_refuses_as_modbus_does(profile: DeviceProfile) -> None:
    device = output_device(profile)
    assert device.receive(FIVE_VOLTS, 0.0) == [SetVoltage(5.0)]
    assert device.reply(Accepted(5.0), to=SetVoltage(5.0)) == FIVE_VOLTS
    for asked, answered in (
        ("01060000FFFF", "018603"),  # 65.5 V
        ("010600090000", "018602"),  # no such register
        ("01050000FF00", "018501"),  # no such function
    ):
        (garbage,) = device.receive(with_crc(asked), 0.0)
        assert isinstance(garbage, Garbage)
        assert device.reply(device.refusal(garbage)) == with_crc(answered)
    (foreign,) = device.receive(with_crc("020600001388"), 0.0)
    assert isinstance(foreign, Garbage)
    assert device.reply(device.refusal(foreign)) == b"", "silence for another unit"


def test_what_the_guardian_writes_and_waits_for(profile: DeviceProfile) -> None:
    host = output_host(profile)
    assert host.safe_frame(0.0) == host.safe_reply == bytes.fromhex("010600000000 89CA")
