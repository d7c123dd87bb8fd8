"""A control socket that plays a calibration run as a test wants it: what the page asks is noted."""

import json
import socketserver
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from gateway.live.live_state import LiveForce, LiveRun, LiveState

PRESSING = LiveForce(measured_n=12.5, voltage_v=1.6)
IDLE = {
    "running": False, "phase": "idle", "progress": 0.0, "eta_s": 0.0, "stair": 0, "stairs": 0, "group": 0, "groups": 0,
    "voltage_v": 0.0, "force_n": 0.0, "recording": None, "ended": "", "result": {},
}  # fmt: skip
PREVIEW = {
    "stairs": 21, "eta_s": 30.0, "v_max_v": 7.5, "force_max_n": 58.0, "simulated": True, "rig": "demo",
    "experiment": "", "check": True, "notes": [], "questions": [],
}  # fmt: skip


class ScriptedControl:
    """status: what `calibrate` answers; asked: every request, in order."""

    def __init__(self, state: Path) -> None:
        self.state = state
        self.asked: list[dict[str, Any]] = []
        self.status: dict[str, Any] = dict(IDLE)
        self.heard = threading.Condition()
        self._recording: str | None = None

    def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        with self.heard:
            self.asked.append(request)
            self.heard.notify_all()
        if request["do"] == "record":
            return self._record(request)
        if request["do"] == "state":
            run = LiveRun(running=self.status["running"], phase=self.status["phase"], share=self.status["progress"])
            state = "calibrating" if run.running else "off"
            live = LiveState(rig="demo", simulated=True, version="0", time_unix_s=0.0, state=state, force=PRESSING)
            return replace(live, run=run).to_json()
        return self._calibrate(request)

    def _record(self, request: dict[str, Any]) -> dict[str, Any]:
        if "on" in request:
            self._recording = str(self.state / "recordings" / "0001.fgr") if request["on"] else None
        return {"recording": self._recording, "rows": 0}

    def _calibrate(self, request: dict[str, Any]) -> dict[str, Any]:
        if request.get("dry_run"):
            return PREVIEW
        if "plan" in request:
            self.status = IDLE | {"running": True, "phase": "ladder", "group": 1, "groups": 1}
        if request.get("stop"):
            self.status = IDLE | {"phase": "stopped", "ended": "calibration stopped at this machine"}
        return self.status

    def count(self, verb: str) -> int:
        return sum(request["do"] == verb for request in self.asked)

    def wait_for(self, verb: str, count: int, within_s: float = 10.0) -> None:
        """Wait until a verb was asked so often."""
        with self.heard:
            assert self.heard.wait_for(lambda: self.count(verb) >= count, within_s), f"{verb}: {self.count(verb)} times"


def modbus(request: dict[str, Any]) -> dict[str, Any]:
    """A gateway at rest: it reads as zeros, and takes every write."""
    pdu = bytes.fromhex(request["pdu"])
    words = 2 * int.from_bytes(pdu[3:5], "big")
    return {"pdu": (bytes((3, words)) + bytes(words) if pdu[0] == 3 else pdu[:5]).hex()}


@contextmanager
def scripted_control(state: Path) -> Iterator[ScriptedControl]:
    """Serve control.sock of a state directory until the block ends."""
    control = ScriptedControl(state)

    class Caller(socketserver.StreamRequestHandler):
        def handle(self) -> None:
            for line in self.rfile:
                self.wfile.write(json.dumps({"ok": True} | control.answer(json.loads(line))).encode() + b"\n")

    with socketserver.ThreadingUnixStreamServer(str(state / "control.sock"), Caller) as server:
        server.daemon_threads = True
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()
        try:
            yield control
        finally:
            server.shutdown()
            thread.join()
