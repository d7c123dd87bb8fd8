"""A real disk that takes nothing for a while, as a worn memory card does: the force is held, and then all is stored."""

import json
import socket
import time
from pathlib import Path
from typing import Any

from gateway.audit.audit_reader import verify_audit
from gateway.cli.control_socket import ask
from gateway.recording import list_recordings
from tests.end_to_end.conftest import start, stop
from tests.end_to_end.disks.small_disks import FailingExt4, hanging
from tests.end_to_end.disks.test_full_disk import COMMITTED, HOLDING, hold, is_held, set_of
from tests.end_to_end.kills.test_upload_kill import stage

HANGS_S = 1.0


def ask_and_leave(state: Path, request: dict[str, Any]) -> socket.socket:
    """Ask without waiting; the answer comes on what is returned."""
    caller = socket.socket(socket.AF_UNIX)
    caller.connect(str(state / "control.sock"))
    caller.sendall(json.dumps(request).encode() + b"\n")
    return caller


def test_a_disk_that_takes_nothing_for_a_while_costs_neither_the_force_nor_a_row(tmp_path: Path) -> None:
    """Meanwhile a recording is ended and another begun, a set committed, and a master is refused: all of it is written."""
    with FailingExt4(tmp_path / "image").mounted(tmp_path / "disk") as disk:
        gateway = start(disk / "state", "--sim")
        try:
            hold(gateway)
            first = ask(gateway.state, {"do": "record", "on": True})["recording"]
            is_held(gateway, 0.3)
            stage(gateway, set_of(1))
            with hanging(disk):
                began_s = time.monotonic()
                caller = ask_and_leave(gateway.state, {"do": "record", "on": False})
                assert not gateway.write(1145, 1).isError()
                assert gateway.write(1, 9000).isError()
                is_held(gateway, HANGS_S)
                assert gateway.words(1146, 1)[0] != COMMITTED, "nothing is said to be stored before it is"
                hung_s = time.monotonic() - began_s
            with caller:
                caller.settimeout(5.0)
                ended = json.loads(caller.recv(1 << 16))
            assert (ended["ok"], ended["written"]) == (True, first)
            gateway.wait_until(lambda status: gateway.words(1146, 1)[0] == COMMITTED)
            is_held(gateway, 0.3)
            second = ask(gateway.state, {"do": "record", "on": True})["recording"]
            is_held(gateway, 0.3)
            rows = ask(gateway.state, {"do": "record", "on": False})["rows"]
            entries = {str(entry.path): entry for entry in list_recordings(gateway.state)}
            assert not [entry.fault for entry in entries.values() if entry.fault]
            assert entries[second].rows == rows > 10
            assert entries[first].rows == ended["rows"] > 25
            print(f"hung for {hung_s:.1f} s; {ended['rows']} rows before it ended")
            assert gateway.status()["state"] == HOLDING
        finally:
            stop(gateway)
        assert verify_audit(gateway.state).broken is None
