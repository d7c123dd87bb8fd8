"""Recordings, backup and restore: nothing is lost, nothing is overwritten, nothing gets outside its directory."""

import errno
import fcntl
import io
import json
import os
import socket
import tarfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from gateway.processes.state_lock import hold_state_lock
from gateway.recording import Recorder


@pytest.fixture
def state(tmp_path: Path) -> Path:
    """A state directory with one recording, a calibration, and what a running gateway leaves there."""
    directory = tmp_path / "state"
    recorder = Recorder(directory / "recordings", {"rig": "demo", "calibration": 1}, ("time_s", "force_n"))
    for row in range(20):
        recorder.append((row * 0.01, float(row)))
    recorder.close()
    (directory / "calibrations").mkdir()
    (directory / "calibrations" / "0001.yaml").write_text("name: one\n")
    (directory / "lock").touch()
    (directory / "running").touch()
    return directory


def content(directory: Path) -> dict[str, bytes]:
    return {str(path.relative_to(directory)): path.read_bytes() for path in directory.rglob("*") if path.is_file()}


def test_list_and_export_give_back_what_was_recorded(state: Path, call, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert "demo" in call("recordings", "list", "--state", state).output
    entry = json.loads(call("recordings", "list", "--state", state, "--json").output)[0]
    assert (entry["id"], entry["rows"], entry["rig"], entry["truncated"]) == (1, 20, "demo", False)
    assert call("recordings", "export", "1", "--state", state).exit_code == 0
    rows = [line for line in (tmp_path / "demo-0001.csv").read_text().splitlines() if not line.startswith("#")]
    assert len(rows) == 21
    assert call("recordings", "export", "1", "--parquet", "-o", "x.parquet", "--state", state).exit_code == 0
    assert pq.read_table(tmp_path / "x.parquet")["force_n"].to_pylist() == [float(row) for row in range(20)]


def test_an_export_overwrites_only_by_force(state: Path, call, tmp_path: Path) -> None:
    target = tmp_path / "mine.csv"
    target.write_text("precious")
    answer = call("recordings", "export", "1", "-o", target, "--state", state)
    assert answer.exit_code == 1
    assert answer.stderr.startswith("E405 ")
    assert target.read_text() == "precious"
    assert call("recordings", "export", "1", "-o", target, "--force", "--state", state).exit_code == 0


def test_an_export_to_stdout_is_the_csv_alone(state: Path, call) -> None:
    answer = call("recordings", "export", "1", "-o", "-", "--state", state)
    assert answer.exit_code == 0
    assert answer.stdout.splitlines()[-1] == "0.19,19"
    assert call("recordings", "export", "1", "--parquet", "-o", "-", "--state", state).exit_code == 2


def test_a_torn_tail_is_said_and_the_rest_exported(state: Path, call) -> None:
    path = state / "recordings" / "0001.fgr"
    path.write_bytes(path.read_bytes() + b"FGB\x1e\x00")
    answer = call("recordings", "export", "1", "-o", "-", "--state", state)
    assert answer.exit_code == 0
    assert "torn tail" in answer.stderr
    assert "torn tail dropped" in call("recordings", "list", "--state", state).output


@pytest.mark.parametrize(("number", "damage"), [("7", b""), ("1", b"not a recording at all")])
def test_what_cannot_be_exported_is_a_data_error(number: str, damage: bytes, state: Path, call) -> None:
    if damage:
        (state / "recordings" / "0001.fgr").write_bytes(damage)
    answer = call("recordings", "export", number, "-o", "-", "--state", state)
    assert answer.exit_code == 65
    assert answer.stderr.startswith("E403 ")
    assert answer.stdout == ""


def test_an_empty_state_says_how_to_record(call, tmp_path: Path) -> None:
    answer = call("recordings", "list", "--state", tmp_path)
    assert answer.exit_code == 0
    assert "record on" in answer.output


def test_a_backup_restores_to_the_same_content(state: Path, call, tmp_path: Path) -> None:
    answer = call("backup", tmp_path / "b.tar.gz", "--state", state)
    assert answer.exit_code == 0, answer.output
    answer = call("restore", tmp_path / "b.tar.gz", "--state", tmp_path / "elsewhere" / "demo")
    assert answer.exit_code == 0, answer.output
    remaining = {name: data for name, data in content(state).items() if name not in ("lock", "running")}
    assert content(tmp_path / "elsewhere" / "demo") == remaining
    assert len(remaining) == 2


def test_what_is_restored_keeps_its_time_and_is_its_owner_s_alone_to_write(call, tmp_path: Path) -> None:
    with tarfile.open(tmp_path / "b.tar.gz", "w:gz") as archive:
        manifest = member("backup.json")
        manifest.size = 13
        archive.addfile(manifest, io.BytesIO(b'{"format": 1}'))
        open_to_all = member("state/open")
        open_to_all.mode, open_to_all.mtime, open_to_all.uid = 0o6777, 1_000_000_000, 12345
        archive.addfile(open_to_all)
    assert call("restore", tmp_path / "b.tar.gz", "--state", tmp_path / "new").exit_code == 0
    found = (tmp_path / "new" / "open").stat()
    assert (found.st_mode & 0o7777, found.st_mtime, found.st_uid) == (0o744, 1_000_000_000, os.getuid())


def test_sockets_stay_behind(state: Path, call, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(state)  # a socket's path is short
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind("control.sock")
        assert call("backup", tmp_path / "b.tar.gz", "--state", state).exit_code == 0
    with tarfile.open(tmp_path / "b.tar.gz") as archive:
        assert not any("sock" in name for name in archive.getnames())


def test_a_backup_without_a_part_that_may_not_be_read_is_none(
    state: Path, call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It packed the rest and said so many files: restored, it took the calibrations away."""

    def refusing(call: Callable[[Any], Any]) -> Callable[[Any], Any]:
        def refuse(path: Any) -> Any:
            if not isinstance(path, int) and Path(path).name == "calibrations":
                raise PermissionError(errno.EACCES, "Permission denied", str(path))
            return call(path)

        return refuse

    for name in ("listdir", "scandir"):  # the one, or from Python 3.13 on the other
        monkeypatch.setattr(os, name, refusing(getattr(os, name)))
    answer = call("backup", tmp_path / "b.tar.gz", "--state", state)
    assert (answer.exit_code, answer.stderr[:4]) == (77, "E105")
    assert not (tmp_path / "b.tar.gz").exists()


def test_a_backup_overwrites_only_by_force(state: Path, call, tmp_path: Path) -> None:
    target = tmp_path / "b.tar.gz"
    target.write_text("precious")
    assert call("backup", target, "--state", state).exit_code == 1
    assert target.read_text() == "precious"
    assert call("backup", target, "--force", "--state", state).exit_code == 0
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


def test_restore_leaves_a_used_directory_alone_and_by_force_keeps_it_beside(state: Path, call, tmp_path: Path) -> None:
    backup = tmp_path / "b.tar.gz"
    call("backup", backup, "--state", state)
    (state / "later.txt").write_text("later")
    before = content(state)
    answer = call("restore", backup, "--state", state)
    assert answer.exit_code == 1
    assert answer.stderr.startswith("E405 ")
    assert content(state) == before
    answer = call("restore", backup, "--force", "--state", state)
    assert answer.exit_code == 0, answer.output
    assert not (state / "later.txt").exists()
    assert content(tmp_path / "state.before-restore-1") == before
    assert (state.stat().st_mode & 0o777) == 0o700


def test_restore_does_not_pull_the_floor_from_under_a_running_gateway(state: Path, call, tmp_path: Path) -> None:
    backup = tmp_path / "b.tar.gz"
    call("backup", backup, "--state", state)
    for kind in (fcntl.LOCK_EX, fcntl.LOCK_SH):  # a gateway, and whoever else wants no other one meanwhile
        with (state / "lock").open("a") as lock:
            fcntl.flock(lock, kind)
            answer = call("restore", backup, "--force", "--state", state)
        assert answer.exit_code == 69
        assert answer.stderr.startswith("E104 ")


def test_a_restore_finds_a_running_gateway_whose_lock_somebody_has_deleted(state: Path, call, tmp_path: Path) -> None:
    """It took the state from under it: what that gateway recorded then went to where nobody looks."""
    backup = tmp_path / "b.tar.gz"
    call("backup", backup, "--state", state)
    with hold_state_lock(state):
        (state / "lock").unlink()
        answer = call("restore", backup, "--force", "--state", state)
    assert answer.exit_code == 69 and answer.stderr.startswith("E104 ")
    assert [path.name for path in tmp_path.glob("state*")] == ["state"]


def test_a_dry_run_restores_nothing(state: Path, call, tmp_path: Path) -> None:
    call("backup", tmp_path / "b.tar.gz", "--state", state)
    answer = call("restore", tmp_path / "b.tar.gz", "--dry-run", "--state", tmp_path / "new")
    assert "calibrations/0001.yaml" in answer.output
    assert "2 files would be restored" in answer.output
    assert not (tmp_path / "new").exists()


def member(name: str, kind: bytes = tarfile.REGTYPE, link: str = "", **header: str) -> tarfile.TarInfo:
    info = tarfile.TarInfo(name)
    info.pax_headers = header
    info.type, info.linkname = kind, link
    return info


@pytest.mark.parametrize(
    "evil",
    [
        member("/etc/evil"),
        member("state/../../evil"),
        member("elsewhere/evil"),
        member("state/link", tarfile.SYMTYPE, "/etc"),
        member("state/hard", tarfile.LNKTYPE, "/etc/passwd"),
        member("state/device", tarfile.CHRTYPE),
        member("state"),
        member("state/good"),
        member("state/good/below"),
        member("state//good"),
        member("state/running"),
        member("state/without-an-end", mtime="inf"),
    ],
    ids=lambda evil: evil.name,
)
def test_an_archive_that_reaches_outside_is_refused_as_a_whole(evil: tarfile.TarInfo, call, tmp_path: Path) -> None:
    with tarfile.open(tmp_path / "evil.tar.gz", "w:gz") as archive:
        manifest = member("backup.json")
        manifest.size = 13
        archive.addfile(manifest, io.BytesIO(b'{"format": 1}'))
        archive.addfile(member("state/good"))
        archive.addfile(evil)
    answer = call("restore", tmp_path / "evil.tar.gz", "--state", tmp_path / "new")
    assert answer.exit_code == 65
    assert answer.stderr.startswith("E404 ")
    assert "nothing was changed" in answer.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["evil.tar.gz"]


def test_a_backup_cut_anywhere_changes_nothing(state: Path, call, tmp_path: Path) -> None:
    call("backup", tmp_path / "b.tar.gz", "--state", state)
    data = (tmp_path / "b.tar.gz").read_bytes()
    for cut in range(0, len(data), max(1, len(data) // 40)):
        (tmp_path / "cut.tar.gz").write_bytes(data[:cut])
        answer = call("restore", tmp_path / "cut.tar.gz", "--state", tmp_path / "new")
        assert answer.exit_code == 65, (cut, answer.output)
        assert not (tmp_path / "new").exists()


def test_a_foreign_archive_is_not_taken_for_a_backup(call, tmp_path: Path) -> None:
    with tarfile.open(tmp_path / "x.tar.gz", "w:gz") as archive:
        archive.addfile(member("state/good"))
    assert "was not made by" in call("restore", tmp_path / "x.tar.gz", "--state", tmp_path / "new").stderr


@pytest.mark.parametrize("manifest", [b"nonsense", b"[1]", b"\xff\xfe", b"[" * 60_000], ids=len)
def test_an_archive_whose_manifest_is_none_is_no_backup(manifest: bytes, call, tmp_path: Path) -> None:
    """It was an internal error, to be reported."""
    with tarfile.open(tmp_path / "x.tar.gz", "w:gz") as archive:
        first = member("backup.json")
        first.size = len(manifest)
        archive.addfile(first, io.BytesIO(manifest))
    answer = call("restore", tmp_path / "x.tar.gz", "--state", tmp_path / "new")
    assert (answer.exit_code, "was not made by" in answer.stderr) == (65, True)


def test_a_backup_of_nothing_says_so(call, tmp_path: Path) -> None:
    answer = call("backup", tmp_path / "b.tar.gz", "--state", tmp_path / "nothing")
    assert answer.exit_code == 65
    assert not (tmp_path / "b.tar.gz").exists()


def test_no_backup_goes_into_the_directory_that_it_packs(state: Path, call, tmp_path: Path) -> None:
    """Each one packed those before it: the disk was full after some weeks of one a night."""
    (tmp_path / "link").symlink_to(state / "recordings")
    for target in (state / "today.tar.gz", tmp_path / "link" / "today.tar.gz"):
        answer = call("backup", target, "--state", state, "--force")
        assert answer.exit_code == 2 and "name a file elsewhere" in answer.stderr
    assert not list(state.rglob("*.tar.gz"))


def test_what_a_backup_leaves_out_for_it_is_a_link_is_said(state: Path, call, tmp_path: Path) -> None:
    """Recordings on a data disk: 'packed 2 files', and the restored cell had none."""
    (state / "recordings").rename(tmp_path / "disk")
    (state / "recordings").symlink_to(tmp_path / "disk")
    (state / "calibrations" / "link").symlink_to("/dev/zero")
    answer = call("backup", tmp_path / "b.tar.gz", "--state", state)
    assert answer.exit_code == 0 and "calibrations/link, recordings" in answer.stderr
    assert call("backup", tmp_path / "c.tar.gz", "--state", tmp_path / "disk").stderr == ""
