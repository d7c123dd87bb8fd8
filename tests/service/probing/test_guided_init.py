"""`init` at a terminal: from two ports to a rig that `check` accepts, with the devices asked what they are."""

from itertools import cycle, product
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner, Result

from gateway.cli.main import command
from gateway.cli.setup.guided_rig import set_in
from gateway.cli.setup.port_probing import known_profiles
from gateway.cli.setup.starter_rig import starter_rig
from gateway.devices import DeviceProfile
from gateway.devices.messages import SetVoltage
from gateway.profiles import check_report, load_device
from gateway.profiles.rigs.checks.wire_times import wire_cycle_s
from tests.service.probing.far_ends import FarEnd, behind_ptys


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("gateway.ports.list_ports", list)
    return tmp_path


def answered(*lines: str) -> Result:
    return CliRunner().invoke(command, ["init", "own", "--guided"], input="\n".join(lines) + "\n")


def test_the_devices_say_what_they_are_and_the_file_is_accepted(folder: Path) -> None:
    module, indicator = FarEnd(load_device("icpdas-702x")), FarEnd(load_device("stream-st-gs"))
    with behind_ptys(module, indicator) as (output, cell):
        result = answered(output, "y", "", "", cell, "y", "", "", "98.07", "40")
    assert result.exit_code == 0, result.output
    answer = "icpdas-702x answers at 9600 8N1: it says that it is 7021"
    assert answer in result.output
    told = f"listens, then asks in the words of {len(known_profiles('output'))} profiles at their own speeds, then at others"
    assert f"{told}: 10 s or so where nothing answers" in result.output.partition(answer)[0]
    found = check_report("own.yaml")
    assert found.rig, [str(fault) for fault in found.faults]
    assert (found.rig.output.device.name, found.rig.load_cell.device.name) == ("icpdas-702x", "stream-st-gs")
    assert found.rig.ports() == {"output": output, "load_cell": cell}
    assert not found.rig.accept_no_device_watchdog
    assert not any(isinstance(one, SetVoltage) for one in module.heard)
    assert sorted(path.name for path in folder.iterdir()) == ["own.yaml"]


def test_enter_takes_the_speed_at_which_the_device_was_found() -> None:
    """Its profile names the one of its factory: in the file the device would be silent at the first start."""
    with behind_ptys(FarEnd(load_device("stream-st-gs"), baud=38400)) as (cell,):
        result = answered("later", "smc-itv-rc", "", "y", cell, "y", "", "", "98.07", "40")
    assert "stream-st-gs answers at 38400 8N1" in result.output
    rig = check_report("own.yaml", simulated=True).rig
    assert rig and (rig.load_cell.device.name, rig.load_cell.baud) == ("stream-st-gs", 38400)


@pytest.mark.parametrize("helps", [True, False])
def test_an_output_without_a_watchdog_is_to_be_looked_at_again_where_nothing_else_helps(helps: bool) -> None:
    answered("later", "smc-itv-rc", "", "y" if helps else "n", "later", "", "", "98.07", "40")
    (line,) = [one for one in Path("own.yaml").read_text().splitlines() if one.startswith("accept_no_device_watchdog")]
    assert line.startswith("accept_no_device_watchdog: true") and ("EDIT: nothing else helps" in line) is not helps


@pytest.mark.parametrize("baud", [4800, 9600])
def test_a_slow_output_may_lose_an_answer_within_its_bound(baud: int) -> None:
    """A bound of one exchange, and the first character that is lost ends the force: check warns of it."""
    answered("later", "smc-itv-rc", str(baud), "y", "later", "", "", "98.07", "40")
    found = check_report("own.yaml", simulated=True)
    assert found.rig, [str(fault) for fault in found.faults]
    assert not [one for one in found.warnings if "output_timeout_s" in f"{one.path} {one.message}"]
    line = found.rig.output
    assert found.rig.control.supervision.output_timeout_s >= 3 * wire_cycle_s(line.device, line.settings)


@pytest.mark.parametrize(
    ("cell", "more"),
    [
        ("adam-4016", ("counts", "0", "12.5")),
        ("mantracourt-dsc", ("kg",)),
        ("laumas-tlb", ()),
        ("hbm-aed-binary", ("counts", "100", "0.001")),
        ("hx711-line", ("counts", "84000", "0.0001")),
    ],
)
def test_every_amplifier_gets_bounds_that_it_can_keep(cell: str, more: tuple[str, ...]) -> None:
    result = answered("later", "smc-itv-rc", "", "y", "later", cell, "", *more, "98.07", "40")
    assert result.exit_code == 0, result.output
    found = check_report("own.yaml", simulated=True)
    assert found.rig, [str(fault) for fault in found.faults]


def test_forces_that_do_not_fit_are_asked_again() -> None:
    result = answered("later", "", "", "y", "later", "", "", "98.07", "300", "98.07", "40")
    assert "limits.force_max_n: 300 N is above 65.2 N" in result.output
    assert check_report("own.yaml", simulated=True).rig


def test_a_force_that_is_no_number_is_asked_again() -> None:
    """NaN was taken, for the cell's range and for the newtons of a count."""
    answers = (
        "later",
        "smc-itv-rc",
        "",
        "y",
        "later",
        "adam-4016",
        "",
        "counts",
        "0",
        "nan",
        "12,5",
        "12.5",
        "nan",
        "-5",
    )
    result = answered(*answers, "98.07", "inf", "40")
    assert result.exit_code == 0 and "decimals take a point: 12.5" in result.output, result.output
    assert "-5: allowed above 0" in result.output
    text = Path("own.yaml").read_text(encoding="utf-8")
    assert "newton_per_count: 12.5" in text and "force_max_n: 40" in text and "range_n: 98.07" in text


@pytest.mark.parametrize("slip", ["maybe", "/dev/ttyUSB0"])
def test_an_answer_that_is_neither_yes_nor_no_is_told_what_is_allowed(slip: str) -> None:
    """`Error: invalid input` was all that stood there."""
    result = answered("later", "smc-itv-rc", "", slip, "yes", "later", "", "", "98.07", "40")
    assert f"{slip} is neither y (yes) nor n (no); Enter alone means n" in result.output
    assert check_report("own.yaml", simulated=True).rig


def test_a_range_that_no_cell_has_is_asked_again() -> None:
    """The fault was told, and the file written with it."""
    result = answered("later", "", "", "y", "later", "", "", "98070", "40", "98.07", "40")
    assert "load_cell.range_n: 98070 N is above 5000 N" in result.output
    assert check_report("own.yaml", simulated=True).rig


@pytest.mark.parametrize("slip", ["115300", "fast", "-9600", "98.07"])
def test_a_speed_that_no_port_has_is_asked_again(slip: str) -> None:
    """It was written into the file, which `check` then refused."""
    result = answered("later", "", slip, "9600", "y", "later", "", slip, "57600", "98.07", "40")
    assert result.output.count(f"{slip} is no speed of a serial port") == 2
    rig = check_report("own.yaml", simulated=True).rig
    assert rig and (rig.output.baud, rig.load_cell.baud) == (9600, 57600)


def test_a_file_that_is_written_with_a_fault_has_it_told() -> None:
    """What was answered at the last time went into the file without a look at it."""
    result = answered("later", "", "", "y", "later", "", "", *["98.07", "300"] * 3, "98.07", "299")
    assert "limits.force_max_n: 299 N is above 65.2 N" in result.output
    assert not check_report("own.yaml", simulated=True).rig


def test_enter_gives_the_load_cell_another_port_than_the_output(monkeypatch: pytest.MonkeyPatch) -> None:
    """It was the output's port again, which is refused by `check` alone, later."""
    paths = ["/dev/serial/by-id/a", "/dev/serial/by-id/b"]
    monkeypatch.setattr("gateway.ports.list_ports", lambda: [SimpleNamespace(path=path) for path in paths])
    answered("", "n", "", "", "y", "", "n", "", "", "98.07", "40")
    found = check_report("own.yaml")
    assert found.rig, [str(fault) for fault in found.faults]
    assert found.rig.ports() == {"output": paths[0], "load_cell": paths[1]}


def test_a_port_that_is_none_or_the_other_device_s_is_asked_for_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """`port: 9` stood in the file, and twice the same port, without a word."""
    paths = ["/dev/serial/by-id/a", "/dev/serial/by-id/b"]
    monkeypatch.setattr("gateway.ports.list_ports", lambda: [SimpleNamespace(path=path) for path in paths])
    result = answered("9", "1", "n", "", "", "y", "1", paths[0], "2", "n", "", "", "98.07", "8")
    assert "9 is no number of this list" in result.output
    assert result.output.count(f"{paths[0]} is the output's port already") == 2
    found = check_report("own.yaml")
    assert found.rig, [str(fault) for fault in found.faults]
    assert found.rig.ports() == {"output": paths[0], "load_cell": paths[1]}
    assert "force-gateway hold 8 " in result.output, "no more than tool and workpiece take"


@pytest.mark.parametrize("guided", ["--guided", "--no-guided"])
def test_a_folder_that_takes_no_file_is_told_before_anything_is_asked(
    guided: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gateway.cli.verbs.setup.init.os.access", lambda path, mode: False)
    result = CliRunner().invoke(command, ["init", "own", guided], input="later\n")
    told = "E105 own.yaml: Permission denied: this user may not; take another place, or chown it (force-gateway explain E105)\n"
    assert (result.exit_code, result.output) == (77, told)
    assert not any(folder.iterdir())


def answers_for(output: DeviceProfile, cell: DeviceProfile) -> tuple[str, ...]:
    """What a person says up to the forces, to whom these two profiles are known by name."""
    accepted = () if output.own_watchdog else ("y",)
    unit = () if cell.reading.newton_per_unit or cell.reading.template.field("unit") else ("counts", "0", "0.0001")
    return ("later", output.name, "", *accepted, "later", cell.name, "", *unit)


def test_enter_at_the_largest_force_is_accepted_for_every_pair_of_devices_and_every_cell() -> None:
    """A cell of 20 N and less, and one of 200 N and more, gave files that `check` refused. Each device meets each cell."""
    pairs = list(product(known_profiles("output"), known_profiles("load cell")))
    for (output, cell), range_n in zip(pairs, cycle(("1", "5", "20", "98.07", "5000")), strict=False):
        result = answered(*answers_for(output, cell), range_n, "")
        found = check_report("own.yaml", simulated=True)
        assert found.rig, (output.name, cell.name, range_n, result.output, *map(str, found.faults))
        Path("own.yaml").unlink()
    assert len(pairs) > 40


@pytest.mark.parametrize(("range_n", "stuck_n"), [("5", 2.0), ("20", 8.0), ("98.07", 15.0)])
def test_a_tool_that_is_stuck_with_the_largest_force_of_a_small_cell_keeps_an_enable_back(
    range_n: str, stuck_n: float
) -> None:
    """15 N stood for every cell, beyond the over-force of a small one: `check` warned of what nobody had answered."""
    answered("later", "", "", "y", "later", "", "", range_n, "")
    found = check_report("own.yaml", simulated=True)
    assert found.rig and found.rig.control.supervision.stuck_n == stuck_n
    assert not [fault for fault in found.warnings if fault.path == "supervision.stuck_n"]


OWN_DAC = """name: own-dac
description: a supply with a serial line
role: output
source: a test
certainty: composed
hardware: never run on hardware
serial: {{baud: {baud}}}
terminator: "\\n"
reply_timeout_s: {reply_timeout_s}
set_voltage: {{ask: "VOLT {{volts:.4f}}", answer: "OK", range: {{device: [0, 10], voltage_v: [0, 10]}}}}
"""
OWN_CELL = """name: own-cell
description: a scale
role: load cell
source: a test
certainty: composed
hardware: never run on hardware
serial: {{baud: 9600}}
terminator: "\\r\\n"
stream: {{frame: "{{force:8.3f}} kg", unit: kg, rate_hz: {rate_hz}}}
"""


@pytest.mark.parametrize(("baud", "reply_timeout_s", "rate_hz"), [(9600, 0.3, 10), (2400, 0.15, 4), (115200, 0.05, 2)])
def test_devices_of_ones_own_that_take_their_time_are_accepted(
    baud: int, reply_timeout_s: float, rate_hz: float, folder: Path
) -> None:
    (folder / "own-dac.yaml").write_text(OWN_DAC.format(baud=baud, reply_timeout_s=reply_timeout_s))
    (folder / "own-cell.yaml").write_text(OWN_CELL.format(rate_hz=rate_hz))
    result = answered("later", "own-dac", "", "y", "later", "own-cell", "", "98.07", "40")
    found = check_report("own.yaml", simulated=True)
    assert found.rig, (result.output, *map(str, found.faults))
    bounds = found.rig.control.supervision
    assert bounds.output_timeout_s >= reply_timeout_s and bounds.response_lag_s >= 1.0 / rate_hz


def test_a_device_file_with_a_fault_is_told_and_not_offered(folder: Path) -> None:
    """It was left out of the known ones without a word."""
    (folder / "own-dac.yaml").write_text(OWN_DAC.format(baud=9601, reply_timeout_s=0.05))
    (folder / "notes.yaml").write_text("some: notes\n")
    result = answered("later", "smc-itv-rc", "", "y", "later", "", "", "98.07", "40")
    assert "own-dac.yaml has faults and is not offered: force-gateway check own-dac.yaml" in result.output
    assert "notes.yaml" not in result.output
    assert "known: adam" in result.output


def test_without_a_terminal_nothing_is_asked() -> None:
    result = CliRunner().invoke(command, ["init", "own"])
    assert result.exit_code == 0
    assert Path("own.yaml").read_text() == starter_rig("own")


def test_a_value_is_set_in_its_own_section() -> None:
    text = set_in(set_in(starter_rig("own"), "load_cell", "baud", 38400), "load_cell", "address", 3)
    before, after = text.split("load_cell:")
    assert "baud: 9600" in before
    assert "baud: 38400\n" in after.split("limits:")[0]
    assert after.split("limits:")[0].rstrip().endswith("address: 3")
