"""The first moment of a command, before click can answer for it, and the terminal that it prints to."""

import io
import os
import signal
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest
from rich.console import Console

import gateway.cli.main
from gateway.__main__ import main


class ReadWhenCtrlCComes(ModuleType):
    """A module that is just being read."""

    def __getattr__(self, name: str) -> object:
        raise KeyboardInterrupt


def test_ctrl_c_while_the_first_modules_are_read_shows_no_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gateway.cli.main", ReadWhenCtrlCComes("gateway.cli.main"))
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == "Aborted!"


@pytest.mark.parametrize("words", [["--help"], ["read", "--help"], ["calibration", "use", "--help"]])
def test_a_help_without_its_texts_says_who_has_dropped_them(words: list[str]) -> None:
    """Takes a second: Python itself drops docstrings while it reads a module. Nothing was said."""
    asked = subprocess.run(
        [sys.executable, "-OO", "-m", "gateway", *words], stdout=subprocess.PIPE, text=True, check=True
    )
    assert asked.stdout.count("PYTHONOPTIMIZE=2") == 1


@pytest.mark.parametrize(
    ("raised", "code"),
    [
        ("KeyboardInterrupt()", -signal.SIGINT),
        ("CliError('Aborted!', 130)", -signal.SIGINT),
        ("CliError('Aborted!', 143)", 143),
        ("click.Abort()", 1),
    ],
)
def test_ctrl_c_ends_a_verb_by_its_signal_as_a_shells_loop_over_files_wants_it(raised: str, code: int) -> None:
    """With exit code 1 it went on with the next file, and Ctrl-C was to be pressed for each."""
    program = (
        "import click, gateway.cli.main as cli\n"
        "from gateway.cli.errors import CliError\n"
        f"raised = {raised}\n"
        "def end(): raise raised\n"
        "verb = click.Command('version', callback=end)\n"
        "cli.import_verb = lambda _: type('Module', (), {'command': verb})\n"
        "import sys; sys.argv[1:] = ['version']; cli.main()"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.stderr.strip().splitlines()[-1:] == ["Aborted!"]
    assert "Traceback" not in done.stderr
    assert done.returncode == code


@pytest.mark.parametrize(("encoding", "printed"), [("ascii", "rig . S?d"), ("latin-1", "rig · Süd")])
def test_what_a_terminal_cannot_print_ends_no_verb(
    monkeypatch: pytest.MonkeyPatch, encoding: str, printed: str
) -> None:
    terminal = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(terminal, encoding, write_through=True))
    monkeypatch.setattr(gateway.cli.main, "command", lambda **_: Console().print("rig · Süd"))
    gateway.cli.main.main()
    assert terminal.getvalue().decode(encoding).strip() == printed


def test_before_it_is_caught_next_to_nothing_is_read() -> None:
    """The package itself read `typing` outside of what catches: for ten of the first milliseconds a traceback was shown."""
    folder = str(Path(gateway.cli.main.__file__).parents[2])
    program = (
        f"import sys; sys.path.insert(0, {folder!r}); before = set(sys.modules); import gateway.__main__; "
        "print(sorted(set(sys.modules) - before))"
    )
    read = subprocess.run([sys.executable, "-I", "-S", "-c", program], capture_output=True, text=True, check=True)
    assert read.stdout.strip() == "['gateway', 'gateway.__main__']"


@pytest.mark.parametrize(("umask", "others"), [(0o777, 0), (0o277, 0), (0o327, 0o050)])
def test_what_a_verb_makes_is_its_owners_whatever_the_umask_says(tmp_path: Path, umask: int, others: int) -> None:
    """By umask 0777 the state directory was made as one that nobody but root can open, and every later start was refused."""
    words = ("calibration", "export", "1", "--c", str(tmp_path / "made" / "c"))
    environment = {**os.environ, "XDG_STATE_HOME": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)}
    subprocess.run([sys.executable, "-m", "gateway", *words], check=True, umask=umask, env=environment)
    modes = {path.name: path.stat().st_mode & 0o777 for path in (tmp_path / "made").rglob("*")}
    assert modes.pop("c") == 0o700 | others
    assert modes and set(modes.values()) == {0o600 | others & 0o666}
