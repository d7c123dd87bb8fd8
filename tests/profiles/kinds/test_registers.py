"""Faults that the registers room finds in a map are told with their lines."""

from pathlib import Path

import pytest

from gateway.profiles import ProfileError, check_report, load_register_map

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


@pytest.mark.parametrize(
    ("line", "spoilt", "told"),
    [
        ("  command:", "  400:", "4:3 blocks[400]: 400 is a number, a name is needed"),
        ("    last: 15\n", "    last: 15\n    repeats: {1: 200}\n", "7:15 blocks.command.repeats[1]: 1 is a number"),
    ],
)
def test_a_number_where_a_block_s_name_belongs_is_a_fault_of_the_file(
    tmp_path: Path, line: str, spoilt: str, told: str
) -> None:
    """It was a traceback, of `check` and of a start."""
    path = tmp_path / "map.yaml"
    path.write_text(MAP.replace(line, spoilt), encoding="utf-8")
    with pytest.raises(ProfileError) as caught:
        load_register_map(path)
    assert any(told in str(fault) for fault in caught.value.faults), caught.value.faults


def test_the_shipped_map_has_the_registers_that_masters_rely_on() -> None:
    register_map = load_register_map("force-v1")
    assert register_map.find("control_word").address == 0
    assert register_map.find("force_measured").block == "status"


SHIPPED = Path(__file__).parents[3] / "profiles"


@pytest.mark.parametrize(
    ("line", "instead", "sentence"),
    [
        ("name: plant_id", "name: plant", "block status lacks plant_id"),
        ("name: byte_order_echo", "name: echo", "byte_order_echo is not a register"),
        ("name: commit_notice", "name: notice", "commit_notice is not a register"),
        ("name: command_sequence", "name: number", "block command must hold control_word, force_setpoint"),
        (
            "name: force_applied, address: 105, type: int16, scale: 0.01, unit: N",
            None,
            "force_applied in lbf; status is",
        ),
        (
            "{name: length, address: 1140",
            "{name: length, address: 1151",
            "length@staging is at 1151, an upload has it at 1140",
        ),
        (
            "{name: damping, address: 1658",
            "{name: damping, address: 1646",
            "damping@active is at 1646, an upload has it at",
        ),
        (
            "address: 416\n        type: float32",
            "address: 416\n        type: uint16",
            "byte_order_echo is uint16, float32 is needed",
        ),
        (
            "contact_ramp, address: 8, type: int16, scale: 1, unit: ms, access: RW, min: 0, max: 10000",
            "contact_ramp, address: 8, type: int16, scale: 0.001, unit: s, access: RW, min: 0, max: 10",
            "contact_ramp in s; a command is taken with force_setpoint in N",
        ),
        (
            "bits: control_word",
            "bits: {0: reset_fault, 1: enable, 2: tare, 3: take_ownership, 4: valve_pull}",
            "control_word has bit 0 as reset_fault, which is 1 of a gateway",
        ),
        ("values: state,", "values: {0: aus, 1: holding},", "state has value 1 as holding, which is 3 of a gateway"),
    ],
)
def test_a_map_that_no_gateway_can_serve_is_told_before_it_starts(
    tmp_path: Path, line: str, instead: str | None, sentence: str
) -> None:
    """One copied from an older version, say: `check` was content, and the gateway ended at each of five starts."""
    text = (SHIPPED / "registers" / "force-v1.yaml").read_text(encoding="utf-8")
    assert text.count(line) == 1
    changed = text.replace(line, line.replace("unit: N", "unit: lbf") if instead is None else instead)
    (tmp_path / "own.yaml").write_text(changed, encoding="utf-8")
    rig = (
        (SHIPPED / "rigs" / "demo.yaml")
        .read_text(encoding="utf-8")
        .replace("registers: force-v1", "registers: own.yaml")
    )
    (tmp_path / "rig.yaml").write_text(rig, encoding="utf-8")
    assert load_register_map(tmp_path / "own.yaml").name == "force-v1", "a map it is"
    (fault,) = check_report(tmp_path / "rig.yaml", simulated=True).faults
    assert "own.yaml:" in str(fault) and "a gateway cannot serve it: " in str(fault) and sentence in str(fault)
    assert "force-v1 has all that it needs" in str(fault)


def test_a_map_too_fine_for_the_rigs_largest_force_is_told(tmp_path: Path) -> None:
    """0.001 N in 16 bits ends at 32.767 N: of a rig of 60 N half could not be commanded, and nobody said so before."""
    text = (SHIPPED / "registers" / "force-v1.yaml").read_text(encoding="utf-8")
    for name in ("force_setpoint", "force_measured"):
        (line,) = [line for line in text.splitlines() if f"name: {name}," in line]
        text = text.replace(line, line.replace("scale: 0.01", "scale: 0.001").replace("max: 327.67", "max: 32.767"))
    (tmp_path / "own.yaml").write_text(text, encoding="utf-8")
    rig = (SHIPPED / "rigs" / "demo.yaml").read_text(encoding="utf-8")
    (tmp_path / "rig.yaml").write_text(rig.replace("registers: force-v1", "registers: own.yaml"), encoding="utf-8")
    report = check_report(tmp_path / "rig.yaml", simulated=True)
    assert not report.faults
    assert [str(each).partition("limits.force_max_n: ")[2] for each in report.warnings if "32.767" in str(each)] == [
        "60 N, but force_setpoint of map force-v1 ends at 32.767 N: no master commands more; give it a coarser scale",
        "60 N, but force_measured of map force-v1 ends at 32.767 N: more is shown as that; give it a coarser scale",
    ]
    assert not any("of map force-v1" in str(each) for each in check_report("demo", simulated=True).warnings)
    (tmp_path / "own.yaml").write_text(
        text.replace("scale: 0.001", "scale: 0.01").replace("32.767", "60"), encoding="utf-8"
    )
    assert not any(
        "of map force-v1" in str(each) for each in check_report(tmp_path / "rig.yaml", simulated=True).warnings
    )
