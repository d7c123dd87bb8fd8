"""Faults that the registers room finds in a map are told with their lines."""

from pathlib import Path

import pytest

from gateway.profiles import ProfileError, load_register_map

MAP = """\
name: mine
version: 1
blocks:
  command:
    first: 0
    last: 15
    registers:
      - {name: control_word, address: 0, type: uint17, text: bits}
      - {name: force, address: 1, type: int16, scal: 0.01, text: force}
      - {name: far, address: 99, type: int16, text: outside}
"""


def test_every_fault_of_a_map_is_told_at_its_place(tmp_path: Path) -> None:
    path = tmp_path / "map.yaml"
    path.write_text(MAP, encoding="utf-8")
    with pytest.raises(ProfileError) as caught:
        load_register_map(path)
    told = [str(fault).split("map.yaml:")[1] for fault in caught.value.faults]
    assert told[0].startswith("8:48 blocks.command.registers[0].type: uint17 is not one of")
    assert told[1].startswith("9:48 blocks.command.registers[1].scal: is not a known key; did you mean scale?")
    assert told[2].startswith("10:9 blocks.command.registers[2]: far at 99 is outside block command, 0 .. 15")


def test_the_shipped_map_has_the_registers_that_masters_rely_on() -> None:
    register_map = load_register_map("force-v1")
    assert register_map.find("control_word").address == 0
    assert register_map.find("force_measured").block == "status"
