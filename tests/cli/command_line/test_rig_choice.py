"""--rig means one thing: a shipped name, a file, or a rig that ran here; an unknown one is answered with those that exist."""

from pathlib import Path
from typing import Any

import click
import pytest

from gateway.cli import control_socket
from gateway.cli.command_line import known_rigs, rig_choice
from gateway.cli.errors import NoAnswerError
from gateway.cli.options import StateChoice, state_directory
from gateway.processes import exit_codes
from gateway.processes.event_file import EventFile
from gateway.processes.event_log import EventLog
from gateway.processes.state_directory import CONTROL_SOCKET
from gateway.profiles import shipped_profiles_folder
from gateway.recording import Recorder


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "state" / "force-gateway" / "my-cell" / "audit").mkdir(parents=True)
    return tmp_path / "state" / "force-gateway"


VERBS = (
    ("calibration", "list"),
    ("recordings", "list"),
    ("plant", "list"),
    ("events",),
    ("record", "status"),
    ("metrics",),
    ("diagnose", "1"),
    ("fit", "1"),
    ("simulate", "1"),
)


@pytest.mark.parametrize("verb", VERBS, ids="-".join)
def test_an_unknown_rig_is_answered_with_those_that_exist(verb: tuple[str, ...], root: Path, call) -> None:
    answer = call(*verb, "--rig", "irc-cell")
    assert answer.exit_code == 2, answer.output
    assert "rig irc-cell is not known; did you mean irc5-cell?" in answer.stderr
    assert "Shipped: demo, irc5-cell, paper-pull. Run here: my-cell." in answer.stderr


def test_a_start_that_was_refused_makes_no_rig_that_has_run(root: Path, call) -> None:
    """Each typo in `run RIG` was offered from then on as one that had run here; what was said of it can still be read."""
    (root / "dmo").mkdir()
    with EventLog(source="control", file=EventFile(root / "dmo")) as log:
        log.note("start", "E151 no such rig")
    (root / "dmo" / "lock").touch()
    (root / "events.jsonl").touch()
    answer = call("events", "--rig", "nope")
    assert "Run here: my-cell." in answer.stderr
    assert "E151 no such rig" in call("events", "--rig", "dmo").stdout


def test_a_file_that_is_not_there_is_said_to_be_none(root: Path, call) -> None:
    answer = call("recordings", "list", "--rig", "my-sell.yaml")
    assert answer.exit_code == 2
    assert "rig my-sell.yaml is no file" in answer.stderr


@pytest.mark.parametrize("name", ["demo", "my-cell", "other.yaml", "other"])
def test_a_shipped_name_a_file_and_one_that_ran_here_are_taken(name: str, root: Path, call) -> None:
    Path("other.yaml").touch()
    answer = call("recordings", "list", "--rig", name)
    assert answer.exit_code == 0, answer.output
    assert str(root / Path(name).stem / "recordings") in answer.output


def test_without_one_it_is_the_rig_that_runs_here(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert state_directory(None, None) == root / "demo"
    monkeypatch.setattr(known_rigs, "running_rigs", lambda: ["my-cell"])
    assert state_directory(None, None) == root / "my-cell"
    monkeypatch.setattr(known_rigs, "running_rigs", lambda: ["demo", "my-cell"])
    assert state_directory(None, None) == root / "demo", "of two nobody knows which is meant"
    assert state_directory(root, None) == root


def test_one_that_stands_still_is_one_of_two(root: Path, call, monkeypatch: pytest.MonkeyPatch) -> None:
    """While cell-a hung a ladder that was meant for it was climbed by cell-b, which alone answered: the one that runs."""

    def answer(state: Path, request: dict[str, Any]) -> dict[str, Any]:
        if state.name == "cell-a":
            raise NoAnswerError("E140 no gateway answers", exit_codes.DEVICE)
        return {"rig": state.name}

    for name in ("cell-a", "cell-b"):
        (root / name).mkdir()
        (root / name / CONTROL_SOCKET).touch()
    monkeypatch.setattr(control_socket, "ask", answer)
    assert known_rigs.running_rigs() == ["cell-a", "cell-b"]
    with pytest.raises(click.UsageError, match=r"^cell-a and cell-b run here: --rig says which one is meant"):
        state_directory(None, None)  # it was demo, of which nobody has spoken
    assert call("events").stderr.startswith("Usage: ") and call("events", "--rig", "my-cell").exit_code == 0
    (root / "cell-a" / CONTROL_SOCKET).unlink()
    assert state_directory(None, None) == root / "cell-b"


def test_one_that_runs_is_read_by_its_file_wherever_it_lies(
    root: Path, tmp_path: Path, call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From another folder its bundle had no rig in it, and its own calibration, plant and retention were not found."""
    file = tmp_path / "elsewhere" / "my-cell.yaml"
    file.parent.mkdir()
    text = (shipped_profiles_folder() / "rigs" / "demo.yaml").read_text(encoding="utf-8")
    file.write_text(text.replace("name: demo", "name: my-cell"), encoding="utf-8")
    monkeypatch.setattr(control_socket, "ask", lambda state, request: {"rig": "my-cell", "file": str(file)})
    assert StateChoice(None, "my-cell").rig == str(file) and StateChoice(None, "demo").rig == "demo"
    assert "(the rig's own)" in call("calibration", "list", "--rig", "my-cell").output
    file.unlink()
    assert StateChoice(None, "my-cell").rig == "my-cell"


def test_a_directory_alone_is_of_the_rig_that_runs_on_it_or_was_recorded_there(
    root: Path, call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the files of demo `report` packed another rig's, and `calibration list` showed another one's own."""
    assert "(the rig's own)" in call("calibration", "list", "--state", str(root)).output
    recorder = Recorder(root / "recordings", {"rig": "my-cell"}, ("time_s",))
    recorder.append((0.0,))
    recorder.close()
    assert "not in it: my-cell: is neither a shipped rig" in call("report", "--show", "--state", str(root)).output
    assert "give the rig's file by --rig" in call("calibration", "list", "--state", str(root)).output
    asked: list[dict[str, Any]] = []
    monkeypatch.setattr(control_socket, "ask", lambda state, request: asked.append(request) or {"rig": "irc5-cell"})
    packed = call("report", "--show", "--state", str(root)).output
    assert "profiles/rigs/irc5-cell.yaml" in packed and "profiles/rigs/demo.yaml" not in packed
    assert {"do": "running"} in asked
    asked.clear()
    file = root / "my-cell.yaml"
    text = (shipped_profiles_folder() / "rigs" / "demo.yaml").read_text(encoding="utf-8")
    file.write_text(text.replace("name: demo", "name: my-cell"), encoding="utf-8")
    said = {"rig": "my-cell", "file": str(file)}
    monkeypatch.setattr(control_socket, "ask", lambda state, request: asked.append(request) or said)
    assert "\nname: my-cell\n" in call("report", "--show", "--state", str(root)).output
    asked.clear()
    assert call("recordings", "list", "--state", str(root)).exit_code == 0 and {"do": "running"} not in asked


def test_on_a_terminal_it_is_said_which_was_taken(root: Path, call, monkeypatch: pytest.MonkeyPatch) -> None:
    assert call("recordings", "list").stderr == ""
    monkeypatch.setattr(rig_choice, "is_terminal", lambda: True)
    said = call("recordings", "list").stderr
    assert f"rig demo, state {root / 'demo'}; --rig takes another: my-cell" in said
    assert call("recordings", "list", "--rig", "demo").stderr == ""


def test_no_color_is_kept_to(root: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rig_choice, "is_terminal", lambda: True)
    monkeypatch.setattr("click.utils.should_strip_ansi", lambda *words: False)
    monkeypatch.setenv("NO_COLOR", "1")
    rig_choice.tell_rig("demo", root / "demo")
    assert "\x1b" not in capsys.readouterr().err
