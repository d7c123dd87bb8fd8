"""A control process that cannot start tells why by its exit code and in the event file, whether or not stderr is read."""

import json
import socket
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.processes import exit_codes
from gateway.processes.event_file import EventFile, EventReader
from gateway.processes.event_log import EventLog
from gateway.service.control_process import _report_start_failure


def refuse(*_: Any) -> int:
    raise BrokenPipeError


def test_a_pipe_that_nobody_reads_any_more_does_not_take_the_reason_away(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`run cell.yaml 2>&1 | head -1`, or a journal that has been restarted: the guardian read exit 1, began anew five times,
    and the event file had nothing of the fault."""
    with EventLog(file=EventFile(tmp_path)) as log:
        monkeypatch.setattr(sys, "stderr", SimpleNamespace(write=refuse, flush=refuse))
        event = "E151 the rig file has faults"
        assert _report_start_failure(log, "faults", exit_codes.CONFIGURATION, event) == exit_codes.CONFIGURATION
    with EventReader(tmp_path) as reader:
        assert [event.code for event in reader.read_stored()] == ["E151"]


def test_a_process_that_gets_no_thread_says_so_and_shows_no_traceback(tmp_path: Path) -> None:
    """Takes half a second, for a process. `ulimit -u 6`, where control is no fork: the machine had no thread for its log."""
    code = (
        "import runpy, threading\n"
        'def refuse(thread): raise RuntimeError("can\'t start new thread")\n'
        "threading.Thread.start = refuse\n"
        "runpy.run_module('gateway.service.control_process', run_name='__main__', alter_sys=True)"
    )
    ours, theirs = socket.socketpair()
    with ours, theirs:
        words = [sys.executable, "-c", code, str(theirs.fileno()), json.dumps({"state": str(tmp_path)})]
        ended = subprocess.run(words, pass_fds=(theirs.fileno(),), stderr=subprocess.PIPE, text=True, check=False)
    assert ended.returncode == 1
    assert ended.stderr.startswith("E106 it does not start (no thread for the log") and "Traceback" not in ended.stderr
