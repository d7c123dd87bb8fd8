"""Compiled loops are kept where files may be written, and everything works where that is nowhere."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import gateway
from gateway.compiled_folder import find_folder

HOME = {"HOME": "/home/me"}


def unwritable(path: Path) -> Path:
    """A path at which no folder can be made, not even by root: a file lies there."""
    path.write_text("")
    return path


@pytest.mark.parametrize(
    ("environment", "expected"),
    [
        ({"HOME": "home"}, None),
        ({"HOME": "{}/home"}, "home/.cache/force-gateway"),
        ({"HOME": "{}/home", "XDG_CACHE_HOME": "{}/cache"}, "cache/force-gateway"),
        ({"HOME": "{}/home", "CACHE_DIRECTORY": "{}/service:{}/other"}, "service"),
        ({"HOME": "{}/file", "XDG_CACHE_HOME": ""}, None),
        ({}, None),
    ],
)
def test_an_installed_package_keeps_them_in_the_users_cache(
    environment: dict[str, str], expected: str | None, tmp_path: Path
) -> None:
    unwritable(tmp_path / "__pycache__")
    unwritable(tmp_path / "file")
    given = {name: value.replace("{}", str(tmp_path)) for name, value in environment.items()}
    assert find_folder("", tmp_path, given) == (tmp_path / expected if expected else None)


def test_a_clone_keeps_them_beside_its_bytecode_and_a_choice_goes_before_all(tmp_path: Path) -> None:
    assert find_folder("", tmp_path, HOME) == tmp_path / "__pycache__"
    assert find_folder(str(tmp_path / "chosen"), tmp_path, HOME) == tmp_path / "chosen"
    assert find_folder(str(unwritable(tmp_path / "file") / "chosen"), tmp_path, HOME) is None


LOOP = """
from gateway.compiled import loop
from gateway import progress
@loop
def double(value):
    return 2.0 * value
"""
RUN = """
from compiled_here import double, progress
with progress.listen(print):
    print(double(21.0))
"""


def run_with(package: Path, home: str, script: str = RUN) -> list[str]:
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("NUMBA", "XDG_CACHE"))}
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=package,
        env=environment | {"HOME": home, "PYTHONPATH": str(package), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.splitlines()


RENAMED = """
from typing import NamedTuple
from gateway.compiled import loop, step
from gateway import progress
class Number(NamedTuple):
    value: float
@step
def twice(number: Number):
    return 2.0 * number.value
@loop
def double_number(number):
    return twice(number)
def double(value):
    return double_number(Number(value))
"""


@pytest.mark.long
def test_what_another_version_has_compiled_is_left_alone(tmp_path: Path) -> None:
    """Its types may have other names now, and what was kept of them can then not be read."""
    room = copy_of_the_compiler(tmp_path)
    (room / "__pycache__").mkdir()
    for name in ("Number", "Figure"):
        (tmp_path / "compiled_here.py").write_text(RENAMED.replace("Number", name))
        assert run_with(tmp_path, str(tmp_path))[-1] == "42.0"


LATER = """
from gateway.compiled import loop, step
@step
def thrice(value):
    return 3.0 * value
@loop
def sixfold(value):
    return 2.0 * thrice(value)
"""


@pytest.mark.long
def test_steps_of_a_module_that_comes_later_are_known_too_and_their_changes_seen(tmp_path: Path) -> None:
    """numba does not look at what a loop calls: a step that has changed in another file must not run as it was."""
    (copy_of_the_compiler(tmp_path) / "__pycache__").mkdir()
    (tmp_path / "compiled_here.py").write_text(LOOP)
    (tmp_path / "loop_later.py").write_text(
        LATER.replace("def thrice", "def unused").replace("@loop", "from step_later import thrice\n@loop")
    )
    run = RUN + "from loop_later import sixfold\nprint(sixfold(7.0))\n"
    for factor, expected in (("3.0", "42.0"), ("4.0", "56.0")):
        (tmp_path / "step_later.py").write_text(LATER.partition("@loop")[0].replace("3.0", factor))
        assert run_with(tmp_path, str(tmp_path), run)[-1] == expected


def copy_of_the_compiler(folder: Path) -> Path:
    ours, room = Path(gateway.__file__).parent, folder / "gateway"
    room.mkdir()
    for name in ("compiled", "compiled_folder", "extras", "progress"):
        (room / f"{name}.py").write_text((ours / f"{name}.py").read_text(encoding="utf-8"), encoding="utf-8")
    (room / "__init__.py").write_text("")
    return room


def test_an_installed_package_is_compiled_once_and_without_a_home_each_time(tmp_path: Path) -> None:
    room = copy_of_the_compiler(tmp_path)
    (tmp_path / "compiled_here.py").write_text(LOOP)
    unwritable(room / "__pycache__")
    compiling = "preparing the simulation for this machine, once: 1 of 1"
    home = str(tmp_path / "home")
    assert run_with(tmp_path, home)[0] == compiling
    assert list((tmp_path / "home" / ".cache" / "force-gateway").glob("compiled-*/*/*.nbc"))
    assert run_with(tmp_path, home) == ["42.0"]
    nowhere = str(unwritable(tmp_path / "file"))
    assert [run_with(tmp_path, nowhere)[0] for _ in range(2)] == [compiling] * 2
