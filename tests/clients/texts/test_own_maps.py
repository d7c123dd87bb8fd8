"""A map of one's own: what it moves or scales is followed in each language, what it lacks is told instead of left out."""

from __future__ import annotations

import math
import re
import shutil
import struct
import subprocess
from pathlib import Path
from typing import Any

import pytest

from gateway.clients import MissingRegisterError, UnspeakableNameError, render_client
from gateway.profiles import load_register_map
from gateway.registers import Status
from tests.clients.conftest import CONTROLLERS
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.controllers.irc5 import Irc5
from tests.clients.programs.controllers.s7 import S7
from tests.clients.programs.controllers.structured_text import Codesys
from tests.clients.programs.python_program import PythonProgram
from tests.clients.scenes import MAP, WHERE, cycles
from tests.clients.texts.test_controller_rules import LANGUAGES, PROFILES, own_map

TENTHS = (
    "name: calibration_time_left, address: 130, type: uint16, scale: 1,",
    "name: calibration_time_left, address: 130, type: uint16, scale: 0.1,",
)


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("min: 0, max: 5, values: state,", "min: 0, max: 5,", "names of state"),
        ("values: fault_code\n", "min: 0\n", "names of fault_code"),
        ("bits: warning_word\n", "min: 0\n", "names of warning_word"),
        (
            "values: commit_status,",
            "values: {0: frei, 3: fertig, 4: failed},",
            "value committed of commit_status",
        ),
        (  # of which the clients' 16#8000, no value, would be 327.68 N
            "name: force_setpoint, address: 1, type: int16, scale: 0.01, unit: N, access: RW, min: 0, max: 327.67",
            "name: force_setpoint, address: 1, type: uint16, scale: 0.01, unit: N, access: RW, min: 0, max: 655.35",
            "type int16 of force_setpoint",
        ),
        (  # which the clients compare with what they asked for
            "name: force_requested, address: 103, type: int16, scale: 0.01, unit: N,",
            "name: force_requested, address: 103, type: uint16, scale: 0.01, unit: N,",
            "type int16 of force_requested",
        ),
        (
            "name: self_test_noise, address: 420, type: uint16, values: self_test_verdict,",
            "name: self_test_noise, address: 420, type: uint16,",
            "names of self_test_noise",
        ),
        ("name: self_test_noise,", "name: rauschen,", r"self_test_noise \(block proof\)"),
        (  # which SCL and ST named all the same
            '      - {name: heartbeat_echo, address: 114, type: uint16, text: "Heartbeat seen by the control"}\n',
            "",
            r"heartbeat_echo \(block status\)",
        ),
    ],
)
@pytest.mark.parametrize("language", LANGUAGES)
def test_a_map_without_the_names_that_a_client_says_is_told_so(
    language: str, old: str, new: str, told: str, tmp_path: Path
) -> None:
    """A CASE or an enumeration with nothing in it is no text that a compiler takes, and no commit would ever end."""
    with pytest.raises(MissingRegisterError, match=f"^map own lacks {told}$"):
        render_client(own_map(tmp_path, old, new), language, WHERE)


@pytest.mark.parametrize(
    ("name", "languages"),
    [
        ("type", {"scl", "st"}),
        ("counter", {"scl"}),  # a type of its own
        ("limit", {"st"}),  # an operator
        ("st", {"st"}),  # and one of an instruction list
        ("default", {"c"}),
        ("force_of_the_left_hand_cells", {"rapid"}),  # FG_S_ and 28 characters
        ("force_of_the_left_hand_cell", set[str]()),
    ],
)
def test_a_register_of_ones_own_that_a_language_cannot_name_is_told(
    name: str, languages: set[str], tmp_path: Path
) -> None:
    """The gateway serves it, and a compiler of the controller would have been the first to refuse."""
    known = '      - {name: plant_id, address: 131, type: uint16, text: "Number of the plant in use'
    own = own_map(tmp_path, known, known.replace("plant_id", name))
    for language in LANGUAGES:
        if language in languages:
            with pytest.raises(UnspeakableNameError, match=f"^map own: {name} .*: give it another name$"):
                render_client(own, language, WHERE)
        else:
            assert name in render_client(own, language, WHERE).lower()


@pytest.mark.parametrize(
    ("item", "languages"),
    [("type", {"scl", "st"}), ("loss_of_force_behind_the_reducer", {"rapid"}), ("valve", set[str]())],
)
def test_an_item_of_a_self_test_of_ones_own_is_said_or_told(item: str, languages: set[str], tmp_path: Path) -> None:
    own = own_map(tmp_path, "self_test_leak", f"self_test_{item}")
    for language in LANGUAGES:
        if language in languages:
            with pytest.raises(UnspeakableNameError, match=f"^map own: {item} .*: give it another name$"):
                render_client(own, language, WHERE)
        else:
            assert re.search(rf"\b(FG_T(EST)?_)?{item}\b", render_client(own, language, WHERE), re.I)


@pytest.mark.parametrize(("name", "is_told"), [("written_to_disk_by_now", False), ("written_to_the_disk_now", True)])
def test_a_value_of_ones_own_that_rapid_cannot_name_is_told(name: str, is_told: bool, tmp_path: Path) -> None:
    """FG_COMMIT_ and 23 characters: the controller loads no module with an identifier of 33."""
    own = own_map(tmp_path, "values: commit_status,", f"values: {{2: {name}, 3: committed, 4: failed}},")
    if is_told:
        with pytest.raises(
            UnspeakableNameError, match=f"^map own: {name} has 23 characters, and rapid has room for 22: "
        ):
            render_client(own, "rapid", WHERE)
    else:
        text = render_client(own, "rapid", WHERE)
        assert max(map(len, re.findall(r"\bFG_\w+", text))) == len(f"FG_COMMIT_{name}") == 32


def test_a_status_block_that_one_request_cannot_read_is_told(tmp_path: Path) -> None:
    """The gateway would refuse each read of it, and the client take that for a loss."""
    text = (PROFILES / "registers" / "force-v1.yaml").read_text()
    for old, new in (
        ("first: 200\n    last: 295", "first: 2000\n    last: 2431"),
        ("first: 300\n    last: 395", "first: 3000\n    last: 3431"),
        ("{command: 200, status: 232}", "{command: 2000, status: 2032}"),
        ("{command: 300, status: 332}", "{command: 3000, status: 3032}"),
        ("last: 131\n", "last: 299\n"),
        ("name: plant_id, address: 131", "name: plant_id, address: 250"),
    ):
        assert text.count(old) == 1
        text = text.replace(old, new)
    (tmp_path / "wide.yaml").write_text(text)
    with pytest.raises(MissingRegisterError, match=r"^map force-v1 lacks a status block of at most 125 words$"):
        render_client(load_register_map(str(tmp_path / "wide.yaml")), "rapid", WHERE)


def test_a_word_without_a_sign_is_shown_in_its_unit_too(tmp_path: Path) -> None:
    changed = own_map(tmp_path, *TENTHS)
    shown: list[float] = []
    for language, kind in (("rapid", Irc5), ("scl", S7), ("st", Codesys), ("python", PythonProgram)):
        gateway = GatewayAtHand(changed)
        client: Any = kind(render_client(changed, language, WHERE), gateway)
        gateway.bank.publish(Status(calibration_time_left_s=12.3))
        cycles(client, 2)
        if language == "rapid":
            shown.append(client.get("fgStatus")[client.get("FG_S_CALIBRATION_TIME_LEFT") - 1])
        elif language == "python":
            shown.append(client.client.status["calibration_time_left"])
        else:
            shown.append(client.output("status")["CALIBRATION_TIME_LEFT"])
    assert shown == pytest.approx([12.3] * 4)


def test_what_a_robot_s_own_modbus_client_is_told_to_write_is_of_the_map_in_use(tmp_path: Path) -> None:
    """By force-v1's numbers 12 N were 120 N of a map in tenths, and control_word somebody else's register."""
    text = (PROFILES / "registers" / "force-v1.yaml").read_text()
    commands = text[text.index("  command:") : text.index("  status:")]
    moved = re.sub(r"(first|last|address): (\d+)", lambda found: f"{found[1]}: {int(found[2]) + 600}", commands)
    tenths = moved.replace("type: int16, scale: 0.01, unit: N, access: RW, min: 0, max: 327.67", "type: int16, scale: 0.1, "
                           "unit: N, access: RW, min: 0, max: 327.67", 1)  # fmt: skip
    (tmp_path / "own.yaml").write_text(text.replace(commands, tenths))
    own = load_register_map(str(tmp_path / "own.yaml"))
    assert (own.find("force_setpoint").address, own.find("force_setpoint").scale) == (601, 0.1)
    script = render_client(own, "urscript", WHERE)
    for line in (
        'modbus_add_signal("192.168.125.20", 1, 600, 3, "fg_control", False)',
        'modbus_add_signal("192.168.125.20", 1, 601, 3, "fg_force", False)',
        'modbus_add_signal("192.168.125.20", 1, 604, 3, "fg_heartbeat", False)',
        'modbus_set_output_register("fg_force", 120, False)             # 12.00 N',
        'modbus_set_output_register("fg_all", [1, 120, 0, 0, beat])',
    ):
        assert line in script, line


@pytest.mark.skipif(not shutil.which("gcc"), reason="no gcc")
def test_c_shows_scaled_words_and_numbers_of_two_words_with_their_sign(tmp_path: Path) -> None:
    wide = own_map(tmp_path, "name: owner_ip, address: 116, type: uint32", "name: owner_ip, address: 116, type: int32")
    assert "int32_t owner_ip;" in render_client(wide, "c", WHERE)
    (tmp_path / "force_gateway.h").write_text(render_client(own_map(tmp_path, *TENTHS), "c", WHERE))
    (tmp_path / "main.c").write_text(
        '#define FORCE_GATEWAY_IMPLEMENTATION\n#include "force_gateway.h"\n'
        "int main(void) { uint16_t w[FG_STATUS_WORDS] = {0}; fg_status s; w[30] = 123; fg_decode(w, &s);\n"
        'printf("%.2f", (double)s.calibration_time_left); return 0; }\n'
    )
    subprocess.run(
        ["gcc", "-std=c99", "-Wall", "-Werror", "-Wno-unused", "main.c", "-o", "it", "-lm"], cwd=tmp_path, check=True
    )
    assert subprocess.run([tmp_path / "it"], capture_output=True, text=True, check=True).stdout == "12.30"


def test_an_s7_names_registers_from_40001_to_49999_and_from_410000_on(tmp_path: Path) -> None:
    """50001 is no MB_DATA_ADDR: five digits end at 49999, the six that go further begin at 400001."""
    shipped = (PROFILES / "registers" / "force-v1.yaml").read_text()
    moved = re.sub(r"(address|first|last): 1(\d{3})\b", r"\g<1>: 10\2", shipped)
    (tmp_path / "far.yaml").write_text(moved)
    scl = render_client(load_register_map(str(tmp_path / "far.yaml")), "scl", WHERE)
    numbers = dict(re.findall(r"(\w+_ADDR) : UDInt := (\d+);", scl))
    assert (numbers["STAGE_A_ADDR"], numbers["TAIL_ADDR"], numbers["COMMAND_ADDR"]) == ("410001", "410141", "40001")


def test_the_limits_of_a_finer_scale_are_said_whole(tmp_path: Path) -> None:
    """32.77 is 3 counts more than 32.767: let through, it would be refused, or wrapped."""
    force = "name: force_setpoint, address: 1, type: int16, scale: 0.01, unit: N, access: RW, min: 0, max: 327.67"
    finer = force.replace("0.01", "0.001").replace("327.67", "32.767")
    changed = own_map(tmp_path, force, finer)
    for language in CONTROLLERS:
        text = render_client(changed, {"twincat": "st", "codesys": "st"}.get(language, language), WHERE)
        assert "32.767" in text and "32.77" not in text
    gateway = GatewayAtHand(changed)
    client = Irc5(render_client(changed, "rapid", WHERE), gateway)
    client.enable(32.768)
    cycles(client)
    assert not gateway.writes and "0.00 .. 32.767" in client.text
    client.enable(math.floor(32.767 * 8) / 8)
    cycles(client)
    assert struct.pack(">H", 32750) in gateway.requests[-6] + gateway.requests[-5]


@pytest.mark.parametrize(
    ("name", "languages"),
    [
        ("host", {"rapid", "urscript"}),
        ("ok", {"c"}),
        ("is_in_band", {"rapid", "urscript", "c"}),
        ("grinding", set[str]()),
    ],
)
def test_a_bit_of_ones_own_whose_constant_a_client_has_already_is_told(
    name: str, languages: set[str], tmp_path: Path
) -> None:
    """FG_HOST twice: an IRC5 loads no such module, and a Universal Robot connected to the bit's number."""
    bits = ", ".join(f"{bit}: {each}" for bit, each in MAP.find("control_word").bits.items())
    own = own_map(tmp_path, "bits: control_word", f"bits: {{{bits}, 9: {name}}}")
    for language in LANGUAGES:
        if language in languages:
            with pytest.raises(
                UnspeakableNameError, match=f"^map own: FG_{name.upper()} stands twice .*: give it another"
            ):
                render_client(own, language, WHERE)
        else:
            assert render_client(own, language, WHERE)


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_status_register_of_ones_own_that_is_named_as_a_flag_is_told(language: str, tmp_path: Path) -> None:
    """A structure with `contact` twice, the register and the bit of status_word, is no text that a compiler takes."""
    known = '      - {name: plant_id, address: 131, type: uint16, text: "Number of the plant in use'
    own = own_map(tmp_path, known, known.replace("plant_id", "contact"))
    if language in ("scl", "st", "c"):
        with pytest.raises(UnspeakableNameError, match=r"^map own: contact .*: give it another name$"):
            render_client(own, language, WHERE)
    else:
        assert "contact" in render_client(own, language, WHERE).lower()


def test_a_force_below_0_that_a_map_of_ones_own_allows_is_asked_for(tmp_path: Path) -> None:
    """RAPID's own sign for no force is no force that anybody could mean."""
    force = "name: force_setpoint, address: 1, type: int16, scale: 0.01, unit: N, access: RW, min: 0, max: 327.67"
    below = own_map(tmp_path, force, force.replace("min: 0", "min: -50"))
    gateway = GatewayAtHand(below)
    client = Irc5(render_client(below, "rapid", WHERE), gateway)
    client.enable(-0.01)
    cycles(client)
    assert gateway.requests[-1][:1] == b"\x03" and any(b"\x00\x01\xff\xff" in each for each in gateway.requests)
