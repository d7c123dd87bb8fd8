"""A process of ours takes its modules from where the one that starts it has them, and from no folder that it is in."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from gateway.module_command import module_command
from gateway.service.supervisor.child_process import spawn_child
from gateway.service.supervisor.event_wait import wait_readable

_STARTER = "from gateway.module_command import module_command as m; print(*m('json.tool')[1:])"


@pytest.fixture
def foreign(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with somebody's own serial.py and json.py; it is the current one, and this process does not search it."""
    for name in ("serial", "json", "signal"):
        (tmp_path / f"{name}.py").write_text("open('taken', 'w').close()\nraise SystemExit(3)\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [entry for entry in sys.path if entry not in ("", str(tmp_path))])
    return tmp_path


def test_a_module_of_the_current_folder_is_not_taken_for_a_library(foreign: Path) -> None:
    """Somebody's serial.py beside the rig file kept the gateway from starting, and control from coming back."""
    child = spawn_child("gateway.service.supervisor.fork_server", {"rig": "demo", "simulate": True})
    child.link.close()  # without a guardian it has nothing to do
    assert wait_readable([child.died], 30.0)
    assert child.wait() == 0 and not (foreign / "taken").exists()
    child.close()


@pytest.mark.parametrize(("option", "searches"), [((), True), (("-P",), False), (("-I",), False)])
def test_the_current_folder_counts_for_a_child_where_it_does_for_who_starts_it(
    option: tuple[str, ...], searches: bool, tmp_path: Path
) -> None:
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    command = [sys.executable, *option, "-c", _STARTER]
    said = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True).stdout
    assert ("-P" not in said.split()) == searches


def test_a_current_folder_that_is_gone_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    monkeypatch.setattr(sys, "path", [entry for entry in sys.path if entry])
    gone.rmdir()
    assert "-P" in module_command("json.tool")
