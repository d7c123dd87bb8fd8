"""The examples of profiles/README.md are whole files that `check` takes as they stand there."""

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from gateway.cli.main import command
from gateway.devices.messages import SetVoltage
from gateway.profiles import check_file, list_shipped, load_device, load_rig
from gateway.profiles.find import FOLDERS, shipped_profiles_folder
from gateway.registers.map.value_names import BIT_NAMES, VALUE_NAMES
from tests.service.probing.far_ends import FarEnd, behind_ptys
from tests.service.wired import Wired

TEXT = (shipped_profiles_folder() / "README.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```yaml\n# (\S+\.yaml)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
EXAMPLES = dict(BLOCK.findall(TEXT))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All examples beside each other, as a reader would write them."""
    folder = tmp_path_factory.mktemp("examples")
    for name, text in EXAMPLES.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def test_there_is_an_example_of_each_kind_that_people_write(folder: Path) -> None:
    kinds = [check_file(folder / name).kind for name in EXAMPLES]
    assert sorted(kinds) == ["device"] * 4 + ["plant", "registers", "rig"]
    assert TEXT.count("```yaml") == len(EXAMPLES)


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_is_checked_without_a_fault(name: str, folder: Path) -> None:
    checked = check_file(folder / name)
    assert [str(fault) for fault in checked.faults] == []
    assert [fault.path for fault in checked.warnings] == (
        ["calibration"] if checked.kind == "rig" else []
    )  # the demo's
    assert checked.value.name == Path(name).stem


def test_each_folder_is_in_the_table() -> None:
    told = set(re.findall(r"^\| `(\w+)/`", TEXT, re.MULTILINE))
    here = {path.name for path in shipped_profiles_folder().iterdir() if path.is_dir()}
    assert told == here
    assert here - {"schemas"} <= set(FOLDERS.values())


def test_enumerations_and_shipped_files_that_the_page_names_are_there() -> None:
    named = re.search(r"by its name \(([^)]*), \.\.\.\)", TEXT)
    assert named
    assert set(re.findall(r"`(\w+)`", named[1])) <= {*VALUE_NAMES, *BIT_NAMES}
    for link in re.findall(r"\]\(([^)]+)\)", TEXT):
        assert (shipped_profiles_folder() / link).is_file(), link


def commands_of(page: str) -> list[str]:
    """The lines of the page's shell blocks."""
    blocks = re.findall(r"^```sh\n(.*?)^```$", page, re.DOTALL | re.MULTILINE)
    return [line for block in blocks for line in block.splitlines()]


def test_a_newcomer_who_follows_the_page_gets_a_device_that_is_not_shipped_to_press(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each command as it stands there, in a folder with the files as they stand there; ports are ptys, devices simulated."""
    assert not {"my-dac", "my-amplifier", "my-modbus-dac", "my-weigher"} & set(list_shipped("device"))
    monkeypatch.chdir(tmp_path)
    dac, indicator = FarEnd(load_device(folder / "my-dac.yaml")), FarEnd(load_device("stream-st-gs"))
    ports = re.findall(r"port: (/dev/serial/by-id/\S+)", EXAMPLES["my-cell.yaml"])
    with behind_ptys(dac, indicator) as paths:
        here = dict(zip(ports, paths, strict=True))
        for name, text in EXAMPLES.items():
            (tmp_path / name).write_text(_with_ports(text, here), encoding="utf-8")
        said = {line: _follow(_with_ports(line, here)) for line in commands_of(TEXT)}
    assert len(said) == 5
    probed = [text for line, text in said.items() if "--probe" in line]
    assert all("my-dac answers at 19200 8N1: it says that it is DAC12" in text for text in probed), probed
    assert not any(isinstance(one, SetVoltage) for one in dac.heard)


def _with_ports(text: str, here: dict[str, str]) -> str:
    for port, path in here.items():
        text = text.replace(port, path)
    return text


def _follow(line: str) -> str:
    """Run a line; `run --sim` in virtual time."""
    program, *arguments = line.split()
    assert program == "force-gateway"
    if arguments[0] == "run":
        assert arguments[2:] == ["--sim"]
        wired = Wired(load_rig(arguments[1], simulated=True)).ready()
        for beat in range(1, 31):
            wired.write(0, 1, 1200, 0, 0, beat)
            wired.run(0.1)
        assert wired.force_n == pytest.approx(12.0, abs=1.0)
        return f"{wired.force_n:.1f} N"
    result = CliRunner().invoke(command, arguments)
    assert result.exit_code == 0, result.output
    return result.output
