"""Whatever is asked of control.sock and rig.sock is answered with one line, and control and rig go on as if nothing was.

Seeded: a failure names its line, and the next run has it again.
"""

import asyncio
import json
import time
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from gateway.audit.rig_audit import RigAudit
from gateway.codes.faults import FaultCode
from gateway.processes.json_socket.server import JsonLineServer
from gateway.registers.words import State
from gateway.service.control_socket import ControlSocket, RunningParts
from gateway.service.running_rig.calibration_runs import CalibrationRuns
from gateway.service.running_rig.recording.recordings import Recordings
from gateway.service.running_rig.rig_calibrations import RigCalibrations
from gateway.service.running_rig.rig_plants import PlantEdges, RigPlants
from gateway.service.simulation.requests import SimulationRequests
from gateway.service.simulation.world import SimulatedRig
from gateway.service.watch_reports import WatchReports
from tests.disk.at_once import AtOnce
from tests.service.requests.hostile import garbage, mutants
from tests.service.wired import ENABLE, MASTER, Wired

PLAN = {"step_v": 1.0, "groups": 2, "minor_points": 24, "v_max_v": 4.0, "tare": False, "first_group": 0}
MOVE = {"do": "ramp", "to_share": 0.5, "over_s": 2.0, "hold_s": 1.0}
EXPERIMENT = {
    "name": "e",
    "columns": ["temperature_c"],
    "parts": [{"name": "p", "moves": [MOVE, {"do": "reversals", "size_share": 0.1, "times": 3, "hold_s": 0.5}]}],
}
CONTROL: list[dict[str, Any]] = [
    {"do": "record"},
    {"do": "record", "on": True},
    {"do": "record", "on": False},
    {"do": "calibration"},
    {"do": "calibration", "use": 1},
    {"do": "calibration", "rollback": True},
    {"do": "calibrate", "plan": PLAN, "continues": [1, 2]},
    {"do": "calibrate", "plan": PLAN, "dry_run": True},
    {"do": "calibrate", "plan": EXPERIMENT, "dry_run": True},
    {"do": "calibrate", "plan": EXPERIMENT},
    {"do": "calibrate", "stop": True},
    {"do": "last-writer"},
    {"do": "last-refusal"},
    {"do": "health"},
    {"do": "running"},
    {"do": "sim"},
    {"do": "sim", "set": {"cell.silent": True, "creep": 0.05}, "clear": ["leak"], "clear_all": True},
    {"do": "state"},
    {"do": "modbus", "via": "web", "unit": 1, "pdu": "0300640004"},
    {"do": "residual"},
    {"do": "residual", "cause": 12, "sentence": "friction", "counters": {"looks": 3, "rms_n": 0.2}},
]
RIG: list[dict[str, Any]] = [
    {"do": "fault", "name": "no-air", "on": False},
    {"do": "fault", "name": "cell-cut", "on": False},
    {"do": "fault", "name": "plant", "values": {"friction.coulomb_n": 2.5, "regulator.hunting_hz": 3.0}},
    {"do": "fault", "name": "plant", "on": False},
    {"do": "sim"},
    {"do": "sim", "set": {"leak": "on", "output.alter": 0.5, "wire.noise": 0.01}},
    {"do": "sim", "clear": ["leak", "output.alter"]},
    {"do": "sim", "clear_all": True},
]


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
        self.calibration_runs.disk = AtOnce()  # type: ignore[assignment]
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
def stage(tmp_path: Path):
    stage = Stage(tmp_path)
    yield stage
    stage.close()


def test_the_valid_requests_are_valid(stage: Stage) -> None:
    """Otherwise their mutants would try nothing."""
    for request in CONTROL:
        answer = stage.ask(json.dumps(request).encode())
        assert (
            answer["ok"] or request.get("use") or request.get("rollback") or "calibration is running" in answer["error"]
        )
        stage.wired.run(0.02)
        stage.ask(b'{"do": "calibrate", "stop": true}')
        stage.wired.run(0.1)


@pytest.mark.parametrize("seed", range(4))
def test_no_request_ends_or_stops_control(seed: int, stage: Stage) -> None:
    wired, answers = stage.wired, []
    for number, line in enumerate(mutants(CONTROL, 600, seed)):
        answers.append(stage.ask(line)["ok"])
        if number % 10 == 0:
            wired.run(0.02)
            stage.ask(b'{"do": "calibrate", "stop": true}')
    assert 0.04 < sum(answers) / len(answers) < 0.7, "the mutants try both sides"
    assert not [line for line in stage.said if "A499" in line]
    wired.run(0.02)
    stage.ask(b'{"do": "calibrate", "stop": true}')
    wired.run(0.1)
    assert wired.fault_code is FaultCode.NONE
    wired.write(0, ENABLE, 1000)
    wired.until(lambda: wired.state is State.HOLDING, 3.0)


def test_no_line_ends_or_stops_control(stage: Stage) -> None:
    for line in garbage(CONTROL, 1500, 1):
        stage.ask(line)
    assert not [line for line in stage.said if "A499" in line]
    assert stage.ask(b'{"do": "health"}')["ok"]


@pytest.mark.parametrize(
    ("line", "told"),
    [
        (b'{"do":"calibrate","plan":{},"continues":5}', "continues"),
        (b'{"do":"calibrate","plan":5}', "plan"),
        (b'{"do":"calibrate","dry_run":true}', "plan"),
        (b'{"do":"calibrate","plan":{"step_v":1e999}}', "step = inf"),
        (b'{"do":"record","on":"yes"}', "on"),
        (b'{"do":"record","onn":true}', "did you mean on?"),
        (b'{"do":"record","on":null}', "on is null"),
        (b'{"do":"calibration","use":true}', "use"),
        (b'{"do":"calibration","use":1e3}', "use"),
        (b'{"do":"calibration","use":-1}', "use"),
        (b'{"do":"health","x":1}', "x"),
        (b'{"do": "record", "on": true, "name": "a\\u001b[2J"}', r'name "a\x1b[2J" has signs that cannot be printed'),
    ],
)
def test_a_wrong_type_is_told_by_its_key(line: bytes, told: str, stage: Stage) -> None:
    answer = stage.ask(line)
    assert answer["ok"] is False
    assert told in answer["error"]


ENDLESS = [
    {"x" * 20_000: 1},
    {f"x{number}": 1 for number in range(6000)},
    {"name": "e", "parts": [{"name": "p", "moves": [{"do": "zz"}] * 4000}]},
    {"name": "e", "parts": [{"name": "p", "moves": [{"do": "dwell", f"h{n}": 1, f"i{n}": 1} for n in range(700)]}]},
    {"name": "e", "parts": [{"name": "p", "moves": [{"do": "dwell", "hold_s": 1}] * 1900}]},
    {"step_v": "9" * 60_000},
    {"step_v": 0.01, "groups": 100, "minor_points": 2000},
]


@pytest.mark.parametrize("plan", ENDLESS, ids=range(len(ENDLESS)))
def test_no_request_of_the_longest_kind_keeps_the_loop_from_its_heartbeat(plan: dict[str, Any], stage: Stage) -> None:
    """What it costs in processor time; the guardian's patience is 100 ms. Some of these took two seconds."""
    line = json.dumps({"do": "calibrate", "plan": plan, "dry_run": True}).encode()
    took_s = []
    for _ in range(3):
        began_s = time.process_time()
        assert stage.ask(line)["ok"] is False
        took_s.append(time.process_time() - began_s)
    assert min(took_s) < 0.06


# -- the simulated rig


@dataclass
class RigStage:
    wired: Wired = field(default_factory=lambda: Wired().ready())

    def __post_init__(self) -> None:
        self.server = JsonLineServer(Path("rig.sock"), {"fault": self.rig.fault, "sim": self.rig.simulate})

    @property
    def rig(self) -> SimulatedRig:
        return self.wired.world


def test_no_request_ends_the_simulated_rig() -> None:
    stage = RigStage()
    for seed, number in ((1, 120), (2, 120)):
        for line in mutants(RIG, number, seed):
            assert_answered(stage.server, line)
            stage.wired.world.advance(stage.wired.world._now_s + 0.01)
    for line in garbage(RIG, 500, 3):
        assert_answered(stage.server, line)


@pytest.mark.parametrize(
    "values",
    [
        {"friction.coulomb_n": -1.0},
        {"friction.coulomb_n": "2.5"},
        {"friction.nonsense": 1.0},
        {"nonsense": 1.0},
        {"regulator.delay_s": 1e9},
        {"contact.pad_stiffness_n_per_m": 0.0},
        {"__class__.x": 1.0},
    ],
)
def test_no_plant_that_the_twin_cannot_be(values: dict[str, Any]) -> None:
    stage = RigStage()
    twin = stage.rig.twin
    assert (
        assert_answered(stage.server, json.dumps({"do": "fault", "name": "plant", "values": values}).encode())["ok"]
        is False
    )
    assert stage.rig.twin is twin
