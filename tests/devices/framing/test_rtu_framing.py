"""Frames between gateway and device: as pymodbus's framer makes them, and found again in whatever pieces and noise."""

from random import Random

import pytest
from pymodbus.framer import FramerRTU
from pymodbus.pdu import DecodePDU

from gateway.devices.binary.register_access import RegisterAccess
from gateway.devices.binary.rtu_framing import RtuSplitter, answers, quiet_s, requests, rtu_frame
from gateway.devices.framing import Line
from gateway.modbus.pdu import read_request, write_register_request
from gateway.modbus.rtu import encode_adu

BODIES = ("0600001388", "0300000001", "0302138 8".replace(" ", ""), "100000000204AABBCCDD", "1000000002", "8603")


@pytest.mark.parametrize("unit", [1, 17, 247])
@pytest.mark.parametrize("body", BODIES)
def test_a_frame_is_the_one_of_pymodbus(unit: int, body: str) -> None:
    frame = rtu_frame(unit, body.encode())
    assert frame == FramerRTU(DecodePDU(is_server=False)).encode(bytes.fromhex(body), unit, 0)


def cut(splitter: RtuSplitter, data: bytes, rng: Random) -> list[Line]:
    lines, at = [], 0
    while at < len(data):
        size = rng.randint(1, 5)
        lines += splitter.feed(data[at : at + size])
        at += size
    return lines


@pytest.mark.parametrize("seed", range(20))
def test_frames_are_found_however_they_are_cut_and_whatever_is_between(seed: int) -> None:
    rng = Random(seed)
    questions = ["0600001388", "0300000001", "100000000204AABBCCDD"]
    sent = [rng.choice(questions) for _ in range(20)]
    noise = [bytes(rng.choices((0, 255, 85), k=rng.randint(0, 3))) for _ in sent]
    data = b"".join(dirt + rtu_frame(1, body.encode()) for dirt, body in zip(noise, sent, strict=True))
    lines = cut(requests(1), data, rng)
    assert [line.body.decode() for line in lines if line.is_whole] == sent
    assert b"".join(line.data for line in lines) == data, "every byte is accounted for"


def test_a_frame_with_one_wrong_bit_costs_itself() -> None:
    good = rtu_frame(1, b"03021388")
    for index in range(len(good)):
        for bit in range(8):
            bad = bytearray(good)
            bad[index] ^= 1 << bit
            splitter = answers(1)
            assert not [line for line in splitter.feed(bytes(bad)) if line.is_whole]
            splitter.forget()
            assert [line.is_whole for line in splitter.feed(good)] == [True]


def test_binary_that_looks_like_a_lines_end_is_a_value() -> None:
    (line,) = answers(1).feed(rtu_frame(1, b"03020D0A"))
    assert line.is_whole
    assert line.body == b"03020D0A"


def test_the_pause_between_frames_is_that_of_the_specification() -> None:
    assert quiet_s(10 / 9600) == pytest.approx(3.646e-3, rel=1e-3)
    assert quiet_s(10 / 115200) == 1.75e-3


@pytest.mark.parametrize(
    ("access", "question", "answer"),
    [
        (RegisterAccess(function=6, register=0), "06{r:04X}", None),
        (RegisterAccess(function=3, register=7, type="uint32"), "0300070002", "0304{value:uint32}"),
        (RegisterAccess(function=4, register=0x1000, type="int16"), "0410000001", "0402{value:int16}"),
        (
            RegisterAccess(function=16, register=2, type="float32", word_order="cdab"),
            "100002000204{value:float32-cdab}",
            "1000020002",
        ),
    ],
)
def test_a_registers_request_as_a_template(access: RegisterAccess, question: str, answer: str | None) -> None:
    if answer is None:
        assert access.question() == access.answer() == "060000{value:uint16}"
    else:
        assert (access.question(), access.answer()) == (question, answer)


def test_a_frame_of_another_unit_is_none_of_ours() -> None:
    """Two devices share a bus: what the other one measures is no force of ours."""
    ours, other = rtu_frame(1, b"03021388"), rtu_frame(2, b"03020000")
    lines = answers(1).feed(other + ours)
    assert [line.is_whole for line in lines] == [False, True]
    assert [line.data for line in lines] == [other, ours]


def test_a_frame_to_everybody_is_no_answer_of_the_device() -> None:
    (line,) = answers(1).feed(rtu_frame(0, b"03021388"))
    assert not line.is_whole


def test_an_adapter_that_repeats_nothing_more_is_known_by_the_next_answer() -> None:
    """The plug was changed: as its own echo each answer to a setting would be dropped, and a living device be silent."""
    reading, setting = encode_adu(1, read_request(3, 0, 1)), encode_adu(1, write_register_request(0, 5))
    answer = encode_adu(1, b"\x03\x02\x00\x07")
    splitter = answers(1)
    splitter.asked = reading
    assert [line.data for line in splitter.feed(reading + answer)] == [answer]
    splitter.asked = setting
    assert splitter.feed(setting) == [], "its echo, for it repeats"
    splitter.asked = reading
    assert [line.data for line in splitter.feed(answer)] == [answer]
    splitter.asked = setting
    assert [line.data for line in splitter.feed(setting)] == [setting]
