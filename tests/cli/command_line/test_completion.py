"""A shell that has our completion offers what there is, and completes files as before."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.shell_completion import ShellComplete

from gateway.cli.command_line.bash_completion import BashCompletion
from gateway.cli.main import command
from gateway.profiles import list_shipped


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A rig that ran here, my-cell, and the demo's recordings and calibrations."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    state = tmp_path / "state" / "force-gateway"
    for folder, names in {
        "demo/recordings": ("0001.fgr", "0012.fgr", "torn.tmp"),
        "demo/calibrations": ("0017.yaml", "head"),
        "my-cell/recordings": ("0003.fgr",),
    }.items():
        (state / folder).mkdir(parents=True)
        for name in names:
            (state / folder / name).touch()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def offered(line: str) -> tuple[set[str], bool]:
    """The words that are offered at the end of a line, and whether files are."""
    *words, incomplete = line.split(" ")
    completion = ShellComplete(command, {}, "force-gateway", "_FORCE_GATEWAY_COMPLETE")
    items = completion.get_completions(words, incomplete)
    return {item.value for item in items if item.type == "plain"}, any(item.type == "file" for item in items)


@pytest.mark.parametrize(
    ("line", "words", "has_files"),
    [
        ("run ", {*list_shipped("rig"), "my-cell"}, True),
        ("hold 12 --rig my", {"my-cell"}, True),
        ("calibration list --rig ir", {"irc5-cell"}, True),
        ("read force_me", {"force_measured"}, False),
        ("read force_measured@float_a", {"force_measured@float_abcd"}, False),
        ("write force_s", {"force_setpoint="}, False),
        ("write mode=", {"mode=force", "mode=voltage"}, False),
        ("registers voltage_s", {"voltage_setpoint"}, False),
        ("effects lea", {"leak"}, False),
        ("diagnose --without lea", {"leak"}, False),
        ("sim set cell.si", {"cell.silent="}, False),
        ("sim clear lea", {"leak"}, False),
        ("explain A301", {"A301"}, False),
        ("diagnose ", {"1", "12", "last"}, True),
        ("diagnose --rig my-cell ", {"3", "last"}, True),
        ("fit ", {"1", "12", "last"}, True),
        ("calibration use ", {"17"}, False),
        ("calibration compare 17 d", {"demo"}, True),
        ("plant use ", {"0"}, False),
        ("upload de", {"demo"}, True),
        ("completion z", {"zsh"}, False),
        ("backup ", set(), True),
        ("simulate 1 --plant ", set(list_shipped("plant")), True),
    ],
)
def test_what_is_there_is_offered(line: str, words: set[str], has_files: bool, root: Path) -> None:
    found, files = offered(line)
    assert found == words
    assert files == has_files


def test_what_goes_wrong_while_a_shell_asks_is_not_seen(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert offered("read force_measured --map no-such-map state") == (set(), False)
    monkeypatch.setenv("COMP_LINE", "force-gateway hold 12 --rig ")
    completion = BashCompletion(command, {}, "force-gateway", "_FORCE_GATEWAY_COMPLETE")
    assert completion.get_completion_args() == (["hold", "12", "--rig"], "")


def test_bash_itself_completes_words_and_files(root: Path) -> None:
    """The script in a bash, function and all; compopt alone needs a terminal."""
    (root / "demo-cell.yaml").touch()
    (root / "ladder two.csv").touch()
    lines = ("write force_set", "write control_word=en", "run demo", "fit lad")
    script = "compopt() { :; }\n" + "".join(
        f"COMP_LINE='force-gateway {line}' COMP_POINT={len(line) + 14}; _force_gateway_completion force-gateway\n"
        "printf '%s|' \"${COMPREPLY[@]}\"; echo\n"
        for line in lines
    )
    bin_directory = Path(sys.executable).parent
    answer = subprocess.run(
        ["bash", "--norc", "-c", f'eval "$(force-gateway completion bash)"\n{script}complete -p force-gateway'],
        env=os.environ | {"PATH": f"{bin_directory}:{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        check=True,
    )
    *replies, registered = answer.stdout.splitlines()
    assert replies == ["force_setpoint=|", "enable|", "demo|demo-cell.yaml|", "ladder two.csv|"]
    assert "-o default" in registered  # files, wherever we know no words
