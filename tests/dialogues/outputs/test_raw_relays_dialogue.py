"""Relays that speak in raw bytes, and such that say nothing when they are set: KMtronic, Devantech USB-RLY02, Conrad."""

import re
from dataclasses import replace

import pytest

from gateway.devices import DeviceProfile, ValveDevice, ValveDirection, ValveHost
from gateway.devices.line_settings import SerialSettings
from gateway.devices.messages import Garbage
from gateway.devices.profile import Certainty, DeviceRole
from gateway.devices.rehearsal import rehearse
from gateway.devices.valve_profile import ValveReading, ValveSetting, ValveSettings

PUSH, PULL = ValveDirection


def relay(push: ValveSetting, pull: ValveSetting, reading: ValveReading, **words: str) -> DeviceProfile:
    return DeviceProfile(
        name="own",
        description="a relay",
        role=DeviceRole.VALVE,
        source="the maker's manual",
        certainty=Certainty.MANUAL,
        hardware="never run on hardware",
        serial=SerialSettings(baud=9600, data_bits=8, parity="none", stop_bits=1),
        set_valve=ValveSettings(push=push, pull=pull),
        read_valve=reading,
        **{"codec": "raw-bytes", **words},  # type: ignore[arg-type]
    )


def reading(ask: str, answer: str, push: str, pull: str) -> ValveReading:
    return ValveReading(ask=ask, answer=answer, words={push: PUSH, pull: PULL})


KMTRONIC = relay(
    ValveSetting(ask="FF0100"), ValveSetting(ask="FF0101"), reading("FF0103", "FF01{state:00|01}", "00", "01")
)
DEVANTECH = relay(ValveSetting(ask="6F"), ValveSetting(ask="65"), reading("5B", "{state:00|01}", "00", "01"))
CONRAD = relay(  # command, address, relays, exclusive or of the three
    ValveSetting(ask="03010002", answer="FC0100FD"),
    ValveSetting(ask="03010103", answer="FC0101FC"),
    reading("02010003", "FD01{state:00FC|01FD}", "00FC", "01FD"),
)
SKETCH = relay(  # text, and silence when it is set
    ValveSetting(ask="R0"),
    ValveSetting(ask="R1"),
    reading("R?", "R={state:0|1}", "0", "1"),
    codec="template",
    terminator="\n",
)
RELAYS = {"kmtronic": KMTRONIC, "devantech": DEVANTECH, "conrad": CONRAD, "sketch": SKETCH}


@pytest.mark.parametrize(
    ("profile", "question", "asked", "answered", "told"),
    [
        (KMTRONIC, PULL, "FF0101 FF0103", "FF0101", [PULL]),
        (KMTRONIC, PULL, "FF0101 FF0103", "FF0100", [PUSH]),  # told, and not obeyed
        (KMTRONIC, None, "FF0103", "FF0100", [PUSH]),
        (KMTRONIC, None, "FF0103", "FF01", []),
        (KMTRONIC, None, "FF0103", "FF0201", [Garbage(bytes.fromhex("FF0201"))]),
        (DEVANTECH, PUSH, "6F 5B", "00", [PUSH]),
        (DEVANTECH, None, "5B", "02", [Garbage(b"\x02")]),  # relay 2 is on
        (CONRAD, PULL, "03010103", "FC0101FC", [PULL]),
        (CONRAD, PULL, "03010103", "FF0000FF", [Garbage(bytes.fromhex("FF0000FF"))]),
        (CONRAD, None, "02010003", "FD0101FD", [PULL]),
    ],
)
def test_a_relay_is_set_and_read_back(
    profile: DeviceProfile, question: ValveDirection | None, asked: str, answered: str, told: list[object]
) -> None:
    host = ValveHost(profile)
    for _ in range(2):  # half an answer is no part of the next one
        assert host.request(question) == bytes.fromhex(asked)
        assert [one for byte in bytes.fromhex(answered) for one in host.receive(bytes([byte]))] == told


@pytest.mark.parametrize("profile", RELAYS.values(), ids=RELAYS)
def test_both_ends_understand_each_other_however_the_bytes_come(profile: DeviceProfile) -> None:
    assert list(rehearse(profile)) == []
    host, device = ValveHost(profile), ValveDevice(profile)
    for direction in (PULL, PUSH, PULL):
        for question in (direction, None):
            heard = [one for byte in host.request(question) for one in device.receive(bytes([byte]))]
            assert heard[0] == question
            answer = b"".join(device.reply(one, direction) for one in heard if not isinstance(one, Garbage))
            assert [one for byte in answer for one in host.receive(bytes([byte]))] == [direction]


@pytest.mark.parametrize(
    ("ask", "told"),
    [
        ("FF010", "a sentence of raw bytes has two digits for each"),
        ("FF01", "the sentences to a device that speaks in raw bytes have one length"),
        ("relay1", "a sentence of raw bytes is hexadecimal digits in capitals"),
        ("FF{x:0|01}00", "words of equal length"),
        ("FF01{x:02X}", "words of equal length"),
    ],
)
def test_what_is_no_sentence_of_bytes_is_told(ask: str, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        replace(KMTRONIC, set_valve=ValveSettings(push=ValveSetting(ask=ask), pull=ValveSetting(ask="FF0101")))


@pytest.mark.parametrize("answer", ["FF010", "OK", "FC0101 FC", "fc0101fc", "FC01{relays:02X}FC"])
def test_an_answer_that_is_no_sentence_of_bytes_is_told_and_quoted(answer: str) -> None:
    pull = ValveSetting(ask="03010103", answer=answer)
    with pytest.raises(ValueError, match=re.escape(f"{answer!r}: a sentence of raw bytes")):
        replace(CONRAD, set_valve=ValveSettings(push=ValveSetting(ask="03010002", answer="FC0100FD"), pull=pull))


@pytest.mark.parametrize("answer", ["FD01{state:0|1}", "fd01{state:00|01}", "FD{count:02X}{state:00|01}"])
def test_a_reading_that_is_no_sentence_of_bytes_is_told_and_quoted(answer: str) -> None:
    words = {"0": PUSH, "1": PULL} if "{state:0|1}" in answer else {"00": PUSH, "01": PULL}
    with pytest.raises(ValueError, match=re.escape(f"{answer!r}: a sentence of raw bytes")):
        replace(CONRAD, read_valve=ValveReading(ask="02010003", answer=answer, words=words))


def test_raw_bytes_have_no_end_and_a_valve_no_other_codec() -> None:
    with pytest.raises(ValueError, match="has its own end"):
        replace(KMTRONIC, terminator="\n")
    with pytest.raises(ValueError, match="codec hbm-binary of a valve is not one of template, modbus-rtu, raw-bytes"):
        replace(KMTRONIC, codec="hbm-binary", terminator="\n")
