"""A pipe, a socket, a device or a directory where a verb looks for a file: no verb waits, and each says what stands where."""

from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

from gateway.service.supervisor import guardian
from gateway.service.supervisor.run_options import RunOptions
from tests.calibrations.store_bench import used_store
from tests.certificates import store_all
from tests.other_kinds import MAKERS, never_waiting, put

Call = Callable[..., Result]
IN_THE_STATE = (
    ("lock", "calibration use 2 --force"),
    ("lock", "plant rollback"),
    ("lock", "restore backup.tar.gz --force"),
    ("events.jsonl", "events"),
    ("events.jsonl.1", "events"),
    ("audit/000000000001.jsonl", "audit show"),
    ("audit/000000000001.jsonl", "audit verify"),
)


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: Call) -> Path:
    """A state directory with two calibrations, and a backup of it, in the working directory."""
    monkeypatch.chdir(tmp_path)
    used_store(tmp_path / "state")
    assert call("backup", "backup.tar.gz", "--state", "state").exit_code == 0
    return tmp_path / "state"


@pytest.mark.sampled
@pytest.mark.parametrize("kind", MAKERS)
@pytest.mark.parametrize(("name", "verb"), IN_THE_STATE)
def test_no_verb_waits_for_what_stands_in_the_state(name: str, verb: str, kind: str, state: Path, call: Call) -> None:
    put(kind, state / name)
    with never_waiting():
        answer = call(*verb.split(), "--state", "state")
    assert f"{name}: it is {kind}, and no file: move it away" in answer.output
    assert answer.exit_code == 1
    assert answer.output.startswith("E106")


@pytest.mark.parametrize("kind", MAKERS)
def test_no_start_waits_for_a_lock_that_is_none(kind: str, state: Path) -> None:
    put(kind, state / "lock")
    with never_waiting(), pytest.raises(OSError, match=f"it is {kind}"):
        guardian.run(RunOptions(state=state))


@pytest.mark.parametrize("kind", ["a pipe", "a socket", "a device"])
@pytest.mark.parametrize("file", ["ca.crt", "monitor.crt", "monitor.key"])
def test_a_master_by_tls_says_which_file_is_none(file: str, kind: str, state: Path, call: Call) -> None:
    store_all(state.parent)
    put(kind, state.parent / file)
    with never_waiting():
        answer = call("read", "force_setpoint", *"--tls ca.crt --cert monitor.crt --key monitor.key".split())
    assert f"E171 {file}: it is {kind}" in answer.output
    assert answer.exit_code == 65


@pytest.mark.parametrize("kind", ["a pipe", "a device"])
def test_a_ca_that_is_no_file_signs_nothing(kind: str, state: Path, call: Call) -> None:
    store_all(state.parent)
    put(kind, state.parent / "ca.key")
    with never_waiting():
        answer = call("certs", ".", "--client", "late:monitor")
    assert f"it is {kind}" in answer.output
    assert "E500" not in answer.output
    assert answer.exit_code


@pytest.mark.parametrize("kind", ["a pipe", "a device"])
def test_restore_says_that_a_backup_is_no_file(kind: str, state: Path, call: Call) -> None:
    put(kind, state.parent / "backup.tar.gz")
    with never_waiting():
        answer = call("restore", "backup.tar.gz", "--state", "other")
    assert f"backup.tar.gz: it is {kind}" in answer.output


@pytest.mark.parametrize("kind", ["a pipe", "a device"])
def test_init_passes_over_what_is_no_file_in_its_folder(kind: str, state: Path) -> None:
    from gateway.cli.setup.guided_rig import own_files, own_profiles

    put(kind, state.parent / "a.yaml")
    with never_waiting():
        assert own_files() == []
        assert list(own_profiles("output")) == []


@pytest.mark.parametrize("kind", ["a pipe", "a device"])
def test_columns_that_are_no_file_are_told(kind: str, state: Path, call: Call) -> None:
    put(kind, state.parent / "columns.yaml")
    (state.parent / "table.csv").write_text("t,u,f\n0,1,2\n")
    with never_waiting():
        answer = call("diagnose", "table.csv", "--columns", "columns.yaml")
    assert f"columns.yaml cannot be read: it is {kind}" in answer.output
