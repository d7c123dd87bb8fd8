"""The state directory that a first start makes: calibrations, recordings and who has written what are its owner's business."""

import json
import os
import socket
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from gateway.processes import exit_codes
from gateway.processes.state_lock import hold_state_lock
from gateway.service.supervisor import guardian
from gateway.service.supervisor.run_options import RunOptions


class _EnoughSeenError(Exception):
    """The directory is there; nothing need be started in it."""


@pytest.mark.usefixtures("generous_umask")
def test_the_state_directory_is_for_its_owner_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(path: Path) -> None:
        raise _EnoughSeenError(path)

    monkeypatch.setattr(guardian, "hold_state_lock", stop)
    state = tmp_path / "force-gateway" / "demo"
    with pytest.raises(_EnoughSeenError):
        guardian.run(RunOptions(state=state))
    assert stat.S_IMODE(state.stat().st_mode) == 0o700


@pytest.mark.usefixtures("generous_umask")
def test_a_control_process_that_is_started_again_makes_it_anew(tmp_path: Path) -> None:
    """Whoever cleans up a disk takes it from a gateway that runs: its control socket could not be made behind a restart."""
    state, (ours, its) = tmp_path / "force-gateway" / "demo", socket.socketpair()
    options = {"rig": "no-such-rig", "simulate": True, "state": str(state), "rtu": None, "kept_rig": None}
    words = (sys.executable, "-m", "gateway.service.control_process", str(its.fileno()), json.dumps(options))
    with ours, its:
        ended = subprocess.run(words, pass_fds=[its.fileno()], capture_output=True, text=True, timeout=60, check=False)
    assert "no-such-rig" in ended.stderr and ended.returncode == exit_codes.CONFIGURATION
    assert stat.S_IMODE(state.stat().st_mode) == 0o700


def test_a_second_gateway_on_one_state_ends_by_a_code_of_its_own(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """0 would read as a gateway that has done its work: a service would not be started again."""
    with hold_state_lock(tmp_path) as is_ours:
        assert is_ours and guardian.run(RunOptions(state=tmp_path)) == exit_codes.DEVICE
    assert capfd.readouterr().err.startswith("E104 ")


def test_a_rig_without_a_given_directory_has_one_of_its_own_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever folder its file is in: a rig that is moved keeps its calibrations."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert RunOptions(rig="cells/left.yaml").state_directory == tmp_path / "force-gateway" / "left"
    for rig in ("cells/cell-1.2.yaml", "cell-1.2", "cell-1.2.yml"):  # by its name, as it is told where it has run here
        assert RunOptions(rig=rig).state_directory == tmp_path / "force-gateway" / "cell-1.2", "not that of cell-1"
    assert RunOptions(rig="left", state=tmp_path / "own").state_directory == tmp_path / "own"
    monkeypatch.delenv("XDG_STATE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert RunOptions(rig="left").state_directory == tmp_path / ".local" / "state" / "force-gateway" / "left"


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a folder away")
def test_a_state_that_root_has_run_on_is_its_owner_s_again(tmp_path: Path) -> None:
    """`sudo force-gateway run` on the state of a service, to look at something: from then on that kept no event, no audit and
    no recording, for want of a permission."""
    (tmp_path / "of-service").mkdir()
    os.chown(tmp_path / "of-service", 501, 502)
    state = tmp_path / "of-service" / "cell"
    (state / "recordings").mkdir(parents=True)
    assert guardian.run(RunOptions(rig=str(tmp_path / "no-such-rig.yaml"), state=state)) == exit_codes.CONFIGURATION
    assert {"events.jsonl", "recordings"} <= {path.name for path in state.iterdir()}
    assert {(path.stat().st_uid, path.stat().st_gid) for path in (state, *state.rglob("*"))} == {(501, 502)}
