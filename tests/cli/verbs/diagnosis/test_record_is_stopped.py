"""Ctrl-C while a recording is being asked for ends it, too: it would go on for hours, and nobody was told."""

import fcntl
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from gateway.cli import control_socket
from gateway.cli.main import command


def test_ctrl_c_before_the_answer_stops_what_has_begun(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    begun, asked = str(tmp_path / "0001.fgr"), list[Any]()

    def ask(state: Path, request: dict[str, Any]) -> dict[str, Any]:
        asked.append(request)
        if request.get("on"):
            signal.raise_signal(signal.SIGINT)
            return {"recording": begun, "rows": 0, "began_in": begun}
        return {"recording": None, "written": begun, "fault": ""}

    monkeypatch.setattr(control_socket, "ask", ask)
    answer = CliRunner().invoke(command, ["record", "--for", "2h", "--state", str(tmp_path)])
    assert asked == [{"do": "record", "for_s": 7200.0, "on": True}, {"do": "record", "on": False}]
    assert answer.exit_code == 0 and answer.output.startswith("stopped; recorded 0 rows"), answer.output


PRESSED_ONCE = """
import signal, sys
from gateway.cli import control_socket
from gateway.cli.main import command

def ask(state, request):
    if request.get("on"):
        signal.raise_signal(signal.SIGINT)
        return {"recording": "0001.fgr", "rows": 0, "began_in": "0001.fgr"}
    print("ended", file=sys.stderr, flush=True)
    return {"recording": None, "written": "0001.fgr", "fault": ""}

control_socket.ask = ask
command(["record", "--for", "2h", "--state", sys.argv[1]])
"""


def test_one_ctrl_c_is_enough_where_nobody_reads_what_it_says(tmp_path: Path) -> None:
    """It waited for room in the pipe, and a second one was needed."""
    read, write = os.pipe()
    os.write(write, bytes(fcntl.fcntl(write, fcntl.F_GETPIPE_SZ)))
    run = [sys.executable, "-c", PRESSED_ONCE, str(tmp_path)]
    try:
        ended = subprocess.run(run, cwd=tmp_path, stdout=write, stderr=subprocess.PIPE, check=False, timeout=30)
    finally:
        os.close(read)
        os.close(write)
    assert (ended.returncode, ended.stderr.split()) == (0, [b"ended"]), ended.stderr
