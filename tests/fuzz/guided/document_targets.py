"""What a byte string does to the readers of profiles, tables, audit, requests and coefficients: read, or a sentence."""

import atexit
import json
import shutil
import tempfile
from pathlib import Path

from gateway.audit.audit_file import AuditFile, audit_files
from gateway.audit.audit_reader import read_audit, verify_audit
from gateway.processes.json_socket.messages import refuse_constant, why_too_large
from gateway.profiles import ProfileError, check_file, shipped_profiles_folder
from gateway.profiles.strict_yaml import text
from gateway.recording import Recorder, RecordingError, read_table
from gateway.service import socket_requests
from tests.audit.appending import append

FOLDER = Path(tempfile.mkdtemp(prefix="guided-", dir="/dev/shm" if Path("/dev/shm").is_dir() else None))
atexit.register(shutil.rmtree, FOLDER, ignore_errors=True)
KINDS = ("devices", "plants", "rigs", "calibrations")
SHAPES = [shape for name, shape in sorted(vars(socket_requests).items()) if name.endswith("Request")]


def judge_yaml(data: bytes) -> None:
    try:
        text.parse(data, "any.yaml")
    except ProfileError as error:
        assert error.faults and all(fault.message and fault.line > 0 for fault in error.faults)


def judge_profile(data: bytes) -> None:
    path = FOLDER / "any.yaml"
    path.write_bytes(data)
    checked = check_file(path)
    assert all(fault.message and "\n" not in str(fault) for fault in checked.faults)
    assert checked.faults or checked.value is not None


def judge_table(data: bytes) -> None:
    """By the first byte strictly or not; a recording of ours, CSV or Parquet as its first bytes say."""
    path = FOLDER / "any.csv"
    path.write_bytes(data[1:])
    try:
        recording = read_table(path, lenient=bool(data[:1] and data[0] & 1))
    except RecordingError as error:
        assert str(error) and "\n" not in str(error)
    else:
        assert {column.shape for column in recording.columns.values()} <= {(recording.rows,)}


def judge_audit(data: bytes) -> None:
    """In place of the last of its files: a verdict, and what is held to be unbroken was written by us."""
    state = FOLDER / "audit-state"
    if not state.exists():
        write_audit(state)
    files = audit_files(state / "audit")
    whole = files[-1].read_bytes()
    try:
        files[-1].write_bytes(data)
        verdict = verify_audit(state)
        list(read_audit(state))
        assert verdict.broken or (data.startswith(whole) and b"\n" not in data[len(whole) :]), verdict
    finally:
        files[-1].write_bytes(whole)


def write_audit(state: Path) -> None:
    file = AuditFile(state, 1200)
    for k in range(14):
        append(file, [{"what": "force_setpoint", "old": k, "new": k + 1.5, "peer": "10.0.0.5:4711"}])
    file.close()


def judge_request(data: bytes) -> None:
    """A line of control.sock or rig.sock, to each verb's shape: taken, or refused by one sentence."""
    try:
        request = json.loads(data, parse_constant=refuse_constant)
    except (ValueError, RecursionError):
        return
    if not isinstance(request, dict) or why_too_large(request):
        return
    for shape in SHAPES:
        try:
            socket_requests.parse_request(shape, request)
        except ValueError as refusal:
            assert str(refusal) and "\n" not in str(refusal)


def profile_seeds() -> list[bytes]:
    """The shortest of each kind."""
    folder = shipped_profiles_folder()
    kinds = [sorted((folder / kind).glob("*.yaml"), key=lambda path: path.stat().st_size)[:3] for kind in KINDS]
    return [path.read_bytes() for paths in kinds for path in paths]


def table_seeds() -> list[bytes]:
    """A recording and two tables of text."""
    folder = FOLDER / "recorded"
    folder.mkdir(exist_ok=True)
    recorder = Recorder(folder, {"rig": "demo", "seed": 7}, ("time_s", "command_v", "force_n"))
    for k in range(3):
        recorder.append((0.01 * k, 0.5, 1.5 * k))
    recorder.write()
    recorder.close()
    rows = "".join(f"{0.01 * k:.2f},{0.5 * k:.3f},{1.5 * k}\n" for k in range(4)).encode()
    ours, german = recorder.path.read_bytes(), rows.replace(b",", b";").replace(b".", b",")
    return [b"\0" + ours, b"\0time_s,command_v,force_n\n" + rows, b"\1time_s;command_v;force_n\n" + german]


def audit_seeds() -> list[bytes]:
    """The last file, and one cut short."""
    state = FOLDER / "audit-seed"
    write_audit(state)
    whole = audit_files(state / "audit")[-1].read_bytes()
    return [whole, whole[: len(whole) // 2]]


def request_seeds() -> list[bytes]:
    """A request of each kind."""
    asked = (
        {"do": "record", "on": True, "name": "a", "for_s": 2.5},
        {"do": "calibrate", "plan": {"step_v": 1.0, "groups": 2, "minor_points": 24}, "continues": [1, 2]},
        {"do": "modbus", "via": "web", "unit": 1, "pdu": "0300640004"},
        {"do": "residual", "cause": 12, "sentence": "friction", "counters": {"looks": 3, "rms_n": 0.2}},
        {"do": "sim", "set": {"cell.silent": True, "creep": 0.05}, "clear": ["leak"], "clear_all": True},
        {"do": "fault", "name": "no-air", "on": False},
    )
    return [json.dumps(one).encode() for one in asked]
