"""Upload of a model by each generated client: the words, their CRC-32, the commit, and why one fails."""

from __future__ import annotations

import re
import struct
import zlib
from typing import Any

import pytest

from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.controllers.irc5 import Irc5
from tests.clients.programs.controllers.plc import Plc
from tests.clients.programs.controllers.s7 import S7
from tests.clients.programs.controllers.structured_text import Codesys
from tests.clients.programs.controllers.universal_robot import UniversalRobot
from tests.clients.programs.python_program import PythonProgram
from tests.clients.scenes import MAP, MODEL, TEXTS, cycles


def words_of(model: dict[str, Any]) -> bytes:
    """The set as the map lays it out, made from the map alone."""
    data = bytearray(2 * 190)
    for register in MAP.registers_of("staging"):
        offset = register.address - 1000 if register.address < 1140 else register.address - 1150 + 140
        stem, _, index = register.name.rpartition("_")
        name, k = (stem, int(index)) if index.isdigit() else (register.name, 0)
        value = model.get(name, 0)
        value = value[k] if isinstance(value, list) and k < len(value) else 0 if isinstance(value, list) else value
        if register.address < 1140 or register.address >= 1150:
            data[2 * offset : 2 * offset + 2 * register.words] = register.encode(value)
    return bytes(data)


def test_an_upload_is_staged_committed_and_awaited(client: Any, gateway: GatewayAtHand) -> None:
    """Of every language in each push: a set in another slot, or with a word at another place, is another force."""
    client.enable(4.0)
    cycles(client)
    client.begin_upload(MODEL, 3)
    cycles(client, 8)
    staged, crc = words_of(MODEL), zlib.crc32(words_of(MODEL))
    assert gateway.uploads == [
        (1000, staged[:140]),
        (1070, staged[140:280]),
        (1150, staged[280:]),
        (1140, struct.pack(">HHIH", 190, 0, crc, 3)),
        (1145, b"\0\1"),
    ]
    assert client.uploaded, client.text
    assert client.enabled, "the heartbeat went on meanwhile"


def test_a_robot_that_sums_a_part_leaves_time_to_its_motion(gateway: GatewayAtHand) -> None:
    """16 bits take it some hundred statements: a thread that never waits among 70 words holds up the others."""
    robot = UniversalRobot(TEXTS["urscript"], gateway)
    cycles(robot)
    assert robot.syncs == 0, "a cycle without an upload is done in one frame"
    robot.begin_upload(MODEL, 3)
    robot.cycle()
    assert len(gateway.uploads) == 1 and robot.syncs >= 70 // 8


@pytest.mark.sampled
def test_an_upload_that_fails_says_why(client: Any, gateway: GatewayAtHand) -> None:
    client.begin_upload(MODEL | {"rising_b": [0.0, 70.0, 60.0]}, 0)
    cycles(client, 8)
    assert not client.uploaded
    assert "not increasing" in client.text


@pytest.mark.sampled
@pytest.mark.parametrize(("change", "number"), [({"blend_span": 1e3}, "-1"), ({"rising_b": [0.0, 500.0, 600.0]}, "1")])
def test_the_number_that_is_to_blame_is_told_by_its_place_and_none_as_minus_1(
    client: Any, gateway: GatewayAtHand, change: dict[str, Any], number: str
) -> None:
    """65535, said of a set whose span is too wide, is no number of any set. A PLC, and a Universal Robot, said which rule, and
    of which of 84 numbers it was broken nothing."""
    client.begin_upload(MODEL | change, 0)
    cycles(client, 8)
    assert not client.uploaded and any(word in client.text for word in ("range", "span"))
    told = [str(client.output("failing"))] if isinstance(client, Plc) else re.findall(r"number (-?\d+)", client.text)
    assert told == [number]


def test_a_python_program_beats_while_it_waits_for_a_slow_commit(gateway: GatewayAtHand) -> None:
    """It waits for 5 s at most, and no lease lasts as long: its force would end."""
    program = PythonProgram(TEXTS["python"], gateway)
    program.enable(4.0)
    cycles(program)
    gateway.bank.staging.on_commit = lambda *_: None  # a disk that is busy
    program.client.stage(MODEL)
    before = len(gateway.beats)
    with pytest.raises(program.module["Lost"], match="no commit within"):
        program.client.commit()
    beats = gateway.beats[before:]
    assert len(beats) == len(set(beats)) > 200 and program.enabled


def test_the_crc_s_check_value_comes_out() -> None:
    gateway = GatewayAtHand(MAP)
    assert Irc5(TEXTS["rapid"], gateway).machine.start("FgCrcIsRight") is True
    robot = UniversalRobot(TEXTS["urscript"], gateway)
    for byte in b"123456789":
        robot.machine.start("fg_crc_byte", byte)
    assert (robot.machine.start("fg_crc_word", 8), robot.machine.start("fg_crc_word", 0)) == (0xCBF4, 0x3926)
    for plc, name in ((S7(TEXTS["scl"], gateway), "FG_CrcByte"), (Codesys(TEXTS["st"], gateway), "F_FgCrcByte")):
        crc = 0xFFFFFFFF
        for byte in b"123456789":
            crc = plc.machine.start(name, crc, byte)
        assert crc ^ 0xFFFFFFFF == 0xCBF43926


@pytest.mark.parametrize("number", [0.0, 1.0, -1.0, 0.1, 60.1, 3.4e38, 1e-9, 16777216.0, -0.3333333, 1.99999999])
def test_a_robot_without_bit_casts_makes_float32_words(number: float) -> None:
    robot = UniversalRobot(TEXTS["urscript"], GatewayAtHand(MAP))
    robot.machine.start("fg_model_number", 2, number)
    assert struct.pack(">HH", *robot.get("fg_set_a")[2:4]) == struct.pack(">f", number)
