"""Recordings, backup and restore: nothing is lost, nothing is overwritten, nothing gets outside its directory."""

import fcntl
import io
import json
import os
import socket
import tarfile
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from gateway.live.live_state import LiveState
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
    with (state / "lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        answer = call("restore", backup, "--force", "--state", state)
    assert answer.exit_code == 69
    assert answer.stderr.startswith("E104 ")


def test_a_dry_run_restores_nothing(state: Path, call, tmp_path: Path) -> None:
    call("backup", tmp_path / "b.tar.gz", "--state", state)
    answer = call("restore", tmp_path / "b.tar.gz", "--dry-run", "--state", tmp_path / "new")
    assert "calibrations/0001.yaml" in answer.output
    assert "2 files would be restored" in answer.output
    assert not (tmp_path / "new").exists()


def member(name: str, kind: bytes = tarfile.REGTYPE, link: str = "") -> tarfile.TarInfo:
    info = tarfile.TarInfo(name)
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


def test_a_backup_of_nothing_says_so(call, tmp_path: Path) -> None:
    answer = call("backup", tmp_path / "b.tar.gz", "--state", tmp_path / "nothing")
    assert answer.exit_code == 65
    assert not (tmp_path / "b.tar.gz").exists()


@pytest.fixture
def control_socket(tmp_path: Path) -> Iterator[Callable[[Any], list[Any]]]:
    """answering(*answers) serves a request for each on tmp_path/control.sock; the list holds what was asked."""
    listeners: list[tuple[socket.socket, threading.Thread]] = []

    def answering(*answers: Any) -> list[Any]:
        requests: list[Any] = []
        listener = socket.socket(socket.AF_UNIX)
        listener.bind(str(tmp_path / "control.sock"))
        listener.listen()

        def serve() -> None:
            for answer in answers:
                connection, _ = listener.accept()
                with connection, connection.makefile("rwb") as stream:
                    requests.append(json.loads(stream.readline()))
                    stream.write(json.dumps(answer).encode() + b"\n")

        listeners.append((listener, threading.Thread(target=serve)))
        listeners[-1][1].start()
        return requests

    yield answering
    for listener, thread in listeners:
        thread.join(10)
        listener.close()


@pytest.mark.parametrize(
    ("word", "request_", "answer", "sentence"),
    [
        ("on", {"do": "record", "on": True}, {"recording": "/s/0001.fgr", "rows": 0}, "recording to /s/0001.fgr"),
        (
            "off",
            {"do": "record", "on": False},
            {"recording": None, "written": "/s/1.fgr", "rows": 9},
            "recorded 9 rows",
        ),
        ("status", {"do": "record"}, {"recording": None}, "not recording"),
    ],
)
def test_record_asks_the_running_gateway(
    word: str, request_: Any, answer: Any, sentence: str, call, control_socket, tmp_path: Path
) -> None:
    requests = control_socket({"ok": True} | answer)
    result = call("record", word, "--state", tmp_path)
    assert result.exit_code == 0, result.output
    assert requests == [request_]
    assert sentence in result.output


def test_metrics_are_figures_with_a_name_a_kind_and_base_units(call, control_socket, tmp_path: Path) -> None:
    residual = {"cause": 1, "name": "transport-delay", "warnings": 2, "age_s": None, "rms_n": 0.31}
    health = {"ticks": 500, "missed_ticks": 3, "loop_time_us": 250.0, "late_p50_us": 64, "late_p99_us": 1024}
    state = LiveState(rig="demo", simulated=True, version="1", time_unix_s=0.0, state="off")
    requests = control_socket({"ok": True} | state.to_json(), {"ok": True, **health, "residual": residual})
    result = call("metrics", "--state", tmp_path)
    assert (result.exit_code, requests) == (0, [{"do": "state"}, {"do": "health"}])
    lines = result.output.splitlines()
    values = [line for line in lines if not line.startswith("#")]
    assert values[-8:] == [
        "force_gateway_loop_ticks_total 500",
        "force_gateway_loop_missed_ticks_total 3",
        "force_gateway_loop_step_seconds 0.00025",
        "force_gateway_loop_late_p50_seconds 6.4e-05",
        "force_gateway_loop_late_p99_seconds 0.001024",
        'force_gateway_residual_cause{name="transport-delay"} 1',
        "force_gateway_residual_warnings_total 2",
        "force_gateway_residual_rms_newtons 0.31",
    ]
    assert "# TYPE force_gateway_loop_ticks_total counter" in lines
    assert 'force_gateway_state{state="off"} 1' in values and "force_gateway_up 1" in values
    assert not any(line.startswith("force_gateway_force_newtons ") for line in values), "no sample, no figure"


def test_what_the_gateway_refuses_is_told(call, control_socket, tmp_path: Path) -> None:
    control_socket({"ok": False, "error": "already recording to 0001.fgr"})
    answer = call("record", "on", "--state", tmp_path)
    assert answer.exit_code == 1
    assert answer.stderr == "E141 already recording to 0001.fgr\n"


def test_without_a_gateway_record_ends_with_69(call, tmp_path: Path) -> None:
    answer = call("record", "on", "--state", tmp_path)
    assert answer.exit_code == 69
    assert answer.stderr.startswith("E140 ")
    assert "--state" in answer.stderr
