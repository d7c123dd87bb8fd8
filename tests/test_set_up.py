"""The set-up of .venv: half of it never passes for a whole one, and the next call finishes what was interrupted."""

import sys
from collections.abc import Callable, Sequence
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from typing import Any

import pytest

from gateway import progress

FILE = Path(__file__).parents[1] / "tools" / "set_up.py"


@pytest.fixture
def set_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The module, working in a folder of its own."""
    monkeypatch.setattr(sys, "path", list(sys.path))
    loader = SourceFileLoader("set_up", str(FILE))
    specification = spec_from_loader("set_up", loader)
    assert specification
    module = module_from_spec(specification)
    loader.exec_module(module)
    for name, place in (("ROOT", ""), ("ENVIRONMENT", ".venv"), ("PYTHON", ".venv/bin/python")):
        monkeypatch.setattr(module, name, tmp_path / place)
    (tmp_path / "lock").write_text("one==1 \\\n    --hash=x\ntwo[extra]==2 ; sys_platform == 'linux'\n# three==3\n")
    return module


def steps_of(set_up: Any, monkeypatch: pytest.MonkeyPatch, fails_at: str = "nothing") -> list[str]:
    """Have no command run; return what is asked for as it comes. fails_at: a word of the command that is interrupted."""
    asked: list[str] = []

    def run_steps(commands: Sequence[Sequence[str]], on_text: Callable[[str], None]) -> None:
        said = ""
        for command, package in zip(commands, ("one", "two"), strict=False):
            asked.append(" ".join(command))
            if "venv" in command:
                (set_up.ENVIRONMENT / "bin").mkdir(parents=True)
                set_up.PYTHON.symlink_to(sys.executable)
            said += f"Collecting {package}\nInstalling collected packages: {package}\n"
            on_text(said)
        if fails_at in commands[0]:
            raise KeyboardInterrupt

    monkeypatch.setattr(set_up, "run_steps", run_steps)
    return asked


@pytest.mark.parametrize("interrupted", ["venv", "-r", "compileall", "-e"])
def test_a_set_up_that_is_interrupted_leaves_no_stamp_and_is_finished_by_the_next(
    interrupted: str, set_up: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    stamp = set_up.ENVIRONMENT / "stamp-lock"
    steps_of(set_up, monkeypatch, interrupted)
    assert set_up.main("lock", ".venv/stamp-lock", "wanted") == 130
    assert "goes on where it was" in capsys.readouterr().err
    assert not stamp.exists()
    asked = steps_of(set_up, monkeypatch)
    if set_up.PYTHON.exists():  # the tests' own Python stands for it, and is in an environment: pip works there
        (set_up.ENVIRONMENT / "bin").rename(set_up.ENVIRONMENT / "gone")
    assert set_up.main("lock", ".venv/stamp-lock", "wanted") == 0
    assert stamp.read_text() == "wanted\n"
    assert "finishing the set-up" in capsys.readouterr().err
    assert [word for line in asked for word in ("venv", "-r", "compileall", "-e") if f" {word} " in line] == [
        "venv", "-r", "-r", "compileall", "-e",
    ]  # fmt: skip
    assert all("--require-hashes" in line for line in asked if " -r " in line), (
        "what a mirror gives is not ours to trust"
    )


def test_a_broken_environment_is_made_anew_and_a_sound_one_kept(set_up: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    (set_up.ENVIRONMENT / "bin").mkdir(parents=True)
    set_up.PYTHON.write_text("#!/bin/sh\nexit 1\n")
    set_up.PYTHON.chmod(0o755)
    asked = steps_of(set_up, monkeypatch)
    monkeypatch.setattr(set_up, "PYTHON", set_up.PYTHON)
    with pytest.raises(FileExistsError):  # as far as the stand-in of venv, which clears nothing
        set_up.make_environment()
    assert "venv --clear" in asked[0]
    set_up.PYTHON.write_text("#!/bin/sh\nexit 0\n")
    asked.clear()
    set_up.make_environment()
    assert asked == []


def test_the_share_is_told_of_what_pip_says(set_up: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    told: list[str] = []
    steps_of(set_up, monkeypatch)
    with progress.listen(lambda each: told.append(str(each))):
        set_up.install_packages(tmp_path / "lock")
    assert told == ["fetching (2/5): 0 of 2", "fetching (2/5): 1 of 2", "installing (3/5): 0 of 2"]


@pytest.mark.parametrize("lock", ["requirements.lock", "tests/requirements.lock"])
def test_each_package_is_in_one_half_with_all_its_hashes(
    lock: str, set_up: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    halves: list[list[str]] = []
    monkeypatch.setattr(
        set_up,
        "run_steps",
        lambda commands, tell: halves.extend(Path(each[-1]).read_text().splitlines() for each in commands),
    )
    set_up.install_packages(FILE.parents[1] / lock)
    whole = (FILE.parents[1] / lock).read_text().splitlines()
    assert sorted(halves[0] + halves[1]) == sorted(line for line in whole if not line.startswith("#"))
    assert all(half[0].split("==")[0] for half in halves)
    packages = [sum("==" in line.partition("#")[0] for line in half) for half in halves]
    assert abs(packages[0] - packages[1]) <= 1


def test_what_runs_side_by_side_is_heard_together_and_the_one_that_fails_is_told(set_up: Any) -> None:
    heard: list[str] = []
    fine, failing = (
        [sys.executable, "-c", f"print({word!r}); raise SystemExit({code})"]
        for word, code in (("fine", 0), ("lost", 4))
    )
    with pytest.raises(set_up.StepError, match=r"^lost\n.*ended with 4$"):
        set_up.run_steps([fine, failing], heard.append)
    assert heard[-1] == "fine\nlost\n"


def test_a_step_that_fails_says_what_it_said_last(set_up: Any) -> None:
    heard: list[str] = []
    with pytest.raises(set_up.StepError, match=r"(?s)no such package.*ended with 3"):
        set_up.run_step([sys.executable, "-c", "print('no such package'); raise SystemExit(3)"], heard.append)
    assert heard[-1] == "no such package\n"
