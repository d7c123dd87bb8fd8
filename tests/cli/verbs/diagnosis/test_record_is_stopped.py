"""Ctrl-C while a recording is being asked for ends it, too: it would go on for hours, and nobody was told."""

import signal
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
