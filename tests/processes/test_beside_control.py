"""What a process beside control has to say is an event like any other: with its time, severity, code, and from where."""

import json
import socket
import subprocess
import sys
from pathlib import Path

from gateway.processes import exit_codes

BROKER_AWAY_THEN_END = """
import sys
from gateway.processes.beside_control import serve_until_guardian_ends

async def serve(options, log):
    log("broker", "E181 the MQTT broker is away")
    raise ExceptionGroup("tasks", [OSError(13, "Permission denied", "/etc/secret")])

sys.exit(serve_until_guardian_ends("mqtt", sys.argv[1:], serve))
"""


def test_what_it_says_and_why_it_ends_are_events(tmp_path: Path) -> None:
    guardian, link = socket.socketpair()
    with guardian, link:
        options = json.dumps({"state": str(tmp_path)})
        command = [sys.executable, "-c", BROKER_AWAY_THEN_END, str(link.fileno()), options]
        ended = subprocess.run(command, pass_fds=[link.fileno()], capture_output=True, text=True, check=False)
    assert ended.returncode == exit_codes.DEVICE
    away, why = ended.stderr.splitlines()
    assert " error   broker E181 the MQTT broker is away" in away and "Permission denied" in why
    kept = [json.loads(line) for line in (tmp_path / "events.jsonl").read_text().splitlines()]
    assert [(one["source"], one["cause"], one["code"]) for one in kept] == [
        ("mqtt", "broker", "E181"),
        ("mqtt", "start", None),
    ]
