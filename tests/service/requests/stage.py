"""A wired rig in virtual time, and the requests of its control socket without a socket."""

import asyncio
import json
from collections.abc import Iterator
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from gateway.audit.rig_audit import RigAudit
from gateway.processes.json_socket.server import JsonLineServer
from gateway.service.control_socket import ControlSocket, RunningParts
from gateway.service.running_rig.calibration_runs import CalibrationRuns
from gateway.service.running_rig.recording.recordings import Recordings
from gateway.service.running_rig.rig_calibrations import RigCalibrations
from gateway.service.running_rig.rig_plants import PlantEdges, RigPlants
from gateway.service.simulation.requests import SimulationRequests
from gateway.service.watch_reports import WatchReports
from tests.disk.at_once import AtOnce
from tests.service.wired import MASTER, Wired


@dataclass
class Stage:
    """A wired rig in virtual time behind a control socket that is asked without a socket."""

    state: Path
    wired: Wired = field(default_factory=lambda: Wired().ready())

    def __post_init__(self) -> None:
        wired = self.wired
        self.said: list[str] = []
        log = lambda cause, sentence: self.said.append(sentence)  # noqa: E731
        self.recordings = Recordings(self.state / "recordings", wired.rig, log, AtOnce())  # type: ignore[arg-type]
        wired.loop.recordings = self.recordings
        self.calibration_runs = CalibrationRuns(wired.controller, wired.rig, self.state, lambda: wired.now_s, log)
        self.calibration_runs.disk = self.calibration_runs.syncing = AtOnce()  # type: ignore[assignment]
        wired.loop.calibration_runs, self.calibration_runs.decide = self.calibration_runs, wired.loop.refresh
        self.upload = RigCalibrations(wired.rig, self.state).serve(wired.bank, lambda taken: None, log)
        self.upload.run_in_background = lambda work, done: None  # type: ignore[assignment]  # a disk that never answers
        self.plants = RigPlants(wired.rig, self.state)
        self.plants.serve(PlantEdges(lambda: False, lambda rig: None, lambda: wired.now_s, log))
        self.plants.run_in_background = lambda work, done: None  # type: ignore[assignment]
        asked = RunningParts(
            rig=wired.rig,
            loop=wired.loop,
            recordings=self.recordings,
            upload=self.upload,
            plants=self.plants,
            calibration_runs=self.calibration_runs,
            audit=RigAudit(self.state, log),
            simulation=SimulationRequests(wired.rig),
            watch=WatchReports(wired.loop, lambda: wired.now_s, log),
            paths=lambda: {"output": "/dev/pts/1", "load_cell": "/dev/pts/2", "valve": "/dev/pts/3"},
            peers=lambda: (MASTER,),
            calibration_date=lambda: wired.rig.calibration.date_utc,
            running={"rig": "demo", "port": 5020, "lease_s": None, "lease_action": "fault"},
        )
        self.server = ControlSocket(self.state, asked, log)
        wired.run(0.1)

    def ask(self, line: bytes) -> dict[str, Any]:
        return assert_answered(self.server, line)

    def close(self) -> None:
        self.recordings.stop()
        asyncio.run(self.calibration_runs.close())
        self.upload.close()


def assert_answered(server: JsonLineServer, line: bytes) -> dict[str, Any]:
    """The answer, which must be one line of true JSON, and no internal error."""
    data = server.answer(line)
    if isinstance(data, Future):
        data = data.result(timeout=0.0)
    assert data.count(b"\n") == 1 and data.endswith(b"\n")
    answer: dict[str, Any] = json.loads(data, parse_constant=pytest.fail)
    assert answer["ok"] is True or (answer["ok"] is False and isinstance(answer["error"], str) and answer["error"])
    assert "internal error" not in answer.get("error", ""), (line[:300], answer)
    return answer


@pytest.fixture
def stage(tmp_path: Path) -> Iterator[Stage]:
    stage = Stage(tmp_path)
    yield stage
    stage.close()
