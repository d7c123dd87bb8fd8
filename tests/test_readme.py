"""README's generated part and its promises are those of the code."""

import itertools
import re
from pathlib import Path

import pytest

from gateway.cli.main import command
from gateway.profiles import load_register_map
from gateway.profiles.device_table import render_devices, render_wires
from gateway.registers import render_block
from gateway.registers.roles import render_roles
from tests.profile_files import load_device

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()


def test_the_command_block_is_the_map_s():
    table = README.split("<!-- command block", 1)[1].split("-->\n", 1)[1].split("<!-- end -->", 1)[0]
    assert table == render_block(load_register_map("force-v1"), "command"), "run tools/readme"


def test_the_tables_of_devices_are_what_the_files_say():
    for page, table in ((README, render_devices()), ((ROOT / "profiles/README.md").read_text(), render_wires())):
        assert table in page.split("<!-- devices", 1)[1].split("<!-- end -->", 1)[0], "run tools/readme"


def test_the_table_of_roles_is_the_one_that_is_asked():
    table = README.split("<!-- roles", 1)[1].split("-->\n", 1)[1].split("<!-- end -->", 1)[0]
    assert table == render_roles(load_register_map("force-v1")), "run tools/readme"


def test_the_device_of_ones_own_is_one(tmp_path: Path):
    lines = itertools.takewhile(
        lambda line: line.startswith("    "), README.partition("    name: my-dac")[2].splitlines()[1:]
    )
    (tmp_path / "my-dac.yaml").write_text("\n".join(["name: my-dac", *(line[4:] for line in lines)]))
    assert load_device(tmp_path / "my-dac.yaml").serial.baud == 57600


@pytest.mark.parametrize("verb", sorted(set(re.findall(r"(?:bin/)?force-gateway ([a-z-]+)(?= |`|\n)", README))))
def test_every_verb_that_readme_names_exists(verb):
    assert verb in command.list_commands(None)


@pytest.mark.parametrize(
    "path", sorted(set(re.findall(r"(?<![-\w])(?:tools|profiles|tests|gateway)/[\w./-]*\w", README)))
)
def test_every_file_that_readme_names_exists(path):
    assert (ROOT / path).exists()
