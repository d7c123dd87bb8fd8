"""Where a restore puts a state, and one that is killed between its two renames: the next start puts the state back."""

import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from gateway.cli.main import command
from gateway.cli.state_archive import pack_state, unpack_state
from gateway.processes.durable_file import lock_directory
from gateway.processes.state_directory import place_of_restore, put_back
from gateway.service.supervisor import guardian
from gateway.service.supervisor.run_options import RunOptions


@pytest.fixture
def state(tmp_path: Path) -> Path:
    (tmp_path / "state" / "calibrations").mkdir(parents=True)
    (tmp_path / "state" / "calibrations" / "0001.yaml").write_text("name: one\n")
    return tmp_path / "state"


@pytest.fixture
def killed(state: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A backup; its restore was killed between its two renames, when the state had the second of its names."""

    class Killed(BaseException):
        pass

    def kill(*_: object, **__: object) -> None:
        raise Killed

    pack_state(state, tmp_path / "b.tar.gz")
    (tmp_path / "state.before-restore-1").mkdir()
    with monkeypatch.context() as patch, pytest.raises(Killed):
        rename = Path.rename
        patch.setattr(Path, "rename", lambda one, to: kill() if one.parent.name[0] == "." else rename(one, to))
        patch.setattr(shutil, "rmtree", kill)
        unpack_state(tmp_path / "b.tar.gz", state)
    assert not state.exists() and (tmp_path / "state.before-restore-2" / "calibrations").is_dir()
    return tmp_path / "b.tar.gz"


def test_the_state_that_a_killed_restore_had_set_aside_is_put_back(state: Path, killed: Path) -> None:
    assert str(state.with_name("state.before-restore-2")) in put_back(state)
    assert (state / "calibrations" / "0001.yaml").read_text() == "name: one\n"
    assert put_back(state) == ""
    assert unpack_state(killed, state) is not None
    assert not place_of_restore(state).exists()


@pytest.mark.usefixtures("killed")
def test_a_restore_that_is_at_work_is_not_put_back(state: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gateway.processes.durable_file._WRITER_BOUND_S", 0.0)
    with lock_directory(place_of_restore(state)), pytest.raises(OSError, match="locked"):
        put_back(state)
    assert not state.exists()


def test_a_state_that_somebody_has_removed_stays_so(state: Path, tmp_path: Path) -> None:
    state.rename(tmp_path / "state.before-restore-1")
    assert put_back(state) == ""
    assert not state.exists()


def test_a_verb_says_where_the_state_is_and_a_restore_puts_it_back(state: Path, killed: Path) -> None:
    said = CliRunner().invoke(command, ["events", "--state", str(state)])
    assert said.exit_code == 65 and "state.before-restore-2" in said.output
    said = CliRunner().invoke(command, ["restore", str(killed), "--state", str(state)])
    assert said.exit_code == 1 and "state.before-restore-2" in said.output and "E405" in said.output
    assert (state / "calibrations").is_dir()


@pytest.mark.usefixtures("killed")
def test_a_gateway_begins_with_it(state: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It began anew, by the calibration of the factory."""

    class SeenError(Exception):
        pass

    def see(path: Path) -> None:
        raise SeenError(*(each.name for each in path.iterdir()))

    monkeypatch.setattr(guardian, "hold_state_lock", see)
    with pytest.raises(SeenError, match="calibrations"):
        guardian.run(RunOptions(state=state))


@pytest.mark.parametrize(
    ("packed", "words", "place"),
    [
        ("my-cell", (), "my-cell"),
        ("my-cell", ("--rig", "my-cell"), "my-cell"),
        ("my-cell", ("--rig", "demo"), "demo"),
        (".hidden", (), "demo"),
    ],
)
def test_without_a_directory_a_backup_goes_where_the_rig_has_it_that_was_packed(
    packed: str, words: tuple[str, ...], place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a new machine, which did not know the cell, it went to demo's."""
    archive = str(tmp_path / "b.tar.gz")
    (tmp_path / packed / "audit").mkdir(parents=True)
    (tmp_path / packed / "audit" / "head").write_text("1")
    assert CliRunner().invoke(command, ["backup", archive, "--state", str(tmp_path / packed)]).exit_code == 0
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "new"))
    answer = CliRunner().invoke(command, ["restore", archive, *words])
    assert answer.exit_code == 0, answer.output
    assert (tmp_path / "new" / "force-gateway" / place / "audit" / "head").read_text() == "1"
