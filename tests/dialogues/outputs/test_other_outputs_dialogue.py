"""Bytes of ADAM-4024 and Alicat manuals, and of the grammar for people who build their own (profiles/devices/mcu-line.yaml)."""

from dataclasses import replace

import pytest

from gateway.devices import DeviceProfile, output_device, output_host
from gateway.devices.messages import (
    Accepted,
    AskDevice,
    DeviceAnswer,
    DeviceStep,
    Garbage,
    OutputReply,
    OutputRequest,
    Pressure,
    ReadPressure,
    ReadVoltage,
    Refused,
    SetVoltage,
    WatchdogTripped,
)
from tests.profile_files import load_device

ADAM = replace(load_device("adam-4024"), constants={"address": 2, "channel": 2})
ALICAT = load_device("alicat-pc")
MCU = load_device("mcu-line")
PSI_PA = 6894.757


@pytest.mark.parametrize(
    ("profile", "message", "asked", "answered", "reply"),
    [
        (ADAM, SetVoltage(7.456), b"#02C2+07.456\r", b"!02C2\r", Accepted(7.456)),
        (ADAM, ReadVoltage(), b"$026C2\r", b"!02+07.456\r", Accepted(7.456)),
        (
            ADAM,
            AskDevice(DeviceStep.IDENTITY),
            b"$02M\r",
            b"!024024\r",
            DeviceAnswer(DeviceStep.IDENTITY, True, "4024"),
        ),
        (ADAM, AskDevice(DeviceStep.ARM), b"$02X00020\r", b"!02\r", DeviceAnswer(DeviceStep.ARM, True)),
        (ADAM, AskDevice(DeviceStep.VERIFY), b"$02X1\r", b"!020020\r", DeviceAnswer(DeviceStep.VERIFY, True, "20")),
        (ADAM, AskDevice(DeviceStep.VERIFY), b"$02X1\r", b"!021234\r", DeviceAnswer(DeviceStep.VERIFY, False, "1234")),
        (ADAM, SetVoltage(7.456), b"#02C2+07.456\r", b"?02\r", Refused("?02")),
        (ALICAT, SetVoltage(0.544), b"as5.44\r", b"A +014.70 +005.44\r", Accepted(0.544)),
        (ALICAT, ReadPressure(), b"a\r", b"A +014.70 +005.44\r", Pressure(pytest.approx(14.70 * PSI_PA, rel=1e-6))),
        # a sensor without pressure reads a little less than 0, and more than its end while the pressure overshoots
        (ALICAT, ReadPressure(), b"a\r", b"A -000.03 +000.00\r", Pressure(pytest.approx(-0.03 * PSI_PA, rel=1e-6))),
        (ALICAT, ReadPressure(), b"a\r", b"A +104.20 +100.00\r", Pressure(pytest.approx(104.2 * PSI_PA, rel=1e-6))),
        (ALICAT, ReadPressure(), b"a\r", b"A +140.00 +100.00\r", Garbage(b"A +140.00 +100.00\r")),
        (ALICAT, SetVoltage(0.544), b"as5.44\r", b"?\r", Refused("?")),
        (MCU, SetVoltage(5.0), b"V1 5.0000*5C\n", b"OK 5.0000*3F\n", Accepted(5.0)),
        (MCU, SetVoltage(5.0), b"V1 5.0000*5C\n", b"ERR TRIPPED*2B\n", WatchdogTripped()),
        (
            MCU,
            AskDevice(DeviceStep.ARM),
            b"W 500*42\n",
            b"OK W 500*66\n",
            DeviceAnswer(DeviceStep.ARM, True, "500"),
        ),  # ms
        (MCU, ReadPressure(), b"?*3F\n", b"S V=5.0000 P=450.0 T=20 FLT=0*59\n", Pressure(450.0e3)),
    ],
)
def test_a_question_and_its_answer(
    profile: DeviceProfile, message: OutputRequest, asked: bytes, answered: bytes, reply: OutputReply
) -> None:
    host = output_host(profile)
    assert host.request(message) == asked
    assert host.receive(answered, 0.0) == [reply]


def test_an_accepted_setpoint_is_not_taken_for_the_pressure() -> None:
    host = output_host(ALICAT)
    host.request(SetVoltage(0.544))
    assert host.receive(b"A +005.44 +014.70\r", 0.0) == [Accepted(pytest.approx(1.47))], "columns count, not values"


def test_a_frame_with_other_columns_is_garbage_and_no_guess() -> None:
    host = output_host(ALICAT)
    host.request(ReadPressure())
    frame = b"A +014.70 +025.00 +005.44\r"
    assert host.receive(frame, 0.0) == [Garbage(frame)]


@pytest.mark.parametrize("time_s", [0.1, 0.5, 60.0])
def test_the_own_grammar_arms_and_switches_off(time_s: float) -> None:
    watchdog = MCU.own_watchdog
    assert watchdog
    profile = replace(MCU, watchdog=replace(watchdog, time_s=time_s))
    host, device = output_host(profile), output_device(profile)
    for step in (DeviceStep.ARM, DeviceStep.VERIFY, DeviceStep.STATUS, DeviceStep.DISARM):
        (request,) = device.receive(host.request(AskDevice(step)), 0.0)
        assert request == AskDevice(step)
        (answer,) = host.receive(device.reply(DeviceAnswer(step, is_right=True), to=request), 0.0)
        assert isinstance(answer, DeviceAnswer)
        assert answer.is_right
    assert device.receive(host.request(AskDevice(DeviceStep.STATUS)), 1e4)
    assert not device.elapse(2e4), "switched off"
