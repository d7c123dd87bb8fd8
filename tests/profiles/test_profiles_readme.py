"""The examples of profiles/README.md are whole files that `check` takes as they stand there."""

import re
from pathlib import Path

import pytest

from gateway.profiles import check_file
from gateway.profiles.find import FOLDERS, shipped_profiles_folder
from gateway.registers.map.value_names import BIT_NAMES, VALUE_NAMES

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
    assert sorted(kinds) == ["device", "device", "plant", "registers", "rig"]
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
