"""Sentences of outputs and relays that no shipped profile is for, as their makers print them: SCPI with an exponent,
hexadecimal words, ends of lines of their own, refusals with a number in them."""

import pytest

from gateway.devices import DeviceProfile, ValveDevice, ValveDirection, ValveHost, output_device, output_host
from gateway.devices.exchange import PressureExchange, PressureRange, Refusals, VoltageExchange, VoltageRange
from gateway.devices.line_settings import SerialSettings
from gateway.devices.messages import (
    Accepted,
    Garbage,
    OutputReply,
    OutputRequest,
    Pressure,
    ReadPressure,
    ReadVoltage,
    Refused,
    SetVoltage,
)
from gateway.devices.profile import Certainty, DeviceRole
from gateway.devices.rehearsal import rehearse
from gateway.devices.valve_profile import ValveReading, ValveSetting, ValveSettings

PUSH, PULL = ValveDirection


def device(role: DeviceRole = DeviceRole.OUTPUT, terminator: str = "\n", **words: object) -> DeviceProfile:
    profile = DeviceProfile(
        name="own",
        description="an output",
        role=role,
        source="the maker's manual",
        certainty=Certainty.MANUAL,
        hardware="never run on hardware",
        serial=SerialSettings(baud=9600, data_bits=8, parity="none", stop_bits=1),
        terminator=terminator,
        **words,  # type: ignore[arg-type]
    )
    assert list(rehearse(profile)) == []
    return profile


def voltage(ask: str, answer: str = "", top: float = 10.0) -> VoltageExchange:
    return VoltageExchange(ask=ask, answer=answer, range=VoltageRange(device=(0.0, top), voltage_v=(0.0, 10.0)))


def pressure(ask: str, answer: str, top: float, top_pa: float) -> PressureExchange:
    return PressureExchange(ask=ask, answer=answer, range=PressureRange(device=(0.0, top), pressure_pa=(0.0, top_pa)))


KEYSIGHT = device(  # E3632A: a query is answered with an exponent
    set_voltage=voltage("VOLT {volts:.4f}"), read_voltage=voltage("VOLT?", "{volts:+.8E}")
)
MENSOR = (
    device(  # CPC6050, section 7.7: a blank ahead of each answer, E where there is an error; readings with an exponent
        terminator="\r\n",
        set_voltage=voltage("SETPT {psi:.3f}", top=100.0),
        read_voltage=voltage("SETPT?", " {psi:.7E}", 100.0),
        read_pressure=pressure("A?", " {psi:.7E}", 100.0, 689475.7),
    )
)
BRONKHORST = device(  # 9.17.027, pages 22 to 25, node 3
    terminator="\r\n",
    constants={"address": 3},
    set_voltage=voltage(":06{address:02X}010121{counts:04X}", ":04{address:02X}000005", 32000.0),
    read_voltage=voltage(":06{address:02X}0401210121", ":06{address:02X}020121{counts:04X}", 32000.0),
    read_pressure=pressure(":06{address:02X}0401210120", ":06{address:02X}020121{counts:+04X}", 32000.0, 1e6),
    refusals=Refusals(unknown=":01{code:02X}"),
)
MKS = device(  # 946: @address ACK value ;FF, and NAK with a number
    terminator=";FF",
    constants={"address": 253},
    set_voltage=voltage("@{address:d}PSP!{value:.2E}", "@{address:d}ACK{value:.2E}"),
    refusals=Refusals(unknown="@{address:d}NAK{code:d}"),
)


@pytest.mark.parametrize(
    ("profile", "message", "asked", "answered", "reply"),
    [
        (KEYSIGHT, SetVoltage(0.5), b"VOLT 0.5000\nVOLT?\n", b"+5.00000000E-01\n", Accepted(0.5)),
        (KEYSIGHT, SetVoltage(10.0), b"VOLT 10.0000\nVOLT?\n", b"+1.00000000E+01\n", Accepted(10.0)),
        (KEYSIGHT, ReadVoltage(), b"VOLT?\n", b"+5.00000000E+01\n", Garbage(b"+5.00000000E+01\n")),  # beyond its range
        (KEYSIGHT, ReadVoltage(), b"VOLT?\n", b"5.000\n", Garbage(b"5.000\n")),
        (MENSOR, SetVoltage(5.0), b"SETPT 50.000\r\nSETPT?\r\n", b" 5.0000000E+01\r\n", Accepted(5.0)),
        (MENSOR, ReadVoltage(), b"SETPT?\r\n", b"E5.0000000E+01\r\n", Garbage(b"E5.0000000E+01\r\n")),
        (MENSOR, ReadPressure(), b"A?\r\n", b" -1.2000000E-02\r\n", Pressure(pytest.approx(-82.737084))),
        (BRONKHORST, SetVoltage(5.0), b":06030101213E80\r\n", b":0403000005\r\n", Accepted(5.0)),
        (BRONKHORST, SetVoltage(5.0), b":06030101213E80\r\n", b":0103\r\n", Refused(":0103")),
        (BRONKHORST, SetVoltage(5.0), b":06030101213E80\r\n", b":0106\r\n", Refused(":0106")),
        (BRONKHORST, SetVoltage(5.0), b":06030101213E80\r\n", b":0404000005\r\n", Garbage(b":0404000005\r\n")),
        (BRONKHORST, ReadVoltage(), b":06030401210121\r\n", b":06030201213E80\r\n", Accepted(5.0)),
        (BRONKHORST, ReadPressure(), b":06030401210120\r\n", b":0603020121FF80\r\n", Pressure(-4000.0)),
        (MKS, SetVoltage(2.5), b"@253PSP!2.50E+00;FF", b"@253ACK2.50E+00;FF", Accepted(2.5)),
        (MKS, SetVoltage(2.5), b"@253PSP!2.50E+00;FF", b"@253NAK169;FF", Refused("@253NAK169")),
    ],
)
def test_a_question_and_its_answer(
    profile: DeviceProfile, message: OutputRequest, asked: bytes, answered: bytes, reply: OutputReply
) -> None:
    host = output_host(profile)
    assert host.request(message) == asked
    assert host.receive(answered, 0.0) == [reply]
    if isinstance(message, SetVoltage) and isinstance(reply, Accepted):
        assert host.confirms(message.voltage_v, reply, message)


@pytest.mark.parametrize(
    "profile", [KEYSIGHT, MENSOR, BRONKHORST, MKS], ids=["keysight", "mensor", "bronkhorst", "mks"]
)
def test_every_setting_of_the_range_is_confirmed_by_the_simulated_device(profile: DeviceProfile) -> None:
    host, far = output_host(profile), output_device(profile)
    for step in range(101):
        setting = SetVoltage(0.1 * step)
        answers = b""
        for request in far.receive(host.request(setting), 0.0):
            assert not isinstance(request, Garbage)
            answers += far.reply(Accepted(setting.voltage_v), to=request)
        (reply,) = host.receive(answers, 0.0)
        assert isinstance(reply, Accepted)
        assert host.confirms(setting.voltage_v, reply, setting)


def test_the_simulated_device_refuses_with_a_number_in_its_words() -> None:
    assert output_device(MKS).refusal(Garbage(b"@253XYZ?;FF")) == Refused("@253NAK0")


ADAM_4060 = device(  # ADAM-4000 manual, pages 7-6 and 7-10
    DeviceRole.VALVE,
    "\r",
    constants={"address": 0x15},
    set_valve=ValveSettings(
        push=ValveSetting(ask="#{address:02X}1000", answer=">"), pull=ValveSetting(ask="#{address:02X}1001", answer=">")
    ),
    read_valve=ValveReading(ask="${address:02X}6", answer="!{state:00|01}0000", words={"00": PUSH, "01": PULL}),
)
NUMATO = device(  # echoes each command, ends its lines with LF CR, and prompts with >
    DeviceRole.VALVE,
    "\n\r",
    question_terminator="\r",
    set_valve=ValveSettings(
        push=ValveSetting(ask="relay off 0", answer="relay off 0"),
        pull=ValveSetting(ask="relay on 0", answer="relay on 0"),
    ),
    read_valve=ValveReading(ask="relay read 0", answer="{state:on|off}", words={"on": PULL, "off": PUSH}),
)


@pytest.mark.parametrize(
    ("profile", "question", "asked", "answered", "told"),
    [
        (ADAM_4060, PULL, b"#151001\r", b">\r", [PULL]),
        (ADAM_4060, PULL, b"#151001\r", b"?15\r", [Garbage(b"?15\r")]),
        (ADAM_4060, None, b"$156\r", b"!010000\r", [PULL]),
        (ADAM_4060, None, b"$156\r", b"!000000\r", [PUSH]),
        (ADAM_4060, None, b"$156\r", b"!030000\r", [Garbage(b"!030000\r")]),  # another relay is on
        (NUMATO, PULL, b"relay on 0\r", b"relay on 0\n\r>", [PULL]),
        (NUMATO, None, b"relay read 0\r", b"relay read 0\n\roff\n\r>", [Garbage(b"relay read 0\n\r"), PUSH]),
    ],
)
def test_a_relay_is_set_and_read_back(
    profile: DeviceProfile, question: ValveDirection | None, asked: bytes, answered: bytes, told: list[object]
) -> None:
    host = ValveHost(profile)
    for _ in range(2):  # what is left of an answer, a prompt, is no part of the next one
        assert host.request(question) == asked
        assert host.receive(answered) == told
    assert ValveDevice(profile).receive(asked) == [question]
