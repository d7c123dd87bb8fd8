"""DCON bytes from the ICP DAS 7000 series manuals, spoken by templates alone: no profile is shipped yet, the
language must carry it."""

from dataclasses import replace

import pytest

from gateway.devices import Certainty, DeviceProfile, Role, SerialSettings, ValueRefused, output_device, output_host
from gateway.devices.checksum import add_checksum, strip_checksum
from gateway.devices.exchange import Refusals, VoltageExchange, VoltageRange
from gateway.devices.messages import Accepted, Garbage, ReadVoltage, Refused, SetVoltage

RANGE = VoltageRange(device=(0.0, 10.0), voltage_v=(0.0, 10.0))
I7021 = DeviceProfile(
    name="i-7021",
    description="one voltage output",
    role=Role.OUTPUT,
    source="ICP DAS 7000 manual",
    certainty=Certainty.MANUAL,
    hardware="never run on hardware",
    serial=SerialSettings(baud=9600),
    terminator="\r",
    constants={"address": 1},
    refusals=Refusals(unknown=""),
    set_voltage=VoltageExchange(ask="#{address:02X}{voltage_v:06.3f}", answer=">", range=RANGE),
    read_voltage=VoltageExchange(ask="${address:02X}6", answer="!{address:02X}{voltage_v:06.3f}", range=RANGE),
)
I7021_SUM = replace(I7021, checksum="dcon-sum")


def test_a_setting_is_acknowledged_without_an_echo() -> None:
    host = output_host(I7021)
    assert host.request(SetVoltage(5.0)) == b"#0105.000\r"
    assert host.receive(b">\r", 0.0) == [Accepted(5.0)]
    assert (host.safe_frame(0.0), host.safe_reply) == (b"#0100.000\r", b">\r")


def test_the_checksum_is_the_sum_of_the_codes() -> None:
    host = output_host(I7021_SUM)
    assert host.request(SetVoltage(5.0)) == b"#0105.000A7\r"
    assert output_device(I7021_SUM).receive(b"#0105.000A7\r", 0.0) == [SetVoltage(5.0)]
    assert output_device(I7021_SUM).receive(b"#0105.000A8\r", 0.0) == [Garbage(b"#0105.000A8\r")]
    assert host.receive(b">\r", 0.0) == [Garbage(b">\r")]


def test_the_configuration_question_of_the_manual_has_this_checksum() -> None:
    assert add_checksum(b"$012", "dcon-sum") == b"$012B7"
    assert strip_checksum(b"$012B7", "dcon-sum") == b"$012"
    assert strip_checksum(b"$012B8", "dcon-sum") is None


def test_another_address_is_not_ours() -> None:
    host, device = output_host(I7021), output_device(I7021)
    assert device.receive(b"#0205.000\r", 0.0) == [Garbage(b"#0205.000\r")]
    assert host.request(ReadVoltage()) == b"$016\r"
    assert host.receive(b"!0205.000\r", 0.0) == [Garbage(b"!0205.000\r")]
    assert host.receive(b"!0105.000\r", 0.0) == [Accepted(5.0)]


def test_bad_syntax_gets_no_answer_at_all() -> None:
    device = output_device(I7021)
    (garbage,) = device.receive(b"#01 5.0\r", 0.0)
    assert isinstance(garbage, Garbage)
    assert device.refusal(garbage) == Refused("")
    assert device.reply(Refused("")) == b""


def test_answers_differ_by_question() -> None:
    device = output_device(I7021)
    assert device.reply(Accepted(5.0)) == b">\r"
    assert device.reply(Accepted(5.0), to=ReadVoltage()) == b"!0105.000\r"


@pytest.mark.parametrize("voltage_v", [float("nan"), float("inf"), -float("inf"), -0.01, 10.01])
def test_what_the_range_does_not_carry_is_refused(voltage_v: float) -> None:
    with pytest.raises(ValueRefused, match=r"i-7021 takes 0 .. 10 V"):
        output_host(I7021).request(SetVoltage(voltage_v))
